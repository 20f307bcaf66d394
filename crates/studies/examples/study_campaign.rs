//! Monte Carlo study of whole campaigns: four one-joint logs, one identification log, one unseen
//! log, on plants whose parameters vary by 15 %, with encoder quantisation and 1 % torque noise.
//!
//! `cargo run --release -p cft-ident-studies --example study_campaign -- [SEEDS] [FOLDER]` writes one line per seed to
//! target/study_campaign.jsonl as it goes (so that a stopped study goes on where it was) and, at
//! the end, into FOLDER the summaries that docs/results/studies.md is generated from.

mod study;

use std::path::Path;

use cft_ident::friction::estimate::{FrictionOptions, JointEstimate, estimate};
use cft_ident::identify::narrowed;
use cft_ident::inertia::columns::{KnownFriction, RegressorColumns};
use cft_ident::inertia::encoder::{GRIDS, accumulate_shifted, add_scatter};
use cft_ident::inertia::solve::{RowWeighting, fit};
use cft_ident::inertia::verdict::verdict;
use cft_ident::inertia::{accumulate, add_processing};
use cft_ident::math::descent::IterationEnding;
use cft_ident::motion::{FilterSettings as Processing, ZeroOrderHold};
use cft_ident::robot::Robot;
use cft_ident::robot::cft::dynamics::{ReportCoefficients, inertia};
use cft_ident::robot::cft::{LaboratorySetup, ParameterStructure};
use cft_ident::robot::friction::DoubleTanh;
use cft_ident::robot::model::{JointFriction, Model};
use cft_ident::simulate::cft::{excitation_at_random_phase, follow, mechanism};
use cft_ident::simulate::{CftTruth, OneJointMove, PlantSensors, Settings};
use cft_ident::validate::TorqueReconstruction;
use cft_ident::verdict::Verdict;
use rand::{RngExt, SeedableRng};
use serde_json::{Value, json};
use study::{
    JOINTS, along, block, estimated, noisy, percent, processing, quantile, series, source, study,
    write_summary,
};

/// Speeds per joint at which the curve's interval is looked at: every fifth point of the hundred.
const EVERY: usize = 5;
/// Fault of the starts: every parameter and the inertia times 3^U(-1, 1).
const FAULT: f64 = 3.0;

fn main() {
    let (rows, folder) = study("study_campaign", 200, campaign);
    summarise(&rows, &folder);
}

/// Relative error of the curve over the speeds covered, and at how many speeds the 95 % interval
/// covers the truth.
fn curve(e: &JointEstimate, truth: &DoubleTanh) -> (f64, usize, usize) {
    let (mut off, mut size, mut covered, mut total) = (0.0, 0.0, 0, 0);
    for (k, point) in e.curve.iter().enumerate() {
        let f = truth.torque(point.v);
        off += (point.torque - f).powi(2);
        size += f * f;
        if k % EVERY == EVERY / 2 {
            total += 1;
            covered += usize::from((point.torque - f).abs() <= 1.96 * point.std);
        }
    }
    ((off / size).sqrt(), covered, total)
}

