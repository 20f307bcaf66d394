//! Tables that are no lines of fields: arrays of numpy and MATLAB, Parquet files, JSON objects. Their rows are handed on
//! as lines of CSV, so that whatever holds of text logs holds of them. A new format is a file of its own and its lines
//! here: its module, and its place in the list.

mod columns;
mod json;
mod lines;
mod literal;
mod mat;
mod npy;
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
mod zip;

use std::io;
use std::path::{Path, PathBuf};

use super::LogError;
use super::open_file::OpenFile;
use super::source::{file_name, shown};
pub(super) use lines::TableText;

/// Largest description of a dataset [bytes].
const DESCRIPTION: u64 = 1 << 24;

/// A file that is opened: its path, its bytes, and the files that go on with it.
type TableOpening<'o> = (&'o Path, &'o OpenFile, &'o [PathBuf]);

struct TableFormat {
    /// Whether a file is of it, by its first bytes.
    is: fn(&[u8]) -> bool,
    open: fn(TableOpening<'_>) -> io::Result<TableText>,
}

const FORMATS: &[TableFormat] = &[
    TableFormat {
        is: |head| head.starts_with(b"\x93NUMPY"),
        open: |(_, file, _)| numpy::table(vec![npy::NpyArray::of_file(file)?]),
    },
    TableFormat {
        is: |head| head.starts_with(b"PK\x03\x04"),
        open: |(_, file, _)| archive(file),
    },
    TableFormat {
        is: mat::is_mat,
        open: |(_, file, _)| mat::open(file),
    },
    #[cfg(feature = "parquet")]
    TableFormat {
        is: |head| head.starts_with(b"PAR1"),
        open: |(path, _, more)| parquet::open(path, more),
    },
    TableFormat {
        is: json::is_json,
        open: |(_, file, _)| json::open(file),
    },
];

pub(super) fn is_table(head: &[u8]) -> bool {
    FORMATS.iter().any(|format| (format.is)(head))
}

/// Arrays of numpy in an archive.
fn archive(file: &OpenFile) -> io::Result<TableText> {
    let arrays = npy::NpyArray::of_members(file, zip::members(file)?)?;
    match arrays.is_empty() {
        true => Err(lines::unusable(
            "it is an archive without arrays of numpy (Excel's .xlsx, or a .zip): save the sheet as CSV, `python -c \"import pandas; pandas.read_excel('IN').to_csv('OUT.csv', index=False)\"`, or unpack the archive".to_owned(),
        )),
        false => numpy::table(arrays),
    }
}

/// Whether a file that can be read is one that others may go on with.
pub(super) fn begins(path: &Path) -> bool {
    super::source::begins_with(path, b"PAR1")
}

/// Opens a table; `more` are the files that go on with it.
pub(super) fn open(
    path: &Path,
    file: &OpenFile,
    head: &[u8],
    more: &[PathBuf],
) -> Result<TableText, LogError> {
    let refuse = |problem: io::Error| LogError::Table {
        file: shown(path),
        problem: problem.to_string(),
    };
    let format = FORMATS.iter().find(|format| (format.is)(head));
    let open = format.map(|format| (format.open)((path, file, more)));
    open.unwrap_or_else(|| Err(io::ErrorKind::Unsupported.into()))
        .map_err(refuse)
}

/// The description of the dataset of LeRobot that a file belongs to.
fn described(path: &Path) -> Option<serde_json::Value> {
    let place = path.ancestors().nth(3)?.join("meta").join("info.json");
    let small = std::fs::metadata(&place).is_ok_and(|about| about.len() <= DESCRIPTION);
    let text = small.then(|| std::fs::read_to_string(&place).ok());
    serde_json::from_str(&text??).ok()
}

/// The kind of robot that a dataset of LeRobot says it is of.
pub(super) fn robot_type(path: &Path) -> Option<String> {
    Some(described(path)?["robot_type"].as_str()?.to_owned())
}

/// The Parquet files of a dataset of LeRobot, in their order; `None` for any other folder.
pub(super) fn dataset(folder: &Path) -> io::Result<Option<Vec<PathBuf>>> {
    if !folder.join("meta").join("info.json").is_file() {
        return Ok(None);
    }
    let inside = |folder: &Path| -> io::Result<Vec<PathBuf>> {
        let entries = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
        let mut found = entries.collect::<io::Result<Vec<_>>>()?;
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
