//! Errors of a model over the rows of one use, as `validate` counts them, with block-bootstrap intervals.

use schemars::JsonSchema;
use serde::Serialize;

use crate::diagnose::problem::case::DiagnosisCase;
use crate::diagnose::problem::data_split::{DataSplit, LogRole};
use crate::diagnose::problem::rests::{resting, standing};
use crate::effect::AugmentedModel;
use crate::math::bootstrap::intervals_95;
use crate::math::relative_error as ratio;
use crate::motion::MotionError;
use crate::robot::model::JointFriction;

/// Errors of one joint.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct JointErrors {
    pub joint: String,
    pub unit: String,
    pub rmse: f64,
    pub relative_error: f64,
    /// The same of the rows in which the joint moves; null where there are none.
    pub relative_error_moving: Option<f64>,
    /// The same of the rows in which it rests.
    pub relative_error_rest: Option<f64>,
    /// Bootstrap interval of the relative error while the joint moves; of all rows where it never does.
    pub interval_95: [f64; 2],
    pub relative_error_raw: f64,
    pub max_abs: f64,
    pub r2: f64,
    pub samples: u64,
    /// Squared residual a row, of the rows that the headline counts.
    #[serde(skip)]
    pub(crate) power: f64,
}

/// Errors over all joints.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct OverallErrors {
    /// Stacked norms; none where the joints' units differ.
    pub relative_error: Option<f64>,
    /// The same of the rows in which each joint moves.
    pub relative_error_moving: Option<f64>,
    /// The same of the rows in which each joint rests.
    pub relative_error_rest: Option<f64>,
    /// Root mean square over joints of their relative errors.
    pub mean_relative_error: f64,
    /// The same of the rows in which each joint moves: the headline.
    pub mean_relative_error_moving: f64,
    /// Bootstrap interval of that.
    pub interval_95: [f64; 2],
}

impl JointErrors {
    /// The error that counts: of the rows in which the joint moves, of all where it never does.
    pub fn headline(&self) -> f64 {
        self.relative_error_moving.unwrap_or(self.relative_error)
    }
}

/// Errors over the rows of one use.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "Errors")]
pub struct UseErrors {
    pub joints: Vec<JointErrors>,
    pub overall: OverallErrors,
}

/// Relative error of one joint before and after a change of the model, over the same rows: those in which it moves.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct JointChange {
    pub joint: String,
    pub before: f64,
    pub after: f64,
    /// 95 % CI of after less before, by a bootstrap over blocks of both.
    pub interval_95: [f64; 2],
    /// The interval lies above zero.
    pub worsened: bool,
}

impl JointChange {
    /// Whether it worsened by this part of the error: with rows enough any change is surely above zero.
    pub(crate) fn noticeably_worse(&self, noticeable: f64) -> bool {
        self.worsened && self.after - self.before > noticeable * self.before
    }
}

/// Errors of every joint over pieces, `[piece][joint]`.
pub type ErrorsByPiece = Vec<Vec<PieceErrors>>;

/// Sums of one joint over one piece.
#[derive(Debug, Clone, Copy, Default)]
pub struct PieceErrors {
    error: f64,
    torque: f64,
    mean: f64,
    rows: f64,
    largest: f64,
    raw_error: f64,
    raw_torque: f64,
    /// Squared error and torque, and number, of the rows in which the joint rests.
    rest: [f64; 3],
    /// The same of those in which it moves, weighed as a fit does.
    moving: [f64; 3],
}

const SEED: u64 = 20_020_520;

