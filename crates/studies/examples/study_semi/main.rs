//! Semi-synthetic study of the diagnosis: logs of measured machines whose torque is made of the refined model's along
//! the measured motion, of its own residual in blocks with random signs, and of ONE effect that the model lacks.
//!
//! Each log is fitted and diagnosed once. What that found is declared in the model that is given afterwards. The
//! effect is the simulator's law along the measured motion (elasticity: the estimator's, for the simulator's moves the
//! joint). Its size is the rms of what the declared model leaves of it, over that of the residual, both in the band
//! that is kept and in the rows in which the joint moves. It is put in where that is at least 5 % of its rms, with
//! numbers that a machine can have.
//!
//! `cargo run --release --example study_semi -- [--draws=N] [--minutes=M] [FOLDER]` writes one line per case to
//! target/study_semi.jsonl as it goes: every effect, size and log before the next draw begins. After M minutes no case
//! is begun; it goes on where it was. At the end the summary of what is there goes into FOLDER, from which
//! docs/closing-the-loop.md has its tables.

mod effects;
mod machine;
#[path = "../study/mod.rs"]
#[allow(dead_code)] // each study uses its share
mod study;
mod summary;

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use effects::{Kind, kinds};
use machine::{ALL, Machine};
use serde_json::Value;

const LOG: &str = "target/study_semi.jsonl";
/// Rms of what the declared model leaves of an effect, over the residual's.
const SIZES: [f64; 2] = [6.0, 2.0];

/// One case; without a kind nothing is put in.
struct Case {
    machine: usize,
    put: Option<(&'static Kind, f64)>,
    draw: u64,
}

impl Case {
    fn key(&self) -> String {
        let put = self.put.map_or("nothing".to_owned(), |(kind, size)| {
            format!("{} {size}", kind.name())
        });
        format!("{}, {put}, {}", ALL[self.machine].name, self.draw)
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |key: &str, usual: u64| {
        let word = words.iter().find_map(|w| w.strip_prefix(key));
        word.map_or(usual, |w| w.parse().expect("a whole number"))
    };
    let (draws, minutes) = (number("--draws=", 1), number("--minutes=", 24 * 60));
    let until = Instant::now() + Duration::from_secs(60 * minutes);
    let folder = words.iter().find(|w| !w.starts_with("--"));
    let folder = PathBuf::from(folder.map_or("docs/results", String::as_str));
    let cases: Vec<Case> = (0..draws).flat_map(of_draw).collect();
    run(&cases, until);
    summary::write(
        &study::finished(Path::new(LOG)),
        draws,
        cases.len(),
        &folder,
    );
}

fn of_draw(draw: u64) -> Vec<Case> {
    let each = |put| (0..ALL.len()).map(move |machine| Case { machine, put, draw });
    let mut out: Vec<Case> = each(None).collect();
    for size in SIZES {
        out.extend(kinds().iter().flat_map(|kind| each(Some((kind, size)))));
    }
    out
}

/// Runs what is not there yet.
fn run(cases: &[Case], until: Instant) {
    let rows = study::finished(Path::new(LOG));
    let done: Vec<&str> = rows.iter().filter_map(|r| r["key"].as_str()).collect();
    let open: Vec<&Case> = (cases.iter())
        .filter(|case| !done.contains(&case.key().as_str()))
        .collect();
    let file = OpenOptions::new().create(true).append(true).open(LOG);
    let file = Mutex::new(file.expect("the log opens"));
    let machines: Vec<OnceLock<Option<Machine>>> = ALL.iter().map(|_| OnceLock::new()).collect();
    let next = AtomicUsize::new(0);
    let worker = || {
        while let Some(case) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
            if Instant::now() > until {
                return;
            }
            let made = machines[case.machine].get_or_init(|| Machine::new(&ALL[case.machine]));
            let Some(machine) = made else { continue };
            let begun = Instant::now();
            let mut row: Value = machine.case(case.put, case.draw);
            row["key"] = case.key().into();
            row["seconds"] = begun.elapsed().as_secs_f64().into();
            let mut file = file.lock().expect("no thread panics");
            writeln!(file, "{row}").expect("the log is written");
            eprintln!("{row}");
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..rayon::current_num_threads() {
            scope.spawn(worker);
        }
    });
}
