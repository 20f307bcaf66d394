//! Study of prediction bands and of the observer: what share of unseen torques a 95 % band holds, how often an
//! untouched robot gives an alarm, how small a push is found.
//!
//! Measured machines: three rotations each, two thirds of the data fitted and the last third scored. Simulated: the
//! CFT robot on motions whose phases the fit did not see.
//!
//! `cargo run --release -p cft-ident-studies --example study_bands -- [SEEDS] [FOLDER]` writes one line per machine and per minute of
//! simulated motion to target/study_bands.jsonl as it goes, so that a stopped study goes on where it was, and at the
//! end the summaries into FOLDER that docs/results/studies.md is generated from.

mod forces;
mod machines;
mod pulses;
mod simulated;
#[path = "../study/mod.rs"]
#[allow(dead_code)] // each study uses its share
mod study;

use std::cell::LazyCell;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let minutes: u64 = arguments.next().and_then(|s| s.parse().ok()).unwrap_or(130);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/results".into()));
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    let mut done = Done::open(Path::new("target/study_bands.jsonl"));
    let measured: Vec<Value> = (machines::ALL.iter())
        .filter_map(|machine| done.once(machine.name, &|| machine.study()))
        .collect();
    // the simulated campaign is fitted where a minute of it is still to be done
    let campaign = LazyCell::new(simulated::Campaign::new);
    let simulated: Vec<Value> = (0..minutes)
        .filter_map(|seed| done.once(&format!("minute {seed}"), &|| Some(campaign.minute(seed))))
        .collect();
    let command =
        format!("cargo run --release -p cft-ident-studies --example study_bands -- {minutes}");
    let mut bands: Vec<Value> = measured.iter().map(machines::band_row).collect();
    bands.extend(simulated::merged(&simulated).iter().map(machines::band_row));
    write(
        &folder,
        "study_bands",
        "95 % bands on data that made nothing",
        &command,
        bands,
    );
    let mut watch: Vec<Value> = measured.iter().map(machines::watch_row).collect();
    watch.extend(
        simulated::merged(&simulated)
            .iter()
            .map(machines::watch_row),
    );
    write(
        &folder,
        "study_watch",
        "external torques where nothing touches the robot",
        &command,
        watch,
    );
    let mut found: Vec<Value> = measured.iter().flat_map(pulses::rows).collect();
    found.extend(pulses::of_minutes(&simulated));
    let title = "smallest torque pulse that is found 95 % of the time";
    write(&folder, "study_pulses", title, &command, found);
    let found: Vec<Value> = measured.iter().flat_map(forces::rows).collect();
    let title = "smallest force on the last link that is found 95 % of the time";
    write(&folder, "study_forces", title, &command, found);
}

fn write(folder: &Path, name: &str, title: &str, command: &str, rows: Vec<Value>) {
    let document = json!({"study": title, "command": command, "rows": rows});
    let path = folder.join(format!("{name}.json"));
    std::fs::write(path, format!("{document:#}\n")).expect("the summary is written");
    println!("{document:#}");
}

/// Results that are there already.
struct Done {
    path: PathBuf,
    rows: Vec<Value>,
}

impl Done {
    fn open(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let rows = text
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok());
        Done {
            path: path.to_owned(),
            rows: rows.collect(),
        }
    }

    fn once(&mut self, key: &str, make: &dyn Fn() -> Option<Value>) -> Option<Value> {
        if let Some(row) = self.rows.iter().find(|row| row["key"] == key) {
            return Some(row.clone());
        }
        let mut row = make()?;
        row["key"] = key.into();
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.path)
            .expect("it opens");
        writeln!(file, "{row}").expect("the log is written");
        eprintln!("{key} done");
        self.rows.push(row.clone());
        Some(row)
    }
}
