//! Gravity's parameters, friction at rest and ratios of gains by least squares over held poses.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Serialize;

use super::HELD;
use super::check::HoldCheck;
use super::error::HeldError;
use super::holds::HeldLog;
use cft_ident_core::judge::{jackknife, width_95};
use cft_ident_core::number;
use cft_ident_core::verdict::{Verdict, verdict_of};
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::escape;

/// A number of gravity with its 95 % interval.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct GravityNumber {
    pub name: String,
    /// Null where these poses do not determine it, or where it is one with the number before it.
    pub value: Option<f64>,
    pub std: Option<f64>,
    pub interval_95: Option<[f64; 2]>,
    pub unit: String,
    pub verdict: Verdict,
    pub meaning: String,
}

/// What is known of a joint at rest.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointAtRest {
    pub joint: String,
    /// Unit of its torque.
    pub unit: String,
    /// Friction at rest: half the difference of both sides. Null where poses were reached from one side alone.
    pub stiction: GravityNumber,
    /// Null where none is fitted.
    pub offset: Option<GravityNumber>,
    /// Gain of its channel over that of the first joint; null where torques are torques, or joints share nothing.
    pub gain: Option<GravityNumber>,
    /// Poses that were reached from below and from above.
    pub from_below: usize,
    pub from_above: usize,
    /// Root mean square of the torque, and of what is left: fitted, and of blocks left out.
    pub torque: f64,
    pub left: f64,
    pub left_held_out: f64,
}

/// Gravity of an arm.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct GravityFit {
    pub poses: usize,
    pub rows_are_poses: bool,
    pub parameters: Vec<GravityNumber>,
    pub joints: Vec<JointAtRest>,
    /// Poses with the torque that is expected there.
    pub checks: Vec<HoldCheck>,
    pub blocks: usize,
    /// Values of all parameters of the robot, 0 where gravity does not ask for them, and which were determined.
    #[serde(skip)]
    pub theta: Vec<f64>,
    #[serde(skip)]
    pub kept: Vec<usize>,
    /// Covariance of the parameters.
    #[serde(skip)]
    pub covariance: Vec<Vec<f64>>,
}

/// Which unknown stands where.
struct HeldUnknowns {
    /// Parameters of the robot.
    kept: Vec<usize>,
    stiction: Vec<Option<usize>>,
    offset: Vec<Option<usize>>,
    gain: Vec<Option<usize>>,
    len: usize,
}

/// One equation: a pose and a joint.
struct HeldEquation {
    pose: usize,
    joint: usize,
    /// Columns of the kept parameters.
    gravity: Vec<f64>,
    side: f64,
    tau: f64,
}

struct HeldProblem {
    equations: Vec<HeldEquation>,
    unknowns: HeldUnknowns,
    weights: Vec<f64>,
    poses: usize,
}

/// Columns that are not one with those before them, the largest first (pivoted Cholesky).
fn independent(gram: &DMatrix<f64>) -> Vec<usize> {
    let n = gram.nrows();
    let scale: Vec<f64> = (0..n).map(|i| gram[(i, i)].sqrt()).collect();
    let largest = scale.iter().copied().fold(0.0, f64::max);
    let mut a = DMatrix::from_fn(n, n, |i, j| match scale[i] * scale[j] > 0.0 {
        true => gram[(i, j)] / (scale[i] * scale[j]),
        false => 0.0,
    });
    let mut kept = Vec::new();
    let mut left: Vec<usize> = (0..n).filter(|i| scale[*i] > 1e-9 * largest).collect();
    while let Some(best) = left
        .iter()
        .copied()
        .max_by(|i, j| a[(*i, *i)].total_cmp(&a[(*j, *j)]))
    {
        if a[(best, best)] <= HELD.singular {
            break;
        }
        left.retain(|i| *i != best);
        kept.push(best);
        let pivot = a[(best, best)];
        let column = a.column(best).into_owned();
        for i in &left {
            for j in &left {
                a[(*i, *j)] -= column[*i] * column[*j] / pivot;
            }
        }
    }
    kept.sort_unstable();
    kept
}

/// Blocks of neighbouring poses.
fn blocks(poses: usize) -> Vec<Range<usize>> {
    let count = poses.clamp(1, 24);
    let end = |k: usize| k * poses / count;
    (0..count).map(|k| end(k)..end(k + 1)).collect()
}

impl HeldProblem {
    /// Fitted with the poses outside `without`; gains by steps of Gauss and Newton from `x`.
    fn solved(&self, without: &Range<usize>, x: &DVector<f64>) -> DVector<f64> {
        let u = &self.unknowns;
        let mut x = x.clone();
        let rounds = if u.gain.iter().any(Option::is_some) {
            20
        } else {
            1
        };
        for _ in 0..rounds {
            let mut normal = DMatrix::<f64>::zeros(u.len, u.len);
            let mut right = DVector::<f64>::zeros(u.len);
            for e in self.equations.iter().filter(|e| !without.contains(&e.pose)) {
                let (row, model) = self.row(e, &x);
                let w = self.weights[e.joint].powi(2);
                normal.ger(w, &row, &row, 1.0);
                right.axpy(w * (e.tau - model), &row, 1.0);
            }
            let scale = normal
                .diagonal()
                .map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
            let scaled =
                DMatrix::from_fn(u.len, u.len, |i, j| normal[(i, j)] * scale[i] * scale[j]);
            let ridge = DMatrix::identity(u.len, u.len) * 1e-10;
            let Some(factor) = (scaled + ridge).cholesky() else {
                return x;
            };
            let step = factor
                .solve(&right.component_mul(&scale))
                .component_mul(&scale);
            let small = step.norm() <= 1e-9 * x.norm();
            x += step;
            if small {
                break;
            }
        }
        x
    }

