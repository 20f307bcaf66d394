//! Shared by the tests of several crates: the folder of the repository, and the measured logs beside it.

#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};

/// The folder of the repository.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A file of the folder with measured logs beside the repository; absence is said aloud.
pub fn shared(file: &str) -> Option<PathBuf> {
    let path = Path::new(ROOT).join("../shared/data").join(file);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is absent", path.display());
    None
}
