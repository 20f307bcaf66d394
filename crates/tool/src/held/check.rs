//! Poses to hold, with the torque that the model expects there: whether it is right shows on the arm in a minute.

use schemars::JsonSchema;
use serde::Serialize;

use super::holds::HeldLog;

/// Torque of a joint in a pose.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ExpectedTorque {
    pub joint: String,
    /// Position \[m or rad\].
    pub position: f64,
    /// Torque that holds it, and how far it may be off: friction at rest, and the model's own interval.
    pub expected: f64,
    pub within: f64,
    pub measured: f64,
    pub unit: String,
}

/// A pose to hold.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct HoldCheck {
    /// Number of the held pose in the log, from 1.
    pub pose: usize,
    pub joints: Vec<ExpectedTorque>,
}

/// Poses that are shown.
const SHOWN: usize = 3;

/// The poses of the log in which joints carry most, each for another joint.
pub(super) fn checks(
    log: &HeldLog,
    names: &[String],
    unit: &dyn Fn(usize) -> String,
    expected: &dyn Fn(usize, usize) -> Option<[f64; 2]>,
) -> Vec<HoldCheck> {
    let n = names.len();
    let mut chosen: Vec<usize> = Vec::new();
    for j in 0..n {
        let carried = |k: &usize| expected(*k, j).map_or(0.0, |[tau, _]| tau.abs());
        let free = (0..log.poses.len()).filter(|k| !chosen.contains(k));
        let most = free.max_by(|a, b| carried(a).total_cmp(&carried(b)));
        if let Some(k) = most.filter(|k| carried(k) > 0.0 && chosen.len() < SHOWN) {
            chosen.push(k);
        }
    }
    let check = |k: usize| HoldCheck {
        pose: log.poses[k].number,
        joints: (0..n)
            .filter_map(|j| {
                let [value, within] = expected(k, j)?;
                Some(ExpectedTorque {
                    joint: names[j].clone(),
                    position: log.poses[k].q[j],
                    expected: value,
                    within,
                    measured: log.poses[k].tau[j],
                    unit: unit(j),
                })
            })
            .collect(),
    };
    chosen.into_iter().map(check).collect()
}