    /// Derivatives of the torque of an equation by the unknowns, and the torque.
    fn row(&self, e: &HeldEquation, x: &DVector<f64>) -> (DVector<f64>, f64) {
        let u = &self.unknowns;
        let j = e.joint;
        let gain = u.gain[j].map_or(1.0, |at| x[at]);
        let mut row = DVector::zeros(u.len);
        let mut gravity = 0.0;
        for (k, column) in e.gravity.iter().enumerate() {
            row[k] = gain * column;
            gravity += column * x[k];
        }
        let mut model = gain * gravity;
        for (at, column) in [(u.stiction[j], e.side), (u.offset[j], 1.0)] {
            if let Some(at) = at {
                row[at] = column;
                model += column * x[at];
            }
        }
        if let Some(at) = u.gain[j] {
            row[at] = gravity;
        }
        (row, model)
    }

    /// What is left of the equations of the poses in a range.
    fn residual(&self, of: &Range<usize>, x: &DVector<f64>) -> Vec<(usize, f64)> {
        let inside = self.equations.iter().filter(|e| of.contains(&e.pose));
        inside
            .map(|e| (e.joint, e.tau - self.row(e, x).1))
            .collect()
    }
}

fn rms(all: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for x in all {
        sum += x * x;
        count += 1;
    }
    (sum / f64::from(count.max(1))).sqrt()
}

