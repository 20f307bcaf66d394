//! Faults of the set-up, made one at a time on measured and simulated machines, and what the tool says
//! of each: `cargo build --release && cargo run --release -p cft-ident-studies --example study_setup -- [MACHINE...] [--kind=KIND]`.
//!
//! Each case leaves its line in target/study_setup/rows.jsonl as soon as it is done: a stopped study
//! goes on where it was. `--again` begins anew. `--every=K` takes a sample, every K-th case of each machine from a
//! place on that chance chose, and `--minutes=M` begins no case after that time. The summary goes to
//! docs/results/study_setup.json; it says of how many cases it is.

mod bench;
mod summary;

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use bench::cases::cases;
use bench::judge::{Clean, judge};
use bench::machines::{NAMES, machine};
use bench::rows::Chance;
use rayon::prelude::*;
use serde_json::Value;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let named: Vec<&String> = words.iter().filter(|w| !w.starts_with("--")).collect();
    let kinds: Vec<&str> = words
        .iter()
        .filter_map(|w| w.strip_prefix("--kind="))
        .collect();
    let number = |key: &str| {
        let word = words.iter().find_map(|w| w.strip_prefix(key));
        word.map(|w| w.parse::<usize>().expect("a whole number"))
    };
    let every = number("--every=").unwrap_or(1).max(1);
    let until = number("--minutes=").map(|m| Instant::now() + Duration::from_secs(60 * m as u64));
    let late = || until.is_some_and(|until| Instant::now() > until);
    let mut chance = Chance(17);
    let mut all = 0;
    let wanted = |name: &str| named.is_empty() || named.iter().any(|w| *w == name);
    let folder = Path::new(cft_ident_support::ROOT).join("target/study_setup");
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    let path = folder.join("rows.jsonl");
    if words.iter().any(|w| w == "--again") {
        let _ = std::fs::remove_file(&path);
    }
    let known = finished(&path);
    let file = OpenOptions::new().create(true).append(true).open(&path);
    let file = Mutex::new(file.expect("the file of rows opens"));
    for name in NAMES {
        // drawn for every machine, so that the sample does not depend on which are named
        let from = (chance.next() * every as f64) as usize;
        if !wanted(name) {
            continue;
        }
        let Some(machine) = machine(name, &folder) else {
            continue;
        };
        let fresh = cases(&machine);
        all += fresh.len();
        if late() {
            continue;
        }
        let clean = Clean::new(machine);
        let done = |case: &str| {
            known
                .iter()
                .any(|r| r["machine"] == name && r["case"] == case)
        };
        let sample: Vec<_> = fresh.iter().skip(from).step_by(every).collect();
        sample.par_iter().for_each(|case| {
            let case_name = case.name(&clean.machine);
            let other = !kinds.is_empty() && !kinds.contains(&case.kind());
            if other || late() || done(&case_name) {
                return;
            }
            let Some(mut row) = judge(&clean, case) else {
                return;
            };
            row["machine"] = name.into();
            row["kind"] = case.kind().into();
            row["case"] = case_name.into();
            let mut file = file.lock().expect("no thread panics");
            writeln!(file, "{row}").expect("the row is written");
        });
        eprintln!(
            "{name}: error {:.4}, {} of {} cases",
            clean.fit.error(),
            sample.len(),
            fresh.len()
        );
    }
    let rows = finished(&path);
    let summary = summary::summary(&rows, all);
    let out = Path::new(cft_ident_support::ROOT).join("docs/results/study_setup.json");
    std::fs::write(out, format!("{summary:#}\n")).expect("the summary is written");
    summary::print(&summary);
}

fn finished(path: &Path) -> Vec<Value> {
    let Ok(file) = File::open(path) else {
        return Vec::new();
    };
    let lines = BufReader::new(file).lines().map_while(Result::ok);
    let mut rows: Vec<Value> = lines
        .filter_map(|line| serde_json::from_str(&line).ok())
        .collect();
    // two studies that run side by side may both have judged a case
    let mut seen = BTreeSet::new();
    rows.retain(|row| seen.insert((row["machine"].to_string(), row["case"].to_string())));
    rows
}
