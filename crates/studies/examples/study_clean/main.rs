//! Monte Carlo study of the diagnosis where nothing is missing: plants of several kinds on several motions, logs of
//! some 20 s with encoder quantisation and 1 % torque noise, identified and diagnosed by the commands that a
//! laboratory would type. An effect that is found is false.
//!
//! Beside it, what the placebos say of the best candidate of each campaign by chance alone, with every other test
//! switched off: that is to be even between 0 and 1.
//!
//! `cargo build --release && cargo run --release --example study_clean -- [SEEDS] [FOLDER]` writes one line per
//! campaign to target/study_clean.jsonl as it goes, first those of single drives, then of the arms seed by seed, and
//! goes on from there when it is begun again; at the end, or with SEEDS = 0 of what is there, it writes into FOLDER the
//! summary that docs/closing-the-loop.md is generated from. `-- try KEY` runs the campaigns whose key begins so again,
//! and leaves their files.

mod campaign;
mod plants;
#[path = "../study/mod.rs"]
#[allow(dead_code)] // each study uses its share
mod study;
#[path = "../study_setup/bench/tool.rs"]
#[allow(dead_code)]
mod tool;

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use campaign::{Campaign, of_seed};
use plants::Law;
use serde_json::{Value, json};
use study::{finished, interval};

const LOG: &str = "target/study_clean.jsonl";
const USUAL: u64 = 5;
/// Chance values below which campaigns are counted.
const CHANCES: [f64; 4] = [0.01, 0.05, 0.1, 0.5];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let first = arguments.next();
    if first.as_deref() == Some("try") {
        return again(&arguments.next().unwrap_or_default());
    }
    let seeds = first.and_then(|s| s.parse().ok());
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/results".into()));
    run(seeds.unwrap_or(USUAL));
    let rows = finished(Path::new(LOG));
    let document = summary(&rows);
    let path = folder.join("study_clean.json");
    std::fs::write(path, format!("{document:#}\n")).expect("the summary is written");
    println!("{document:#}");
}

/// Runs the campaign whose key begins so, and leaves its files.
fn again(key: &str) {
    let root = Path::new("target/study_clean");
    let of_key = |campaign: &Campaign| campaign.key().starts_with(key);
    for campaign in (0..100).flat_map(of_seed).filter(of_key) {
        let folder = root.join(format!("try {}", campaign.key()));
        std::fs::create_dir_all(&folder).expect("the folder can be made");
        println!("{}", campaign.run(&folder, &root.join("designs")));
    }
}

/// Runs what is not there yet.
fn run(seeds: u64) {
    let rows = finished(Path::new(LOG));
    let done: Vec<&str> = rows.iter().filter_map(|r| r["key"].as_str()).collect();
    let mut open: Vec<Campaign> = (0..seeds)
        .flat_map(of_seed)
        .filter(|campaign| !done.contains(&campaign.key().as_str()))
        .collect();
    // single drives take seconds
    open.sort_by_key(|campaign| campaign.machine.joints().len() > 1);
    let file = OpenOptions::new().create(true).append(true).open(LOG);
    let file = Mutex::new(file.expect("the log opens"));
    let next = AtomicUsize::new(0);
    let worker = |number: usize| {
        let root = Path::new("target/study_clean");
        let (folder, designs) = (root.join(number.to_string()), root.join("designs"));
        while let Some(campaign) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
            std::fs::create_dir_all(&folder).expect("the folder can be made");
            let row = campaign.run(&folder, &designs);
            let mut file = file.lock().expect("no thread panics");
            writeln!(file, "{row}").expect("the log is written");
            eprintln!("{row}");
            drop(file);
            std::fs::remove_dir_all(&folder).expect("the folder can be removed");
        }
    };
    std::thread::scope(|scope| {
        let worker = &worker;
        for number in 0..rayon::current_num_threads() {
            scope.spawn(move || worker(number));
        }
    });
}

fn summary(rows: &[Value]) -> Value {
    let mut lines = vec![line("all", rows.iter().collect())];
    for key in ["motion", "one-joint logs", "machine", "friction law"] {
        let mut kinds: Vec<&str> = rows.iter().filter_map(|r| r[key].as_str()).collect();
        kinds.sort_unstable();
        kinds.dedup();
        for kind in kinds {
            let of_kind = rows.iter().filter(|r| r[key] == kind).collect();
            lines.push(line(&format!("{key}: {kind}"), of_kind));
        }
    }
    json!({
        "study": format!("effects found where nothing is missing, {} campaigns", rows.len()),
        "command": "cargo run --release --example study_clean",
        "false": rows.iter().filter(|r| is_false(r)).collect::<Vec<_>>(),
        "refused": rows.iter().filter(|r| r["steps"].is_null()).collect::<Vec<_>>(),
        "rows": lines,
    })
}

/// Whether a step is the plant's own: where a jump is declared the plant has a slope, as steep as its integration
/// carries.
fn own(row: &Value, step: &Value) -> bool {
    let smooth = step
        .as_str()
        .is_some_and(|s| s.starts_with("smooth-coulomb"));
    smooth && row["friction law"] == Law::Jump.words()
}

/// Whether a campaign has a step that the plant has not.
fn is_false(row: &Value) -> bool {
    let mut steps = row["steps"].as_array().into_iter().flatten();
    steps.any(|step| !own(row, step))
}

fn has_own(row: &Value) -> bool {
    let mut steps = row["steps"].as_array().into_iter().flatten();
    steps.any(|step| own(row, step))
}

/// A line of the table.
fn line(kind: &str, rows: Vec<&Value>) -> Value {
    let ran: Vec<&&Value> = rows.iter().filter(|r| r["steps"].is_array()).collect();
    // what is missing has no chance value of nothing
    let clean: Vec<&&&Value> = ran.iter().filter(|r| !has_own(r)).collect();
    let found = ran.iter().filter(|r| is_false(r)).count();
    let mut line = json!({
        "campaigns": kind,
        "diagnosed": ran.len(),
        "with a false effect": found,
        "95 % interval": interval(found, ran.len()),
    });
    for chance in CHANCES {
        let below = clean
            .iter()
            .filter(|r| r["chance"].as_f64().is_some_and(|p| p <= chance));
        let share = below.count() as f64 / clean.len().max(1) as f64;
        line[format!("chance at most {chance}")] = format!("{:.1} %", 100.0 * share).into();
    }
    line["the plant's own slope found"] = ran.iter().filter(|r| has_own(r)).count().into();
    line["not diagnosed"] = (rows.len() - ran.len()).into();
    line
}
