//! Which joint a log moves, and whether its motion can show friction at all.

use crate::explain::Explain;
use schemars::JsonSchema;
use serde::Serialize;

use super::prepare::{SmoothedMotion, rms};

/// Why a log cannot give a joint's friction. Each message says what motion is missing.
#[derive(Debug, Clone, PartialEq, Explain, thiserror::Error)]
pub enum FrictionError {
    #[explain(
        "no joint moves in this log: the largest travel is {travel:.3e} of a joint's range",
        "log an experiment in which one joint runs back and forth"
    )]
    NothingMoves { travel: f64 },
    #[explain(
        "joints {first} and {second} both move ({first_share:.0} % and {second_share:.0} % of their ranges), so it is open which joint this log is about",
        "name it with --joint, or log one joint at a time"
    )]
    SeveralMove {
        first: String,
        second: String,
        first_share: f64,
        second_share: f64,
    },
    #[explain(
        "joint {joint} does not move in this log, or its torque is zero throughout",
        "log it moving back and forth"
    )]
    StandsStill { joint: String },
    #[explain(
        "joint {joint} never reverses (speeds from {least:.4} to {most:.4}): Coulomb friction cannot be separated from a constant torque",
        "log it in both directions"
    )]
    NeverReverses {
        joint: String,
        least: f64,
        most: f64,
    },
    #[explain(
        "the log of joint {joint} holds {samples} samples in which it moves, too few for {unknowns} unknowns",
        "log longer"
    )]
    TooShort {
        joint: String,
        samples: usize,
        unknowns: usize,
    },
    #[explain(
        "the filter found no finite estimate for joint {joint} from any start",
        "inspect the log's torque and position channels"
    )]
    NoEstimate { joint: String },
    #[explain(
        "the friction law of joint {joint} explains nothing: it leaves {left:.0} % of the torque, and no friction at all {without:.0} %",
        "check the torque channel, its unit and sign, and the velocities; log slow reversals with torques well above their noise"
    )]
    ExplainsNothing {
        joint: String,
        left: f64,
        without: f64,
    },
    #[explain(
        "the friction of joint {joint} comes out below zero: over the speeds covered it drives the joint",
        "check the sign of the torque or the position; a torque that gravity or a spring holds against the friction does the same"
    )]
    Drives { joint: String },
}

/// Share of its range that a joint must travel to count as moving.
const MOVES: f64 = 0.02;
/// A second joint that travels more than this share of what the first does makes the log ambiguous.
const AMBIGUOUS: f64 = 0.3;

/// The joint that moves. `range` is each joint's full travel [m or rad]; ones where unknown.
pub fn moving_joint(
    names: &[String],
    motions: &[SmoothedMotion],
    range: &[f64],
) -> Result<usize, FrictionError> {
    let n = names.len();
    let share = |j: usize| {
        // as measured: smoothing leaves rounding errors in what stands still
        let measured = motions.iter().flat_map(|m| m.measured.iter());
        let q = measured.skip(j).step_by(n).copied();
        let (lo, hi) = (
            q.clone().fold(f64::INFINITY, f64::min),
            q.fold(f64::NEG_INFINITY, f64::max),
        );
        if hi > lo { (hi - lo) / range[j] } else { 0.0 }
    };
    let share: Vec<f64> = (0..n).map(share).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| share[*b].total_cmp(&share[*a]));
    let first = order[0];
    if share[first] < MOVES {
        return Err(FrictionError::NothingMoves {
            travel: share[first],
        });
    }
    if let Some(&second) = order.get(1)
        && share[second] > AMBIGUOUS * share[first]
    {
        return Err(FrictionError::SeveralMove {
            first: names[first].clone(),
            second: names[second].clone(),
            first_share: 100.0 * share[first],
            second_share: 100.0 * share[second],
        });
    }
    Ok(first)
}

/// Speeds that the moving joint reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Speeds")]
pub struct SpeedCoverage {
    /// Smallest and largest speed with data in either direction [1/s].
    #[serde(rename = "speeds_covered")]
    pub covered: [f64; 2],
}

/// Checks that a joint's velocity shows friction: both directions, enough samples.
pub fn speeds(
    joint: &str,
    velocity: &[f64],
    unknowns: usize,
) -> Result<SpeedCoverage, FrictionError> {
    let size = rms(velocity.iter().copied());
    let moving = |v: &&f64| v.abs() > 1e-3 * size;
    let samples = velocity.iter().filter(moving).count();
    if samples < 20 * unknowns {
        return Err(FrictionError::TooShort {
            joint: joint.to_owned(),
            samples,
            unknowns,
        });
    }
    let direction = |positive: bool| {
        let own = velocity
            .iter()
            .filter(moving)
            .filter(|v| (**v > 0.0) == positive);
        let mut v: Vec<f64> = own.map(|v| v.abs()).collect();
        v.sort_by(f64::total_cmp);
        v
    };
    let (forward, backward) = (direction(true), direction(false));
    let least = samples / 20;
    if forward.len() < least || backward.len() < least {
        let signed = |v: &Vec<f64>, s: f64| v.last().map_or(0.0, |x| s * x);
        return Err(FrictionError::NeverReverses {
            joint: joint.to_owned(),
            least: signed(&backward, -1.0),
            most: signed(&forward, 1.0),
        });
    }
    let at = |v: &[f64], share: f64| v[((v.len() - 1) as f64 * share) as usize];
    Ok(SpeedCoverage {
        covered: [
            at(&forward, 0.02).max(at(&backward, 0.02)),
            at(&forward, 0.995).min(at(&backward, 0.995)),
        ],
    })
}
