//! Where a joint with a jump in its friction law stands or turns: static friction takes any torque up to its limit
//! there, and no law of v says which.

use crate::effect::AugmentedModel;
use crate::motion::{FilterDesign, MotionError, Stretch, rest};
use crate::robot::model::JointFriction;

/// Speed below which a joint counts as standing, over its rms speed.
const STANDING: f64 = 0.01;

/// Rows in which a joint with a jump in its friction law stands still for as long as the filter remembers.
pub(crate) fn standing(
    model: &AugmentedModel,
    stretch: &Stretch,
    parallel: &FilterDesign,
    j: usize,
) -> Vec<bool> {
    let rows = 0..parallel.rows(stretch.len());
    if !model.model.friction[j].jumps() {
        return vec![false; rows.len()];
    }
    let v = &stretch.v[j];
    let square = v.iter().map(|v| v * v).sum::<f64>() / v.len().max(1) as f64;
    let slow = STANDING * square.sqrt();
    // samples since the joint last moved, and until it moves again
    let next = |count: &mut usize, v: &f64| {
        *count = if v.abs() > slow { 0 } else { *count + 1 };
        Some(*count)
    };
    let far = usize::MAX / 2;
    let mut stands: Vec<usize> = v.iter().scan(far, next).collect();
    let after = v.iter().rev().scan(far, next);
    for (stands, after) in stands.iter_mut().rev().zip(after) {
        *stands = after.min(*stands);
    }
    rows.map(|i| stands[parallel.sample_of(i)] > parallel.decimation)
        .collect()
}

/// Rows in which each joint rests, as `validate` finds them, `[joint][row]`; none of joints without friction.
pub(crate) fn resting(
    model: &AugmentedModel,
    stretch: &Stretch,
    parallel: &FilterDesign,
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
