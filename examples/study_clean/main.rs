//! Monte Carlo study of the diagnosis where nothing is missing: plants of several kinds on several motions, logs of
//! 20 s with encoder quantisation and 1 % torque noise, identified as a laboratory would, and diagnosed. A step that
//! is found is false.
//!
//! What the largest chance value of each campaign is told by the placebos is to be even between 0 and 1: shares of
//! campaigns below a few values show it.
//!
//! `cargo run --release --example study_clean -- [SEEDS] [FOLDER]` writes one line per seed to
//! target/study_clean.jsonl as it goes, and goes on from there when it is begun again; at the end it writes into
//! FOLDER the summary that docs/closing-the-loop.md is generated from.

#[path = "../study_diagnosis/campaign.rs"]
#[allow(dead_code)] // each study uses its share
mod campaign;
#[path = "../study_diagnosis/catalogue.rs"]
#[allow(dead_code)]
mod catalogue;
#[path = "../study_diagnosis/drive.rs"]
#[allow(dead_code)]
mod drive;
#[path = "../study/mod.rs"]
#[allow(dead_code)]
mod study;

use campaign::{Campaign, Lab};
use cft_ident::diagnose::{Diagnosis, SelectionLimits, UNWATCHED, diagnose};
use cft_ident::motion::Parallel;
use cft_ident::robot::Robot;
use cft_ident::robot::cft::{Setup, Structure};
use cft_ident::simulate::{CftTruth, Reference};
use serde_json::{Value, json};
use study::{along, processing, series, study, write_summary};

/// Kinds of campaigns: single drives on ladders of speeds, and the CFT robot on its motion, on it run slowly and on
/// one designed at 0.4 Hz, each with a ladder of every joint beside it.
const KINDS: [&str; 5] = [
    drive::SLIDE,
    drive::WHEEL,
    "arm, slow",
    "arm, 0.2 Hz",
    "arm, designed at 0.4 Hz",
];
const USUAL: u64 = 40;

fn main() {
    let (rows, folder) = study("study_clean", USUAL, plant);
    let share = |counted: usize, of: usize| format!("{counted} of {of}");
    let table = KINDS.iter().map(|kind| {
        let all: Vec<&Value> = rows.iter().map(|row| &row[*kind]).collect();
        let ran = || all.iter().filter(|c| c["steps"].is_array());
        let steps = |c: &&&Value| c["steps"].as_array().is_some_and(|s| !s.is_empty());
        let found = ran().filter(steps).count();
        let mut names: Vec<String> = ran()
            .flat_map(|c| c["steps"].as_array().into_iter().flatten())
            .filter_map(|s| s.as_str().map(str::to_owned))
            .collect();
        names.sort();
        names.dedup();
        json!({
            "campaigns": kind,
            "with an effect found": share(found, ran().count()),
            "found": if names.is_empty() { "-".to_owned() } else { names.join(", ") },
            "refused by placebos alone": share(
                ran().filter(|c| c["refused"].as_u64().unwrap_or(0) > 0).count(),
                ran().count()
            ),
        })
    });
    write_summary(
        &folder,
        "study_clean",
        "effects found where nothing is missing",
        "cargo run --release --example study_clean",
        rows.len(),
        table.collect(),
    );
}

/// All kinds of campaigns of one seed.
fn plant(seed: u64) -> Value {
    let mut row = json!({ "seed": seed });
    for kind in KINDS {
        row[kind] = one(kind, 7000 + seed);
    }
    row
}

fn one(kind: &str, seed: u64) -> Value {
    let (lab, campaign) = match kind {
        drive::SLIDE | drive::WHEEL => on_drive(kind, seed),
        _ => on_arm(kind, seed),
    };
    let limits = SelectionLimits {
        deviations: false,
        ..SelectionLimits::default()
    };
    let case = campaign.case(&lab, campaign.declared.clone(), limits, Vec::new());
    match diagnose(&case, UNWATCHED) {
        Ok(found) => told(&lab, &found),
        Err(error) => json!({ "error": error.to_string() }),
    }
}

fn told(lab: &Lab, found: &Diagnosis) -> Value {
    let steps = found.steps.iter();
    let steps: Vec<String> = steps
        .map(|s| found.model.effects[s.effect].title(&lab.robot))
        .collect();
    let by_placebos = found
        .candidates
        .iter()
        .filter(|c| c.placebo_p_value.is_some());
    let lowest = by_placebos.clone().filter_map(|c| c.placebo_p_value);
    json!({
        "steps": steps,
        "refused": by_placebos.count(),
        "lowest": lowest.fold(1.0, f64::min),
        "structured": found.structured(),
    })
}

fn on_drive(name: &str, seed: u64) -> (Lab, Campaign) {
    let truth = drive::truth(name, seed);
    let processing = drive::settings();
    let lab = Lab {
        robot: Robot::single_joint(name, truth.kind),
        parallel: Parallel::design(&processing, 1e-3).expect("a filter"),
        processing,
    };
    (lab, drive::campaign(&truth, &[], seed))
}

fn on_arm(kind: &str, seed: u64) -> (Lab, Campaign) {
    let lab = Lab {
        robot: Robot::cft(Setup::Tuedacs, Structure::Printed12),
        processing: processing(),
        parallel: Parallel::design(&processing(), 1e-3).expect("a filter"),
    };
    let truth = CftTruth::synthetic(Setup::Tuedacs)
        .varied(0.15, seed)
        .expect("a plant");
    let motion = |seed: u64| motion(kind, seed);
    let campaign = Campaign::made(&lab, &truth, &[], &motion, (seed, false));
    (lab, campaign)
}

fn motion(kind: &str, seed: u64) -> Reference<4> {
    let file = match kind {
        "arm, designed at 0.4 Hz" => "examples/study_rows/designed.toml",
        _ => "configs/cft-excitation.toml",
    };
    let mut of = series(file).at_random_phase(seed);
    if kind == "arm, slow" {
        let factor = 0.3;
        of.fundamental *= factor;
        for x in of.a.iter_mut().chain(&mut of.b).flatten() {
            *x *= factor;
        }
    }
    along(of)
}
