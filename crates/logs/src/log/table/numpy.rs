//! Arrays of one length as a table: a column for an array of one axis, one for each joint for an array of two.

use std::collections::BTreeMap;
use std::io::{self, Read};

use super::lines::{COLUMNS, Table, TableText, unusable};
use super::npy::{Field, NpyArray};

/// Columns of an array whose columns lie one behind the other, each of which is read from a place of its own.
const MAX_COLUMNS_APART: u64 = 256;
/// Names of the column of times, by which the rows are counted.
pub(super) const TIMES: [&str; 6] = ["t", "time", "times", "timestamp", "timestamps", "stamp"];

/// Rows of some columns that lie side by side.
struct Stream {
    file: Box<dyn Read + Send>,
    record: Vec<u8>,
    fields: Vec<Field>,
}

pub(super) struct ArrayTable {
    pub(super) names: Vec<String>,
    streams: Vec<Stream>,
    left: u64,
}

/// Axes of an array, those of one element aside.
fn axes(array: &NpyArray) -> Vec<u64> {
    match array.shape.len() {
        0..=2 => array.shape.clone(),
        _ => (array.shape.iter().copied().filter(|count| *count != 1)).collect(),
    }
}

/// The number of rows: that of the times, else that which most arrays have along an axis.
fn rows_of(arrays: &[NpyArray]) -> Option<u64> {
    let numbers = || arrays.iter().filter(|array| array.element.is_some());
    let timed = numbers().find(|array| TIMES.contains(&&*array.name.to_lowercase()));
    if let Some(array) = timed {
        return axes(array).into_iter().max();
    }
    let mut votes: BTreeMap<u64, usize> = BTreeMap::new();
    for array in numbers() {
        if let Some(longest) = axes(array).into_iter().max() {
            *votes.entry(longest).or_default() += 1;
        }
    }
    let most = votes.into_iter().map(|(rows, votes)| (votes, rows)).max();
    most.map(|(_, rows)| rows)
}

/// The table that arrays make up.
pub(super) fn table(arrays: Vec<NpyArray>) -> io::Result<TableText> {
    let (table, notes) = ArrayTable::new(arrays)?;
    Ok(TableText::new(&table.names.clone(), table, notes))
}

impl ArrayTable {
    /// The table that arrays make up, and what is left out of it.
    pub(super) fn new(arrays: Vec<NpyArray>) -> io::Result<(Self, Vec<String>)> {
        let Some(rows) = rows_of(&arrays) else {
            return Err(unusable("it holds no array of numbers".to_owned()));
        };
        let mut out = Self {
            names: Vec::new(),
            streams: Vec::new(),
            left: rows,
        };
        let mut notes = Vec::new();
        for array in &arrays {
            if !out.add(array, rows)? {
                let shape: Vec<String> = array.shape.iter().map(u64::to_string).collect();
                let kind = match array.element {
                    Some(_) => format!("which is not {rows} rows"),
                    None => "and no numbers".to_owned(),
                };
                notes.push(format!(
                    "the array `{}` is left out: it has the shape ({}), {kind}",
                    array.name,
                    shape.join(", "),
                ));
            }
        }
        match out.names.is_empty() {
            true => Err(unusable("no array holds numbers in rows".to_owned())),
            false => Ok((out, notes)),
        }
    }

    /// Adds the columns of an array; false where it has none of so many rows.
    fn add(&mut self, array: &NpyArray, rows: u64) -> io::Result<bool> {
        let Some(element) = &array.element else {
            return Ok(false);
        };
        let size = element.size as u64;
        // how many elements a row has, and whether they lie apart
        let (count, apart) = match axes(array)[..] {
            [n] if n == rows => (1, false),
            [n, count] if n == rows => (count, array.by_columns && count > 1),
            [count, n] if n == rows => (count, !array.by_columns && count > 1),
            _ => return Ok(false),
        };
        let wide = count.saturating_mul(element.fields.len() as u64);
        let room = (COLUMNS - self.names.len()) as u64;
        if count == 0 || wide > room || (apart && count > MAX_COLUMNS_APART) {
            return Ok(false);
        }
        for k in 0..count {
            let index = match count {
                1 => String::new(),
                _ => format!("_{k}"),
            };
            let name = |field: &Field| match (&*array.name, &field.name, element.named) {
                ("", own, true) => format!("{own}{index}"),
                (base, own, true) => format!("{base}_{own}{index}"),
                ("", own, false) => format!("column{index}{own}"),
                (base, own, false) => format!("{base}{index}{own}"),
            };
            self.names.extend(element.fields.iter().map(name));
        }
        let (streams, each) = if apart { (count, 1) } else { (1, count) };
        for k in 0..streams {
            let from = k.saturating_mul(rows).saturating_mul(size);
            let shifted = |j: u64| {
                let moved = move |field: &Field| Field {
                    at: field.at + (j * size) as usize,
                    ..field.clone()
                };
                element.fields.iter().map(moved)
            };
            self.streams.push(Stream {
                file: array.reader(from)?,
                record: vec![0; (each * size) as usize],
                fields: (0..each).flat_map(shifted).collect(),
            });
        }
        Ok(true)
    }
}

impl Table for ArrayTable {
    fn row(&mut self, line: &mut Vec<u8>) -> io::Result<bool> {
        if self.left == 0 {
            return Ok(false);
        }
        self.left -= 1;
        let mut first = true;
        for stream in &mut self.streams {
            stream.file.read_exact(&mut stream.record)?;
            for field in &stream.fields {
                if !std::mem::take(&mut first) {
                    line.push(b',');
                }
                field.scalar.write(line, &stream.record[field.at..])?;
            }
        }
        Ok(true)
    }
}
