//! The columns that `vsonar run` asks about.

use vsonar::dataset::spread;

use super::CliError;

/// The columns asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Columns {
    /// So many.
    Spread(u32),
    /// These, in this order.
    These(Vec<u32>),
}

/// Reads how many columns or which.
pub(crate) fn parse(text: &str) -> Result<Columns, String> {
    let wrong = || "write how many, as in 12, or which, as in 26,80,134".to_string();
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    if !text.contains(',') {
        return number(text).and_then(|n| if n > 0 { Ok(Columns::Spread(n)) } else { Err(wrong()) });
    }
    let list = text.strip_suffix(',').unwrap_or(text);
    list.split(',').map(number).collect::<Result<_, _>>().map(Columns::These)
}

impl Columns {
    /// The columns of frames of this width; spread ones in the middle of equal parts.
    pub(crate) fn of(&self, width: u32) -> Result<Vec<u32>, CliError> {
        let columns: Vec<u32> = match self {
            Columns::Spread(n) if *n > width => {
                let text =
                    format!("--columns: {n} are more than the frames have, which are {width} pixels wide");
                return Err(CliError::Usage(text));
            }
            Columns::Spread(n) => spread(*n, width),
            Columns::These(columns) => columns.clone(),
        };
        match columns.iter().find(|&&column| column >= width) {
            Some(column) => Err(CliError::Usage(format!(
                "--columns: {column} is outside the frames, whose columns are 0 to {}",
                width - 1
            ))),
            None => Ok(columns),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_spread_or_given() {
        let of = |text: &str, width| parse(text).expect("sound").of(width);
        assert_eq!(of("12", 320).expect("inside"), [13, 40, 66, 93, 120, 146, 173, 200, 226, 253, 280, 306]);
        assert_eq!(of("1", 320).expect("inside"), [160]);
        assert_eq!(of("16", 16).expect("inside"), (0..16).collect::<Vec<_>>());
        assert_eq!(of("26, 80,26", 81).expect("inside"), [26, 80, 26]);
        assert_eq!(of("0,", 16).expect("inside"), [0]);
        assert!(matches!(of("17", 16), Err(CliError::Usage(text)) if text.contains("16 pixels wide")));
        assert!(matches!(of("3,16", 16), Err(CliError::Usage(text)) if text.contains("0 to 15")));
        for wrong in ["", "0", "-1", ",", "1,,2", "a", "1.5", "1;2", "4294967296"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
