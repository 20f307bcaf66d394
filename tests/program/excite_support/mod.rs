//! Runs `excite` in a folder.

use std::path::Path;

use assert_cmd::Command;

/// `excite` with these words.
pub fn excite(folder: &Path, line: &str) -> Command {
    let mut command = Command::cargo_bin("cft-ident").unwrap();
    command
        .current_dir(folder)
        .arg("excite")
        .args(line.split_whitespace());
    command
}
