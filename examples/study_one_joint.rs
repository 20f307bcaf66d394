//! Friction curves from one-joint logs as laboratories have them: logs of one speed each, the slow
//! speeds of harmonic drives, short logs, two slopes that are hardly apart, one slope.
//!
//! `cargo run --release --example study_one_joint -- [SEEDS] [FOLDER]` writes one line per seed to
//! target/study_one_joint.jsonl as it goes and, at the end, FOLDER/study_one_joint.json, from which
//! docs/studies.md has its table. The motion is integrated by the simulator; encoder and torque
//! noise are those of a wrist's drive; the filter is given nothing but the log.

mod study;

use cft_ident::friction::estimate::{JointEstimate, Options, estimate};
use cft_ident::friction::inputs::Inputs;
use cft_ident::friction::motions::motions;
use cft_ident::friction::prepare::{SensorModel, SmoothedMotion, prepare};
use cft_ident::identify::narrowed;
use cft_ident::motion::FilterSettings as Processing;
use cft_ident::robot::friction::DoubleTanh;
use cft_ident::robot::{JointKind, Robot};
use cft_ident::simulate::reference::{Frame, LadderPlan, Path, TURN};
use cft_ident::simulate::run::run;
use cft_ident::simulate::{
    Drive, Effects, Noise, Reference, Settings, SimulatedRun, SingleJointTruth, SmoothFriction,
    Start,
};
use cft_ident::verdict::Verdict;
use rand::{RngExt, SeedableRng};
use serde_json::{Value, json};
use study::{percent, quantile, study, write_summary};

/// Travel of the joint \[rad\] and largest acceleration \[rad/s^2\].
const RANGE: (f64, f64) = (-2.4, 2.4);
const ACCELERATION: f64 = 12.0;
/// One encoder count \[rad\], torque per volt \[Nm/V\].
const COUNT: f64 = 2e-5;
const GAIN: f64 = 4.0;
/// A tenth of the curve must hold to this.
const ASKED: f64 = 0.03;

/// A kind of experiment.
struct Case {
    name: &'static str,
    /// Bv, Bf1, Bf2, w1, w2 before they are varied.
    law: [f64; 5],
    /// Plateau speeds \[rad/s\].
    speeds: &'static [f64],
    /// Length of a log \[s\].
    seconds: f64,
    /// Whether each direction of each speed is a log of its own, without turning points.
    constant: bool,
}

const TEN: [f64; 10] = [0.04, 0.06, 0.09, 0.13, 0.2, 0.3, 0.45, 0.67, 1.0, 1.5];
const CASES: [Case; 5] = [
    Case {
        name: "one speed a log, each direction by itself",
        law: [0.8, 2.0, -0.45, 120.0, 9.0],
        speeds: &TEN,
        seconds: 8.0,
        constant: true,
    },
    Case {
        name: "harmonic drive, from 0.01 rad/s",
        law: [6.0, 9.0, -2.5, 300.0, 40.0],
        speeds: &[0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2],
        seconds: 60.0,
        constant: false,
    },
    Case {
        name: "10 s",
        law: [0.8, 2.0, -0.45, 120.0, 9.0],
        speeds: &[0.3, 0.6, 1.2, 2.4],
        seconds: 10.0,
        constant: false,
    },
    Case {
        name: "two slopes within a factor 1.5",
        law: [0.8, 1.2, 0.9, 60.0, 42.0],
        speeds: &TEN,
        seconds: 40.0,
        constant: false,
    },
    Case {
        name: "one slope",
        law: [0.8, 1.8, 0.0, 60.0, 60.0],
        speeds: &TEN,
        seconds: 40.0,
        constant: false,
    },
];

fn main() {
    let (rows, folder) = study("study_one_joint", 20, campaign);
    let rows: Vec<Value> = CASES.iter().map(|case| summary(case.name, &rows)).collect();
    let seeds = rows.first().and_then(|r| r["seeds"].as_u64()).unwrap_or(0);
    write_summary(
        &folder,
        "study_one_joint",
        "friction curves from one-joint logs as laboratories have them",
        "study_one_joint",
        seeds as usize,
        rows,
    );
}

