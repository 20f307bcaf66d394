//! Arrays in memory as a table: a column for an array of one axis, one for each joint for an array of two.

use std::collections::BTreeMap;
use std::io;

use super::lines::{COLUMNS, Table, TableText, number, unusable};
use super::numpy::TIMES;

/// An array: its name, its axes but for those of one element, and its numbers, the first axis running fastest.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct HeldArray {
    pub(super) name: String,
    pub(super) axes: Vec<usize>,
    pub(super) numbers: Vec<f64>,
    /// Names of its columns, where something says them.
    pub(super) labels: Vec<String>,
}

struct ArrayColumns {
    columns: Vec<Vec<f64>>,
    rows: usize,
    next: usize,
}

impl HeldArray {
    /// The last part of its name, in small letters.
    fn bare(&self) -> String {
        let last = self.name.rsplit(['.', '_']).next();
        last.unwrap_or_default().to_lowercase()
    }

    /// Its columns of so many rows; none where it has another length.
    fn columns(&self, rows: usize) -> Vec<Vec<f64>> {
        match self.axes[..] {
            [n] if n == rows => vec![self.numbers.clone()],
            [n, count] if n == rows && count > 0 => {
                self.numbers.chunks(n).map(<[f64]>::to_vec).collect()
            }
            [count, n] if n == rows && count > 0 => (0..count)
                .map(|k| {
                    self.numbers
                        .iter()
                        .skip(k)
                        .step_by(count)
                        .copied()
                        .collect()
                })
                .collect(),
            _ => Vec::new(),
        }
    }
}

/// The number of rows: that of the times, else that which most arrays have along an axis.
fn rows_of(arrays: &[HeldArray]) -> Option<usize> {
    let longest = |array: &HeldArray| array.axes.iter().copied().max();
    let timed = |array: &&HeldArray| {
        TIMES.contains(&&*array.name.to_lowercase()) || TIMES.contains(&&*array.bare())
    };
    if let Some(rows) = arrays.iter().filter(timed).filter_map(longest).max()
        && rows > 1
    {
        return Some(rows);
    }
    let mut votes: BTreeMap<usize, usize> = BTreeMap::new();
    for rows in arrays.iter().filter_map(longest).filter(|rows| *rows > 1) {
        *votes.entry(rows).or_default() += 1;
    }
    let most = votes.into_iter().map(|(rows, votes)| (votes, rows)).max();
    most.map(|(_, rows)| rows)
}

/// The table that arrays make up; what is left out of it is noted.
pub(super) fn table(arrays: &[HeldArray], mut notes: Vec<String>) -> io::Result<TableText> {
    let Some(rows) = rows_of(arrays) else {
        return Err(unusable("it holds no array of numbers".to_owned()));
    };
    let mut out = ArrayColumns {
        columns: Vec::new(),
        rows,
        next: 0,
    };
    let mut names = Vec::new();
    for array in arrays {
        let columns = array.columns(rows);
        if columns.is_empty() || out.columns.len() + columns.len() > COLUMNS {
            let axes: Vec<String> = array.axes.iter().map(usize::to_string).collect();
            notes.push(format!(
                "the array `{}` is left out: it has the shape ({}), which is not {rows} rows",
                array.name,
                axes.join(", ")
            ));
            continue;
        }
        let alone = columns.len() == 1;
        for (k, column) in columns.into_iter().enumerate() {
            names.push(match array.labels.get(k) {
                Some(label) => label.clone(),
                None if alone => array.name.clone(),
                None => format!("{}_{k}", array.name),
            });
            out.columns.push(column);
        }
    }
    match names.is_empty() {
        true => Err(unusable("no array holds numbers in rows".to_owned())),
        false => Ok(TableText::new(&names, out, notes)),
    }
}

impl Table for ArrayColumns {
    fn row(&mut self, line: &mut Vec<u8>) -> io::Result<bool> {
        if self.next == self.rows {
            return Ok(false);
        }
        for (k, column) in self.columns.iter().enumerate() {
            if k > 0 {
                line.push(b',');
            }
            number(line, column.get(self.next).copied().unwrap_or(f64::NAN))?;
        }
        self.next += 1;
        Ok(true)
    }
}
