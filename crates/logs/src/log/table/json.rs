//! JSON objects one after the other, a line each or in one list: every number of the first is a column, and every
//! object a row. One object of equally long arrays is a table of columns, and one that holds an array of objects has its
//! rows there.

use std::io::{self, BufRead, BufReader, Write};

use serde_json::Value;

use super::columns::{self, HeldArray};
use super::lines::{COLUMNS, Table, TableText, damaged, number, unusable};
use super::numpy::TIMES;
use crate::log::json_text::parsed;
use crate::log::open_file::OpenFile;

/// Bytes that one object may take as a row, and as the whole of a table.
const LARGEST: usize = 1 << 20;
const WHOLE: usize = 1 << 28;
/// Elements from which equally long lists are columns, where none is called a time.
const COLUMN_ROWS: usize = 64;

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
    /// Bytes that the next object may take.
    most: usize,
}

/// Rows of one object that holds all of them.
struct JsonEntries {
    places: Vec<String>,
    rows: std::vec::IntoIter<Value>,
}

pub(super) fn open(file: &OpenFile) -> io::Result<TableText> {
    let mut table = JsonTable::new(BufReader::new(file.from(0)));
    table.first = table.next()?;
    table.most = LARGEST;
    if let Some(arrays) = table.first.as_ref().and_then(arrays) {
        return columns::table(&arrays, Vec::new());
    }
    if let Some(rows) = table.first.as_mut().and_then(entries) {
        let mut leaves = Vec::new();
        for (key, value) in rows
            .first()
            .and_then(Value::as_object)
            .into_iter()
            .flatten()
        {
            list(value, key.clone(), pointed("", key), &mut leaves);
        }
        let (names, places): (Vec<String>, Vec<String>) = leaves.into_iter().unzip();
        if names.is_empty() || names.len() > COLUMNS {
            return Err(too_wide(names.len()));
        }
        let rows = rows.into_iter();
        return Ok(TableText::new(
            &names,
            JsonEntries { places, rows },
            Vec::new(),
        ));
    }
    let mut leaves = Vec::new();
    for (key, value) in table.first.iter().flat_map(Value::as_object).flatten() {
        list(value, key.clone(), pointed("", key), &mut leaves);
    }
    if leaves.is_empty() || leaves.len() > COLUMNS {
        return Err(too_wide(leaves.len()));
    }
    let names: Vec<String>;
    (names, table.places) = leaves.into_iter().unzip();
    Ok(TableText::new(&names, table, Vec::new()))
}

fn too_wide(count: usize) -> io::Error {
    unusable(format!(
        "its first JSON object is no row: it holds {count} numbers and words, and a row has 1 to {COLUMNS}; write one object a row, or one list a column: {{\"t\": [..], \"q1\": [..]}}"
    ))
}

/// The numbers of a list; NaN for null, none where it holds anything else.
fn numbers(list: &[Value]) -> Option<Vec<f64>> {
    let one = |value: &Value| match value {
        Value::Number(x) => x.as_f64(),
        Value::Null => Some(f64::NAN),
        Value::Bool(yes) => Some(f64::from(u8::from(*yes))),
        _ => None,
    };
    list.iter().map(one).collect()
}

/// A list of numbers, or of lists of as many numbers each, as an array.
fn array(name: &str, value: &Value) -> Option<HeldArray> {
    let held = |axes, numbers| HeldArray {
        name: name.to_owned(),
        axes,
        numbers,
        labels: Vec::new(),
    };
    let rows = match value {
        Value::Array(rows) if rows.len() > 1 => rows,
        // pandas writes a column as an object of rows by their numbers
        Value::Object(rows)
            if rows.len() >= COLUMN_ROWS
                && rows
                    .keys()
                    .enumerate()
                    .all(|(k, key)| *key == k.to_string()) =>
        {
            let column: Vec<Value> = rows.values().cloned().collect();
            return Some(held(vec![column.len()], numbers(&column)?));
        }
        _ => return None,
    };
    if let Some(column) = numbers(rows) {
        return Some(held(vec![column.len()], column));
    }
    let inner: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| numbers(row.as_array()?))
        .collect::<Option<_>>()?;
    let count = inner.first()?.len();
    if count == 0 || inner.iter().any(|row| row.len() != count) {
        return None;
    }
    // the first axis runs fastest
    let turned = (0..count).flat_map(|k| inner.iter().map(move |row| row[k]));
    Some(held(vec![inner.len(), count], turned.collect()))
}

/// Adds the arrays of an object and of the objects in it.
fn add_arrays(fields: &serde_json::Map<String, Value>, prefix: &str, out: &mut Vec<HeldArray>) {
    for (key, value) in fields {
        let name = match prefix {
            "" => key.clone(),
            prefix => format!("{prefix}.{key}"),
        };
        match (array(&name, value), value) {
            (Some(array), _) => out.push(array),
            (None, Value::Object(inner)) if out.len() < COLUMNS => add_arrays(inner, &name, out),
            _ => {}
        }
    }
}

/// The arrays of an object that is a table of columns.
fn arrays(object: &Value) -> Option<Vec<HeldArray>> {
    let fields = object.as_object()?;
    let mut found = Vec::new();
    add_arrays(fields, "", &mut found);
    let longest = |array: &HeldArray| array.axes.iter().copied().max().unwrap_or(0);
    // pandas' split form: names of the columns, and their rows
    if let (Some(names), [.., data]) = (
        fields.get("columns").and_then(Value::as_array),
        &mut found[..],
    ) && data.name == "data"
        && data.axes.last() == Some(&names.len())
    {
        let names = names
            .iter()
            .map(|name| name.as_str().unwrap_or_default().to_owned());
        data.labels = names.collect();
        return Some(vec![data.clone()]);
    }
    let timed = found.iter().find(|array| {
        let last = array
            .name
            .rsplit('.')
            .next()
            .unwrap_or_default()
            .to_lowercase();
        TIMES.contains(&&*last) && longest(array) > 2
    });
    let rows = match timed {
        Some(array) => longest(array),
        None => found
            .iter()
            .map(longest)
            .max()
            .filter(|rows| *rows >= COLUMN_ROWS)?,
    };
    let alike = found.iter().filter(|array| array.axes.contains(&rows));
    (alike.count() > 1).then_some(found)
}

/// The longest array of objects in an object.
fn entries(object: &mut Value) -> Option<Vec<Value>> {
    let fields = object.as_object_mut()?;
    let of_objects = |value: &Value| {
        let all = value.as_array().filter(|all| all.len() > 2)?;
        all.iter().all(Value::is_object).then_some(all.len())
    };
    let inner = fields.values_mut().max_by_key(|value| of_objects(value))?;
    match inner {
        Value::Array(rows) if rows.len() > 2 && rows.iter().all(Value::is_object) => {
            Some(std::mem::take(rows))
        }
        _ => None,
    }
}

/// Appends the fields of an object that is a row.
fn row_of(object: &Value, places: &[String], line: &mut Vec<u8>) -> io::Result<()> {
    for (k, place) in places.iter().enumerate() {
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
    Ok(())
}

impl Table for JsonEntries {
    fn row(&mut self, line: &mut Vec<u8>) -> io::Result<bool> {
        match self.rows.next() {
            Some(object) => row_of(&object, &self.places, line).map(|()| true),
            None => Ok(false),
        }
    }
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
            most: WHOLE,
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
            if self.object.len() > self.most {
                return Err(unusable(format!(
                    "a JSON object takes more than {} MB: write one object a row, a line each",
                    self.most >> 20
                )));
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
        row_of(&object, &self.places, line)?;
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
