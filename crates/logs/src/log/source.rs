//! Files as they lie on the disk: opened with errors that help, and known again by their checksum.

use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::LogError;
use super::names::{escape, escape_whole, list, nearest};
use super::open_file::OpenFile;

/// One input of a result: enough to know the data again, and nothing of the machine it was read on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// File name without folders.
    pub name: String,
    /// The part that was used, as written after `@`; absent (null in JSON) for the whole log.
    #[serde(default)]
    pub span: Option<String>,
    /// SHA-256 of the whole file, hexadecimal.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub sha256: String,
    /// Rows used; 0 for a file that is no log.
    #[serde(default)]
    pub samples: u64,
    /// Time from the first to the last row used [s].
    #[serde(default)]
    pub duration_s: f64,
    /// What its rows were used for; absent where nothing was made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub role: Option<DataRole>,
}

/// What the rows of a log were used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DataRole {
    /// Parameters were fitted to them.
    Fitted,
    /// They were never fitted, and judged what was added.
    #[serde(alias = "vetoed")]
    HeldOut,
}

impl DataRole {
    /// The word in tables and files.
    pub fn word(self) -> &'static str {
        match self {
            DataRole::Fitted => "fitted",
            DataRole::HeldOut => "held-out",
        }
    }
}

impl Provenance {
    /// The same, with what it was used for; a file that is no log has no role.
    pub fn used_as(mut self, role: DataRole) -> Self {
        self.role = (self.samples > 0).then_some(role);
        self
    }

    /// Whether something was made from these rows: from those of a log that was not held out.
    pub fn made(&self) -> bool {
        self.samples > 0 && self.role != Some(DataRole::HeldOut)
    }

    /// An input that is no log: a model, robot, campaign or trajectory file.
    pub fn of_file(path: &Path) -> Result<Self, LogError> {
        Ok(Self::of_bytes(file_name(path), sha256(path)?))
    }

    /// An input that is no file of the user: a configuration that comes with the tool.
    pub fn of_text(name: &str, text: &str) -> Self {
        Self::of_bytes(name.to_owned(), sha256_of_bytes(text.as_bytes()))
    }

    fn of_bytes(name: String, sha256: String) -> Self {
        Self {
            name,
            span: None,
            sha256,
            samples: 0,
            duration_s: 0.0,
            role: None,
        }
    }
}

/// File name without folders: the only form in which a path enters an output.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// A path for a message.
pub fn shown(path: &Path) -> String {
    escape_whole(&path.to_string_lossy())
}

/// What to do when the system refuses to read.
pub fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::NotFound => "check the path\nit is looked for from the current folder",
        io::ErrorKind::PermissionDenied => "allow reading it, or copy it to where you may read",
        io::ErrorKind::IsADirectory => "name a file inside this folder",
        io::ErrorKind::InvalidData => "it is no UTF-8 text\nname the right file",
        io::ErrorKind::Unsupported => "write it as CSV, a column for each channel",
        io::ErrorKind::UnexpectedEof => "it is cut off: copy it again from where it was recorded",
        _ => "check the disk or the connection, and try again",
    }
}

/// Several paths for a message: the first, and how many more.
pub(super) fn shown_all(paths: &[PathBuf]) -> String {
    match paths {
        [] => String::new(),
        [path] => shown(path),
        [first, rest @ ..] => format!("{} and {} more files", shown(first), rest.len()),
    }
}

pub(super) fn open(path: &Path) -> Result<OpenFile, LogError> {
    OpenFile::open(path).map_err(|error| failed(path, error))
}

/// Whether a file begins with these bytes; one that cannot be read does not.
pub fn begins_with(path: &Path, bytes: &[u8]) -> bool {
    let mut first = vec![0; bytes.len()];
    let read = OpenFile::open(path).and_then(|mut file| file.read_exact(&mut first));
    read.is_ok() && first == bytes
}

/// "\nthe nearest is `x`", or "\nthere are x, y" of the files of these kinds in the folder of one that is
/// not there; empty where there are none.
pub fn named_beside(path: &Path, ends: &[&str]) -> String {
    named_beside_of(path, ends, &|_| true)
}

/// The same of those files of which `wanted` holds.
pub fn named_beside_of(path: &Path, ends: &[&str], wanted: &dyn Fn(&Path) -> bool) -> String {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let Ok(entries) = std::fs::read_dir(folder) else {
        return String::new();
    };
    let is = |name: &String| ends.iter().any(|end| name.ends_with(&format!(".{end}")));
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(is).collect();
    names.retain(|name| wanted(&folder.join(name)));
    names.sort();
    let known = || names.iter().map(String::as_str);
    match nearest(&file_name(path), known()) {
        Some(near) => format!("\ndid you mean `{}`?", escape(near)),
        None if names.is_empty() => String::new(),
        None => format!("\nin that folder are {}", list(known())),
    }
}

const LOGS: [&str; 12] = [
    "csv", "txt", "dat", "tsv", "npz", "npy", "parquet", "mcap", "db3", "csv.gz", "csv.zst",
    "mcap.zst",
];

pub(super) fn failed(path: &Path, error: io::Error) -> LogError {
    let beside = match error.kind() {
        io::ErrorKind::NotFound => named_beside(path, &LOGS),
        _ => String::new(),
    };
    LogError::Read {
        file: shown(path),
        remedy: format!("{}{beside}", remedy(&error)),
        source: Arc::new(error),
    }
}

/// SHA-256 of a whole file, hexadecimal.
pub fn sha256(path: &Path) -> Result<String, LogError> {
    sha256_of(&[path.to_owned()])
}

/// SHA-256 of bytes, hexadecimal.
pub fn sha256_of_bytes(bytes: &[u8]) -> String {
    let mut checksum = SourceChecksum::default();
    checksum.update(bytes);
    checksum.hexadecimal()
}

/// Bytes of a whole file.
pub fn bytes(path: &Path) -> Result<Vec<u8>, LogError> {
    let mut all = Vec::new();
    let read = open(path)?.read_to_end(&mut all);
    read.map_err(|error| failed(path, error))?;
    Ok(all)
}

/// SHA-256 of whole files one after the other, hexadecimal.
pub(super) fn sha256_of(paths: &[PathBuf]) -> Result<String, LogError> {
    let mut checksum = SourceChecksum::default();
    for path in paths {
        let mut file = BufReader::with_capacity(1 << 16, open(path)?);
        let read = io::copy(&mut file, &mut checksum.0);
        read.map_err(|error| failed(path, error))?;
    }
    Ok(checksum.hexadecimal())
}

/// SHA-256 of the bytes of a log, as they are read.
#[derive(Clone, Default)]
pub(super) struct SourceChecksum(Sha256);

impl SourceChecksum {
    pub(super) fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    pub(super) fn hexadecimal(self) -> String {
        let digest = self.0.finalize();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_published_one() {
        // FIPS 180-2, appendix B.1.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(Provenance::of_text("abc", "abc").sha256, abc);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("abc.csv");
        std::fs::write(&path, "abc").unwrap();
        let Provenance { name, sha256, .. } = Provenance::of_file(&path).unwrap();
        assert_eq!((&*name, &*sha256), ("abc.csv", abc));
    }

    #[test]
    fn a_folder_and_a_missing_file_are_distinguished() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |path: &Path| sha256(path).unwrap_err().to_string();
        let said = refused(folder.path());
        assert!(said.contains("name a file inside"), "{said}");
        let said = refused(&folder.path().join("none.csv"));
        assert!(
            said.contains("none.csv") && said.contains("check the path"),
            "{said}"
        );
    }
}
