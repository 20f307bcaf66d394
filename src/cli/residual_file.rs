//! The CSV file of measured, reconstructed and residual torques that `validate -o` writes.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::CliError;
use crate::validate::Reconstructed;

/// A residual file that appears whole, or not at all.
pub struct ResidualFile {
    path: PathBuf,
    file: BufWriter<NamedTempFile>,
    line: String,
}

impl ResidualFile {
    /// Begins the file beside its final place, with its header.
    ///
    /// # Errors
    /// Where the folder cannot be written to.
    pub fn create(path: &Path, joints: &[String]) -> Result<Self, CliError> {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let file = NamedTempFile::new_in(folder).map_err(|e| failed(path, &e))?;
        let mut out = ResidualFile {
            path: path.to_path_buf(),
            file: BufWriter::new(file),
            line: String::from("t"),
        };
        for kind in ["tau", "tau_hat", "residual"] {
            for joint in joints {
                out.line.push_str(&format!(",{kind}_{joint}"));
            }
        }
        out.write_line()?;
        Ok(out)
    }

    fn write_line(&mut self) -> Result<(), CliError> {
        self.line.push('\n');
        let written = self.file.write_all(self.line.as_bytes());
        self.line.clear();
        written.map_err(|e| failed(&self.path, &e))
    }

    /// Adds one sample.
    ///
    /// # Errors
    /// Where it cannot be written: a full disk.
    pub fn row(&mut self, r: &Reconstructed) -> Result<(), CliError> {
        use std::fmt::Write as _;
        let Self { line, .. } = self;
        // writing to a string does not fail
        let _ = write!(line, "{}", r.t);
        for x in r.measured.iter().chain(r.reconstructed) {
            let _ = write!(line, ",{x}");
        }
        for (a, b) in r.measured.iter().zip(r.reconstructed) {
            let _ = write!(line, ",{}", a - b);
        }
        self.write_line()
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// Where that fails; nothing is left then.
    pub fn finish(self) -> Result<(), CliError> {
        let path = self.path;
        let file = self
            .file
            .into_inner()
            .map_err(|e| failed(&path, e.error()))?;
        file.as_file().sync_all().map_err(|e| failed(&path, &e))?;
        file.persist(&path).map_err(|e| failed(&path, &e.error))?;
        Ok(())
    }
}

fn failed(path: &Path, error: &std::io::Error) -> CliError {
    CliError::output(format!("cannot write {}: {error}", path.display()))
        .hint("free space on the disk, or name another folder")
}
