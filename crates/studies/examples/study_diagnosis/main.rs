//! Monte Carlo study of the diagnosis: campaigns of the simulated CFT robot with effects in them
//! that the declared model lacks, of a known size, and clean ones. Plants vary by 15 %; logs of 20 s
//! with encoder quantisation and torque noise; friction from one-joint logs that carry the effect
//! too, inertias by least squares, as a lab would have them, and all these logs for the diagnosis.
//!
//! The size of an effect is the rms of its torque over that of the noise, both in the band that the
//! parallel filter keeps.
//!
//! `cargo run --release --example study_diagnosis -- [SEEDS] [FOLDER]` writes one line per case to
//! target/study_diagnosis.jsonl as it goes, and goes on from there when it is begun again. All
//! effects, places and sizes, clean campaigns, pairs and withheld effects of one seed are done before
//! the next seed begins. At the end, or with SEEDS = 0 of what is there, it writes into FOLDER the
//! summaries that docs/closing-the-loop.md is generated from, and the lines themselves, from which it
//! begins where there is no file in target. Lines made before the diagnosis was changed are to be deleted.
//! `-- try TEXT [SEED]` runs the cases whose name holds TEXT, and tells everything of them.

mod campaign;
mod catalogue;
mod drive;
#[path = "../study/mod.rs"]
mod study;
mod summary;

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use catalogue::{Setting, settings};
use serde_json::Value;

const LOG: &str = "target/study_diagnosis.jsonl";
const KEPT: &str = "study_diagnosis_rows.jsonl";
const RESULTS: &str = "docs/results";
const USUAL: u64 = 10;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |i: usize| arguments.get(i).map(String::as_str);
    if argument(0) == Some("try") {
        let seed = argument(2).and_then(|s| s.parse().ok()).unwrap_or(1);
        let wanted = argument(1).unwrap_or("clean");
        for (k, setting) in settings().iter().enumerate() {
            if setting.name().contains(wanted) {
                eprintln!("{} seed {seed}", setting.name());
                let begun = std::time::Instant::now();
                let row = campaign::case(setting, plant(seed, k), true);
                eprintln!("{row} {:.1} s", begun.elapsed().as_secs_f64());
            }
        }
        return;
    }
    let seeds: u64 = argument(0).and_then(|s| s.parse().ok()).unwrap_or(USUAL);
    let folder = PathBuf::from(argument(1).unwrap_or(RESULTS));
    if !Path::new(LOG).exists() {
        let kept = Path::new(RESULTS).join(KEPT);
        if kept.exists() {
            std::fs::copy(kept, LOG).expect("the log is written");
        }
    }
    let mut rows = study::finished(Path::new(LOG));
    run(seeds, &mut rows);
    // whole seeds, where so many were asked for
    rows.retain(|r| seeds == 0 || r["seed"].as_u64().is_some_and(|s| s < plant(seeds + 1, 0)));
    rows.sort_by_key(|r| r["seed"].as_u64());
    summary::write(&rows, &folder);
    let lines: String = rows.iter().map(|row| format!("{row}\n")).collect();
    std::fs::write(folder.join(KEPT), lines).expect("the lines are written");
}

/// A plant of its own for every case.
fn plant(seed: u64, case: usize) -> u64 {
    1000 * seed + case as u64
}

/// Runs what is not there yet, seed by seed.
fn run(seeds: u64, rows: &mut Vec<Value>) {
    let all = settings();
    let open: Vec<(&Setting, u64)> = (1..=seeds)
        .flat_map(|seed| {
            all.iter()
                .enumerate()
                .map(move |(k, s)| (s, plant(seed, k)))
        })
        .filter(|(s, seed)| {
            let name = s.name();
            !rows.iter().any(|r| r["case"] == name && r["seed"] == *seed)
        })
        .collect();
    let file = OpenOptions::new().create(true).append(true).open(LOG);
    let file = Mutex::new(file.expect("the log opens"));
    let next = AtomicUsize::new(0);
    let fresh = Mutex::new(Vec::new());
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some((setting, seed)) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let row = campaign::case(setting, *seed, false);
                    let mut file = file.lock().expect("no thread panics");
                    writeln!(file, "{row}").expect("the log is written");
                    eprintln!("{} {seed} done", setting.name());
                    fresh.lock().expect("no thread panics").push(row);
                }
            });
        }
    });
    rows.extend(fresh.into_inner().expect("no thread panics"));
}
