//! The free run of a model: windows of logs simulated from their measured begin, how the error of the positions grows,
//! and whether another model of the same robot runs better or worse.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::fit::RunSpan;
use super::windows::TorqueFollower;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::deviation::NORMAL_95;

/// Length of the windows \[s\]: a slow joint moves visibly in it, and gravity has not yet thrown an arm about.
pub const FREE_RUN_S: f64 = 0.5;
/// Longest step of the simulation \[s\].
const STEP_S: f64 = 1e-3;
/// Windows that are simulated; of longer logs they are spread all along.
const MAX_WINDOWS: usize = 60;
/// Windows below which nothing is compared.
const MIN_WINDOWS: usize = 4;
/// Where in a window its error is looked at, as shares of its length.
const SHARES: [f64; 4] = [0.125, 0.25, 0.5, 1.0];

/// The motion that a model makes of measured torques, beside that of another where there is one.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FreeRun {
    /// Length of the windows, each of which begins at a measured state \[s\].
    pub window_s: f64,
    pub windows: u64,
    /// Windows in which the motion of one of the models went astray: they are left out of every number.
    pub astray: u64,
    pub joints: Vec<JointFreeRun>,
}

/// Errors of the positions of one joint.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointFreeRun {
    pub joint: String,
    /// "m" or "rad".
    pub unit: &'static str,
    /// Of the model as given.
    pub given: PositionError,
    /// Of the model after.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<PositionError>,
    /// Mean change of a window's rms, above 0 where the model after runs worse.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change: Option<PositionErrorChange>,
}

/// Error of simulated positions.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PositionError {
    /// Root mean square over all samples of all windows \[m or rad\].
    pub rms: f64,
    /// `rms` over that of the way that the joint goes from each window's begin.
    pub relative: f64,
    /// Root mean square so long after the begin of a window.
    pub growth: Vec<ErrorAfter>,
}

/// Error at one time after the begin of a window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct ErrorAfter {
    /// \[s\]
    pub after_s: f64,
    /// \[m or rad\]
    pub rms: f64,
}

/// A change with its interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct PositionErrorChange {
    /// \[m or rad\]
    pub value: f64,
    pub interval_95: [f64; 2],
}

impl FreeRun {
    /// Joints that run worse with the model after, by the whole interval.
    pub fn worse(&self) -> impl Iterator<Item = &JointFreeRun> {
        let worse = |c: &PositionErrorChange| c.interval_95[0] > 0.0;
        let joints = self.joints.iter();
        joints.filter(move |joint| joint.change.as_ref().is_some_and(worse))
    }
}

/// One joint in one window.
#[derive(Debug, Clone, Copy, Default)]
struct FreeRunSums {
    square: f64,
    moved: f64,
    samples: f64,
    /// Squares at [`SHARES`].
    at: [f64; SHARES.len()],
}

impl FreeRunSums {
    fn rms(&self) -> f64 {
        (self.square / self.samples).sqrt()
    }
}

/// Runs a model, and another after it, in windows of these spans; nothing where they hold too few windows.
pub fn free_run(
    given: &AugmentedModel,
    after: Option<&AugmentedModel>,
    stretches: &[Stretch],
    spans: &[RunSpan],
) -> Option<FreeRun> {
    let windows = windows(stretches, spans);
    if windows.len() < MIN_WINDOWS {
        return None;
    }
    let models: Vec<&AugmentedModel> = std::iter::once(given).chain(after).collect();
    let each = |window: &RunSpan| -> Option<Vec<Vec<FreeRunSums>>> {
        let of = |model: &&AugmentedModel| one(model, &stretches[window.0], *window);
        models.iter().map(of).collect()
    };
    let found: Vec<Option<Vec<Vec<FreeRunSums>>>> = windows.par_iter().map(each).collect();
    let kept: Vec<&Vec<Vec<FreeRunSums>>> = found.iter().flatten().collect();
    let robot = &given.model.robot;
    let joints = robot.joint_names().iter().enumerate().map(|(j, joint)| {
        let of = |model: usize| -> Vec<FreeRunSums> { kept.iter().map(|w| w[model][j]).collect() };
        let (before, then) = (of(0), after.map(|_| of(1)));
        JointFreeRun {
            joint: joint.clone(),
            unit: robot.joint_kind(j).position_unit(),
            change: then.as_ref().and_then(|then| change(&before, then)),
            after: then.map(|then| error(&then)),
            given: error(&before),
        }
    });
    Some(FreeRun {
        window_s: FREE_RUN_S,
        windows: windows.len() as u64,
        astray: (windows.len() - kept.len()) as u64,
        joints: joints.collect(),
    })
}

