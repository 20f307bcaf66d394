//! Monte Carlo study of rows at fast reversals: clean campaigns whose motions, slopes of friction and position
//! cut-offs differ, with the encoders of Table 5 and 1 % torque noise.
//!
//! Friction is that of the plant, so that what is seen comes from velocities alone. The error of an unseen log, by
//! the parameters found and velocities as they are made from encoders, is given as a ratio to that of the true
//! parameters along the TRUE motion, over the rows in which the joint moves.
//!
//! `cargo run --release -p cft-ident-studies --example study_rows -- [SEEDS] [FOLDER]` writes one line per seed to
//! target/study_rows.jsonl as it goes and, at the end, into FOLDER the summary that docs/results/studies.md is generated from.

#[path = "../study/mod.rs"]
#[allow(dead_code)] // each study uses its share
mod study;

use std::path::Path;

use cft_ident::identify::narrowed;
use cft_ident::inertia::columns::{KnownFriction, RegressorColumns};
use cft_ident::inertia::encoder::{GRIDS, accumulate_shifted, add_scatter};
use cft_ident::inertia::solve::{Fit, RowWeighting, fit};
use cft_ident::inertia::{accumulate, add_processing};
use cft_ident::log::Block;
use cft_ident::motion::position_cutoff::{CutoffTrial, ReversalFriction, candidates};
use cft_ident::motion::{FilterDesign, FilterSettings, Stretch, ZeroOrderHold, full_rate, rest};
use cft_ident::robot::Robot;
use cft_ident::robot::cft::{LaboratorySetup, ParameterStructure};
use cft_ident::robot::friction::DoubleTanh;
use cft_ident::simulate::cft::follow;
use cft_ident::simulate::reference::{FourierReference, SplineReference};
use cft_ident::simulate::{CftTruth, Path as Motion, Reference, ReferenceFrame, SimulatedRun};
use rand::{RngExt, SeedableRng};
use serde_json::{Value, json};
use study::{JOINTS, along, block, noisy, series, source, study, write_summary};

const SECONDS: f64 = 20.0;
const DT: f64 = 1e-3;
const MOTIONS: [&str; 4] = ["slow", "0.2 Hz", "0.4 Hz designed", "point to point"];
/// The steeper slope of q2, q4 and q5 [s/rad]; that of q1 goes with it.
const SLOPES: [f64; 3] = [15.0, 60.0, 200.0];
const USUAL_SLOPE: f64 = 60.0;
const DECLARED: [f64; 4] = [50.0, 100.0, 200.0, 300.0];
/// Samples at each end that are left out: the filters have not settled there.
const EDGE: usize = 300;
/// Speed up to which a joint rests, over its rms speed.
const RESTING: f64 = 0.01;

fn main() {
    let (rows, folder) = study("study_rows", 20, plant);
    summarise(&rows, &folder);
}

fn slowed(mut of: FourierReference<4>, factor: f64) -> FourierReference<4> {
    of.fundamental *= factor;
    for x in of.a.iter_mut().chain(&mut of.b).flatten() {
        *x *= factor;
    }
    of
}

fn motion(name: &str, seed: u64) -> Reference<4> {
    let campaign = || series("configs/cft-excitation.toml").at_random_phase(seed);
    match name {
        "slow" => along(slowed(campaign(), 0.3)),
        "0.2 Hz" => along(campaign()),
        "0.4 Hz designed" => {
            along(series("crates/studies/examples/study_rows/designed.toml").at_random_phase(seed))
        }
        _ => points(seed),
    }
}

/// A pose a second, a fifth of it at rest, anywhere in the box that the campaign's motion fills.
fn points(seed: u64) -> Reference<4> {
    const LOW: [f64; 4] = [-0.22, 0.08, 2.1, 0.14];
    const HIGH: [f64; 4] = [-0.05, 0.45, 2.7, 0.33];
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(seed ^ 0x901);
    let mut pose = || std::array::from_fn(|i| chance.random_range(LOW[i]..HIGH[i]));
    let mut list = Vec::new();
    for k in 0..SECONDS as usize {
        let (t, there): (f64, [f64; 4]) = (k as f64, pose());
        list.extend([(t, there), (t + 0.2, there)]);
    }
    Reference {
        frame: ReferenceFrame::Motors,
        path: Motion::Points(SplineReference::new(&list).expect("times increase")),
    }
}

/// A log with what was true of it.
struct Driven {
    log: Block,
    q: Vec<f64>,
    v: Vec<f64>,
    rest: Vec<f64>,
}

impl Driven {
    fn of(robot: &Robot, run: &SimulatedRun<4>) -> Self {
        let mut log = block(run);
        ZeroOrderHold::new(4).centre(robot, &mut log);
        let v = run.actual.v.concat();
        let rms = |j: usize| {
            let squares = v.chunks_exact(4).map(|v| v[j] * v[j]).sum::<f64>();
            (squares / run.rows() as f64).sqrt()
        };
        Driven {
            rest: (0..4).map(|j| RESTING * rms(j)).collect(),
            q: run.actual.q.concat(),
            v,
            log,
        }
    }

