//! Measured logs and the commands that are run on them.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

/// A measured log, its span behind it where one is named; or `None` with a word about it.
#[allow(dead_code)] // a test of what the program carries needs none
pub fn shared(log: &str) -> Option<PathBuf> {
    let data = Path::new(cft_ident_support::ROOT).join("../shared/data");
    let file = data.join(log.split('@').next().unwrap_or(log));
    if file.exists() {
        return Some(data.join(log));
    }
    eprintln!(
        "SKIPPED: {} is not there (docs/results/measured/data.md says where it is from)",
        file.display()
    );
    None
}

/// Runs a command in `folder` that must succeed, and gives its JSON document.
#[allow(dead_code)] // a test that only wants a log runs nothing
#[track_caller]
pub fn run<S: AsRef<OsStr> + std::fmt::Debug>(folder: &Path, words: &[S]) -> Value {
    let output = Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder)
        .args(words)
        .args(["--json", "-", "-q"])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{words:?}: {message}");
    serde_json::from_slice(&output.stdout).unwrap()
}
