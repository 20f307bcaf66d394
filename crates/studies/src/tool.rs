//! The binary that is judged: it is run as a laboratory would run it, and only its documents are read.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::study::StudyError;

/// The binary, and what its column is called in tables.
#[derive(Debug, Clone)]
pub struct Tool {
    pub path: PathBuf,
    pub label: String,
}

/// What a run left: its exit status, and its document where it wrote one.
pub struct Answer {
    pub exit: i32,
    pub document: Option<Value>,
    pub message: String,
}

impl Tool {
    /// Runs it in a folder with `--json`, on one thread; the document is read and removed.
    pub fn run(&self, folder: &Path, words: &[&str]) -> Result<Answer, StudyError> {
        let json = folder.join("answer.json");
        let output = Command::new(&self.path)
            .current_dir(folder)
            .args(words)
            .args(["--json", "answer.json", "--threads", "1", "-q"])
            .output()
            .map_err(|source| StudyError::Tool {
                path: self.path.clone(),
                source,
            })?;
        let document = match std::fs::read_to_string(&json) {
            Ok(text) => {
                let _ = std::fs::remove_file(&json);
                serde_json::from_str(&text).ok()
            }
            Err(_) => None,
        };
        Ok(Answer {
            exit: output.status.code().unwrap_or(-1),
            document,
            message: String::from_utf8_lossy(&output.stderr).into_owned(),
        })
    }
}

impl Answer {
    pub fn list(&self, key: &str) -> &[Value] {
        self.document
            .as_ref()
            .and_then(|d| d[key].as_array())
            .map_or(&[], Vec::as_slice)
    }

    /// The last line of what it said, to find the cause of an exit in the results.
    pub fn last_words(&self) -> String {
        let line = self
            .message
            .lines()
            .rev()
            .find(|line| !line.trim().is_empty());
        line.unwrap_or_default().chars().take(300).collect()
    }
}