    /// Position cut-offs as the tool finds them.
    fn found(&self, laws: &[DoubleTanh; 4]) -> FilterSettings {
        let settings = FilterSettings::default();
        let column = |j: usize| self.log.q.chunks_exact(4).map(|q| q[j]).collect();
        let raw = Stretch {
            dt: DT,
            t: self.log.t.clone(),
            q: (0..4).map(column).collect(),
            ..Stretch::default()
        };
        let friction = laws.map(ReversalFriction::Smooth).to_vec();
        let tried = candidates(&settings, 1.0 / DT);
        let mut trial = CutoffTrial::new(&settings, tried, friction, &self.rest);
        trial.add(&raw).expect("the rate carries them");
        FilterSettings {
            joint_q_cutoffs_hz: trial.chosen(settings.plain_q_cutoff_hz(1.0 / DT)),
            ..settings
        }
    }

    /// Rms of what is left of each joint's torque, filtered, over the rows in which it moves.
    fn left(
        &self,
        robot: &Robot,
        laws: &[DoubleTanh; 4],
        theta: &[f64],
        qva: [&[f64]; 3],
    ) -> Vec<f64> {
        let n = self.log.t.len();
        let mut tau = [0.0; 4];
        let mut channels = vec![Vec::new(); 8];
        for k in EDGE..n - EDGE {
            let at = 4 * k..4 * k + 4;
            let [q, v, a] = qva.map(|x| &x[at.clone()]);
            robot.torque(theta, q, v, a, &mut tau);
            for j in 0..4 {
                channels[j].push(self.log.tau[4 * k + j] - tau[j] - laws[j].torque(v[j]));
                channels[4 + j].push(f64::from(self.v[4 * k + j].abs() > self.rest[j]));
            }
        }
        let parallel = FilterDesign::design(&FilterSettings::default(), DT).expect("usual filters");
        let views: Vec<&[f64]> = channels.iter().map(Vec::as_slice).collect();
        let rows = parallel.run(&views).expect("a long log");
        let rms = |j: usize| {
            let moving = rows[j]
                .iter()
                .zip(&rows[4 + j])
                .filter(|(_, m)| !rest::rests(**m));
            let squares: Vec<f64> = moving.map(|(e, _)| e * e).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        (0..4).map(rms).collect()
    }

    /// What the true parameters leave along the true motion.
    fn noise(&self, robot: &Robot, laws: &[DoubleTanh; 4], theta: &[f64]) -> Vec<f64> {
        // the torque of a row is the mean about its instant, and so is the acceleration
        let mut a = vec![0.0; self.v.len()];
        for i in 4..a.len() - 4 {
            a[i] = (self.v[i + 4] - self.v[i - 4]) / (2.0 * DT);
        }
        self.left(robot, laws, theta, [&self.q, &self.v, &a])
    }

    fn by(
        &self,
        robot: &Robot,
        laws: &[DoubleTanh; 4],
        theta: &[f64],
        settings: &FilterSettings,
    ) -> Vec<f64> {
        let smooth = full_rate(&self.log.t, &self.log.q, 4, settings).expect("a long log");
        self.left(robot, laws, theta, [&smooth.q, &smooth.v, &smooth.a])
    }
}

fn fitted(
    robot: &Robot,
    columns: &RegressorColumns,
    log: &Block,
    settings: &FilterSettings,
) -> Fit {
    let found = accumulate(robot, columns, settings, &mut source(log)).expect("a log");
    fit(&found.0, RowWeighting::Wls).expect("a fit")
}

/// The fit with the deviations that the tool states.
fn with_deviations(
    robot: &Robot,
    columns: &RegressorColumns,
    log: &Block,
    settings: &FilterSettings,
) -> Fit {
    let mut found = fitted(robot, columns, log, settings);
    let narrower = fitted(robot, columns, log, &narrowed(settings, 1.0 / DT));
    add_processing(&mut found, &narrower);
    let shifted: Vec<Fit> = (0..GRIDS)
        .map(|grid| {
            let mut read = source(log);
            let sums = accumulate_shifted(robot, columns, None, settings, grid, &mut read);
            let sums = sums.expect("a log").expect("its encoders are known");
            fit(&sums, RowWeighting::Wls).expect("a fit")
        })
        .collect();
    add_scatter(&mut found, &shifted);
    found
}

fn plant(seed: u64) -> Value {
    let robot = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Printed12);
    let mut cases = Vec::new();
    for (s, slope) in SLOPES.into_iter().enumerate() {
        let mut truth = CftTruth::synthetic(LaboratorySetup::Tuedacs)
            .varied(0.15, seed)
            .expect("a plant");
        for law in &mut truth.friction {
            law.slope_1 *= slope / USUAL_SLOPE;
            law.slope_2 *= slope / USUAL_SLOPE;
        }
        let (laws, theta) = (truth.friction, truth.printed());
        let drive = |reference: Reference<4>, number: u64| {
            let settings = noisy(SECONDS, 100 * seed + 10 * s as u64 + number);
            let run = follow(&truth, &[], reference, &settings).expect("a run");
            Driven::of(&robot, &run)
        };
        let unseen = drive(along(series("configs/cft-validation.toml")), 9);
        let unseen_noise = unseen.noise(&robot, &laws, &theta);
        let unseen_found = unseen.found(&laws);
        let columns = RegressorColumns {
            joints: 4,
            shared: 12,
            own: vec![Vec::new(); 4],
            known: laws
                .map(|law| {
                    Some(KnownFriction {
                        law,
                        covariance: [[0.0; 5]; 5],
                        held: [true; 5],
                    })
                })
                .to_vec(),
            rest_speed: Vec::new(),
        };
        for (m, name) in MOTIONS.into_iter().enumerate() {
            let own = drive(motion(name, seed), m as u64);
            let columns = RegressorColumns {
                rest_speed: own.rest.clone(),
                ..columns.clone()
            };
            // the same motion again, with other noise, for the parameters found on the first
            let again = drive(motion(name, seed + 1000), m as u64 + 4);
            let again_noise = again.noise(&robot, &laws, &theta);
            let ratios = |fit: &Fit, of_again: &FilterSettings, of_unseen: &FilterSettings| {
                let over = |left: Vec<f64>, noise: &[f64]| -> Vec<f64> {
                    left.iter().zip(noise).map(|(e, n)| e / n).collect()
                };
                let theta = fit.theta.as_slice();
                json!({
                    "alike": over(again.by(&robot, &laws, theta, of_again), &again_noise),
                    "unseen": over(unseen.by(&robot, &laws, theta, of_unseen), &unseen_noise),
                })
            };
            let settings = own.found(&laws);
            let fit = with_deviations(&robot, &columns, &own.log, &settings);
            let off: Vec<f64> = (0..12)
                .map(|i| (fit.theta[i] - theta[i]) / fit.covariance[(i, i)].sqrt())
                .collect();
            let mut case = json!({
                "motion": name,
                "slope": slope,
                "cut-offs": settings.joint_q_cutoffs_hz,
                "found": ratios(&fit, &again.found(&laws), &unseen_found),
                "off in deviations": off,
            });
            for hz in DECLARED {
                let settings = FilterSettings {
                    q_cutoff_hz: Some(hz),
                    ..FilterSettings::default()
                };
                let fit = fitted(&robot, &columns, &own.log, &settings);
                case[format!("{hz} Hz")] = ratios(&fit, &settings, &settings);
            }
            cases.push(case);
        }
    }
    json!({ "seed": seed, "cases": cases })
}

