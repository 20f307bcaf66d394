//! Friction curves from one-joint logs as laboratories have them: logs of one speed each, the slow
//! speeds of harmonic drives, short logs, two slopes that are hardly apart, one slope.
//!
//! `cargo run --release -p cft-ident-studies --example study_one_joint -- [SEEDS] [FOLDER]` writes one line per seed to
//! target/study_one_joint.jsonl as it goes and, at the end, FOLDER/study_one_joint.json, from which
//! docs/results/studies.md has its table. The motion is integrated by the simulator; encoder and torque
//! noise are those of a wrist's drive; the filter is given nothing but the log.

mod bench;
#[allow(dead_code)] // it uses its share
#[path = "../study/mod.rs"]
mod study;

use bench::{ASKED, CASES, Case, error_at_plateaus, estimated, off};
use cft_ident::friction::estimate::JointEstimate;
use cft_ident::robot::friction::DoubleTanh;
use serde_json::{Value, json};
use study::{percent, quantile, study, write_summary};

fn main() {
    let (rows, folder) = study("study_one_joint", 20, campaign);
    let seeds = rows.len();
    let rows: Vec<Value> = CASES.iter().map(|case| summary(case.name, &rows)).collect();
    write_summary(
        &folder,
        "study_one_joint",
        "friction curves from one-joint logs as laboratories have them",
        "study_one_joint",
        seeds,
        rows,
    );
}

fn campaign(seed: u64) -> Value {
    let cases: Vec<Value> = CASES.iter().map(|case| one(case, seed)).collect();
    json!({ "seed": seed, "cases": cases })
}

fn one(case: &Case, seed: u64) -> Value {
    let (found, law) = estimated(case, seed);
    let mut row = match found {
        Ok(e) => judged(case, &e, &law),
        Err(refusal) => json!({ "refused": refusal.to_string() }),
    };
    row["case"] = json!(case.name);
    row
}

/// Errors of the curve at the plateaus' speeds and over all speeds covered, and what its band holds.
fn judged(case: &Case, e: &JointEstimate, law: &DoubleTanh) -> Value {
    let inside = |p: &&cft_ident::friction::estimate::FrictionCurvePoint| {
        (p.torque - law.torque(p.v)).abs() <= 1.96 * p.std
    };
    json!({
        "plateaus": error_at_plateaus(case, e, law),
        "curve": e.curve.iter().map(|p| off(e, law, p.v)).fold(0.0, f64::max),
        "inside": e.curve.iter().filter(inside).count() as f64 / e.curve.len() as f64,
        "terms": (e.coulomb_terms == 1) == case.one_slope,
        "missed": !e.missed_plateaus().is_empty(),
        "rows": e.samples,
    })
}

fn summary(name: &str, rows: &[Value]) -> Value {
    let of = |row: &Value| -> Vec<Value> { row["cases"].as_array().cloned().unwrap_or_default() };
    let cases: Vec<Value> = rows
        .iter()
        .flat_map(of)
        .filter(|c| c["case"] == name)
        .collect();
    let numbers =
        |key: &str| -> Vec<f64> { cases.iter().filter_map(|c| c[key].as_f64()).collect() };
    let (plateaus, curve, inside) = (numbers("plateaus"), numbers("curve"), numbers("inside"));
    let refused = cases.len() - plateaus.len();
    let share = |x: &[f64]| format!("{:.3}", x.iter().sum::<f64>() / x.len().max(1) as f64);
    let most = |x: &[f64]| match x.is_empty() {
        true => "-".to_owned(),
        false => percent(quantile(x.to_vec(), 1.0)),
    };
    let right = plateaus.iter().filter(|x| **x <= ASKED).count();
    let missed = cases.iter().filter(|c| c["missed"] == true).count();
    let terms = cases.iter().filter(|c| c["terms"] == true).count();
    json!({
        "case": name,
        "rows": quantile(numbers("rows"), 0.5),
        "within 3 % at every plateau": format!("{right} of {}", plateaus.len()),
        "refused": refused,
        "misses a plateau, and says so": missed,
        "as many terms as the plant": format!("{terms} of {}", plateaus.len()),
        "largest error at a plateau": most(&plateaus),
        "largest error of a curve": most(&curve),
        "coverage of the 95 % band": share(&inside),
    })
}
