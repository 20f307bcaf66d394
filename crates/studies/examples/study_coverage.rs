//! Whether the intervals of `lsq` cover, by log length, number of logs and correlation of the residual.
//!
//! `cargo run --release -p cft-ident-studies --example study_coverage -- [SEEDS] [FOLDER]` writes one line per seed to
//! target/study_coverage.jsonl as it goes and, at the end, FOLDER/study_coverage.json. The torque is that of the
//! declared model along random multisines, with a disturbance whose correlation falls to 1/e in a tenth of a second or
//! in a second; a slide, and the six joints of a UR10. The intervals are those of reduced logs; the last
//! column says by how much deviations of the logs themselves differ.

#[allow(dead_code)] // it uses its share
#[path = "study/mod.rs"]
mod study;

use std::f64::consts::TAU;

use cft_ident::config::RobotFile;
use cft_ident::identify::{Control, Dataset, Log, LsqSettings, RobotSetup, lsq, reduce};
use cft_ident::robot::friction::sign;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use study::{study, write_summary};

const SLIDE: &str = r#"
    robot = { model = "single-joint", joint = "slide", kind = "prismatic" }
    friction = { law = "viscous-coulomb", fitted_with_inertias = true, offset = true }
    filter = { cutoff_hz = 10.0, position_cutoff_hz = 40.0 }
"#;
const UR10: &str = include_str!("../../../configs/ur10.toml");
/// Robot, sampling rate [Hz], logs, seconds of each, and time in which the disturbance forgets [s].
const CASES: [(&str, f64, usize, f64, f64); 8] = [
    ("slide", 200.0, 1, 10.0, 0.1),
    ("slide", 200.0, 1, 60.0, 0.1),
    ("slide", 200.0, 1, 60.0, 1.0),
    ("slide", 200.0, 10, 12.0, 0.1),
    ("UR10", 125.0, 1, 20.0, 0.1),
    ("UR10", 125.0, 1, 60.0, 0.1),
    ("UR10", 125.0, 1, 60.0, 1.0),
    ("UR10", 125.0, 5, 20.0, 0.1),
];

fn main() {
    let (rows, folder) = study("study_coverage", 200, campaign);
    let of_case = |(k, case): (usize, &(&str, f64, usize, f64, f64))| {
        let (robot, _, logs, seconds, memory) = *case;
        let cases = || rows.iter().map(move |row| &row["cases"][k]);
        let sum = |key: &str| cases().filter_map(|c| c[key].as_f64()).sum::<f64>();
        let largest = |key: &str| cases().filter_map(|c| c[key].as_f64()).fold(0.0, f64::max);
        let intervals = sum("intervals");
        let share = |key: &str| format!("{:.3}", sum(key) / intervals);
        json!({
            "robot": robot,
            "logs": format!("{logs} of {seconds} s"),
            "disturbance forgets in": format!("{memory} s"),
            "blocks a log": format!("{:.0}", sum("blocks") / rows.len() as f64),
            "intervals": intervals,
            "95 % intervals that cover": share("covered"),
            "the same, textbook": share("textbook"),
            "rms error over deviation": format!("{:.2}", (sum("squares") / intervals).sqrt()),
            "deviations of the logs differ by at most": format!("{:.0} %", 100.0 * largest("apart")),
        })
    };
    let table = CASES.iter().enumerate().map(of_case).collect();
    write_summary(
        &folder,
        "study_coverage",
        "intervals of `lsq` from reduced logs",
        "study_coverage",
        rows.len(),
        table,
    );
}

/// Normal numbers.
fn chance(seed: u64) -> impl FnMut() -> f64 {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    move || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0
}

