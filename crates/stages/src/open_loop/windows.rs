//! Windows of a log, each simulated from its measured begin.

use schemars::JsonSchema;
use serde::Serialize;

use super::stepper::Stepper;
use cft_ident_core::effect::{AugmentedModel, shifted};
use cft_ident_core::motion::Stretch;

/// Longest step of the simulation \[s\].
const STEP_S: f64 = 2.5e-4;
/// Least window, in samples.
const MIN_WINDOW_SAMPLES: usize = 4;

/// How long windows are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WindowLength {
    /// \[s\]
    Seconds(f64),
    /// Each stretch from its begin to its end.
    Whole,
}

/// How far the simulated position of one joint is off.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointDrift {
    pub joint: String,
    /// "m" or "rad".
    pub unit: &'static str,
    /// Root mean square over all samples of all windows.
    pub rms: f64,
    /// Root mean square at the windows' ends.
    pub rms_at_end: f64,
    /// Greatest.
    pub max_abs: f64,
    /// `rms` over the root mean square by which the joint moves away from each window's begin.
    pub relative: f64,
}

/// Errors of motions that were simulated from measured torques.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct OpenLoop {
    /// Length that windows were asked to have; null where each stretch is one.
    pub window_s: Option<f64>,
    pub windows: u64,
    /// Windows in which the simulated motion went astray: no position is counted behind that.
    pub astray: u64,
    pub joints: Vec<JointDrift>,
}

#[derive(Clone, Copy, Default)]
struct Sums {
    square: f64,
    moved: f64,
    samples: u64,
    at_end: f64,
    ends: u64,
    largest: f64,
}

/// Simulates stretches of logs window after window.
pub fn along(model: &AugmentedModel, stretches: &[Stretch], length: WindowLength) -> OpenLoop {
    let robot = &model.model.robot;
    let n = robot.joints();
    let mut sums = vec![Sums::default(); n];
    let (mut windows, mut astray) = (0, 0);
    for stretch in stretches {
        let size = match length {
            WindowLength::Whole => stretch.len(),
            WindowLength::Seconds(s) => (s / stretch.dt).round() as usize + 1,
        };
        if size < MIN_WINDOW_SAMPLES {
            continue;
        }
        // where the model's torque comes late, the torque that moves it at t is logged later
        let mut tau = stretch.tau.clone();
        for (j, tau) in tau.iter_mut().enumerate() {
            shifted(tau, -model.shift(j) / stretch.dt);
        }
        let parts = (stretch.dt / STEP_S).ceil().max(1.0);
        let mut stepper = Stepper::new(model, stretch.dt / parts);
        let mut begin = 0;
        while begin + size <= stretch.len() {
            windows += 1;
            let window = (begin, begin + size);
            astray += u64::from(!score(
                &mut stepper,
                stretch,
                &tau,
                window,
                parts,
                &mut sums,
            ));
            // the last sample of a window is the first of the next
            begin += size - 1;
        }
    }
    let names = robot.joint_names().iter().zip(&sums).enumerate();
    let mean = |sum: f64, count: u64| (sum / count.max(1) as f64).sqrt();
    let joints = names.map(|(j, (joint, s))| JointDrift {
        joint: joint.clone(),
        unit: robot.joint_kind(j).position_unit(),
        rms: mean(s.square, s.samples),
        rms_at_end: mean(s.at_end, s.ends),
        max_abs: s.largest,
        relative: (s.square / s.moved).sqrt(),
    });
    OpenLoop {
        window_s: match length {
            WindowLength::Seconds(s) => Some(s),
            WindowLength::Whole => None,
        },
        windows,
        astray,
        joints: joints.collect(),
    }
}

/// Simulates one window and adds up its errors; false where it goes astray.
fn score(
    stepper: &mut Stepper,
    stretch: &Stretch,
    tau: &[Vec<f64>],
    (begin, end): (usize, usize),
    parts: f64,
    sums: &mut [Sums],
) -> bool {
    run(
        stepper,
        stretch,
        tau,
        (begin, end),
        parts,
        &mut |k, found| {
            for (j, s) in sums.iter_mut().enumerate() {
                let q = &stretch.q[j];
                let e = found[j] - q[k];
                s.square += e * e;
                s.moved += (q[k] - q[begin]).powi(2);
                s.samples += 1;
                s.largest = s.largest.max(e.abs());
                if k + 1 == end {
                    s.at_end += e * e;
                    s.ends += 1;
                }
            }
        },
    )
}

/// Simulates one window from its measured begin, each sample in so many parts: `each` gets the number of the sample
/// and the positions that were found; false where it goes astray.
pub(super) fn run(
    stepper: &mut Stepper,
    stretch: &Stretch,
    tau: &[Vec<f64>],
    (begin, end): (usize, usize),
    parts: f64,
    each: &mut dyn FnMut(usize, &[f64]),
) -> bool {
    let n = tau.len();
    let [mut q, mut v, mut a, mut now] = [(); 4].map(|()| vec![0.0; n]);
    stretch.at(begin, &mut q, &mut v, &mut a);
    stepper.begin(&q, &v);
    for k in begin..end {
        if k > begin {
            stepper.set_temperatures(stretch, k);
            for part in 0..parts as usize {
                let share = (part as f64 + 0.5) / parts;
                for (now, tau) in now.iter_mut().zip(tau) {
                    *now = tau[k - 1] + share * (tau[k] - tau[k - 1]);
                }
                let since = stretch.began + stretch.dt * (k as f64 - 1.0 + share);
                if !stepper.step(since, &now) {
                    return false;
                }
            }
        }
        each(k, &stepper.q);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use cft_ident_core::robot::model::{JointFriction, Model};
    use cft_ident_core::robot::{JointKind, Robot};

    #[test]
    fn the_true_model_follows_and_a_wrong_mass_is_off_by_its_share() {
        let model = |inertia: f64| {
            AugmentedModel::plain(Model {
                robot: Robot::single_joint("q1", JointKind::Revolute),
                theta: vec![inertia],
                friction: vec![JointFriction::None],
                offset: vec![0.0],
            })
        };
        let dt = 1e-3;
        let t: Vec<f64> = (0..2001).map(|k| f64::from(k) * dt).collect();
        let of = |f: fn(f64) -> f64| vec![t.iter().map(|t| f(*t)).collect::<Vec<f64>>()];
        let stretch = [Stretch {
            dt,
            q: of(|t| (3.0 * t).sin()),
            v: of(|t| 3.0 * (3.0 * t).cos()),
            a: of(|t| -9.0 * (3.0 * t).sin()),
            tau: of(|t| -1.8 * (3.0 * t).sin()),
            t,
            ..Stretch::default()
        }];
        let right = along(&model(0.2), &stretch, WindowLength::Whole);
        assert_eq!((right.windows, right.astray), (1, 0));
        assert!(right.joints[0].rms < 1e-5, "{}", right.joints[0].rms);
        let windows = along(&model(0.2), &stretch, WindowLength::Seconds(0.5));
        assert_eq!(windows.windows, 4);
        // a quarter of the acceleration is missing: q errs by a quarter of what it integrates to
        let wrong = along(&model(0.25), &stretch, WindowLength::Whole);
        let error = |t: f64| 0.2 * (3.0 * t - (3.0 * t).sin());
        assert!((wrong.joints[0].max_abs - error(2.0)).abs() < 1e-3);
    }
}
