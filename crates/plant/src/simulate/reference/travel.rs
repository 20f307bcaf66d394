//! How far and how fast one joint can move alone.

use crate::simulate::SimulateError;
use crate::simulate::mechanism::Mechanism;

/// Room of one joint around a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointTravel {
    /// Lower and upper end, m or rad.
    pub range: (f64, f64),
    /// Speed at which the first motor reaches its own limit somewhere on the way, m/s or rad/s.
    pub top_speed: f64,
}

/// Poses tried along the way.
const POSES: usize = 400;
/// Largest joint travel that is looked for, m or rad.
const FARTHEST: f64 = 20.0;

/// Finds how far joint `moving` can go from `pose` while the others stay, with a distance of `margin`
/// (a fraction of each span) to the limits of every motor coordinate, and how fast, given the motors'
/// top speeds.
///
/// # Errors
/// [`SimulateError::LimitAtStart`] when the pose itself lies within the margin of a limit.
pub fn travel<const J: usize>(
    mechanism: &Mechanism<J>,
    pose: &[f64; J],
    moving: usize,
    margin: f64,
    motor_speeds: &[f64; J],
) -> Result<JointTravel, SimulateError> {
    let (lower, upper) = (mechanism.lower, mechanism.upper);
    let outside = |q: &[f64; J]| {
        let x = mechanism.coordinates(q);
        (0..J).find(|&i| {
            let gap = margin * (upper[i] - lower[i]);
            let gap = if gap.is_finite() { gap } else { 0.0 };
            !(lower[i] + gap..=upper[i] - gap).contains(&x[i])
        })
    };
    if let Some(i) = outside(pose) {
        return Err(mechanism.beyond_at_start(i, mechanism.coordinates(pose)[i]));
    }
    let at = |offset: f64| {
        let mut q = *pose;
        q[moving] += offset;
        q
    };
    // The first exit on each side: walk in small steps, then halve the last one.
    let reach = |direction: f64| {
        let step = direction * FARTHEST / 4096.0;
        let mut inside = 0.0;
        for k in 1..=4096 {
            let next = f64::from(k) * step;
            if outside(&at(next)).is_some() {
                let mut beyond = next;
                for _ in 0..50 {
                    let middle = 0.5 * (inside + beyond);
                    let left = outside(&at(middle)).is_some();
                    *(if left { &mut beyond } else { &mut inside }) = middle;
                }
                break;
            }
            inside = next;
        }
        inside
    };
    let (low, high) = (reach(-1.0), reach(1.0));
    let mut unit = [0.0; J];
    unit[moving] = 1.0;
    let mut top_speed = f64::INFINITY;
    for k in 0..=POSES {
        let q = at(low + (high - low) * k as f64 / POSES as f64);
        let speeds = mechanism.coordinate_speeds(&q, &unit);
        for (speed, motor) in speeds.iter().zip(motor_speeds) {
            top_speed = top_speed.min(motor / speed.abs());
        }
    }
    Ok(JointTravel {
        range: (pose[moving] + low, pose[moving] + high),
        top_speed,
    })
}

/// The middle part of a range.
pub fn middle_part((low, high): (f64, f64), part: f64) -> (f64, f64) {
    let (middle, half) = (0.5 * (low + high), 0.5 * part * (high - low));
    if part == 1.0 {
        return (low, high);
    }
    (middle - half, middle + half)
}
