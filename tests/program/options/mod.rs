//! Options in pairs, on every kind of input: what is taken is used, what is not used is refused by name, and no pair gives
//! a wrong number. The tables are made from the code: a new option, effect or input joins by itself.

mod accepted;
mod inputs;
mod pairs;
mod unseen;

use std::path::Path;
use std::process::Command;

use cft_ident::cli::CommandLine;
use clap::CommandFactory;
use serde_json::Value;

/// How a run ended.
pub struct Ended {
    pub line: String,
    pub status: Option<i32>,
    pub document: Value,
    pub stderr: String,
}

impl Ended {
    /// The relative error of the first table that the document holds, as the mean over the joints while they move.
    pub fn error(&self) -> f64 {
        let joints = self.document["joints"].as_array().unwrap();
        let of = |j: &Value| {
            let moving = j["relative_error_moving"].as_f64();
            moving.or(j["relative_error"].as_f64()).unwrap()
        };
        joints.iter().map(of).sum::<f64>() / joints.len() as f64
    }
}

/// Runs a line whose words stand between spaces; its document goes to standard output.
pub fn run(folder: &Path, line: &str) -> Ended {
    let words: Vec<&str> = line.split_whitespace().collect();
    let output = Command::new(env!("CARGO_BIN_EXE_cft-ident"))
        .args(&words)
        .args(["--json", "-", "-q"])
        .current_dir(folder)
        .stdin(std::process::Stdio::null())
        .output()
        .unwrap();
    Ended {
        line: line.to_owned(),
        status: output.status.code(),
        document: serde_json::from_slice(&output.stdout).unwrap_or(Value::Null),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// The same of a line that must end well.
#[track_caller]
pub fn done(folder: &Path, line: &str) -> Ended {
    let ended = run(folder, line);
    assert_eq!(ended.status, Some(0), "{line}: {}", ended.stderr);
    ended
}

/// Does something for each of a list on two threads; what is wrong is gathered.
pub fn faults<T: Sync>(all: &[T], of: impl Fn(&T) -> Option<String> + Sync) -> Vec<String> {
    let half = all.len().div_ceil(2).max(1);
    std::thread::scope(|scope| {
        let parts = all.chunks(half);
        let workers =
            parts.map(|part| scope.spawn(|| part.iter().filter_map(&of).collect::<Vec<_>>()));
        let workers: Vec<_> = workers.collect();
        workers
            .into_iter()
            .flat_map(|w| w.join().unwrap())
            .collect()
    })
}

/// The options of a command by their long names, but for those that every command has.
pub fn options_of(command: &str) -> Vec<clap::Arg> {
    let all = CommandLine::command();
    let found = all.find_subcommand(command).unwrap();
    let common: Vec<&str> = all
        .get_arguments()
        .filter_map(clap::Arg::get_long)
        .collect();
    let own = found
        .get_arguments()
        .filter(|arg| arg.get_long().is_some_and(|name| !common.contains(&name)));
    own.cloned().collect()
}
