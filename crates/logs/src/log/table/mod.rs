//! Tables that are no lines of fields: arrays of numpy, Parquet files, JSON objects. Their rows are handed on as lines of CSV, so that
//! whatever holds of text logs holds of them.

mod json;
mod lines;
mod literal;
mod npy;
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
mod zip;

use std::io;
use std::path::{Path, PathBuf};

use super::LogError;
use super::held_files::OpenFile;
use super::source::{file_name, shown};
pub(super) use lines::TableText;

pub(super) fn is_table(head: &[u8]) -> bool {
    [&b"\x93NUMPY"[..], b"PK\x03\x04"]
        .iter()
        .any(|magic| head.starts_with(magic))
        || (cfg!(feature = "parquet") && is_parquet(head))
        || json::is_json(head)
}

fn is_parquet(head: &[u8]) -> bool {
    head.starts_with(b"PAR1")
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
    if is_parquet(head) {
        #[cfg(feature = "parquet")]
        return parquet::open(path, more).map_err(refuse);
    }
    let _ = more;
    if json::is_json(head) {
        return json::open(file).map_err(refuse);
    }
    let arrays = match head.starts_with(b"PK") {
        false => npy::Array::of_file(file).map(|array| vec![array]),
        true => zip::members(file).and_then(|members| npy::Array::of_members(file, members)),
    };
    if head.starts_with(b"PK") && arrays.as_ref().is_ok_and(Vec::is_empty) {
        return Err(LogError::Format {
            file: shown(path),
            kind: "an archive without arrays of numpy (Excel's .xlsx, or a .zip)",
            remedy: "save the sheet as CSV: `python -c \"import pandas; pandas.read_excel('IN').to_csv('OUT.csv', index=False)\"`\nor unpack the archive",
        });
    }
    let arrays = arrays.and_then(numpy::ArrayTable::new);
    let (table, notes) = arrays.map_err(refuse)?;
    Ok(TableText::new(&table.names.clone(), table, notes))
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
