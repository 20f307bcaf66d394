//! Studies that go on where they were stopped: one line of JSON per run, by cell, number and binary.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::tool::Tool;

#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    #[error("{}: {source}", path.display())]
    File {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("cannot run {}: {source}; give the binary with --tool, or in CFT_IDENT", path.display())]
    Tool {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{}: line {line}: {message}", path.display())]
    Line {
        path: PathBuf,
        line: usize,
        message: String,
    },
    #[error("{}: no `{mark}` and its end in it, between which the table stands", path.display())]
    NoPlace { path: PathBuf, mark: String },
}

/// The lines of one study, of all binaries.
pub struct Rows {
    path: PathBuf,
    pub rows: Vec<Value>,
    done: BTreeSet<(String, String, u64)>,
}

fn key(row: &Value) -> (String, String, u64) {
    let text = |key: &str| row[key].as_str().unwrap_or_default().to_owned();
    (
        text("tool"),
        text("cell"),
        row["run"].as_u64().unwrap_or(u64::MAX),
    )
}

impl Rows {
    pub fn open(folder: &Path, name: &str) -> Result<Self, StudyError> {
        let path = folder.join(format!("{name}.jsonl"));
        let mut all = Self {
            rows: Vec::new(),
            done: BTreeSet::new(),
            path,
        };
        if let Ok(file) = File::open(&all.path) {
            for (k, line) in BufReader::new(file).lines().enumerate() {
                let line = line.map_err(|source| StudyError::File {
                    path: all.path.clone(),
                    source,
                })?;
                let row: Value = serde_json::from_str(&line).map_err(|error| StudyError::Line {
                    path: all.path.clone(),
                    line: k + 1,
                    message: format!("{error}; delete the line, and its run is made anew"),
                })?;
                all.done.insert(key(&row));
                all.rows.push(row);
            }
        }
        Ok(all)
    }

    /// Makes a run that is not there yet; its folder is deleted afterwards.
    pub fn once(
        &mut self,
        tool: &Tool,
        cell: &str,
        run: u64,
        one: impl FnOnce(&Path) -> Result<Value, StudyError>,
    ) -> Result<(), StudyError> {
        if self
            .done
            .contains(&(tool.label.clone(), cell.to_owned(), run))
        {
            return Ok(());
        }
        let of_file = |path: &Path, source| StudyError::File {
            path: path.to_owned(),
            source,
        };
        let folder = tempfile::tempdir().map_err(|e| of_file(Path::new("a scratch folder"), e))?;
        let result = one(folder.path())?;
        let mut row = json!({ "tool": tool.label, "cell": cell, "run": run });
        if let (Value::Object(row), Value::Object(result)) = (&mut row, result) {
            row.extend(result);
        }
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.path)
            .map_err(|e| of_file(&self.path, e))?;
        writeln!(file, "{row}").map_err(|e| of_file(&self.path, e))?;
        self.done.insert(key(&row));
        self.rows.push(row);
        Ok(())
    }

    /// The names of the binaries, in the order of their first lines.
    pub fn tools(&self) -> Vec<String> {
        let mut tools = Vec::new();
        for row in &self.rows {
            let tool = row["tool"].as_str().unwrap_or_default().to_owned();
            if !tools.contains(&tool) {
                tools.push(tool);
            }
        }
        tools
    }

    pub fn of<'a>(&'a self, tool: &'a str, cell: &'a str) -> impl Iterator<Item = &'a Value> {
        self.rows
            .iter()
            .filter(move |row| row["tool"] == tool && row["cell"] == cell)
    }

    pub fn of_tool<'a>(&'a self, tool: &'a str) -> impl Iterator<Item = &'a Value> {
        self.rows.iter().filter(move |row| row["tool"] == tool)
    }
}