/// A log of the model with these parameters: inertial ones, then viscous, Coulomb and offset of each joint.
fn log(machine: &RobotSetup, truth: &[f64], case: (f64, f64, f64), seed: u64) -> Log {
    let (rate, seconds, memory) = case;
    let (n, mut draw) = (machine.robot.joints(), chance(seed));
    let shared = truth.len() - 3 * n;
    // amplitude, angular frequency and phase of each wave of each joint
    let waves: Vec<Vec<[f64; 3]>> = (0..n)
        .map(|_| {
            let wave = |k: usize| {
                let hertz = 0.15 * (k as f64 + 1.0) * (1.0 + 0.1 * draw());
                [0.5 / (k as f64 + 1.0), TAU * hertz, TAU * draw()]
            };
            (0..6).map(wave).collect()
        })
        .collect();
    let forgets = (-1.0 / (rate * memory)).exp();
    let fresh = (1.0 - forgets * forgets).sqrt();
    let mut error: Vec<f64> = (0..n).map(|_| draw()).collect();
    let (mut times, mut positions, mut torques) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(rate * seconds) as usize {
        let now = k as f64 / rate;
        let sum = |of: &dyn Fn(&[f64; 3]) -> f64| -> Vec<f64> {
            waves.iter().map(|own| own.iter().map(of).sum()).collect()
        };
        let q = sum(&|[a, w, p]| a * (w * now + p).sin());
        let v = sum(&|[a, w, p]| a * w * (w * now + p).cos());
        let acc = sum(&|[a, w, p]| -a * w * w * (w * now + p).sin());
        let mut tau = vec![0.0; n];
        machine
            .robot
            .torque(&truth[..shared], &q, &v, &acc, &mut tau);
        for j in 0..n {
            let [viscous, coulomb, offset] = [0, 1, 2].map(|k| truth[shared + 3 * j + k]);
            error[j] = forgets * error[j] + fresh * draw();
            tau[j] += viscous * v[j] + coulomb * sign(v[j]) + offset + error[j];
        }
        times.push(now);
        positions.extend(q);
        torques.extend(tau);
    }
    Log::of_rows(&format!("log{seed}"), &times, &positions, &torques).expect("a log")
}

/// All cases with the noise, the motions and the parameters of a seed.
fn campaign(seed: u64) -> Value {
    let case = |(k, case): (u64, &(&str, f64, usize, f64, f64))| {
        let (name, rate, logs, seconds, memory) = *case;
        let text = if name == "UR10" { UR10 } else { SLIDE };
        let machine = RobotSetup::new(name, RobotFile::parse(name, text).expect("a robot file"));
        let (n, mut draw) = (machine.robot.joints(), chance(1_000 * seed + k));
        let inertial = machine.robot.parameters().len();
        let parameter = |i: usize| match i < inertial {
            true => draw(),
            false => 2.0 + 0.3 * draw(),
        };
        let truth: Vec<f64> = (0..inertial + 3 * n).map(parameter).collect();
        let logs: Vec<Log> = (0..logs as u64)
            .map(|one| {
                log(
                    &machine,
                    &truth,
                    (rate, seconds, memory),
                    1_000_000 * (seed + 1) + 1_000 * k + one,
                )
            })
            .collect();
        judged(&machine, &logs, &truth)
    };
    let cases: Vec<Value> = (0..).zip(&CASES).map(case).collect();
    json!({ "seed": seed, "cases": cases })
}

/// Intervals of a fit against the parameters that made its logs.
fn judged(machine: &RobotSetup, logs: &[Log], truth: &[f64]) -> Value {
    let (control, settings) = (Control::default(), LsqSettings::default());
    let parts = reduce(
        &Dataset::read(machine, logs, &Control::default()).expect("logs that can be read"),
        None,
        &control,
    )
    .expect("parts");
    let blocks = parts
        .logs()
        .iter()
        .map(|log| log.blocks())
        .max()
        .unwrap_or(0);
    let found = lsq(
        &Dataset::read(machine, &parts.as_logs(), &Control::default())
            .expect("logs that can be read"),
        &settings,
        &control,
    )
    .expect("a fit");
    let of_logs = lsq(
        &Dataset::read(machine, logs, &Control::default()).expect("logs that can be read"),
        &settings,
        &control,
    )
    .expect("a fit");
    let (mut intervals, mut covered, mut textbook, mut squares, mut apart) =
        (0, 0, 0, 0.0, 0.0_f64);
    for (i, truth) in truth
        .iter()
        .enumerate()
        .filter(|(i, _)| found.fit.determined[*i])
    {
        let std = found.fit.covariance[(i, i)].sqrt();
        let off = (found.fit.theta[i] - truth).abs();
        intervals += 1;
        covered += u32::from(off < 1.96 * std);
        textbook += u32::from(off < 1.96 * found.fit.textbook[(i, i)].sqrt());
        squares += (off / std).powi(2);
        apart = apart.max((of_logs.fit.covariance[(i, i)].sqrt() / std - 1.0).abs());
    }
    json!({
        "intervals": intervals,
        "covered": covered,
        "textbook": textbook,
        "squares": squares,
        "blocks": blocks,
        "apart": apart,
    })
}
