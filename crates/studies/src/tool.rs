//! The binary that is judged: it is run as a laboratory would run it, and only its documents are read.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::study::StudyError;

/// No command on a minute of log should take longer than this, a search on a machine that many others use included.
const PATIENCE: Duration = Duration::from_secs(600);

/// Exit status of a run that was ended from outside.
pub const ENDED: i32 = -1;

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
    /// Runs it in a folder with `--json`, on one thread; the document is read and removed. A run that goes on for
    /// longer than [`PATIENCE`] is ended, and has [`ENDED`] for an exit status.
    pub fn run(&self, folder: &Path, words: &[&str]) -> Result<Answer, StudyError> {
        let failed = |source| StudyError::Tool {
            path: self.path.clone(),
            source,
        };
        let json = folder.join("answer.json");
        let said = folder.join("said.txt");
        let mut child = Command::new(&self.path)
            .current_dir(folder)
            .args(words)
            .args(["--json", "answer.json", "--threads", "1", "-q"])
            .stdout(Stdio::null())
            .stderr(File::create(&said).map_err(failed)?)
            .spawn()
            .map_err(failed)?;
        let begin = Instant::now();
        let exit = loop {
            if let Some(status) = child.try_wait().map_err(failed)? {
                break status.code().unwrap_or(ENDED);
            }
            if begin.elapsed() > PATIENCE {
                child.kill().and_then(|()| child.wait()).map_err(failed)?;
                break ENDED;
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let document = match std::fs::read_to_string(&json) {
            Ok(text) => {
                let _ = std::fs::remove_file(&json);
                serde_json::from_str(&text).ok()
            }
            Err(_) => None,
        };
        Ok(Answer {
            exit,
            document,
            message: std::fs::read_to_string(&said).unwrap_or_default(),
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
