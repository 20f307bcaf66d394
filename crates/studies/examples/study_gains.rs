//! Monte Carlo study of `lsq --fit-gains`: an arm of four joints that logs currents, whose gains are off
//! by up to 30 % in its robot file, and a payload that is known to 2 %.
//!
//! Each run has gains, motions, a payload with a centre and an inertia of its own, noise and encoders;
//! a log of 20 s at 200 Hz without the payload and one with it. Beside the gains of the tool stand those
//! of two linear formulations on the same rows, with the channels among the columns: least squares, and
//! total least squares (Gautier and Briot 2014).
//!
//! `cargo run --release -p cft-ident-studies --example study_gains -- [RUNS] [FOLDER]` writes one line per run to
//! target/study_gains.jsonl as it goes and, at the end, into FOLDER the summary that
//! docs/results/studies.md is generated from.

#[path = "../../../tests/program/currents_arm/mod.rs"]
mod currents_arm;
#[allow(dead_code, reason = "each study uses its share")]
mod study;

use std::fs;
use std::path::Path;

use cft_ident::config::{ModelFile, RobotFile};
use cft_ident::identify::{
    Control, Dataset, Log, LogData, LsqSettings, PayloadLog, RobotSetup, fit_gains, lsq,
};
use cft_ident::inertia::accumulate;
use cft_ident::inertia::accumulate::BlockFactors;
use cft_ident::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident::log::LogSpec;
use cft_ident::math::rank::svd;
use cft_ident::math::rfactor::RFactor;
use cft_ident::robot::Robot;
use cft_ident::robot::standard::STANDARD;
use currents_arm::{Chance, DECLARED, JOINTS, Payload, log, log_section, plant, robot_file};
use nalgebra::{DMatrix, DVector};
use serde_json::{Value, json};
use study::{percent, study, write_summary};

const SECONDS: f64 = 20.0;
/// Of the mass that is given for the payload.
const MASS_STD: f64 = 0.02;
/// Noise of the currents, of their rms.
const NOISE: f64 = 0.03;

fn main() {
    let (rows, folder) = study("study_gains", 200, run);
    summarise(&rows, &folder);
}

fn run(seed: u64) -> Value {
    let mut chance = Chance::new(seed);
    let gains = DECLARED.map(|g| g * (0.7 + 0.6 * chance.uniform()));
    let payload = Payload::drawn(&mut chance);
    let given_mass = payload.mass * (1.0 + MASS_STD * chance.normal());
    let (text, base) = plant(NOISE);
    let model = ModelFile::parse("plant.toml", &text).expect("a model");
    let folder = std::env::temp_dir().join(format!("cft-ident-study-gains-{seed}"));
    fs::create_dir_all(&folder).expect("a folder");
    let [empty, loaded] =
        [("empty.csv", None), ("loaded.csv", Some(payload))].map(|(name, with)| {
            let (path, run) = (folder.join(name), 2 * seed + u64::from(with.is_some()));
            log(&path, &model, (&gains, with), (&mut chance, SECONDS, run));
            Log::from(LogSpec::whole(path))
        });
    let section = log_section(Some(DECLARED));
    let file = RobotFile::parse("arm.toml", &robot_file(&section)).expect("a robot");
    let machine = RobotSetup::new("arm.toml", file);
    let known = PayloadLog {
        log: loaded.clone(),
        mass: given_mass,
        std: MASS_STD * given_mass,
    };
    let control = Control::default();
    let logs = [empty];
    let fitted = fit_gains(
        &Dataset::read(&machine, &logs, &Control::default()).expect("logs that can be read"),
        Some(&known),
        &control,
    )
    .expect("gains");
    let ratios = fit_gains(
        &Dataset::read(&machine, &logs, &Control::default()).expect("logs that can be read"),
        None,
        &control,
    )
    .ok();
    let settings = LsqSettings {
        gains: Some(&fitted.gains),
        ..LsqSettings::default()
    };
    let found = lsq(
        &Dataset::read(&fitted.setup, &logs, &Control::default()).expect("logs that can be read"),
        &settings,
        &control,
    )
    .expect("a fit");
    let linear = linear(&machine, [&logs[0], &loaded], given_mass, &control);
    fs::remove_dir_all(&folder).expect("the folder is there");
    let gain = |g: &cft_ident::identify::Gain| json!([g.value, g.std]);
    json!({
        "seed": seed,
        "truth": gains,
        "gains": fitted.gains.joints.iter().map(gain).collect::<Vec<_>>(),
        "ratios": ratios.map(|r| json!({
            "reference": r.gains.reference,
            "gains": r.gains.joints.iter().map(gain).collect::<Vec<_>>(),
        })),
        "parameters": found.unknowns.iter().take(base.len()).zip(&base).map(|(u, (_, truth))| {
            json!([truth, u.fitted, u.fitted_std])
        }).collect::<Vec<_>>(),
        "least_squares": linear[0],
        "total_least_squares": linear[1],
        "mass_off": given_mass / payload.mass - 1.0,
    })
}

