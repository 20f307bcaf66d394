//! The files of a command: they get their names together, or none of them does.
//!
//! Each is written whole under a temporary name in its own folder first. A rename cannot be made of several
//! files at once: a machine that loses its power between two of them leaves some new files beside old ones,
//! each of them whole, and the old ones that were replaced under `.cft-ident-*_old.part`.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::NamedTempFile;

use super::{AtomicFile, LogWriter, OutputError, SUFFIX, unfinished};

/// Files that are ready, and the folders that were made for them.
#[derive(Debug, Default)]
pub struct FileBatch {
    inner: Mutex<PendingFiles>,
}

#[derive(Debug, Default)]
struct PendingFiles {
    ready: Vec<ReadyFile>,
    folders: Vec<PathBuf>,
}

/// A file that lacks only its name.
#[derive(Debug)]
struct ReadyFile {
    file: NamedTempFile,
    path: PathBuf,
    /// As the user named it.
    named: PathBuf,
}

/// A second name of a file that is replaced, held for as long as this value lives.
struct SecondName {
    name: PathBuf,
    _held: Option<File>,
}

impl FileBatch {
    /// Writes a file that gets its name with the others. What is no regular file is written at once.
    ///
    /// # Errors
    /// A place that cannot be written to, a full disk.
    pub fn write(&self, path: &Path, content: &[u8]) -> Result<(), OutputError> {
        use std::io::Write;
        let mut file = AtomicFile::create(path)?;
        let written = file.write_all(content);
        written.map_err(|error| OutputError::new(path, error))?;
        self.add(file)
    }

    /// Takes a file that is written.
    ///
    /// # Errors
    /// A full disk, a lost connection.
    pub fn add(&self, file: AtomicFile) -> Result<(), OutputError> {
        let named = file.path.clone();
        if let Some((file, path)) = file.ready()? {
            self.lock().ready.push(ReadyFile { file, path, named });
        }
        Ok(())
    }

    /// Takes a log that is written.
    ///
    /// # Errors
    /// A full disk, a lost connection.
    pub fn add_log(&self, log: LogWriter) -> Result<(), OutputError> {
        self.add(log.finish()?)
    }

    /// Makes a folder, and those above it; without files in the end, it is gone again.
    ///
    /// # Errors
    /// What the system says.
    pub fn make_folder(&self, path: &Path) -> std::io::Result<()> {
        let named = path.ancestors();
        let named = named.filter(|folder| !folder.as_os_str().is_empty());
        let missing = named.take_while(|folder| !folder.exists());
        let missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        unfinished().extend(missing.iter().cloned());
        // the deepest first, as they are removed
        self.lock().folders.splice(0..0, missing);
        std::fs::create_dir_all(path)
    }

    /// Gives all files their names, in the order in which they were added.
    ///
    /// # Errors
    /// A name that cannot be given: then what was there before is there again.
    pub fn commit(&self) -> Result<(), OutputError> {
        let ready = std::mem::take(&mut self.lock().ready);
        let several = ready.len() > 1;
        // Under the lock: an interruption finds all of them finished or none.
        let mut unfinished = unfinished();
        // with what had their names before, under other ones
        let mut renamed: Vec<(PathBuf, Option<SecondName>)> = Vec::with_capacity(ready.len());
        for ReadyFile { file, path, named } in ready {
            let temporary = file.path().to_owned();
            unfinished.remove(&temporary);
            let old = match several {
                true => kept(&path, &temporary),
                false => None,
            };
            if let Err(error) = file.persist(&path) {
                // what stands under the other name is the same file
                if let Some(old) = old {
                    let _ = std::fs::remove_file(old.name);
                }
                for (path, old) in renamed.into_iter().rev() {
                    // As far as the system lets us: it has just refused something.
                    let _ = match old {
                        Some(old) => std::fs::rename(old.name, path),
                        None => std::fs::remove_file(path),
                    };
                }
                return Err(OutputError::new(&named, error.error));
            }
            renamed.push((path, old));
        }
        for old in renamed.into_iter().filter_map(|(_, old)| old) {
            // one that is left is a file too many, and no half one
            let _ = std::fs::remove_file(old.name);
        }
        Ok(())
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, PendingFiles> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A second name for the file at `path`, where there is one and the disk knows second names.
fn kept(path: &Path, temporary: &Path) -> Option<SecondName> {
    let own = temporary.file_name()?.to_str()?.strip_suffix(SUFFIX)?;
    let name = temporary.with_file_name(format!("{own}_old{SUFFIX}"));
    // held before it is named, so that no other run takes it for abandoned
    let held = File::open(path).ok();
    let _ = held.as_ref().map(File::try_lock);
    std::fs::hard_link(path, &name).ok()?;
    Some(SecondName { name, _held: held })
}

impl Drop for FileBatch {
    fn drop(&mut self) {
        let mut inner = self.lock();
        let ready = std::mem::take(&mut inner.ready);
        let folders = std::mem::take(&mut inner.folders);
        drop(inner);
        let mut unfinished = unfinished();
        for file in ready {
            unfinished.remove(file.file.path());
        }
        for folder in folders {
            unfinished.remove(&folder);
            // One that holds something stays.
            let _ = std::fs::remove_dir(folder);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::names;
    use super::*;

    #[test]
    fn files_appear_together_and_not_before() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a"), "old").unwrap();
        let files = FileBatch::default();
        files.write(&at("a"), b"new").unwrap();
        files.write(&at("b"), b"new").unwrap();
        assert_eq!(std::fs::read_to_string(at("a")).unwrap(), "old");
        assert!(!at("b").exists());
        files.commit().unwrap();
        assert_eq!(names(folder.path()), ["a", "b"]);
        assert_eq!(std::fs::read_to_string(at("a")).unwrap(), "new");
    }

    #[test]
    fn a_second_name_is_held_and_one_that_a_killed_run_left_is_abandoned() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let long_ago = std::time::SystemTime::now() - std::time::Duration::from_secs(600);
        let old = |name: &str| {
            let file = File::create(at(name)).unwrap();
            file.set_modified(long_ago).unwrap();
            kept(&at(name), &at(&format!(".cft-ident-{name}.part"))).unwrap()
        };
        let (living, killed) = (old("a"), old("b"));
        drop(killed);
        drop(AtomicFile::create(&at("c")).unwrap());
        assert_eq!(names(folder.path()), [".cft-ident-a_old.part", "a", "b"]);
        assert_eq!(living.name, at(".cft-ident-a_old.part"));
    }

    #[test]
    fn a_name_that_cannot_be_given_takes_the_others_back() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a"), "old").unwrap();
        let files = FileBatch::default();
        for name in ["a", "b", "c"] {
            files.write(&at(name), b"new").unwrap();
        }
        // a folder takes the last name before its file does
        std::fs::create_dir_all(at("c").join("inside")).unwrap();
        assert!(files.commit().is_err());
        assert_eq!(names(folder.path()), ["a", "c"]);
        assert_eq!(std::fs::read_to_string(at("a")).unwrap(), "old");
    }

    #[test]
    fn what_is_dropped_leaves_neither_files_nor_folders() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("runs").join("monday");
        for commits in [false, true] {
            let files = FileBatch::default();
            files.make_folder(&inside).unwrap();
            files.write(&inside.join("a"), b"new").unwrap();
            if commits {
                files.commit().unwrap();
            }
            drop(files);
            assert_eq!(names(folder.path()).is_empty(), !commits);
        }
        assert_eq!(names(&inside), ["a"]);
    }
}
