//! JSON as annotation tools write it: numbers that are none (`NaN`), whole numbers with a fraction, numbers as text.

use std::borrow::Cow;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::csv_table::{whole, whole_number};

/// What Python writes for numbers that are none, which no JSON has; the longer ones first.
const NO_NUMBERS: [&[u8]; 3] = [b"-Infinity", b"Infinity", b"NaN"];

/// Reads JSON that may begin with a byte order mark; in the place of a number there may be `NaN`, `Infinity` or
/// `-Infinity`, which are as good as `null`.
pub(super) fn parse<T: DeserializeOwned>(bytes: &[u8]) -> serde_json::Result<T> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match serde_json::from_slice(bytes) {
        Err(error) if error.is_syntax() => match with_nulls(bytes) {
            Cow::Owned(bytes) => serde_json::from_slice(&bytes),
            Cow::Borrowed(_) => Err(error),
        },
        read => read,
    }
}

/// What a file is, by how it begins, if it is no object of JSON, as annotations are; with what to do.
pub(super) fn foreign(bytes: &[u8], remedy: &str) -> Option<String> {
    if matches!(bytes, [0xff, 0xfe, ..] | [0xfe, 0xff, ..] | [0, ..] | [_, 0, ..]) {
        return Some("is UTF-16; save it as UTF-8".to_string());
    }
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let kind = match text.first() {
        Some(b'{') => return None,
        Some(b'[') => "is a list, as COCO's form of results is",
        Some(b'<') => "is XML, as CVAT and Pascal VOC write it",
        Some(_) => "is not JSON",
        None => "is empty",
    };
    Some(format!("{kind}; {remedy}"))
}

/// The text with `null` for what is no number, outside of texts.
fn with_nulls(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut out = Vec::new();
    let (mut at, mut copied, mut quoted) = (0, 0, false);
    while let Some(&byte) = bytes.get(at) {
        let token = NO_NUMBERS.iter().find(|token| !quoted && bytes[at..].starts_with(token));
        match (byte, token) {
            (_, Some(token)) => {
                out.extend_from_slice(&bytes[copied..at]);
                out.extend_from_slice(b"null");
                at += token.len();
                copied = at;
                continue;
            }
            // The next byte is no end of the text, whatever it is.
            (b'\\', _) if quoted => at += 1,
            (b'"', _) => quoted = !quoted,
            _ => {}
        }
        at += 1;
    }
    if copied == 0 {
        return Cow::Borrowed(bytes);
    }
    out.extend_from_slice(&bytes[copied..]);
    Cow::Owned(out)
}

/// The whole number that a value is, also as `1.0` or as text.
pub(super) fn whole_value(value: &Value) -> Option<i128> {
    match value {
        Value::Number(number) => {
            let exact = number.as_u64().map(i128::from).or_else(|| number.as_i64().map(i128::from));
            exact.or_else(|| number.as_f64().and_then(whole))
        }
        Value::String(text) => whole_number(text.trim()),
        _ => None,
    }
}

/// A pair of numbers.
pub(super) fn pair(value: &Value) -> Option<[f64; 2]> {
    match value.as_array()?.as_slice() {
        [x, y] => Some([x.as_f64()?, y.as_f64()?]),
        _ => None,
    }
}

/// A value for a message, cut where it is long.
pub(super) fn shown(value: &Value) -> String {
    const MOST: usize = 40;
    let text = value.to_string();
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_is_no_number_is_null() {
        let read: Value =
            parse(br#"{"area": NaN, "bbox": [-Infinity, 1, Infinity], "name": "NaN \" NaN \\", "x": NaN}"#)
                .expect("JSON of Python");
        assert_eq!(read, json!({"area": null, "bbox": [null, 1, null], "name": "NaN \" NaN \\", "x": null}));
        assert_eq!(parse::<Value>(b"\xef\xbb\xbf[NaN]").expect("a mark"), json!([null]));
        for wrong in ["[NaNs]", "{NaN: 1}", "[nan]", "[1", "\"NaN", "[+Infinity]"] {
            assert!(parse::<Value>(wrong.as_bytes()).is_err(), "{wrong}");
        }
    }

    #[test]
    fn files_of_other_kinds_are_named() {
        for (bytes, kind) in [
            (&b""[..], Some("is empty")),
            (b"\xef\xbb\xbf \n", Some("is empty")),
            (b"<?xml version=\"1.0\"?>", Some("is XML")),
            (b"\xff\xfe{\0", Some("is UTF-16")),
            (b"{\0}\0", Some("is UTF-16")),
            (b"PK\x03\x04", Some("is not JSON; export it anew")),
            (b"[", Some("is a list")),
            (b"\xef\xbb\xbf\n{", None),
        ] {
            let said = foreign(bytes, "export it anew");
            assert!(said.is_some() == kind.is_some(), "{bytes:?}: {said:?}");
            let said = said.unwrap_or_default();
            assert!(said.starts_with(kind.unwrap_or_default()), "{bytes:?}: {said}");
        }
    }

    #[test]
    fn numbers_as_tools_write_them() {
        for (value, number) in [
            (json!(1), Some(1)),
            (json!(-7), Some(-7)),
            (json!(1.0), Some(1)),
            (json!("12"), Some(12)),
            (json!(" 3.0 "), Some(3)),
            (json!(u64::MAX), Some(u64::MAX.into())),
            (json!(1.5), None),
            (json!("one"), None),
            (json!(null), None),
            (json!(true), None),
            (json!([1]), None),
        ] {
            assert_eq!(whole_value(&value), number, "{value}");
        }
        assert_eq!(pair(&json!([1, 2.5])), Some([1.0, 2.5]));
        for wrong in [json!([1]), json!([1, 2, 3]), json!([1, null]), json!("1,2")] {
            assert_eq!(pair(&wrong), None, "{wrong}");
        }
        assert_eq!(shown(&json!("é".repeat(50))).chars().count(), 43);
    }
}
