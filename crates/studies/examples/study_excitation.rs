//! Monte Carlo study of what a designed trajectory is worth: campaigns whose identification log runs
//! along Table 3 of the report, and the same campaigns along configs/cft-excitation.toml, on plants
//! whose parameters vary by 15 %, with encoder quantisation and torque noise.
//!
//! Both logs are 40 s long, have the same friction to work with (from the same four one-joint logs)
//! and the same noise: 1 % of each joint's rms torque along Table 3. A third log has 1 % of its own.
//!
//! `cargo run --release -p cft-ident-studies --example study_excitation -- [SEEDS] [FOLDER]` writes one line per seed to
//! target/study_excitation.jsonl as it goes and, at the end, into FOLDER the summary that
//! docs/results/studies.md is generated from.

mod study;

use std::path::Path;

use cft_ident::inertia::accumulate;
use cft_ident::inertia::columns::{KnownFriction, RegressorColumns};
use cft_ident::inertia::solve::{RowWeighting, fit};
use cft_ident::motion::ZeroOrderHold;
use cft_ident::robot::Robot;
use cft_ident::robot::cft::{LaboratorySetup, ParameterStructure};
use cft_ident::simulate::cft::{excitation_at_random_phase, follow, mechanism};
use cft_ident::simulate::{CftTruth, Noise, OneJointMove, Settings, SimulatedRun};
use serde_json::{Value, json};
use study::{
    JOINTS, along, block, estimated, noisy, percent, processing, quantile, series, source, study,
    write_summary,
};

const SECONDS: f64 = 40.0;
const DESIGNED: &str = "configs/cft-excitation.toml";

fn main() {
    let (rows, folder) = study("study_excitation", 50, campaigns);
    summarise(&rows, &folder);
}

/// What the one-joint logs of a plant give of its friction.
fn friction(robot: &Robot, truth: &CftTruth, seed: u64) -> Vec<Option<KnownFriction>> {
    let infos = robot.parameters();
    let names: Vec<String> = infos.iter().map(|p| p.name.to_string()).collect();
    let of = |j: usize| {
        let motion = OneJointMove::new(j, 20.0, Some(seed))
            .reference(&mechanism(LaboratorySetup::Tuedacs).expect("four joints"))
            .expect("a ladder");
        let settings = noisy(20.0, 10 * seed + j as u64);
        let log = block(&follow(truth, &[], motion, &settings).expect("a run"));
        let (_, e) = estimated(robot, j, &names, &log, true);
        Some(KnownFriction {
            law: e.law,
            covariance: e.covariance,
            held: [true; 5],
        })
    };
    (0..JOINTS.len()).map(of).collect()
}

fn campaigns(seed: u64) -> Value {
    let robot = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Printed12);
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs)
        .varied(0.15, seed)
        .expect("a plant");
    let columns = RegressorColumns {
        joints: 4,
        shared: 12,
        own: vec![Vec::new(); 4],
        known: friction(&robot, &truth, seed),
        rest_speed: Vec::new(),
    };
    let theta = |recording: &SimulatedRun<4>| -> Vec<f64> {
        let mut log = block(recording);
        ZeroOrderHold::new(4).centre(&robot, &mut log);
        let found = accumulate(&robot, &columns, &processing(), &mut source(&log)).expect("a log");
        let fit = fit(&found.0, RowWeighting::Wls).expect("a fit");
        fit.theta.as_slice().to_vec()
    };
    let run = |designed: bool, settings: &Settings<4>| {
        let motion = if designed {
            along(series(DESIGNED))
        } else {
            excitation_at_random_phase(LaboratorySetup::Tuedacs, seed)
        };
        follow(&truth, &[], motion, settings).expect("a run")
    };
    let own_noise = noisy(SECONDS, 10 * seed + 5);
    let table_3 = run(false, &own_noise);
    let mut same_noise = own_noise;
    same_noise.sensors.torque_noise = Noise::Absolute(
        // the noise in them adds half of a ten-thousandth
        own_noise.sensors.torque_noise.deviation(&table_3.torque),
    );
    json!({
        "seed": seed,
        "truth": truth.printed().to_vec(),
        "table_3": theta(&table_3),
        "designed": theta(&run(true, &same_noise)),
        "designed_own_noise": theta(&run(true, &own_noise)),
    })
}

fn summarise(rows: &[Value], folder: &Path) {
    let number = |v: &Value| v.as_f64().unwrap_or(f64::INFINITY);
    let errors = |key: &str, i: usize| -> Vec<f64> {
        let error = |r: &Value| (number(&r[key][i]) / number(&r["truth"][i]) - 1.0).abs();
        rows.iter().map(error).collect()
    };
    let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    let mut logs = [0.0; 2];
    let mut smaller = 0;
    let mut lines: Vec<Value> = (0..12)
        .map(|i| {
            let (before, after) = (errors("table_3", i), errors("designed", i));
            let own = errors("designed_own_noise", i);
            let wins = before.iter().zip(&after).filter(|(b, a)| a < b).count();
            smaller += wins;
            let ratios = [rms(&before) / rms(&after), rms(&before) / rms(&own)];
            for (sum, ratio) in logs.iter_mut().zip(ratios) {
                *sum += ratio.ln() / 12.0;
            }
            json!({
                "parameter": format!("theta_{}", i + 1),
                "median error, Table 3": percent(quantile(before, 0.5)),
                "designed": percent(quantile(after, 0.5)),
                "smaller in": format!("{:.0} %", 100.0 * wins as f64 / rows.len() as f64),
                "rms error smaller by": format!("{:.2}", ratios[0]),
                "with 1 % of its own torque as noise": format!("{:.2}", ratios[1]),
            })
        })
        .collect();
    lines.push(json!({
        "parameter": "all (geometric mean)",
        "median error, Table 3": "",
        "designed": "",
        "smaller in": format!("{:.0} %", 100.0 * smaller as f64 / (12 * rows.len()) as f64),
        "rms error smaller by": format!("{:.2}", logs[0].exp()),
        "with 1 % of its own torque as noise": format!("{:.2}", logs[1].exp()),
    }));
    let title = "errors of theta 1..12 along Table 3 and along the designed trajectory";
    write_summary(
        folder,
        "study_excitation",
        title,
        "study_excitation",
        rows.len(),
        lines,
    );
}
