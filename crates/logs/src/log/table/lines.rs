//! A table as the lines of a text log.

use std::io::{self, Read, Write};

/// Columns that a table may have.
pub(super) const COLUMNS: usize = 4096;

pub(super) trait Table: Send {
    /// Appends the fields of the next row, parted by commas; false at the end.
    fn row(&mut self, line: &mut Vec<u8>) -> io::Result<bool>;
}

pub(in crate::log) struct TableText {
    table: Box<dyn Table>,
    line: Vec<u8>,
    /// Bytes of the line that were handed out.
    taken: usize,
    /// Arrays and columns that are left out, one sentence each.
    pub(in crate::log) notes: Vec<String>,
}

impl TableText {
    pub(super) fn new(names: &[String], table: impl Table + 'static, notes: Vec<String>) -> Self {
        let names: Vec<String> = names.iter().map(|name| quoted(name)).collect();
        Self {
            line: (names.join(",") + "\n").into_bytes(),
            taken: 0,
            table: Box::new(table),
            notes,
        }
    }
}

impl Read for TableText {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.taken == self.line.len() {
            self.line.clear();
            self.taken = 0;
            if !self.table.row(&mut self.line)? {
                return Ok(0);
            }
            self.line.push(b'\n');
        }
        let count = buffer.len().min(self.line.len() - self.taken);
        buffer[..count].copy_from_slice(&self.line[self.taken..self.taken + count]);
        self.taken += count;
        Ok(count)
    }
}

/// A name as a field that is no number and no comment.
fn quoted(name: &str) -> String {
    let bare = name.trim();
    let name = match bare.is_empty() || bare.parse::<f64>().is_ok() {
        true => format!("column_{bare}"),
        false => bare.replace(['\n', '\r'], " "),
    };
    match name.contains([',', ';', '"', '\t']) || name.starts_with(['#', '%']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name,
    }
}

/// Appends a number that is read back bit for bit.
pub(super) fn number(line: &mut Vec<u8>, x: f64) -> io::Result<()> {
    match x.is_nan() {
        true => line.write_all(b"nan"),
        false => write!(line, "{x:e}"),
    }
}

/// The error of a file that ends too early, or is not what was written.
pub(super) fn damaged(problem: &str) -> io::Error {
    io::Error::new(io::ErrorKind::UnexpectedEof, problem.to_owned())
}

/// The error of a file that holds no table of numbers.
pub(super) fn unusable(problem: String) -> io::Error {
    io::Error::new(io::ErrorKind::Unsupported, problem)
}