fn campaign(seed: u64) -> Value {
    let cases: Vec<Value> = CASES.iter().map(|case| one(case, seed)).collect();
    json!({ "seed": seed, "cases": cases })
}

fn truth(case: &Case, seed: u64) -> (SingleJointTruth, DoubleTanh) {
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut vary = |x: f64| x * (1.0 + 0.15 * (2.0 * chance.random::<f64>() - 1.0));
    let mut law = case.law.map(&mut vary);
    if case.law[3] < 1.5 * case.law[4] {
        // what sets the slopes apart is the case itself
        law[4] = law[3] * case.law[4] / case.law[3];
    }
    let law = DoubleTanh::from_parameters(law);
    let truth = SingleJointTruth {
        name: "wrist".to_owned(),
        kind: JointKind::Revolute,
        inertia: vary(0.25),
        friction: SmoothFriction::DoubleTanh(law),
        offset: 0.05,
        gain: GAIN,
        resolution: COUNT,
        limits: (RANGE.0 - 0.3, RANGE.1 + 0.3),
    };
    (truth, law)
}

/// Motion along a ladder of the speeds, and the true speeds of its rows.
fn ladder(
    truth: &SingleJointTruth,
    range: (f64, f64),
    speeds: &[f64],
    seconds: f64,
    seed: u64,
) -> SimulatedRun<1> {
    let plan = LadderPlan {
        range,
        speeds: speeds.to_vec(),
        acceleration: ACCELERATION,
        turn: TURN,
        seconds,
    };
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let ladder = plan.build(Some(&mut chance)).expect("a ladder");
    let plant = truth.plant().expect("a joint");
    let drive = Drive::Follow {
        reference: Reference {
            frame: Frame::Joints,
            path: Path::Ladder {
                moving: 0,
                pose: [ladder.at(0.0).0],
                ladder,
            },
        },
        control: plant.control(),
    };
    let mut settings = Settings::new(seconds);
    settings.seed = seed;
    settings.sensors.torque_noise = Noise::Relative(0.01);
    run(
        &plant,
        Effects::default(),
        &Start::Settled,
        &drive,
        &settings,
    )
    .expect("a run")
}

/// Rows `from..to` as a log of its own, smoothed.
fn smoothed(
    run: &SimulatedRun<1>,
    rows: std::ops::Range<usize>,
    wide: bool,
) -> Vec<SmoothedMotion> {
    let settings = Processing {
        q_cutoff_hz: Some(100.0),
        ..Processing::default()
    };
    let narrow = narrowed(&settings, 1000.0);
    let column = |x: &[[f64; 1]]| x[rows.clone()].concat();
    motions(
        &run.t[rows.clone()],
        &column(&run.q),
        &column(&run.torque),
        1,
        if wide { &settings } else { &narrow },
    )
    .expect("long enough")
}

/// Longest stretch at `speed` within 3 %.
fn plateau(run: &SimulatedRun<1>, speed: f64) -> std::ops::Range<usize> {
    let near = |k: usize| (run.actual.v[k][0] - speed).abs() < 0.03 * speed.abs();
    let (mut best, mut from) = (0..0, 0);
    for k in 0..=run.rows() {
        if k == run.rows() || !near(k) {
            if k - from > best.len() {
                best = from..k;
            }
            from = k + 1;
        }
    }
    best
}