/// Gains with the channels among the columns of one linear problem: by least squares and by total least
/// squares, rows weighted by the noise of each joint's channel in the units of the declared gains.
fn linear(machine: &RobotSetup, logs: [&Log; 2], mass: f64, control: &Control) -> [Vec<f64>; 2] {
    let robot: &Robot = &machine.robot;
    let (n, p) = (robot.joints(), robot.parameters().len());
    let columns = RegressorColumns {
        joints: n,
        shared: p,
        own: vec![vec![JointTerm::Viscous, JointTerm::Coulomb]; n],
        known: vec![None; n],
        rest_speed: Vec::new(),
    };
    let read = |log: &Log| -> BlockFactors {
        let read = LogData::read(machine, log, control).expect("a log");
        let mut blocks = read.blocks(control).expect("a log");
        accumulate(robot, &columns, &machine.settings(), &mut |b| {
            blocks.read(b)
        })
        .expect("rows")
        .0
    };
    let sets = logs.map(read);
    let map = robot.standard_map();
    let load = map
        .matrix
        .columns(STANDARD * (map.links.len() - 1), STANDARD);
    let rest = svd(&load.columns(0, STANDARD - 1).into_owned()).expect("finite");
    let kept = rest.s.iter().filter(|s| **s > 1e-9 * rest.s[0]).count();
    let rest = rest.u.columns(0, kept);
    let others = p + kept + 2 * n;
    let std: Vec<f64> = (0..n)
        .map(|j| {
            let square: f64 = sets.iter().map(|s| s.moving[j].torque_square).sum();
            (square / sets.iter().map(|s| s.moving[j].count as f64).sum::<f64>()).sqrt()
        })
        .collect();
    // columns: parameters, payload, friction | channels | known mass
    let mut factor = RFactor::new(others + n + 1);
    let mut row = vec![0.0; others + n + 1];
    for (s, set) in sets.iter().enumerate() {
        for j in 0..n {
            let r = set.joint(j);
            let y = r.columns(0, p);
            let (body, known) = (y * rest, y * load.column(STANDARD - 1) * mass);
            for i in 0..r.nrows() {
                row.fill(0.0);
                for c in 0..p {
                    row[c] = r[(i, c)] / std[j];
                }
                for c in 0..2 {
                    row[p + kept + 2 * j + c] = r[(i, p + c)] / std[j];
                }
                row[others + j] = -r[(i, r.ncols() - 1)] / std[j];
                if s == 1 {
                    for c in 0..kept {
                        row[p + c] = body[(i, c)] / std[j];
                    }
                    row[others + n] = known[i] / std[j];
                }
                factor.fold(&row);
            }
        }
    }
    let r = factor.r();
    let left = DMatrix::from_fn(n + 1, n + 1, |a, b| r[(others + a, others + b)]);
    let declared =
        |g: DVector<f64>| -> Vec<f64> { g.iter().zip(DECLARED).map(|(g, d)| g * d).collect() };
    let of = svd(&left.columns(0, n).into_owned()).expect("finite");
    let target = -(of.u.transpose() * left.column(n));
    let plain = &of.v * DVector::from_fn(n, |k, _| target[k] / of.s[k]);
    // the mass column has no noise: it is eliminated first
    let mut ordered = left.clone();
    ordered.set_column(0, &left.column(n));
    for c in 0..n {
        ordered.set_column(c + 1, &left.column(c));
    }
    let r = ordered.clone().qr().r();
    let noisy = DMatrix::from_fn(n, n, |a, b| r[(a + 1, b + 1)]);
    let of = svd(&noisy).expect("finite");
    let direction = of.v.column(n - 1).into_owned();
    let row: f64 = (0..n).map(|b| r[(0, b + 1)] * direction[b]).sum();
    let total = direction * (-r[(0, 0)] / row);
    [declared(plain), declared(total)]
}

