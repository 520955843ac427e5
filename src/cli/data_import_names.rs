//! Names between commas.

use std::str::FromStr;

/// Names as they are given to a flag: between commas, without the spaces around them; one with a comma in it stands
/// between double quotes, as in a CSV file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Names(pub(super) Vec<String>);

impl FromStr for Names {
    type Err = String;

    fn from_str(text: &str) -> Result<Names, String> {
        let mut names = Vec::new();
        let mut rest = text;
        loop {
            let (name, after) = match rest.trim_start().strip_prefix('"') {
                Some(quoted) => unquoted(quoted)?,
                None => {
                    let (name, after) = rest.split_at(rest.find(',').unwrap_or(rest.len()));
                    (name.trim().to_string(), after)
                }
            };
            names.push(name);
            rest = match after.trim_start().strip_prefix(',') {
                Some(rest) => rest,
                None if after.trim().is_empty() => return Ok(Names(names)),
                None => {
                    return Err(format!("after a name in quotes there is a comma, not `{}`", after.trim()));
                }
            };
        }
    }
}

/// The name whose first quote is gone, and what is after its last one. A quote in it is written twice.
fn unquoted(text: &str) -> Result<(String, &str), String> {
    let (mut name, mut rest) = (String::new(), text);
    loop {
        let Some((before, after)) = rest.split_once('"') else {
            return Err("a quote is not closed; write \"\" for one in a name in quotes".to_string());
        };
        name += before;
        match after.strip_prefix('"') {
            Some(after) => (name, rest) = (name + "\"", after),
            None => return Ok((name, after)),
        }
    }
}

/// Names for a message, as they could be given.
pub(super) fn listed<'n>(names: impl IntoIterator<Item = &'n str>) -> String {
    let quoted = |name: &str| format!("\"{}\"", name.replace('"', "\"\""));
    names.into_iter().map(quoted).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_commas_stand_in_quotes() {
        let read = |text: &str| text.parse::<Names>().map(|names| names.0);
        let names = |names: &[&str]| Ok(names.iter().map(ToString::to_string).collect::<Vec<_>>());
        assert_eq!(read("floor"), names(&["floor"]));
        assert_eq!(read(" floor , rug"), names(&["floor", "rug"]));
        assert_eq!(read(r#""a,b" , c"#), names(&["a,b", "c"]));
        assert_eq!(read(r#"c, "a ""big"", b""#), names(&["c", r#"a "big", b"#]));
        assert_eq!(read(r#"19" rack,c"#), names(&[r#"19" rack"#, "c"]));
        assert_eq!(read("a,"), names(&["a", ""]));
        assert!(read(r#""a,b"#).expect_err("open").contains("not closed"));
        assert!(read(r#""a"b,c"#).expect_err("no comma").contains("`b,c`"));
        let all = ["a,b", "the \"rug\"", " c"];
        assert_eq!(read(&listed(all)), names(&all), "what is shown can be given");
    }
}
