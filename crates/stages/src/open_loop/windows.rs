//! Windows of a log, each simulated from its measured begin.

use schemars::JsonSchema;
use serde::Serialize;

use super::stepper::ModelStepper;
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

/// Sums of the squares of one joint over windows.
#[derive(Clone, Copy, Default)]
struct WindowSums {
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
    let mut sums = vec![WindowSums::default(); robot.joints()];
    let (mut windows, mut astray) = (0, 0);
    for stretch in stretches {
        let size = match length {
            WindowLength::Whole => stretch.len(),
            WindowLength::Seconds(s) => (s / stretch.dt).round() as usize + 1,
        };
        if size < MIN_WINDOW_SAMPLES {
            continue;
        }
        let mut follower = TorqueFollower::new(model, stretch, STEP_S);
        // the last sample of a window is the first of the next
        let begins = (0..).step_by(size - 1);
        for begin in begins.take_while(|begin| begin + size <= stretch.len()) {
            windows += 1;
            let end = begin + size;
            let follows = follower.run((begin, end), &mut |k, found| {
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
            });
            astray += u64::from(!follows);
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

/// A model that follows the torques of a stretch.
pub(super) struct TorqueFollower<'a> {
    stepper: ModelStepper,
    stretch: &'a Stretch,
    /// Torques where they move the model: one that comes late is logged later.
    tau: Vec<Vec<f64>>,
    /// Steps of a sample.
    parts: f64,
}

impl<'a> TorqueFollower<'a> {
    /// By steps of at most so many seconds.
    pub fn new(model: &AugmentedModel, stretch: &'a Stretch, step_s: f64) -> Self {
        let mut tau = stretch.tau.clone();
        for (j, tau) in tau.iter_mut().enumerate() {
            shifted(tau, -model.shift(j) / stretch.dt);
        }
        let parts = (stretch.dt / step_s).ceil().max(1.0);
        Self {
            stepper: ModelStepper::new(model, stretch.dt / parts),
            stretch,
            tau,
            parts,
        }
    }

    /// One window from its measured begin: `each` gets samples and the positions found; false where it goes astray.
    pub fn run(
        &mut self,
        (begin, end): (usize, usize),
        each: &mut dyn FnMut(usize, &[f64]),
    ) -> bool {
        let (stepper, stretch, parts) = (&mut self.stepper, self.stretch, self.parts);
        let [mut q, mut v, mut a, mut now] = [(); 4].map(|()| vec![0.0; self.tau.len()]);
        stretch.at(begin, &mut q, &mut v, &mut a);
        stepper.begin(&q, &v);
        for k in begin..end {
            if k > begin {
                stepper.set_temperatures(stretch, k);
                for part in 0..parts as usize {
                    let share = (part as f64 + 0.5) / parts;
                    for (now, tau) in now.iter_mut().zip(&self.tau) {
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::open_loop::one_axis::{inertia, sine};

    #[test]
    fn the_true_model_follows_and_a_wrong_mass_is_off_by_its_share() {
        let stretch = [sine(1e-3, 2000)];
        let right = along(&inertia(0.2), &stretch, WindowLength::Whole);
        assert_eq!((right.windows, right.astray), (1, 0));
        assert!(right.joints[0].rms < 1e-5, "{}", right.joints[0].rms);
        let windows = along(&inertia(0.2), &stretch, WindowLength::Seconds(0.5));
        assert_eq!(windows.windows, 4);
        // a quarter of the acceleration is missing: q errs by a quarter of what it integrates to
        let wrong = along(&inertia(0.25), &stretch, WindowLength::Whole);
        let error = |t: f64| 0.2 * (3.0 * t - (3.0 * t).sin());
        assert!((wrong.joints[0].max_abs - error(2.0)).abs() < 1e-3);
    }
}
