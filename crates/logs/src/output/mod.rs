//! Files that appear whole or not at all, logs as CSV, MCAP and Parquet, motions as controllers take them.
//!
//! A file is written under another name in its own folder, brought to the disk, and renamed. Until
//! then whatever had its name stays as it was. What is no regular file (a terminal, a pipe,
//! `/dev/null`) is written directly: there is nothing that could be half.

mod columns;
mod log;
mod mcap;
#[cfg(feature = "parquet")]
mod parquet;
mod text;
mod together;
mod trajectory;

pub use log::{LogForm, LogWriter};
pub use together::FileBatch;
pub use trajectory::JointTrajectory;

use cft_ident_core::explain::Explain;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tempfile::NamedTempFile;
use thiserror::Error;

use crate::log::shown;

/// An output that cannot be written.
#[derive(Debug, Explain, Error)]
#[explain("{file}: cannot be written: {source}", remedy)]
pub struct OutputError {
    /// File as the user named it.
    pub file: String,
    /// What the system said.
    pub source: io::Error,
    /// What to do.
    pub remedy: &'static str,
}

impl OutputError {
    fn new(path: &Path, source: io::Error) -> Self {
        let remedy = match source.kind() {
            io::ErrorKind::NotFound => "make the folder first, or choose another",
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                "choose a folder that you may write to"
            }
            io::ErrorKind::IsADirectory => "name a file inside this folder",
            io::ErrorKind::StorageFull
            | io::ErrorKind::QuotaExceeded
            | io::ErrorKind::FileTooLarge => {
                "free some space or choose another disk; no half file was left"
            }
            io::ErrorKind::BrokenPipe => "the program that reads it has ended",
            _ => "choose another place for it",
        };
        Self {
            file: shown(path),
            source,
            remedy,
        }
    }
}

/// Temporary files that are not yet renamed, and folders made for them: what an interruption must remove.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every file that is not finished, right before an interrupted process ends.
///
/// From then on no file can be begun or finished: a thread that tries waits for the end.
pub fn remove_unfinished() {
    let mut unfinished = unfinished();
    // From the end: what a folder holds comes before it.
    while let Some(path) = unfinished.pop_last() {
        // It may be gone already, or a folder hold something of the user's; then nothing is left to do.
        let _ = match path.is_dir() {
            true => std::fs::remove_dir(path),
            false => std::fs::remove_file(path),
        };
    }
    // Never unlocked: a file begun now would be left behind.
    std::mem::forget(unfinished);
}

/// What names of files begin and end with until they are whole.
const PREFIX: &str = ".cft-ident-";
const SUFFIX: &str = ".part";
/// Age from which such a file that nobody holds is abandoned: its process locks it right after it made it.
const ABANDONED: Duration = Duration::from_secs(60);

/// Removes what a run that was killed left in a folder.
fn remove_abandoned(folder: &Path) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if !name.starts_with(PREFIX) || !name.ends_with(SUFFIX) {
            continue;
        }
        let age = entry.metadata().and_then(|about| about.modified());
        let old = age.is_ok_and(|at| at.elapsed().is_ok_and(|age| age > ABANDONED));
        let free = |file: File| file.try_lock().is_ok();
        if old && File::open(entry.path()).is_ok_and(free) {
            // another run may have been quicker
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

#[derive(Debug)]
enum OutputTarget {
    /// A file under a temporary name, and the name that it is to have.
    Temporary(NamedTempFile, PathBuf),
    /// Something that is no regular file.
    Direct(File),
}

/// A file that appears when it is committed, and not at all when it is dropped before.
#[derive(Debug)]
pub struct AtomicFile {
    path: PathBuf,
    /// `None` only while it is being committed.
    target: Option<BufWriter<OutputTarget>>,
}

impl AtomicFile {
    /// Begins a file. An unwritable place is reported here, before the work.
    ///
    /// # Errors
    /// A folder that is not there or may not be written to; a name that is a folder's.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let target = open(path).map_err(|error| OutputError::new(path, error))?;
        Ok(Self {
            path: path.to_owned(),
            target: Some(BufWriter::with_capacity(1 << 16, target)),
        })
    }

    /// Brings the file to the disk and gives it its name.
    ///
    /// # Errors
    /// A full disk, a lost connection; then there is no file.
    pub fn commit(self) -> Result<(), OutputError> {
        let files = FileBatch::default();
        files.add(self)?;
        files.commit()
    }

    /// Brings the file to the disk, with the name that it is to have; `None` where there is nothing to rename.
    fn ready(mut self) -> Result<Option<(NamedTempFile, PathBuf)>, OutputError> {
        let target = self.target.take();
        let finished = match target.map(BufWriter::into_inner) {
            None => Ok(None),
            Some(Err(error)) => {
                let (error, writer) = error.into_parts();
                // Dropping the writer would try the same write again.
                let (target, _) = writer.into_parts();
                forget(&target);
                Err(error)
            }
            Some(Ok(OutputTarget::Direct(_))) => Ok(None),
            // Delayed writes may fail only here.
            Some(Ok(OutputTarget::Temporary(file, path))) => match file.as_file().sync_all() {
                Ok(()) => Ok(Some((file, path))),
                Err(error) => {
                    forget(&OutputTarget::Temporary(file, path));
                    Err(error)
                }
            },
        };
        finished.map_err(|error| OutputError::new(&self.path, error))
    }
}

