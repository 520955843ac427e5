//! Lists of seeds: `1-10`, `1-5,9`.

use std::collections::BTreeSet;

/// Far more than anyone runs; a slip of the finger is not to fill the memory.
const MOST: u64 = 100_000;

/// The seeds of a text, ascending, each once.
pub(crate) fn of_text(text: &str) -> Result<Vec<u64>, String> {
    let fault = || format!("`{text}` is no list of seeds; write it like 1-10 or 1-5,9");
    let mut seeds = BTreeSet::new();
    for part in text.split(',') {
        let number = |text: &str| text.trim().parse::<u64>().map_err(|_| fault());
        let (first, last) = match part.split_once('-') {
            Some((first, last)) => (number(first)?, number(last)?),
            None => (number(part)?, number(part)?),
        };
        if first > last || last > i64::MAX as u64 {
            return Err(fault());
        }
        if last - first >= MOST || seeds.len() as u64 > MOST {
            return Err(format!("`{text}` are more than {MOST} seeds"));
        }
        seeds.extend(first..=last);
    }
    Ok(seeds.into_iter().collect())
}

/// The seeds of a field: a text, a number or a list of numbers.
pub(crate) fn of_value(value: &toml::Value) -> Result<Vec<u64>, String> {
    let number = |value: &toml::Value| value.as_integer().and_then(|n| u64::try_from(n).ok());
    let fault = || "seeds are given like \"1-10\", \"1-5,9\" or [1, 2, 3]".to_string();
    match value {
        toml::Value::String(text) => of_text(text),
        toml::Value::Array(list) if !list.is_empty() => {
            let seeds: Option<BTreeSet<u64>> = list.iter().map(number).collect();
            Ok(seeds.ok_or_else(fault)?.into_iter().collect())
        }
        other => Ok(vec![number(other).ok_or_else(fault)?]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists() {
        assert_eq!(of_text("1-3"), Ok(vec![1, 2, 3]));
        assert_eq!(of_text("9, 1-2,2"), Ok(vec![1, 2, 9]));
        for wrong in ["", "a", "3-1", "1-", "-1", "1,,2", "0-9223372036854775808", "1-900000"] {
            assert!(of_text(wrong).is_err(), "{wrong}");
        }
        let value =
            |text: &str| of_value(&toml::from_str::<toml::Table>(&format!("v = {text}")).expect("TOML")["v"]);
        assert_eq!(value("[3, 1]"), Ok(vec![1, 3]));
        assert_eq!((value("7"), value("\"1-2\"")), (Ok(vec![7]), Ok(vec![1, 2])));
        for wrong in ["[]", "[1, \"2\"]", "-1", "1.5", "\"x\""] {
            assert!(value(wrong).is_err(), "{wrong}");
        }
    }
}