/// The logs of a case, smoothed wide and narrow, and whether each of its speeds has a plateau.
fn logs(case: &Case, truth: &SingleJointTruth, seed: u64) -> [Vec<SmoothedMotion>; 2] {
    if !case.constant {
        let run = ladder(truth, RANGE, case.speeds, case.seconds, seed);
        return [true, false].map(|wide| smoothed(&run, 0..run.rows(), wide));
    }
    let mut both = [Vec::new(), Vec::new()];
    for (k, &speed) in case.speeds.iter().enumerate() {
        let half = (0.55 * speed * case.seconds).min(RANGE.1);
        let seconds = 5.0 * half / speed + 4.0;
        let run = ladder(
            truth,
            (-half, half),
            &[speed],
            seconds,
            100 * seed + k as u64,
        );
        for sign in [1.0, -1.0] {
            let rows = plateau(&run, sign * speed);
            let most = (case.seconds * 1000.0) as usize;
            let rows = rows.start..rows.end.min(rows.start + most);
            for (out, wide) in both.iter_mut().zip([true, false]) {
                out.extend(smoothed(&run, rows.clone(), wide));
            }
        }
    }
    both
}

fn one(case: &Case, seed: u64) -> Value {
    let (truth, law) = truth(case, seed);
    let [wide, narrower] = logs(case, &truth, seed);
    let robot = Robot::single_joint("wrist", JointKind::Revolute);
    let variance = |_: &[f64]| COUNT * COUNT / 12.0;
    let sensors = SensorModel {
        variance: &variance,
        zero_order_hold: true,
    };
    let prepared = prepare(&robot, 0, &wide, &sensors).expect("the joint moves");
    let inputs = Inputs {
        robot: &robot,
        joint: 0,
        motions: &wide,
        narrower: &narrower,
        sensors: &sensors,
    };
    let names = ["inertia".to_owned()];
    let options = Options::default();
    let began = std::time::Instant::now();
    let found = estimate("wrist", &names, &prepared, Some(&inputs), &options);
    let seconds = began.elapsed().as_secs_f64();
    let mut row = match found {
        Ok(e) => judged(case, &e, &law),
        Err(refusal) => json!({ "refused": refusal.to_string() }),
    };
    row["case"] = json!(case.name);
    row["rows"] = json!(prepared.velocity.len());
    row["seconds"] = json!(seconds);
    row
}

/// Errors of the curve at the plateaus' speeds and over all speeds covered, and what is covered.
fn judged(case: &Case, e: &JointEstimate, law: &DoubleTanh) -> Value {
    let off = |v: f64| (e.law.torque(v) - law.torque(v)).abs() / law.torque(v).abs();
    let at_plateaus = case.speeds.iter().flat_map(|v| [off(*v), off(-v)]);
    let inside = e
        .curve
        .iter()
        .map(|p| (p.torque - law.torque(p.v)).abs() <= 1.96 * p.std);
    let whole = e.curve.iter().map(|p| off(p.v)).fold(0.0, f64::max);
    json!({
        "plateaus": at_plateaus.fold(0.0, f64::max),
        "curve": whole,
        "inside": inside.filter(|x| *x).count() as f64 / e.curve.len() as f64,
        "values": e.values.iter().map(|v| v.value).collect::<Vec<_>>(),
        "truth": law.parameters(),
        "not_identifiable": e.values.iter().filter(|v| v.verdict == Verdict::NotIdentifiable).count(),
        "cancelling": e.law.coulomb_1.abs() > 3.0 * (e.law.coulomb_1 + e.law.coulomb_2).abs(),
        "covered": e.speeds.covered,
        "nis": e.nis.mean,
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
    let most = |x: &[f64]| match x.is_empty() {
        true => "-".to_owned(),
        false => percent(quantile(x.to_vec(), 1.0)),
    };
    let right = plateaus.iter().filter(|x| **x <= ASKED).count();
    json!({
        "seeds": cases.len(),
        "case": name,
        "rows": quantile(numbers("rows"), 0.5),
        "curves within 3 % at every plateau": format!("{right} of {}", plateaus.len()),
        "refused": refused,
        "largest error at a plateau": most(&plateaus),
        "largest error of a curve": most(&curve),
        "coverage": format!("{:.3}", inside.iter().sum::<f64>() / inside.len().max(1) as f64),
        "median seconds": format!("{:.1}", quantile(numbers("seconds"), 0.5)),
    })
}