/// Errors of a model over the pieces of a role, all rows of them or without those in which a joint stands.
pub fn pieces(
    model: &AugmentedModel,
    case: &DiagnosisCase,
    split: &DataSplit,
    (wanted, moving): (LogRole, bool),
) -> Result<ErrorsByPiece, MotionError> {
    let n = model.model.robot.joints();
    let mut pieces = ErrorsByPiece::new();
    for (index, stretch) in case.stretches.iter().enumerate() {
        let own = split.pieces.iter();
        let own = own.filter(|p| p.stretch == index && p.role == wanted);
        if own.clone().next().is_none() {
            continue;
        }
        let parallel = case.filters.of(stretch);
        let hat = model.reconstruct(stretch);
        // samples where a joint turns or stands count less in its error while it moves, as in a fit
        let by_weight = stretch.tau.iter().chain(&hat).enumerate().map(|(c, x)| {
            let (j, friction) = (c % n, &model.model.friction);
            match friction[j] {
                JointFriction::None => x.clone(),
                _ => {
                    let weights = parallel.weights(stretch, j, case.rest_speed[j]);
                    x.iter().zip(weights).map(|(x, w)| x * w).collect()
                }
            }
        });
        let by_weight: Vec<Vec<f64>> = by_weight.collect();
        let channels = stretch.tau.iter().chain(&hat).chain(&by_weight);
        let channels: Vec<&[f64]> = channels.map(Vec::as_slice).collect();
        let rows = parallel.run(&channels)?;
        let resting = resting(model, stretch, parallel, &case.rest_speed)?;
        let still = |j| match moving {
            true => standing(model, stretch, parallel, j),
            false => vec![false; parallel.rows(stretch.len())],
        };
        let still: Vec<Vec<bool>> = (0..n).map(still).collect();
        for piece in own {
            let joint = |j: usize| {
                let mut s = PieceErrors::default();
                if split.is_stationary(index, j) {
                    return s;
                }
                for i in piece.rows.clone().filter(|i| !still[j][*i]) {
                    let (measured, e) = (rows[j][i], rows[j][i] - rows[n + j][i]);
                    s.error += e * e;
                    s.torque += measured * measured;
                    s.mean += measured;
                    s.rows += 1.0;
                    s.largest = s.largest.max(e.abs());
                    let (of, own) = match resting[j][i] {
                        true => ([e, measured], &mut s.rest),
                        false => {
                            let [tau, hat] = [&rows[2 * n + j], &rows[3 * n + j]].map(|x| x[i]);
                            ([tau - hat, tau], &mut s.moving)
                        }
                    };
                    let [e, measured] = of;
                    let squares = [e * e, measured * measured, 1.0];
                    own.iter_mut().zip(squares).for_each(|(sum, x)| *sum += x);
                }
                let first = parallel.sample_of(piece.rows.start);
                let last = parallel.sample_of(piece.rows.end).min(stretch.len());
                let raw = stretch.tau[j][first..last].iter();
                for (measured, hat) in raw.zip(&hat[j][first..last]) {
                    s.raw_error += (measured - hat).powi(2);
                    s.raw_torque += measured * measured;
                }
                s
            };
            pieces.push((0..n).map(joint).collect());
        }
    }
    Ok(pieces)
}

/// Relative error of every joint over those of the pieces that were picked, of the rows in which it moves, or of all
/// where it never does.
fn relative(pieces: &[Vec<PieceErrors>], picked: &[usize]) -> Vec<f64> {
    let joints = 0..pieces.first().map_or(0, Vec::len);
    let of_joint = |j: usize| {
        let sum = |of: fn(&PieceErrors) -> f64| -> f64 {
            picked.iter().map(|p| of(&pieces[*p][j])).sum()
        };
        match sum(|s| s.moving[2]) > 0.0 {
            true => ratio(sum(|s| s.moving[0]), sum(|s| s.moving[1])),
            false => ratio(sum(|s| s.error), sum(|s| s.torque)),
        }
    };
    joints.map(of_joint).collect()
}

/// Root mean square over joints of their relative errors.
fn mean(errors: &[f64]) -> f64 {
    let known = || errors.iter().filter(|e| e.is_finite());
    (known().map(|e| e * e).sum::<f64>() / known().count() as f64).sqrt()
}

/// The same over all pieces; none where there is none.
pub fn mean_relative_error(pieces: &ErrorsByPiece) -> Option<f64> {
    let all: Vec<usize> = (0..pieces.len()).collect();
    (!all.is_empty()).then(|| mean(&relative(pieces, &all)))
}

/// What a change does to the errors of each joint that has one; the bootstrap draws `block` neighbouring pieces at a time.
pub fn changes(
    joints: &[String],
    (before, after): (&ErrorsByPiece, &ErrorsByPiece),
    block: usize,
) -> Vec<JointChange> {
    let count = before.len();
    if count == 0 {
        return Vec::new();
    }
    let of = |picked: &[usize]| [relative(before, picked), relative(after, picked)];
    let all: Vec<usize> = (0..count).collect();
    let [had, has] = of(&all);
    let intervals = intervals_95(count, block, SEED, &mut |picked| {
        let [before, after] = of(picked);
        after.iter().zip(before).map(|(a, b)| a - b).collect()
    });
    let named = joints.iter().zip(had.into_iter().zip(has)).zip(intervals);
    let change = named.map(|((joint, (before, after)), interval_95)| JointChange {
        joint: joint.clone(),
        before,
        after,
        interval_95,
        worsened: interval_95[0] > 0.0,
    });
    change.filter(|c| c.before.is_finite()).collect()
}

