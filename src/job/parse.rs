//! From bytes to a JSON value: what is wrong with the syntax, and where.

use crate::{Error, Result};
use serde::de::{Deserialize, Deserializer, Error as _, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};
use std::fmt;

/// Parses strict JSON (RFC 8259) without duplicate keys. `name` names the source in messages.
pub fn parse(bytes: &[u8], name: &str) -> Result<Value> {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(e) => {
            let before = &bytes[..e.valid_up_to()];
            let line = before.iter().filter(|&&b| b == b'\n').count() + 1;
            return Err(Error::Job(format!(
                "{name}: line {line}: byte 0x{:02x} at offset {} is not UTF-8 text; a job is a JSON file in UTF-8",
                bytes[e.valid_up_to()],
                e.valid_up_to()
            )));
        }
    };
    if text.starts_with('\u{feff}') {
        return Err(Error::Job(format!("{name}: begins with a byte order mark; save the file as UTF-8 without one")));
    }
    if text.trim().is_empty() {
        return Err(Error::Job(format!("{name}: the file is empty; a job is a JSON object, see `railsqueal schema`")));
    }
    serde_json::from_str::<Unique>(text).map(|u| u.0).map_err(|e| syntax_error(&e, text, name))
}

fn syntax_error(e: &serde_json::Error, text: &str, name: &str) -> Error {
    let lines: Vec<&str> = text.lines().collect();
    let line = e.line().clamp(1, lines.len().max(1));
    let source = lines.get(line - 1).copied().unwrap_or("");
    let column = e.column().max(1);
    let mut what = e.to_string();
    if let Some(at) = what.rfind(" at line ") {
        what.truncate(at);
    }
    let hint = if e.is_eof() {
        "\n  The file ends before the JSON is complete: it is truncated, or a bracket or quote is not closed."
    } else if what.contains("recursion limit") {
        what = "nested too deeply".into();
        "\n  A job has no more than a few levels."
    } else if what.contains("number out of range") {
        "\n  Numbers must be representable in double precision (up to about 1.8e308)."
    } else if not_a_number(source, column) {
        "\n  NaN and Infinity are not JSON; every number of a job is finite."
    } else if comment(source, column) {
        "\n  JSON has no comments; use the key \"title\" for remarks."
    } else if what.contains("trailing comma") {
        "\n  Remove the comma after the last entry."
    } else if two_commas(source, column) {
        "\n  There are two commas with nothing between them; remove one."
    } else {
        ""
    };
    Error::Job(format!("{name}: line {line}, column {column}: {what}{}{hint}", excerpt(source, column)))
}

/// True if one of the words that other languages print for non-finite numbers stands at or just before the column.
fn not_a_number(source: &str, column: usize) -> bool {
    let mut start = column.saturating_sub(12).min(source.len());
    while !source.is_char_boundary(start) {
        start -= 1;
    }
    let near: String = source[start..].chars().take(24).collect::<String>().to_ascii_lowercase();
    near.contains("nan") || near.contains("inf")
}

/// The line before the (byte) column and from it on.
fn parted(source: &str, column: usize) -> (&str, &str) {
    source.split_at_checked(column.saturating_sub(1)).unwrap_or((source, ""))
}

/// True if a comment of another language begins at the column.
fn comment(source: &str, column: usize) -> bool {
    let (before, from) = parted(source, column);
    // The parser may have taken the first slash.
    let from = if before.ends_with('/') { source.get(column.saturating_sub(2)..).unwrap_or("") } else { from };
    ["//", "/*", "#"].iter().any(|mark| from.trim_start().starts_with(mark))
}

/// True if the column is at the second of two commas.
fn two_commas(source: &str, column: usize) -> bool {
    let (before, from) = parted(source, column);
    from.starts_with(',') && before.trim_end().ends_with(',')
}

/// The line with a caret under the (byte) column, cut to what fits a terminal.
fn excerpt(source: &str, column: usize) -> String {
    let chars: Vec<char> = source.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    // serde_json counts bytes; the caret stands under a character.
    let at = source.char_indices().take_while(|(i, _)| *i + 1 < column).count().min(chars.len());
    let from = at.saturating_sub(60);
    let shown: String = chars[from..(at + 40).min(chars.len())].iter().collect();
    format!("\n  | {}\n  | {}^", shown, " ".repeat(at - from))
}

/// A value whose objects have no duplicate keys. (`serde_json::Value` silently keeps the last one.)
struct Unique(Value);

impl<'de> Deserialize<'de> for Unique {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Values;
        impl<'de> Visitor<'de> for Values {
            type Value = Unique;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a JSON value")
            }
            fn visit_bool<E>(self, v: bool) -> std::result::Result<Unique, E> {
                Ok(Unique(Value::Bool(v)))
            }
            fn visit_i64<E>(self, v: i64) -> std::result::Result<Unique, E> {
                Ok(Unique(Value::Number(v.into())))
            }
            fn visit_u64<E>(self, v: u64) -> std::result::Result<Unique, E> {
                Ok(Unique(Value::Number(v.into())))
            }
            fn visit_f64<E: serde::de::Error>(self, v: f64) -> std::result::Result<Unique, E> {
                Number::from_f64(v).map(|n| Unique(Value::Number(n))).ok_or_else(|| E::custom("number out of range"))
            }
            fn visit_str<E>(self, v: &str) -> std::result::Result<Unique, E> {
                Ok(Unique(Value::String(v.into())))
            }
            fn visit_unit<E>(self) -> std::result::Result<Unique, E> {
                Ok(Unique(Value::Null))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> std::result::Result<Unique, A::Error> {
                let mut items = Vec::new();
                while let Some(Unique(item)) = seq.next_element()? {
                    items.push(item);
                }
                Ok(Unique(Value::Array(items)))
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Unique, A::Error> {
                let mut object = Map::new();
                while let Some(key) = map.next_key::<String>()? {
                    if object.contains_key(&key) {
                        return Err(A::Error::custom(format!("the key \"{key}\" is given twice")));
                    }
                    let Unique(value) = map.next_value()?;
                    object.insert(key, value);
                }
                Ok(Unique(Value::Object(object)))
            }
        }
        deserializer.deserialize_any(Values)
    }
}
