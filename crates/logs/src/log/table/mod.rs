//! Tables that are no text: arrays of numpy and Parquet files. Their rows are handed on as lines of CSV, so that
//! whatever holds of text logs holds of them.

mod literal;
mod npy;
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
mod zip;

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::LogError;
use super::held_files::OpenFile;
use super::source::{file_name, shown};

/// Columns that a table may have.
const COLUMNS: usize = 4096;

/// A table, read row by row.
trait Table: Send {
    /// Names of the columns.
    fn names(&self) -> &[String];

    /// Appends the fields of the next row, parted by commas; false at the end.
    fn row(&mut self, line: &mut Vec<u8>) -> io::Result<bool>;
}

/// A table as text.
pub(super) struct TableText {
    table: Box<dyn Table>,
    line: Vec<u8>,
    /// Bytes of the line that were handed out.
    taken: usize,
    /// Arrays and columns that are left out, one sentence each.
    pub(super) notes: Vec<String>,
}

impl TableText {
    fn new(table: Box<dyn Table>, notes: Vec<String>) -> Self {
        let names: Vec<String> = table.names().iter().map(|name| quoted(name)).collect();
        Self {
            line: (names.join(",") + "\n").into_bytes(),
            taken: 0,
            table,
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
fn number(line: &mut Vec<u8>, x: f64) -> io::Result<()> {
    match x.is_nan() {
        true => line.write_all(b"nan"),
        false => write!(line, "{x:e}"),
    }
}

/// Whether a file holds a table, by its first bytes.
pub(super) fn is_table(head: &[u8]) -> bool {
    [&b"\x93NUMPY"[..], b"PK\x03\x04"]
        .iter()
        .any(|magic| head.starts_with(magic))
        || (cfg!(feature = "parquet") && is_parquet(head))
}

/// Whether a file is a Parquet file, by its first bytes.
fn is_parquet(head: &[u8]) -> bool {
    head.starts_with(b"PAR1")
}

/// Whether a file that can be read is one that others may go on with.
pub(super) fn begins(path: &Path) -> bool {
    super::source::begins_with(path, b"PAR1")
}

/// Opens a table; `more` are the files that go on with it.
///
/// # Errors
/// A file that is damaged, or that holds no numbers in rows.
pub(super) fn open(
    path: &Path,
    file: &OpenFile,
    head: &[u8],
    more: &[PathBuf],
) -> Result<TableText, LogError> {
    let refuse = |problem: String| LogError::Table {
        file: shown(path),
        problem,
    };
    if is_parquet(head) {
        #[cfg(feature = "parquet")]
        return parquet::open(path, more).map_err(|error| refuse(error.to_string()));
    }
    let _ = more;
    let arrays = match head.starts_with(b"PK") {
        false => npy::Array::of_file(file).map(|array| vec![array]),
        true => zip::members(file).and_then(|members| npy::Array::of_members(file, members)),
    };
    let (table, notes) = arrays
        .and_then(numpy::ArrayTable::new)
        .map_err(|error| refuse(error.to_string()))?;
    Ok(TableText::new(Box::new(table), notes))
}

/// The Parquet files of a dataset of LeRobot, in their order; `None` for any other folder.
pub(super) fn dataset(folder: &Path) -> io::Result<Option<Vec<PathBuf>>> {
    if !folder.join("meta").join("info.json").is_file() {
        return Ok(None);
    }
    let inside = |folder: &Path| -> io::Result<Vec<PathBuf>> {
        let entries = std::fs::read_dir(folder)?;
        let mut found = entries
            .map(|entry| Ok(entry?.path()))
            .collect::<io::Result<Vec<_>>>()?;
        found.sort_by_cached_key(|path| file_name(path));
        Ok(found)
    };
    let mut out = Vec::new();
    for part in inside(&folder.join("data"))? {
        if part.is_dir() {
            let files = inside(&part)?.into_iter();
            out.extend(files.filter(|file| file.extension().is_some_and(|end| end == "parquet")));
        }
    }
    Ok(Some(out).filter(|files| !files.is_empty()))
}

fn damaged(problem: &str) -> io::Error {
    io::Error::new(io::ErrorKind::UnexpectedEof, problem.to_owned())
}

fn unusable(problem: String) -> io::Error {
    io::Error::new(io::ErrorKind::Unsupported, problem)
}