/// Errors over pieces; none where there is none.
pub fn summed(case: &DiagnosisCase, (pieces, block): (&ErrorsByPiece, usize)) -> Option<UseErrors> {
    let units = &case.units;
    let n = units.len();
    if pieces.is_empty() {
        return None;
    }
    let all: Vec<usize> = (0..pieces.len()).collect();
    let found = relative(pieces, &all);
    let intervals = intervals_95(pieces.len(), block, SEED, &mut |picked| {
        let mut errors = relative(pieces, picked);
        errors.push(mean(&errors));
        errors
    });
    // squared error and torque, and number of rows, of joint j: moving, resting
    let sum = |j: usize, of: fn(&PieceErrors) -> f64| pieces.iter().map(|p| of(&p[j])).sum::<f64>();
    let parts = |j: usize| -> [[f64; 3]; 2] {
        let sum = |of| sum(j, of);
        let moving = [
            sum(|s| s.moving[0]),
            sum(|s| s.moving[1]),
            sum(|s| s.moving[2]),
        ];
        let rest = [sum(|s| s.rest[0]), sum(|s| s.rest[1]), sum(|s| s.rest[2])];
        [moving, rest]
    };
    let part = |[error, torque, rows]: [f64; 3]| (rows > 0.0).then(|| ratio(error, torque));
    let of_joint = |j: usize| {
        let sum = |of| sum(j, of);
        let rows = sum(|s| s.rows);
        let scatter = sum(|s| s.torque) - sum(|s| s.mean).powi(2) / rows.max(1.0);
        let [moving, rest] = parts(j).map(part);
        JointErrors {
            joint: case.given.model.robot.joint_names()[j].clone(),
            unit: units[j].clone(),
            rmse: (sum(|s| s.error) / rows.max(1.0)).sqrt(),
            relative_error: ratio(sum(|s| s.error), sum(|s| s.torque)),
            relative_error_moving: moving,
            relative_error_rest: rest,
            interval_95: intervals[j],
            relative_error_raw: ratio(sum(|s| s.raw_error), sum(|s| s.raw_torque)),
            max_abs: pieces.iter().map(|p| p[j].largest).fold(0.0, f64::max),
            r2: match scatter > 0.0 {
                true => 1.0 - sum(|s| s.error) / scatter,
                false => f64::NAN,
            },
            samples: rows as u64,
            power: {
                let [moving, rest] = parts(j);
                let [error, _, rows] = if moving[2] > 0.0 { moving } else { rest };
                error / rows.max(1.0)
            },
        }
    };
    let joints: Vec<JointErrors> = (0..n).map(of_joint).collect();
    let one_unit = units.iter().all(|u| *u == units[0]);
    let pooled = |k: usize| {
        let add = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + b[i]);
        let all = (0..n).map(|j| parts(j)[k]).fold([0.0; 3], add);
        one_unit.then(|| part(all)).flatten()
    };
    let total = |of: fn(&PieceErrors) -> f64| pieces.iter().flatten().map(of).sum::<f64>();
    Some(UseErrors {
        overall: OverallErrors {
            relative_error: one_unit.then(|| ratio(total(|s| s.error), total(|s| s.torque))),
            relative_error_moving: pooled(0),
            relative_error_rest: pooled(1),
            mean_relative_error: mean(&joints.iter().map(|j| j.relative_error).collect::<Vec<_>>()),
            mean_relative_error_moving: mean(&found),
            interval_95: intervals[n],
        },
        joints,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Many pieces of one joint with the same torque, whose errors scatter a little.
    fn pieces(error: f64) -> ErrorsByPiece {
        let piece = |k: usize| PieceErrors {
            error: (error * (1.0 + 0.001 * (k % 3) as f64)).powi(2),
            torque: 1.0,
            rows: 1.0,
            ..PieceErrors::default()
        };
        (0..60).map(|k| vec![piece(k)]).collect()
    }

    #[test]
    fn a_change_that_is_surely_above_zero_and_far_too_small_to_matter_is_distinguished() {
        let joints = ["q4".to_owned()];
        let of = |after: f64| changes(&joints, (&pieces(0.00146), &pieces(after)), 1).remove(0);
        let tiny = of(0.001461);
        assert!(tiny.worsened && tiny.interval_95[0] > 0.0, "{tiny:?}");
        assert!(!tiny.noticeably_worse(0.02), "{tiny:?}");
        assert!(of(0.0032).noticeably_worse(0.02));
        let better = of(0.0013);
        assert!(!better.worsened && !better.noticeably_worse(0.02));
    }
}
