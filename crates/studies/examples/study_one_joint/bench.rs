//! One-joint logs as laboratories have them, simulated, and the filter's estimate from them.

use cft_ident::friction::estimate::{FrictionOptions, JointEstimate, estimate};
use cft_ident::friction::excitation::FrictionError;
use cft_ident::friction::inputs::FrictionInputs;
use cft_ident::friction::motions::motions;
use cft_ident::friction::prepare::{SensorModel, SmoothedMotion, prepare};
use cft_ident::identify::narrowed;
use cft_ident::motion::FilterSettings as Processing;
use cft_ident::robot::friction::DoubleTanh;
use cft_ident::robot::{JointKind, Robot};
use cft_ident::simulate::reference::{LadderPlan, Path, ReferenceFrame, TURN};
use cft_ident::simulate::run::run;
use cft_ident::simulate::{
    MotionStart, MotorInput, Noise, PlantEffects, Reference, Settings, SimulatedRun,
    SingleJointTruth, SmoothFriction,
};
use rand::{RngExt, SeedableRng};

/// Travel of the joint \[rad\] and largest acceleration \[rad/s^2\].
const RANGE: (f64, f64) = (-2.4, 2.4);
const ACCELERATION: f64 = 12.0;
/// One encoder count \[rad\], torque per volt \[Nm/V\].
const COUNT: f64 = 2e-5;
const GAIN: f64 = 4.0;
/// A curve must hold to this wherever there are plateaus.
pub const ASKED: f64 = 0.03;

/// A kind of experiment.
pub struct Case {
    pub name: &'static str,
    /// Bv, Bf1, Bf2, w1, w2 before they are varied.
    law: [f64; 5],
    /// Plateau speeds \[rad/s\].
    pub speeds: &'static [f64],
    /// Whether the plant has one Coulomb term.
    pub one_slope: bool,
    /// Length of a log \[s\].
    seconds: f64,
    /// Whether each direction of each speed is a log of its own, without turning points.
    constant: bool,
}

const TEN: [f64; 10] = [0.04, 0.06, 0.09, 0.13, 0.2, 0.3, 0.45, 0.67, 1.0, 1.5];
pub const CASES: [Case; 5] = [
    Case {
        name: "one speed a log, each direction by itself",
        law: [0.8, 2.0, -0.45, 120.0, 9.0],
        speeds: &TEN,
        one_slope: false,
        seconds: 8.0,
        constant: true,
    },
    Case {
        name: "harmonic drive, from 0.01 rad/s",
        law: [6.0, 9.0, -2.5, 300.0, 40.0],
        speeds: &[0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2],
        one_slope: false,
        seconds: 60.0,
        constant: false,
    },
    Case {
        name: "10 s",
        law: [0.8, 2.0, -0.45, 120.0, 9.0],
        speeds: &[0.3, 0.6, 1.2, 2.4],
        one_slope: false,
        seconds: 10.0,
        constant: false,
    },
    Case {
        name: "two slopes within a factor 1.5",
        law: [0.8, 1.2, 0.9, 60.0, 42.0],
        speeds: &TEN,
        one_slope: false,
        seconds: 40.0,
        constant: false,
    },
    Case {
        name: "one slope",
        law: [0.8, 1.8, 0.0, 60.0, 60.0],
        speeds: &TEN,
        one_slope: true,
        seconds: 40.0,
        constant: false,
    },
];

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
    let drive = MotorInput::Follow {
        reference: Reference {
            frame: ReferenceFrame::Joints,
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
        PlantEffects::default(),
        &MotionStart::Settled,
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

/// What the filter makes of a case, and the true law.
pub fn estimated(case: &Case, seed: u64) -> (Result<JointEstimate, FrictionError>, DoubleTanh) {
    let (truth, law) = truth(case, seed);
    let [wide, narrower] = logs(case, &truth, seed);
    let robot = Robot::single_joint("wrist", JointKind::Revolute);
    let variance = |_: &[f64]| COUNT * COUNT / 12.0;
    let sensors = SensorModel {
        variance: &variance,
        zero_order_hold: true,
    };
    let prepared = prepare(&robot, 0, &wide, &sensors).expect("the joint moves");
    let inputs = FrictionInputs {
        robot: &robot,
        joint: 0,
        motions: &wide,
        narrower: &narrower,
        sensors: &sensors,
    };
    let names = ["inertia".to_owned()];
    let options = FrictionOptions::default();
    let found = estimate("wrist", &names, &prepared, Some(&inputs), &options);
    (found, law)
}

/// Largest relative error of the curve at the speeds of the plateaus, in both directions.
pub fn error_at_plateaus(case: &Case, e: &JointEstimate, law: &DoubleTanh) -> f64 {
    let speeds = case.speeds.iter().flat_map(|v| [*v, -v]);
    speeds.map(|v| off(e, law, v)).fold(0.0, f64::max)
}

/// Relative error of the curve at a speed.
pub fn off(e: &JointEstimate, law: &DoubleTanh, v: f64) -> f64 {
    (e.law.torque(v) / law.torque(v) - 1.0).abs()
}