fn summarise(rows: &[Value], folder: &Path) {
    let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
    let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let mut lines = Vec::new();
    let inside = |hits: usize, of: usize| percent(hits as f64 / of as f64);
    for (j, joint) in JOINTS.iter().enumerate() {
        // the mass that is given is off by as much as all gains are: bias is told without it
        let error = |key: &str, r: &Value| {
            let found = match key {
                "gains" => number(&r[key][j][0]),
                _ => number(&r[key][j]),
            };
            found / number(&r["truth"][j]) / (1.0 + number(&r["mass_off"])) - 1.0
        };
        let errors = |key: &str| -> Vec<f64> { rows.iter().map(|r| error(key, r)).collect() };
        let hits = rows.iter().filter(|r| {
            let (value, std) = (number(&r["gains"][j][0]), number(&r["gains"][j][1]));
            (value - number(&r["truth"][j])).abs() < 1.96 * std
        });
        let declared: Vec<f64> = rows
            .iter()
            .map(|r| DECLARED[j] / number(&r["truth"][j]) - 1.0)
            .collect();
        let ours: Vec<f64> = rows
            .iter()
            .map(|r| number(&r["gains"][j][0]) / number(&r["truth"][j]) - 1.0)
            .collect();
        lines.push(json!({
            "joint": joint,
            "declared off, rms": percent(rms(&declared)),
            "fitted off, rms": percent(rms(&ours)),
            "inside 95 %": inside(hits.count(), rows.len()),
            "mean error beside the mass's": percent(mean(&errors("gains"))),
            "the same of least squares": percent(mean(&errors("least_squares"))),
            "of total least squares": percent(mean(&errors("total_least_squares"))),
        }));
    }
    let mut all = [0, 0];
    for row in rows
        .iter()
        .flat_map(|r| r["parameters"].as_array().into_iter().flatten())
    {
        let [truth, value, std] = [0, 1, 2].map(|k| number(&row[k]));
        all[1] += 1;
        all[0] += usize::from((value - truth).abs() < 1.96 * std);
    }
    let mut ratios = [0, 0];
    for row in rows {
        let reference = JOINTS
            .iter()
            .position(|j| Some(*j) == row["ratios"]["reference"].as_str());
        for (j, _) in JOINTS
            .iter()
            .enumerate()
            .filter(|(j, _)| reference.is_some_and(|r| r != *j))
        {
            let base = number(&row["truth"][reference.unwrap_or(0)]);
            let found = &row["ratios"]["gains"][j];
            let truth = number(&row["truth"][j]) / base;
            let (value, std) = (number(&found[0]), number(&found[1]));
            ratios[1] += 1;
            ratios[0] += usize::from((value - truth).abs() < 1.96 * std);
        }
    }
    lines.push(json!({
        "joint": "SI parameters",
        "inside 95 %": inside(all[0], all[1].max(1)),
    }));
    lines.push(json!({
        "joint": "ratios without a payload",
        "inside 95 %": inside(ratios[0], ratios[1].max(1)),
    }));
    write_summary(
        folder,
        "study_gains",
        "gains of four joints from a known payload",
        "study_gains",
        rows.len(),
        lines,
    );
}