/// Opens the temporary file, or what is no regular file itself.
fn open(path: &Path) -> io::Result<OutputTarget> {
    let existing = std::fs::metadata(path).ok();
    match &existing {
        Some(existing) if existing.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Some(existing) if !existing.is_file() => {
            let file = File::options().write(true).open(path);
            return file.map(OutputTarget::Direct);
        }
        // A file that may not be written is not replaced either, though its folder would let us.
        Some(existing) if existing.permissions().readonly() => {
            return Err(io::ErrorKind::PermissionDenied.into());
        }
        _ => {}
    }
    // A link stays a link: the file behind it is replaced.
    let path = match existing {
        Some(_) => path.canonicalize()?,
        None => path.to_owned(),
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    remove_abandoned(folder);
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any new file: the user's mask applies.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    // The lock comes first, so that no interruption finds the file before it is known.
    let mut unfinished = unfinished();
    let file = builder.tempfile_in(folder).map_err(plain)?;
    // Held as long as this process lives; where there are no locks the file is never taken for abandoned.
    let _ = file.as_file().try_lock();
    unfinished.insert(file.path().to_owned());
    Ok(OutputTarget::Temporary(file, path))
}

/// The error of the system alone: the temporary file's own names a path that nobody asked for.
fn plain(error: io::Error) -> io::Error {
    let inner = error.get_ref().and_then(|outer| outer.source());
    let inner = inner.and_then(|inner| inner.downcast_ref::<io::Error>());
    let code = inner.and_then(io::Error::raw_os_error);
    code.map_or(error, io::Error::from_raw_os_error)
}

/// A temporary file that removes itself need not be removed by an interruption.
fn forget(target: &OutputTarget) {
    if let OutputTarget::Temporary(file, _) = target {
        unfinished().remove(file.path());
    }
}

impl OutputTarget {
    /// The file itself, for its errors: see `plain`.
    fn file(&mut self) -> &mut File {
        match self {
            Self::Temporary(file, _) => file.as_file_mut(),
            Self::Direct(file) => file,
        }
    }
}

impl Write for OutputTarget {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.file().write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file().flush()
    }
}

impl Write for AtomicFile {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        match &mut self.target {
            Some(target) => target.write(buffer),
            None => Ok(buffer.len()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.target.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if let Some(writer) = self.target.take() {
            // What is still in the buffer must not be written any more.
            let (target, _) = writer.into_parts();
            forget(&target);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes a file whole or not at all.
    fn write_whole(
        path: &Path,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), OutputError> {
        let mut file = AtomicFile::create(path)?;
        content(&mut file).map_err(|error| OutputError::new(path, error))?;
        file.commit()
    }

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().unwrap()
    }

    pub(super) fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_that_is_not_committed_leaves_nothing_and_keeps_the_old_one() {
        let folder = folder();
        let path = folder.path().join("model.toml");
        std::fs::write(&path, "old").unwrap();
        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(&[b'x'; 200_000]).unwrap();
        assert_eq!(names(folder.path()).len(), 2);
        drop(file);
        assert_eq!(names(folder.path()), ["model.toml"]);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    }

    #[test]
    fn what_a_killed_run_left_is_removed_by_the_next_and_what_is_being_written_is_not() {
        let folder = folder();
        let part = |name: &str, minutes: u64| {
            let path = folder.path().join(format!("{PREFIX}{name}{SUFFIX}"));
            let file = File::create(path).unwrap();
            let then = std::time::SystemTime::now() - Duration::from_secs(60 * minutes);
            file.set_modified(then).unwrap();
            file
        };
        drop((part("killed", 5), part("new", 0)));
        let held = part("held", 5);
        held.lock().unwrap();
        write_whole(&folder.path().join("a.csv"), |file| file.write_all(b"a")).unwrap();
        let left = [".cft-ident-held.part", ".cft-ident-new.part", "a.csv"];
        assert_eq!(names(folder.path()), left);
    }

    #[test]
    fn a_committed_file_replaces_the_old_one_whole() {
        let folder = folder();
        let path = folder.path().join("model.toml");
        std::fs::write(&path, "old").unwrap();
        write_whole(&path, |file| file.write_all(b"new")).unwrap();
        assert_eq!(names(folder.path()), ["model.toml"]);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    }

    #[test]
    fn an_error_in_the_content_leaves_no_file() {
        let folder = folder();
        let path = folder.path().join("a.csv");
        let result = write_whole(&path, |file| {
            file.write_all(b"half")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(result.unwrap_err().to_string().contains("free some space"));
        assert!(names(folder.path()).is_empty());
    }

    #[cfg(unix)]
    #[test]
    fn a_new_file_has_the_permissions_of_any_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = folder();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write_whole(&ours, |file| file.write_all(b"x")).unwrap();
        std::fs::write(&plain, "x").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_reported_and_a_device_is_not_replaced() {
        let full = Path::new("/dev/full");
        let error = write_whole(full, |file| file.write_all(b"x")).unwrap_err();
        assert_eq!(error.source.kind(), io::ErrorKind::StorageFull);
        let text = error.to_string();
        assert!(text.contains("/dev/full") && text.contains("free some space"));
        assert!(!std::fs::metadata(full).unwrap().is_file());
        write_whole(Path::new("/dev/null"), |file| file.write_all(b"x")).unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_the_file_behind_it_is_replaced() {
        let folder = folder();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_whole(&link, |content| content.write_all(b"new")).unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "new");
    }

    #[test]
    fn a_missing_folder_and_a_folder_as_name_are_reported_before_the_work() {
        let folder = folder();
        let missing = (folder.path().join("none/a.csv"), "make the folder first");
        let named = (folder.path().to_owned(), "name a file inside");
        for (path, said) in [missing, named] {
            let error = AtomicFile::create(&path).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