/// Fits gravity to held poses. `currents`: torques are currents without gains of their own.
pub fn fit_gravity(log: &HeldLog, file: &RobotFile, name: &str) -> Result<GravityFit, HeldError> {
    let robot = file.robot();
    let (n, p) = (robot.joints(), robot.parameters().len());
    let zero = vec![0.0; n];
    let mut y = vec![0.0; n * p];
    let mut all: Vec<(usize, usize, Vec<f64>)> = Vec::new();
    let mut gram = DMatrix::<f64>::zeros(p, p);
    for (k, pose) in log.poses.iter().enumerate() {
        robot.regressor(&pose.q, &zero, &zero, &mut y);
        for j in 0..n {
            let row = &y[j * p..(j + 1) * p];
            let of = DVector::from_row_slice(row);
            if pose.tau[j].is_finite() {
                gram.ger(1.0, &of, &of, 1.0);
            }
            all.push((k, j, row.to_vec()));
        }
    }
    let kept = independent(&gram);
    if kept.is_empty() {
        return Err(HeldError::NoGravity {
            robot: name.to_owned(),
        });
    }
    let currents = !file.without_gains().is_empty();
    let mut len = kept.len();
    let mut next = || {
        len += 1;
        Some(len - 1)
    };
    let side = |j: usize, s: f64| log.poses.iter().filter(|pose| pose.side[j] == s).count();
    // two of each side: one alone is an offset
    let both = |j: usize| side(j, 1.0) > 1 && side(j, -1.0) > 1;
    let stiction: Vec<Option<usize>> = (0..n)
        .map(|j| if both(j) { next() } else { None })
        .collect();
    let offset: Vec<Option<usize>> = (0..n)
        .map(|_| if file.friction.offset { next() } else { None })
        .collect();
    let heavy = |j: usize| {
        all.iter()
            .any(|(_, joint, row)| *joint == j && kept.iter().any(|k| row[*k] != 0.0))
    };
    // of the joints that gravity moves, the first one's unit is that of all
    let first = (0..n).find(|j| heavy(*j));
    let gain: Vec<Option<usize>> = (0..n)
        .map(|j| {
            if currents && heavy(j) && Some(j) != first {
                next()
            } else {
                None
            }
        })
        .collect();
    let unknowns = HeldUnknowns {
        kept: kept.clone(),
        stiction,
        offset,
        gain,
        len,
    };
    let equations: Vec<HeldEquation> = all
        .into_iter()
        .filter(|(k, j, _)| log.poses[*k].tau[*j].is_finite())
        .map(|(k, j, row)| HeldEquation {
            pose: k,
            joint: j,
            gravity: kept.iter().map(|at| row[*at]).collect(),
            side: log.poses[k].side[j],
            tau: log.poses[k].tau[j],
        })
        .collect();
    if equations.len() <= unknowns.len {
        return Err(HeldError::NothingDetermined);
    }
    let mut problem = HeldProblem {
        equations,
        unknowns,
        weights: vec![1.0; n],
        poses: log.poses.len(),
    };
    let nothing = 0..0;
    let mut start = DVector::zeros(problem.unknowns.len);
    problem
        .unknowns
        .gain
        .iter()
        .flatten()
        .for_each(|at| start[*at] = 1.0);
    let mut x = problem.solved(&nothing, &start);
    // each joint by its own noise
    let whole = 0..problem.poses;
    let of_joint = |left: &[(usize, f64)], j: usize| {
        rms(left
            .iter()
            .filter(|(joint, _)| *joint == j)
            .map(|(_, e)| *e))
    };
    let torque: Vec<f64> = (0..n)
        .map(|j| {
            rms(problem
                .equations
                .iter()
                .filter(|e| e.joint == j)
                .map(|e| e.tau))
        })
        .collect();
    let left = problem.residual(&whole, &x);
    let largest = torque.iter().copied().fold(0.0, f64::max);
    problem.weights = (0..n)
        .map(|j| 1.0 / of_joint(&left, j).max(1e-4 * largest))
        .collect();
    x = problem.solved(&nothing, &x);
    let parts = blocks(problem.poses);
    let left_out: Vec<DVector<f64>> = parts
        .iter()
        .map(|block| problem.solved(block, &x))
        .collect();
    let v = jackknife(&x, &left_out);
    let left = problem.residual(&whole, &x);
    let held_out: Vec<(usize, f64)> = parts
        .iter()
        .zip(&left_out)
        .flat_map(|(block, x)| problem.residual(block, x))
        .collect();
    let width = width_95(parts.len());
    let number = |at: usize, name: &str, unit: &str, meaning: &str| {
        let (value, std) = (x[at], v[(at, at)].sqrt());
        GravityNumber {
            name: name.to_owned(),
            value: Some(value),
            std: Some(std),
            interval_95: Some([value - width * std, value + width * std]),
            unit: unit.to_owned(),
            verdict: verdict_of(value, std),
            meaning: meaning.to_owned(),
        }
    };
    let unit_of = |j: usize| file.torque_unit(j).to_owned();
    let common = file.inertial_torque_unit();
    let mut parameters = Vec::new();
    let mut theta = vec![0.0; p];
    for (k, at) in kept.iter().enumerate() {
        let info = &robot.parameters()[*at];
        theta[*at] = x[k];
        let unit = cft_ident_files::config::identified::inertia_unit(&robot, &info.unit, common);
        parameters.push(number(k, &info.name, &unit, &info.meaning));
    }
    let names = robot.joint_names();
    let u = &problem.unknowns;
    let open = |name: &str, unit: &str| GravityNumber {
        name: name.to_owned(),
        value: None,
        std: None,
        interval_95: None,
        unit: unit.to_owned(),
        verdict: Verdict::NotIdentifiable,
        meaning: "poses were reached from one side alone".to_owned(),
    };
    let joints: Vec<JointAtRest> = (0..n)
        .map(|j| {
            let unit = unit_of(j);
            let found = |at: Option<usize>, name: &str, unit: &str, meaning: &str| {
                at.map(|at| number(at, name, unit, meaning))
            };
            let gain = found(
                u.gain[j],
                "gain",
                "1",
                "gain of the channel over that of the first joint that gravity moves",
            );
            let (torque, left, left_held_out) =
                (torque[j], of_joint(&left, j), of_joint(&held_out, j));
            JointAtRest {
                joint: names[j].clone(),
                stiction: found(u.stiction[j], "stiction", &unit, "friction at rest")
                    .unwrap_or_else(|| open("stiction", &unit)),
                offset: found(u.offset[j], "offset", &unit, "constant torque"),
                gain,
                from_below: side(j, 1.0),
                from_above: side(j, -1.0),
                torque,
                left,
                left_held_out,
                unit,
            }
        })
        .collect();
    // a joint that is heavy beside the others and of which most is left
    let bad = joints
        .iter()
        .find(|j| j.torque > 0.3 * largest && j.left > HELD.explained * j.torque);
    if let Some(bad) = bad {
        return Err(HeldError::NotGravity {
            joint: escape(&bad.joint),
            left: number::percent(bad.left / bad.torque),
        });
    }
    let expected = |k: usize, j: usize| {
        let e = problem
            .equations
            .iter()
            .find(|e| e.pose == k && e.joint == j)?;
        let (row, model) = problem.row(e, &x);
        let mut held = row.clone();
        let friction = u.stiction[j].map(|at| {
            held[at] = 0.0;
            x[at].abs()
        });
        let own = u.stiction[j].map_or(0.0, |at| e.side * x[at]);
        let std = (held.dot(&(&v * &held))).max(0.0).sqrt();
        let noise = joints[j].left_held_out;
        Some([
            model - own,
            friction.unwrap_or(0.0) + width * std.hypot(noise),
        ])
    };
    let checks = super::check::checks(log, names, &|j| unit_of(j), &expected);
    Ok(GravityFit {
        poses: log.poses.len(),
        rows_are_poses: log.rows_are_poses,
        parameters,
        joints,
        checks,
        blocks: parts.len(),
        theta,
        covariance: (0..kept.len())
            .map(|i| (0..kept.len()).map(|j| v[(i, j)]).collect())
            .collect(),
        kept: u.kept.clone(),
    })
}
