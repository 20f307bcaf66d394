//! Commands of the tool: the binary beside the program that asks.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// What a command did.
#[derive(Debug, Clone)]
pub struct Done {
    pub status: i32,
    pub document: Value,
    pub message: String,
}

impl Done {
    /// Warnings and errors as one text.
    pub fn said(&self) -> String {
        let warnings = self.document["warnings"].to_string();
        format!("{} {warnings}", self.message)
    }
}

/// The binary of the same build.
pub fn binary() -> PathBuf {
    let this = std::env::current_exe().expect("this program has a path");
    let build = this.parent().and_then(Path::parent);
    let name = format!("cft-ident{}", std::env::consts::EXE_SUFFIX);
    build.expect("a folder of the build").join(name)
}

/// Runs a command in a folder, on one thread.
pub fn run(folder: &Path, words: &[&str]) -> Done {
    let output = Command::new(binary())
        .current_dir(folder)
        .args(words)
        .args(["--json", "-", "-q", "--threads", "1"])
        .output()
        .expect("cft-ident is built: cargo build");
    Done {
        status: output.status.code().unwrap_or(-1),
        document: serde_json::from_slice(&output.stdout).unwrap_or(Value::Null),
        message: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// The same with an option that older builds of the tool lack.
pub fn run_with(folder: &Path, words: &[&str], option: &[&str]) -> Done {
    let done = run(folder, &[words, option].concat());
    match done.status == 2 && done.message.contains("unexpected argument") {
        true => run(folder, words),
        false => done,
    }
}
