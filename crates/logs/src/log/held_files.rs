//! Files of logs that somebody holds: opened once, and read by each reader from a place of its own.

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

pub(super) struct HeldFiles {
    path: PathBuf,
    files: Mutex<Vec<(PathBuf, Arc<File>)>>,
}

/// The files of logs that somebody holds now.
static HELD: Mutex<Vec<Weak<HeldFiles>>> = Mutex::new(Vec::new());

/// Files of one log that are kept open.
const OPEN: usize = 16;

impl HeldFiles {
    /// Those of the log of this path, kept open as long as they are held.
    pub(super) fn of(path: &Path) -> Arc<Self> {
        let held = Arc::new(Self {
            path: path.to_owned(),
            files: Mutex::default(),
        });
        let mut all = lock(&HELD);
        all.retain(|held| held.strong_count() > 0);
        all.push(Arc::downgrade(&held));
        held
    }

    /// Whether a file is one of the log: itself, in its folder, or one of those that `+` joins.
    fn has(&self, path: &Path) -> bool {
        let joined = || self.path.to_str().zip(path.to_str());
        self.path == path
            || path.parent() == Some(&self.path)
            || joined().is_some_and(|(all, one)| all.split('+').any(|part| part == one))
    }
}

/// A file that is being read. A regular one is read from a place of one's own.
pub(super) struct OpenFile {
    file: Arc<File>,
    at: Option<u64>,
}

impl OpenFile {
    fn new(file: Arc<File>, regular: bool) -> Self {
        Self {
            file,
            at: regular.then_some(0),
        }
    }

    /// The same file, read from a byte on by whoever takes this.
    pub(super) fn from(&self, at: u64) -> Self {
        Self {
            file: Arc::clone(&self.file),
            at: Some(at),
        }
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

/// A file, opened anew unless it is one of a log that somebody holds.
pub(super) fn opened(path: &Path) -> io::Result<OpenFile> {
    let held: Vec<Arc<HeldFiles>> = lock(&HELD).iter().filter_map(Weak::upgrade).collect();
    let held = held.iter().find(|held| held.has(path));
    let mut files = held.map(|held| lock(&held.files));
    let now = path.metadata()?;
    let same = |file: &File| {
        let then = file.metadata()?;
        Ok::<bool, io::Error>(then.len() == now.len() && then.modified()? == now.modified()?)
    };
    if let Some(files) = &mut files {
        files.retain(|(of, file)| of != path || same(file).unwrap_or(false));
        if let Some((_, file)) = files.iter().find(|(of, _)| of == path) {
            return Ok(OpenFile::new(Arc::clone(file), true));
        }
    }
    if now.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let file = Arc::new(File::open(path)?);
    let regular = now.is_file();
    if let Some(files) = files.as_mut().filter(|files| regular && files.len() < OPEN) {
        files.push((path.to_owned(), Arc::clone(&file)));
    }
    Ok(OpenFile::new(file, regular))
}

/// A value behind a lock, whatever became of who held it before.
pub(super) fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
