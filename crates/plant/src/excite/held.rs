//! Poses to hold for gravity: within limits, links apart, each reached from both sides, and together as telling as
//! can be found among those that were drawn.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::ExciteError;
use super::limits::Quantity;
use super::machine::ForeseenRobot;
use super::usage::check_pose;

/// A pose, and the two from which its joints come to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseToHold {
    /// \[m or rad\]
    pub at: Vec<f64>,
    pub below: Vec<f64>,
    pub above: Vec<f64>,
}

/// Poses that are drawn for each that is wanted.
const DRAWN: usize = 40;
/// Part of the range that stays free at both ends.
const MARGIN: f64 = 0.05;
/// Part of the range from which a joint comes.
const APPROACH: f64 = 0.04;
/// Part of the information that is there before the first pose: poses of all kinds come first.
const RIDGE: f64 = 1e-6;

/// `count` poses of a robot.
///
/// # Errors
/// A coordinate without a range, or limits that leave no pose.
pub fn poses_to_hold(
    machine: &ForeseenRobot,
    count: usize,
    seed: u64,
) -> Result<Vec<PoseToHold>, ExciteError> {
    let robot = &machine.model.robot;
    let (n, p) = (robot.joints(), robot.parameters().len());
    let names = machine.coordinate_names();
    let mut ranges = Vec::with_capacity(names.len());
    for (i, name) in names.iter().enumerate() {
        let of = machine.channels.iter().find(|c| {
            c.index == i && matches!(c.quantity, Quantity::Position | Quantity::JointPosition)
        });
        let range = of
            .map(|c| [c.lower, c.upper])
            .filter(|r| r.iter().all(|x| x.is_finite()));
        ranges.push(range.ok_or_else(|| ExciteError::NoTravel {
            coordinate: name.clone(),
        })?);
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let zero = vec![0.0; n];
    let draw = |random: &mut ChaCha8Rng| -> Vec<f64> {
        let of = |[low, high]: &[f64; 2]| {
            low + (high - low) * (MARGIN + (1.0 - 2.0 * MARGIN) * random.random::<f64>())
        };
        ranges.iter().map(of).collect()
    };
    let mut candidates: Vec<(Vec<f64>, DMatrix<f64>)> = Vec::new();
    for _ in 0..DRAWN * count {
        let q = draw(&mut random);
        let mut y = vec![0.0; n * p];
        robot.regressor(&q, &zero, &zero, &mut y);
        candidates.push((q, DMatrix::from_row_slice(n, p, &y)));
    }
    // columns that gravity fills, each by its own size
    let mut scale = DVector::<f64>::zeros(p);
    for (_, y) in &candidates {
        for k in 0..p {
            scale[k] += y.column(k).norm_squared();
        }
    }
    let kept: Vec<usize> = (0..p).filter(|k| scale[*k] > 1e-12 * scale.max()).collect();
    for (_, y) in &mut candidates {
        let own = y.clone();
        *y = DMatrix::from_fn(n, kept.len(), |i, k| {
            own[(i, kept[k])] / scale[kept[k]].sqrt()
        });
    }
    let mut information = DMatrix::<f64>::identity(kept.len(), kept.len()) * RIDGE;
    let mut out = Vec::with_capacity(count);
    let mut last = None;
    while out.len() < count && !candidates.is_empty() {
        let Some(inverse) = information.clone().try_inverse() else {
            break;
        };
        // log det(M + Y'Y) grows by log det(I + Y M^-1 Y')
        let gain = |y: &DMatrix<f64>| {
            (DMatrix::identity(n, n) + y * &inverse * y.transpose()).determinant()
        };
        let best = (0..candidates.len())
            .max_by(|a, b| gain(&candidates[*a].1).total_cmp(&gain(&candidates[*b].1)));
        let Some(best) = best else { break };
        let (at, y) = candidates.swap_remove(best);
        let beside = |sign: f64| -> Vec<f64> {
            let all = at.iter().zip(&ranges);
            all.map(|(q, [low, high])| q + sign * APPROACH * (high - low))
                .collect()
        };
        let pose = PoseToHold {
            below: beside(-1.0),
            above: beside(1.0),
            at,
        };
        let checked = [&pose.below, &pose.at, &pose.above]
            .into_iter()
            .try_for_each(|q| check_pose(machine, q));
        match checked {
            Err(error) => last = Some(error),
            Ok(()) => {
                information += y.transpose() * &y;
                out.push(pose);
            }
        }
    }
    match (out.len() < count, last) {
        (true, Some(error)) => Err(error),
        _ => Ok(ordered(out, &ranges)),
    }
}

/// The poses in an order of short ways.
fn ordered(mut poses: Vec<PoseToHold>, ranges: &[[f64; 2]]) -> Vec<PoseToHold> {
    let apart = |a: &PoseToHold, b: &PoseToHold| -> f64 {
        let all = a.at.iter().zip(&b.at).zip(ranges);
        all.map(|((x, y), [low, high])| ((x - y) / (high - low)).powi(2))
            .sum()
    };
    for k in 1..poses.len() {
        let next = (k..poses.len()).min_by(|a, b| {
            let from = &poses[k - 1];
            apart(from, &poses[*a]).total_cmp(&apart(from, &poses[*b]))
        });
        if let Some(next) = next {
            poses.swap(k, next);
        }
    }
    poses
}