fn campaign(seed: u64) -> Value {
    let robot = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Printed12);
    let names: Vec<String> = robot
        .parameters()
        .iter()
        .map(|p| p.name.to_string())
        .collect();
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs)
        .varied(0.15, seed)
        .expect("a plant");
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let mut joints = Vec::new();
    let mut known = Vec::new();
    for (j, name) in JOINTS.iter().enumerate() {
        let motion = OneJointMove::new(j, 20.0, Some(seed))
            .reference(&mechanism(LaboratorySetup::Tuedacs).expect("four joints"))
            .expect("a ladder");
        let recording =
            follow(&truth, &[], motion, &noisy(20.0, 10 * seed + j as u64)).expect("a run");
        let log = block(&recording);
        let (prepared, e) = estimated(&robot, j, &names, &log, true);
        let law = truth.friction[j];
        let (error, covered, total) = curve(&e, &law);
        // a start that is wrong by up to a factor of three in everything, alone
        let mut wrong = |x: f64| x * FAULT.powf(chance.random_range(-1.0..1.0));
        let start = DoubleTanh::from_parameters(law.parameters().map(&mut wrong));
        let m = inertia(
            &recording.q[0],
            &ReportCoefficients::from_theta22(&truth.theta),
        )[j][j];
        let options = |only_start| FrictionOptions {
            start: Some(start),
            start_inertia: Some(wrong_inertia(m, seed, j)),
            only_start,
            ..FrictionOptions::default()
        };
        let end = |o: &FrictionOptions| match estimate(name, &names, &prepared, None, o) {
            Ok(e) => (curve(&e, &law).0, e.ending == IterationEnding::Converged),
            Err(_) => (f64::INFINITY, false),
        };
        let quick = std::env::var_os("QUICK").is_some();
        let (with_log, _) = if quick {
            (0.0, true)
        } else {
            end(&options(false))
        };
        let (alone, said) = if quick {
            (0.0, true)
        } else {
            end(&options(true))
        };
        joints.push(json!({
            "curve_error": error, "covered": covered, "speeds": total,
            "value": e.law.parameters(), "truth": law.parameters(),
            "std": (0..5).map(|i| e.covariance[i][i].sqrt()).collect::<Vec<_>>(),
            "nis": e.nis.mean, "widening": e.widening,
            "converged": e.ending == IterationEnding::Converged,
            "start_with_log": with_log, "start_alone": alone, "start_alone_says_converged": said,
        }));
        known.push(Some(KnownFriction {
            law: e.law,
            covariance: e.covariance,
            held: [true; 5],
        }));
    }

    let columns = RegressorColumns {
        joints: 4,
        shared: 12,
        own: vec![Vec::new(); 4],
        known: known.clone(),
        rest_speed: Vec::new(),
    };
    let motion = excitation_at_random_phase(LaboratorySetup::Tuedacs, seed);
    let recording = follow(&truth, &[], motion, &noisy(40.0, 10 * seed + 5)).expect("a run");
    let mut log = block(&recording);
    ZeroOrderHold::new(4).centre(&robot, &mut log);
    let solved = |settings: &Processing| {
        let found = accumulate(&robot, &columns, settings, &mut source(&log)).expect("a log");
        fit(&found.0, RowWeighting::Wls).expect("a fit")
    };
    let mut fit = solved(&processing());
    add_processing(&mut fit, &solved(&narrowed(&processing(), 1000.0)));
    let shifted: Vec<_> = (0..GRIDS)
        .map(|grid| {
            let mut read = source(&log);
            let found = accumulate_shifted(&robot, &columns, None, &processing(), grid, &mut read);
            let sums = found.expect("a log").expect("its encoders are known");
            cft_ident::inertia::solve::fit(&sums, RowWeighting::Wls).expect("a fit")
        })
        .collect();
    add_scatter(&mut fit, &shifted);
    let theta: Vec<Value> = (0..12)
        .map(|i| {
            let std = fit.covariance[(i, i)].sqrt();
            let share = (0..4)
                .map(|j| 2.0 * std * fit.column_rms[(j, i)] / fit.torque_rms[j])
                .fold(0.0, f64::max);
            let (verdict, negligible) = verdict(fit.theta[i], std, fit.determined[i], share);
            json!({
                "value": fit.theta[i], "std": std, "truth": truth.theta[i],
                "identified": verdict == Verdict::Identified, "negligible": negligible,
            })
        })
        .collect();

    let model = |theta: Vec<f64>, friction: [DoubleTanh; 4]| Model {
        robot: robot.clone(),
        theta,
        friction: friction.map(JointFriction::DoubleTanh).to_vec(),
        offset: vec![0.0; 4],
    };
    let estimated = std::array::from_fn(|j| known[j].as_ref().expect("filled above").law);
    let estimated = model(fit.theta.as_slice().to_vec(), estimated);
    let true_model = model(truth.printed().to_vec(), truth.friction);
    let mut settings = noisy(20.0, 10 * seed + 6);
    let sensed = errors(&robot, &truth, &settings, &[&estimated, &true_model]);
    settings.sensors = PlantSensors::perfect();
    let clean = errors(&robot, &truth, &settings, &[&estimated, &true_model]);
    json!({
        "seed": seed, "joints": joints, "theta": theta,
        "unseen": sensed[0], "unseen_truth": sensed[1],
        "clean": clean[0], "clean_truth": clean[1],
        "rows": fit.rows, "effective_rows": fit.effective_rows,
    })
}

fn wrong_inertia(m: f64, seed: u64, joint: usize) -> f64 {
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(1 + 10 * seed + joint as u64);
    m * FAULT.powf(chance.random_range(-1.0..1.0))
}

/// Relative torque errors per joint on the unseen motion, for several models.
fn errors(
    robot: &Robot,
    truth: &CftTruth,
    settings: &Settings<4>,
    models: &[&Model],
) -> Vec<Vec<f64>> {
    let recording = follow(
        truth,
        &[],
        along(series("configs/cft-validation.toml")),
        settings,
    )
    .expect("a run");
    let mut log = block(&recording);
    ZeroOrderHold::new(4).centre(robot, &mut log);
    models
        .iter()
        .map(|model| {
            let mut all = TorqueReconstruction::new(model, &[], None);
            let summary = all
                .add(&processing(), &mut source(&log), &mut |_| {})
                .expect("a log");
            all.finish(summary)
                .errors
                .joints
                .iter()
                .map(|j| j.relative_error)
                .collect()
        })
        .collect()
}

