//! Files that are read from a place of one's own.

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

/// A file that is being read. A regular one is read from a place of one's own.
pub(super) struct OpenFile {
    file: Arc<File>,
    at: Option<u64>,
}

impl OpenFile {
    /// Opens a file.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let about = path.metadata()?;
        if about.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        Ok(Self {
            file: Arc::new(File::open(path)?),
            at: about.is_file().then_some(0),
        })
    }

    /// The same file, read from a byte on by whoever takes this.
    pub(super) fn from(&self, at: u64) -> Self {
        Self::at(Arc::clone(&self.file), at)
    }

    /// A regular file, read from a byte on.
    pub(super) fn at(file: Arc<File>, at: u64) -> Self {
        Self { file, at: Some(at) }
    }

    pub(super) fn metadata(&self) -> io::Result<Metadata> {
        self.file.metadata()
    }
}

impl Read for OpenFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Some(at) = &mut self.at else {
            return (&*self.file).read(buffer);
        };
        #[cfg(unix)]
        let count = std::os::unix::fs::FileExt::read_at(&*self.file, buffer, *at)?;
        #[cfg(windows)]
        let count = std::os::windows::fs::FileExt::seek_read(&*self.file, buffer, *at)?;
        *at += count as u64;
        Ok(count)
    }
}
