//! JSON objects one after the other, a line each or in one list: every number of the first is a column, and every
//! object a row.

use std::io::{self, BufRead, BufReader, Write};

use serde_json::Value;

use super::lines::{COLUMNS, Table, TableText, damaged, number, unusable};
use crate::log::held_files::OpenFile;
use crate::log::json_text::parsed;

/// Bytes that one object may take.
const LARGEST: usize = 1 << 20;

/// Whether a file holds JSON objects, by its first bytes.
pub(super) fn is_json(head: &[u8]) -> bool {
    let mut signs = head.iter().filter(|byte| !byte.is_ascii_whitespace());
    matches!(
        (signs.next(), signs.next()),
        (Some(b'{'), Some(b'"' | b'}')) | (Some(b'['), Some(b'{'))
    )
}

struct JsonTable<R> {
    reader: R,
    /// JSON pointers of the columns.
    places: Vec<String>,
    /// The first object, read for its names.
    first: Option<Value>,
    object: Vec<u8>,
}

pub(super) fn open(file: &OpenFile) -> io::Result<TableText> {
    let mut table = JsonTable::new(BufReader::new(file.from(0)));
    table.first = table.next()?;
    let mut leaves = Vec::new();
    for (key, value) in table.first.iter().flat_map(Value::as_object).flatten() {
        list(value, key.clone(), pointed("", key), &mut leaves);
    }
    if leaves.is_empty() || leaves.len() > COLUMNS {
        return Err(unusable(format!(
            "its first JSON object is no row: it holds {} numbers and words, and a row has 1 to {COLUMNS}",
            leaves.len()
        )));
    }
    let names: Vec<String>;
    (names, table.places) = leaves.into_iter().unzip();
    Ok(TableText::new(&names, table, Vec::new()))
}

fn pointed(place: &str, key: &str) -> String {
    format!("{place}/{}", key.replace('~', "~0").replace('/', "~1"))
}

/// Names and places of all numbers and words of a value.
fn list(value: &Value, name: String, place: String, out: &mut Vec<(String, String)>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                list(value, format!("{name}.{key}"), pointed(&place, key), out);
            }
        }
        Value::Array(elements) => {
            for (k, value) in elements.iter().enumerate() {
                list(value, format!("{name}_{k}"), format!("{place}/{k}"), out);
            }
        }
        _ => out.push((name, place)),
    }
}

impl<R: BufRead> JsonTable<R> {
    fn new(reader: R) -> Self {
        Self {
            reader,
            places: Vec::new(),
            first: None,
            object: Vec::new(),
        }
    }

    fn next(&mut self) -> io::Result<Option<Value>> {
        self.object.clear();
        let (mut depth, mut quoted, mut escaped) = (0_usize, false, false);
        loop {
            let bytes = self.reader.fill_buf()?;
            if bytes.is_empty() {
                return match depth {
                    0 => Ok(None),
                    _ => Err(damaged("its last JSON object has no end")),
                };
            }
            let mut taken = 0;
            for byte in bytes {
                taken += 1;
                if depth == 0 && *byte != b'{' {
                    continue;
                }
                self.object.push(*byte);
                match (*byte, quoted) {
                    _ if escaped => escaped = false,
                    (b'\\', true) => escaped = true,
                    (b'"', _) => quoted = !quoted,
                    (b'{', false) => depth += 1,
                    (b'}', false) => depth -= 1,
                    _ => {}
                }
                if depth == 0 {
                    break;
                }
            }
            self.reader.consume(taken);
            if self.object.len() > LARGEST {
                return Err(unusable(
                    "a JSON object takes more than 1 MB: where it holds a list for each column, write it as CSV, `python -c \"import pandas; pandas.read_json('IN').to_csv('OUT.csv', index=False)\"`"
                        .to_owned(),
                ));
            }
            if depth == 0 && !self.object.is_empty() {
                let no_json = |error| damaged(&format!("a JSON object cannot be read: {error}"));
                return parsed(&self.object).map(Some).map_err(no_json);
            }
        }
    }
}

impl<R: BufRead + Send> Table for JsonTable<R> {
    fn row(&mut self, line: &mut Vec<u8>) -> io::Result<bool> {
        let object = match self.first.take() {
            Some(first) => Some(first),
            None => self.next()?,
        };
        let Some(object) = object else {
            return Ok(false);
        };
        for (k, place) in self.places.iter().enumerate() {
            if k > 0 {
                line.push(b',');
            }
            match object.pointer(place) {
                Some(Value::Number(x)) => number(line, x.as_f64().unwrap_or(f64::NAN))?,
                Some(Value::Bool(yes)) => number(line, f64::from(u8::from(*yes)))?,
                Some(Value::String(text)) => {
                    write!(line, "\"{}\"", text.replace('"', "\"\"").replace('\n', " "))?;
                }
                _ => number(line, f64::NAN)?,
            }
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Vec<Value> {
        let mut table = JsonTable::new(text.as_bytes());
        std::iter::from_fn(|| table.next().unwrap()).collect()
    }

    #[test]
    fn objects_are_rows_whatever_parts_them() {
        let lines = "{\"t\": 0, \"name\": \"}{\\\"\"}\n{\"t\": NaN, \"q\": [1, {\"x\": 2}]}\n";
        let found = rows(lines);
        let listed = format!("[{}]", lines.trim().replace('\n', ","));
        assert_eq!(found, rows(&listed));
        assert_eq!((found.len(), &found[0]["t"]), (2, &Value::from(0)));
        assert!(found[1]["t"].is_null());
        let mut leaves = Vec::new();
        list(&found[1]["q"], "q".to_owned(), "/q".to_owned(), &mut leaves);
        let expected = [("q_0", "/q/0"), ("q_1.x", "/q/1/x")];
        assert_eq!(leaves, expected.map(|(a, b)| (a.to_owned(), b.to_owned())));
    }

    #[test]
    fn braces_and_lists_of_objects_begin_json_and_names_in_brackets_do_not() {
        assert!(is_json(b" {\"t\": 0}") && is_json(b"[\n {\"t\": 0}]"));
        assert!(!is_json(b"[s],[rad]\n0,1\n") && !is_json(b"t,q\n"));
    }
}