/// Windows one behind the other, as many as are simulated.
fn windows(stretches: &[Stretch], spans: &[RunSpan]) -> Vec<RunSpan> {
    let mut all = Vec::new();
    for &(s, from, until) in spans {
        let size = (FREE_RUN_S / stretches[s].dt).round() as usize + 1;
        let mut begin = from;
        while size > 1 && begin + size <= until {
            all.push((s, begin, begin + size));
            // the last sample of a window is the first of the next
            begin += size - 1;
        }
    }
    let count = all.len().min(MAX_WINDOWS);
    (0..count).map(|i| all[i * all.len() / count]).collect()
}

/// Errors of every joint in one window; none where the motion goes astray.
fn one(
    model: &AugmentedModel,
    stretch: &Stretch,
    (_, begin, end): RunSpan,
) -> Option<Vec<FreeRunSums>> {
    let mut sums = vec![FreeRunSums::default(); stretch.tau.len()];
    let looked: [usize; SHARES.len()] =
        SHARES.map(|share| begin + (share * (end - 1 - begin) as f64).round() as usize);
    let mut follower = TorqueFollower::new(model, stretch, STEP_S);
    let follows = follower.run((begin, end), &mut |k, found| {
        for (j, s) in sums.iter_mut().enumerate() {
            let q = &stretch.q[j];
            let square = (found[j] - q[k]).powi(2);
            s.square += square;
            s.moved += (q[k] - q[begin]).powi(2);
            s.samples += 1.0;
            for (at, looked) in s.at.iter_mut().zip(looked) {
                if k == looked {
                    *at = square;
                }
            }
        }
    });
    let finite = sums.iter().all(|s| s.square.is_finite());
    (follows && finite).then_some(sums)
}

fn error(windows: &[FreeRunSums]) -> PositionError {
    let sum = |of: fn(&FreeRunSums) -> f64| windows.iter().map(of).sum::<f64>();
    let square = sum(|s| s.square);
    let growth = SHARES.iter().enumerate().map(|(i, share)| {
        let at: f64 = windows.iter().map(|s| s.at[i]).sum();
        ErrorAfter {
            after_s: share * FREE_RUN_S,
            rms: (at / windows.len() as f64).sqrt(),
        }
    });
    PositionError {
        rms: (square / sum(|s| s.samples)).sqrt(),
        relative: (square / sum(|s| s.moved)).sqrt(),
        growth: growth.collect(),
    }
}

/// Mean change of a window's rms, window by window.
fn change(before: &[FreeRunSums], after: &[FreeRunSums]) -> Option<PositionErrorChange> {
    let pairs = before.iter().zip(after);
    let changes: Vec<f64> = pairs.map(|(a, b)| b.rms() - a.rms()).collect();
    let n = changes.len() as f64;
    if changes.len() < MIN_WINDOWS {
        return None;
    }
    let value = changes.iter().sum::<f64>() / n;
    let square: f64 = changes.iter().map(|x| (x - value).powi(2)).sum();
    let half = NORMAL_95 * (square / (n - 1.0) / n).sqrt();
    Some(PositionErrorChange {
        value,
        interval_95: [value - half, value + half],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::open_loop::one_axis::{inertia, sine};

    /// The free run of an inertia, and of another after it, along a sine of 0.2 for so many seconds.
    fn run(seconds: usize, given: f64, after: Option<f64>) -> Option<FreeRun> {
        let along = [sine(2e-3, 500 * seconds)];
        let after = after.map(inertia);
        free_run(
            &inertia(given),
            after.as_ref(),
            &along,
            &[(0, 0, along[0].len())],
        )
    }

    #[test]
    fn a_wrong_mass_errs_more_the_longer_it_runs_and_is_worse_by_its_whole_interval() {
        let right = run(10, 0.2, Some(0.25)).unwrap();
        assert_eq!((right.windows, right.astray), (20, 0));
        let joint = &right.joints[0];
        let after = joint.after.as_ref().unwrap();
        assert!(joint.given.rms < 1e-4 && after.rms > 10.0 * joint.given.rms);
        let growth: Vec<f64> = after.growth.iter().map(|g| g.rms).collect();
        assert!(growth.windows(2).all(|p| p[0] < p[1]), "{growth:?}");
        assert_eq!(right.worse().count(), 1);
        let mended = run(10, 0.25, Some(0.2)).unwrap();
        assert_eq!(mended.worse().count(), 0);
        assert!(mended.joints[0].change.unwrap().interval_95[1] < 0.0);
    }

    #[test]
    fn a_log_of_few_windows_compares_nothing_and_a_long_one_is_looked_at_all_along() {
        assert_eq!(run(1, 0.2, None), None);
        let long = [sine(2e-3, 50_000)];
        let found = windows(&long, &[(0, 0, long[0].len())]);
        assert_eq!(found.len(), MAX_WINDOWS);
        assert!(found[MAX_WINDOWS - 1].1 > 40_000);
    }

    #[test]
    fn a_mass_below_nothing_goes_astray_and_has_no_error() {
        let found = run(10, -0.2, None).unwrap();
        assert_eq!(found.astray, found.windows);
        assert!(found.joints[0].given.rms.is_nan());
    }
}
