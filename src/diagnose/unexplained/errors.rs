//! Errors of a model over the rows of one use, as `validate` counts them, with block-bootstrap
//! intervals.

use schemars::JsonSchema;
use serde::Serialize;

use crate::diagnose::problem::data_split::{DataSplit, RowRole};
use crate::diagnose::problem::rests::{resting, standing};
use crate::effect::AugmentedModel;
use crate::math::bootstrap::intervals_95;
use crate::motion::{MotionError, ParallelFilters, Stretch};

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
    /// Bootstrap interval of the relative error.
    pub interval_95: [f64; 2],
    pub relative_error_raw: f64,
    pub max_abs: f64,
    pub r2: f64,
    pub samples: u64,
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
    /// Bootstrap interval of the mean relative error.
    pub interval_95: [f64; 2],
}

/// Errors over the rows of one use.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Errors {
    pub joints: Vec<JointErrors>,
    pub overall: OverallErrors,
}

/// Sums of one joint over one piece.
#[derive(Debug, Clone, Copy, Default)]
struct PieceErrors {
    error: f64,
    torque: f64,
    mean: f64,
    rows: f64,
    largest: f64,
    raw_error: f64,
    raw_torque: f64,
    /// Squared error and torque, and number, of the rows in which the joint rests.
    rest: [f64; 3],
}

/// Seed of the bootstrap.
const SEED: u64 = 20_020_520;

/// Which rows of the pieces count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Counted {
    /// All of them, as `validate` counts.
    All,
    /// Without those in which friction at rest takes whatever the torque is.
    Moving,
}

/// Errors of a model over the pieces whose role is wanted; none where there is no such piece.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn errors(
    model: &AugmentedModel,
    units: &[String],
    stretches: &[Stretch],
    (filters, rest_speed): (&ParallelFilters, &[f64]),
    split: &DataSplit,
    (wanted, counted): (&dyn Fn(RowRole) -> bool, Counted),
) -> Result<Option<Errors>, MotionError> {
    let n = model.model.robot.joints();
    let mut pieces: Vec<Vec<PieceErrors>> = Vec::new();
    for (index, stretch) in stretches.iter().enumerate() {
        let own = split
            .pieces
            .iter()
            .filter(|p| p.stretch == index && wanted(p.role));
        let own: Vec<_> = own.collect();
        if own.is_empty() {
            continue;
        }
        let parallel = filters.of(stretch);
        let hat = model.reconstruct(stretch);
        let channels: Vec<&[f64]> = stretch.tau.iter().chain(&hat).map(Vec::as_slice).collect();
        let rows = parallel.run(&channels)?;
        let resting = resting(model, stretch, parallel, rest_speed)?;
        let mut still = vec![vec![false; parallel.rows(stretch.len())]; n];
        if counted == Counted::Moving {
            for (j, still) in still.iter_mut().enumerate() {
                for i in standing(model, stretch, parallel, j) {
                    still[i] = true;
                }
            }
        }
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
                    if resting[j][i] {
                        let rest = [e * e, measured * measured, 1.0];
                        s.rest.iter_mut().zip(rest).for_each(|(sum, x)| *sum += x);
                    }
                }
                let first = parallel.sample_of(piece.rows.start);
                let last = parallel.sample_of(piece.rows.end).min(stretch.len());
                for (measured, hat) in stretch.tau[j][first..last].iter().zip(&hat[j][first..last])
                {
                    s.raw_error += (measured - hat).powi(2);
                    s.raw_torque += measured * measured;
                }
                s
            };
            pieces.push((0..n).map(joint).collect());
        }
    }
    if pieces.is_empty() {
        return Ok(None);
    }
    Ok(Some(summed(model, units, &pieces)))
}

fn summed(model: &AugmentedModel, units: &[String], pieces: &[Vec<PieceErrors>]) -> Errors {
    let n = units.len();
    let ratio = |a: f64, b: f64| if b > 0.0 { (a / b).sqrt() } else { f64::NAN };
    let relative = |picked: &[usize]| -> Vec<f64> {
        (0..n)
            .map(|j| {
                let sum =
                    |of: fn(&PieceErrors) -> f64| picked.iter().map(|p| of(&pieces[*p][j])).sum();
                ratio(sum(|s| s.error), sum(|s| s.torque))
            })
            .collect()
    };
    let mean = |errors: &[f64]| {
        let known = || errors.iter().filter(|e| e.is_finite());
        (known().map(|e| e * e).sum::<f64>() / known().count() as f64).sqrt()
    };
    let all: Vec<usize> = (0..pieces.len()).collect();
    let found = relative(&all);

    // neighbours together: the residual's slow part reaches over some pieces
    let block = (pieces.len() / 20).clamp(1, 4);
    let intervals = intervals_95(pieces.len(), block, SEED, &mut |picked| {
        let mut errors = relative(picked);
        errors.push(mean(&errors));
        errors
    });
    // squared error and torque, and number of rows, of joint j: moving, resting
    let parts = |j: usize| -> [[f64; 3]; 2] {
        let sum = |of: fn(&PieceErrors) -> f64| pieces.iter().map(|p| of(&p[j])).sum::<f64>();
        let all = [sum(|s| s.error), sum(|s| s.torque), sum(|s| s.rows)];
        let rest = [sum(|s| s.rest[0]), sum(|s| s.rest[1]), sum(|s| s.rest[2])];
        [std::array::from_fn(|k| (all[k] - rest[k]).max(0.0)), rest]
    };
    let part = |[error, torque, rows]: [f64; 3]| (rows > 0.0).then(|| ratio(error, torque));
    let joints: Vec<JointErrors> = (0..n)
        .map(|j| {
            let sum = |of: fn(&PieceErrors) -> f64| pieces.iter().map(|p| of(&p[j])).sum::<f64>();
            let rows = sum(|s| s.rows);
            let scatter = sum(|s| s.torque) - sum(|s| s.mean).powi(2) / rows.max(1.0);
            JointErrors {
                joint: model.model.robot.joint_names()[j].clone(),
                unit: units[j].clone(),
                rmse: (sum(|s| s.error) / rows.max(1.0)).sqrt(),
                relative_error: found[j],
                relative_error_moving: part(parts(j)[0]),
                relative_error_rest: part(parts(j)[1]),
                interval_95: intervals[j],
                relative_error_raw: ratio(sum(|s| s.raw_error), sum(|s| s.raw_torque)),
                max_abs: pieces.iter().map(|p| p[j].largest).fold(0.0, f64::max),
                r2: if scatter > 0.0 {
                    1.0 - sum(|s| s.error) / scatter
                } else {
                    f64::NAN
                },
                samples: rows as u64,
            }
        })
        .collect();
    let one_unit = units.iter().all(|u| *u == units[0]);
    let pooled = |k: usize| {
        let add = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + b[i]);
        let all = (0..n).map(|j| parts(j)[k]).fold([0.0; 3], add);
        one_unit.then(|| part(all)).flatten()
    };
    let total = |of: fn(&PieceErrors) -> f64| pieces.iter().flatten().map(of).sum::<f64>();
    Errors {
        overall: OverallErrors {
            relative_error: one_unit.then(|| ratio(total(|s| s.error), total(|s| s.torque))),
            relative_error_moving: pooled(0),
            relative_error_rest: pooled(1),
            mean_relative_error: mean(&found),
            interval_95: intervals[n],
        },
        joints,
    }
}