fn summarise(rows: &[Value], folder: &Path) {
    let n = rows.len() as f64;
    let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
    let mut lines = Vec::new();
    for place in 0..MOTIONS.len() * SLOPES.len() {
        let cases: Vec<&Value> = rows.iter().map(|r| &r["cases"][place]).collect();
        let mean = |key: &str, log: &str, j: usize| {
            cases.iter().map(|c| number(&c[key][log][j])).sum::<f64>() / n
        };
        let worst = |key: &str| {
            let all = ["alike", "unseen"].into_iter();
            let of_log = |log| (0..4).map(move |j| (log, j));
            let all = all.flat_map(of_log).map(|(log, j)| mean(key, log, j));
            format!("{:.2}", all.fold(0.0, f64::max))
        };
        let each = |log: &str| {
            let each = (0..4).map(|j| format!("{:.2}", mean("found", log, j)));
            each.collect::<Vec<_>>().join(", ")
        };
        let cutoff = |j: usize| cases.iter().map(|c| number(&c["cut-offs"][j])).sum::<f64>() / n;
        let all = cases
            .iter()
            .flat_map(|c| c["off in deviations"].as_array().into_iter().flatten());
        let within = all.filter(|z| number(z).abs() <= 3.0).count() as f64 / (12.0 * n);
        let mut line = json!({
            "motion": cases[0]["motion"],
            "slope [s/rad]": format!("{}", number(&cases[0]["slope"])),
            "cut-offs found [Hz]": (0..4).map(|j| format!("{:.0}", cutoff(j))).collect::<Vec<_>>().join(", "),
            "same kind of motion": each("alike"),
            "unseen motion": each("unseen"),
            "worst": worst("found"),
        });
        for hz in DECLARED {
            let key = format!("{hz} Hz");
            line[format!("worst at {key}")] = worst(&key).into();
        }
        line["parameters within 3 std"] = format!("{:.1} %", 100.0 * within).into();
        lines.push(line);
    }
    let title = format!(
        "torque errors over those of the true parameters along the true motion ({})",
        JOINTS.join(", ")
    );
    write_summary(
        folder,
        "study_rows",
        &title,
        "study_rows",
        rows.len(),
        lines,
    );
}
