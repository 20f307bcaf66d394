//! Where a joint with a jump in its friction law stands or turns: static friction takes any torque there.

use crate::effect::AugmentedModel;
use crate::motion::{MotionError, Parallel, Stretch, rest};
use crate::robot::model::JointFriction;

/// Speed below which a joint counts as standing, over its rms speed.
const STANDING: f64 = 0.01;

/// Rows in which a joint with a jump in its friction law stands still for as long as the filter
/// remembers: static friction takes any torque up to its limit there, and no law of v says which.
pub(crate) fn standing(
    model: &AugmentedModel,
    stretch: &Stretch,
    parallel: &Parallel,
    j: usize,
) -> Vec<usize> {
    if !model.model.friction[j].jumps() {
        return Vec::new();
    }
    let v = &stretch.v[j];
    let slow = slow(v);
    // samples since the joint last moved, and until it moves again
    let mut since = vec![0usize; v.len()];
    let mut count = usize::MAX / 2;
    for (k, v) in v.iter().enumerate() {
        count = if v.abs() > slow { 0 } else { count + 1 };
        since[k] = count;
    }
    count = usize::MAX / 2;
    for (k, v) in v.iter().enumerate().rev() {
        count = if v.abs() > slow { 0 } else { count + 1 };
        since[k] = since[k].min(count);
    }
    (0..parallel.rows(stretch.len()))
        .filter(|i| since[parallel.sample_of(*i)] > parallel.decimation)
        .collect()
}

/// Speed below which a joint counts as standing.
fn slow(v: &[f64]) -> f64 {
    let square = v.iter().map(|v| v * v).sum::<f64>() / v.len().max(1) as f64;
    STANDING * square.sqrt()
}

/// Rows in which each joint rests, as `validate` finds them, `[joint][row]`; none of joints without friction.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn resting(
    model: &AugmentedModel,
    stretch: &Stretch,
    parallel: &Parallel,
    rest_speed: &[f64],
) -> Result<Vec<Vec<bool>>, MotionError> {
    let rows = parallel.rows(stretch.len());
    let of_joint = |(j, speed): (usize, &f64)| {
        if model.model.friction[j] == JointFriction::None {
            return Ok(vec![false; rows]);
        }
        let speeds = stretch.v[j].iter();
        let moving: Vec<f64> = speeds.map(|v| rest::movement(*v, *speed)).collect();
        let filtered = parallel.run(&[&moving])?;
        Ok(filtered[0].iter().map(|m| rest::rests(*m)).collect())
    };
    rest_speed.iter().enumerate().map(of_joint).collect()
}