/// The numbers that the studies are asked for, as rows of tables.
fn summarise(rows: &[Value], folder: &Path) {
    let n = rows.len();
    let number = |v: &Value| v.as_f64().unwrap_or(f64::INFINITY);
    let over = |f: &dyn Fn(&Value) -> f64| -> Vec<f64> { rows.iter().map(f).collect() };
    let share = |f: &dyn Fn(&Value) -> bool| rows.iter().filter(|r| f(r)).count() as f64 / n as f64;
    let (mut curves, mut starts, mut frictions, mut torques) = (vec![], vec![], vec![], vec![]);
    for (j, joint) in JOINTS.iter().enumerate() {
        let error = over(&|r| number(&r["joints"][j]["curve_error"]));
        let covered: f64 = over(&|r| number(&r["joints"][j]["covered"])).iter().sum();
        let speeds: f64 = over(&|r| number(&r["joints"][j]["speeds"])).iter().sum();
        curves.push(json!({
            "joint": joint,
            "median curve error": percent(quantile(error.clone(), 0.5)),
            "95 % of seeds": percent(quantile(error.clone(), 0.95)),
            "largest": percent(quantile(error, 1.0)),
            "coverage of the 95 % interval": format!("{:.3}", covered / speeds),
            "median NIS": format!("{:.3}", quantile(over(&|r| number(&r["joints"][j]["nis"])), 0.5)),
        }));
        let ends = |key: &str| share(&|r| number(&r["joints"][j][key]) <= 0.01);
        starts.push(json!({
            "joint": joint,
            "from the wrong start and starts from the log": format!("{:.1} %", 100.0 * ends("start_with_log")),
            "from the wrong start alone": format!("{:.1} %", 100.0 * ends("start_alone")),
        }));
        for (i, name) in DoubleTanh::NAMES.iter().enumerate() {
            let z = |r: &Value| {
                let e = &r["joints"][j];
                (number(&e["value"][i]) - number(&e["truth"][i])) / number(&e["std"][i])
            };
            let relative = |r: &Value| {
                let e = &r["joints"][j];
                (number(&e["value"][i]) / number(&e["truth"][i]) - 1.0).abs()
            };
            frictions.push(json!({
                "theta": 13 + 4 * i + j,
                "joint": joint,
                "parameter": name,
                "median error": percent(quantile(over(&relative), 0.5)),
                "within 3 std": format!("{:.1} %", 100.0 * share(&|r| z(r).abs() <= 3.0)),
                "within 1.96 std": format!("{:.1} %", 100.0 * share(&|r| z(r).abs() <= 1.96)),
                "mean error in std": format!("{:.2}", over(&z).iter().sum::<f64>() / n as f64),
                "largest in std": format!("{:.1}", quantile(over(&|r| z(r).abs()), 1.0)),
            }));
        }
        let at = |key: &'static str| over(&|r| number(&r[key][j]));
        let ratio = over(&|r| number(&r["unseen"][j]) / number(&r["unseen_truth"][j]));
        torques.push(json!({
            "joint": joint,
            "unseen, median": percent(quantile(at("unseen"), 0.5)),
            "largest": percent(quantile(at("unseen"), 1.0)),
            "true parameters, median": percent(quantile(at("unseen_truth"), 0.5)),
            "ratio to them above 1.1": ratio.iter().filter(|r| **r > 1.1).count(),
            "largest ratio": format!("{:.3}", quantile(ratio, 1.0)),
            "noise-free sensors, median": percent(quantile(at("clean"), 0.5)),
            "noise-free, true parameters": percent(quantile(at("clean_truth"), 0.5)),
        }));
    }
    frictions.sort_by_key(|r| r["theta"].as_u64());
    let thetas: Vec<Value> = (0..12)
        .map(|i| {
            let z = |r: &Value| {
                let e = &r["theta"][i];
                (number(&e["value"]) - number(&e["truth"])) / number(&e["std"])
            };
            let relative = |r: &Value| {
                let e = &r["theta"][i];
                (number(&e["value"]) / number(&e["truth"]) - 1.0).abs()
            };
            json!({
                "parameter": format!("theta_{}", i + 1),
                "identified in": format!("{:.1} %", 100.0 * share(&|r| r["theta"][i]["identified"] == true)),
                "of which negligible": format!("{:.1} %", 100.0 * share(&|r| r["theta"][i]["negligible"] == true)),
                "median error": percent(quantile(over(&relative), 0.5)),
                "within 3 std": format!("{:.1} %", 100.0 * share(&|r| z(r).abs() <= 3.0)),
                "within 1.96 std": format!("{:.1} %", 100.0 * share(&|r| z(r).abs() <= 1.96)),
            })
        })
        .collect();
    for (name, title, rows) in [
        ("study_curve", "friction curves and their intervals", curves),
        (
            "study_friction",
            "friction parameters theta 13..32",
            frictions,
        ),
        (
            "study_starts",
            "share of starts that end at a curve error of at most 1 %",
            starts,
        ),
        ("study_inertia", "inertial parameters theta 1..12", thetas),
        ("study_torque", "torque error on an unseen log", torques),
    ] {
        write_summary(folder, name, title, "study_campaign", n, rows);
    }
}
