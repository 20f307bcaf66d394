//! The least squares over held poses.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::HELD;
use super::error::HeldError;
use super::holds::HeldLog;
use cft_ident_core::judge::{GroupError, kept_groups};
use cft_ident_files::config::RobotFile;

/// Which unknown stands where.
pub(super) struct HeldUnknowns {
    /// Parameters of the robot.
    pub kept: Vec<usize>,
    pub stiction: Vec<Option<usize>>,
    pub offset: Vec<Option<usize>>,
    pub gain: Vec<Option<usize>>,
    pub len: usize,
}

/// One equation: a pose and a joint.
pub(super) struct HeldEquation {
    pub pose: usize,
    pub joint: usize,
    /// Columns of the kept parameters.
    gravity: Vec<f64>,
    pub side: f64,
    pub tau: f64,
}

pub(super) struct HeldProblem {
    pub equations: Vec<HeldEquation>,
    pub unknowns: HeldUnknowns,
    /// Of each joint: one over what is left of it.
    weights: Vec<f64>,
    pub poses: usize,
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
pub(super) fn blocks(poses: usize) -> Vec<Range<usize>> {
    let count = poses.clamp(1, 24);
    let end = |k: usize| k * poses / count;
    (0..count).map(|k| end(k)..end(k + 1)).collect()
}

impl HeldProblem {
    /// The equations of the poses of a log, and what is unknown in them.
    pub fn of(log: &HeldLog, file: &RobotFile, name: &str) -> Result<Self, HeldError> {
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
        let side = |j: usize, s: f64| log.count_poses_from_side(j, s);
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
        Ok(HeldProblem {
            equations,
            unknowns,
            weights: vec![1.0; n],
            poses: log.poses.len(),
        })
    }

    /// Normal matrix and right side at `x`, of the poses that are taken.
    fn normal(
        &self,
        takes: &dyn Fn(usize) -> bool,
        x: &DVector<f64>,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let u = &self.unknowns;
        let mut normal = DMatrix::<f64>::zeros(u.len, u.len);
        let mut right = DVector::<f64>::zeros(u.len);
        for e in self.equations.iter().filter(|e| takes(e.pose)) {
            let (row, model) = self.row(e, x);
            let w = self.weights[e.joint].powi(2);
            normal.ger(w, &row, &row, 1.0);
            right.axpy(w * (e.tau - model), &row, 1.0);
        }
        (normal, right)
    }

    /// Fitted with the poses that are taken; gains by steps of Gauss and Newton from `x`.
    pub fn solved(&self, takes: &dyn Fn(usize) -> bool, x: &DVector<f64>) -> DVector<f64> {
        let mut x = x.clone();
        let curved = self.unknowns.gain.iter().any(Option::is_some);
        for _ in 0..if curved { 20 } else { 1 } {
            let (normal, right) = self.normal(takes, &x);
            let scale = scale_of(&normal);
            let Some(factor) = scaled(&normal, &scale).cholesky() else {
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

    /// What the fit to the poses that are kept leaves of each pose, joint by joint.
    fn left_by(&self, kept: &[bool], x: &DVector<f64>) -> Option<Vec<Vec<GroupError>>> {
        let takes = |pose: usize| kept[pose];
        let x = self.solved(&takes, x);
        let (normal, _) = self.normal(&takes, &x);
        let scale = scale_of(&normal);
        let factor = scaled(&normal, &scale).cholesky()?;
        let joints = self.weights.len();
        let mut out = vec![vec![GroupError::default(); joints]; self.poses];
        for e in &self.equations {
            let (row, model) = self.row(e, &x);
            let row = row.component_mul(&scale);
            let leverage = self.weights[e.joint].powi(2) * row.dot(&factor.solve(&row));
            out[e.pose][e.joint] = GroupError {
                square: (e.tau - model).powi(2),
                expected: match kept[e.pose] {
                    true => (1.0 - leverage).max(0.0),
                    false => 1.0 + leverage,
                },
            };
        }
        Some(out)
    }

    /// Which poses belong together; none where all do.
    pub fn kept_poses(&self) -> Option<Vec<bool>> {
        let x = self.fitted();
        kept_groups(self.poses, |kept| self.left_by(kept, &x))
    }

    /// Fitted to all poses.
    pub fn fitted(&self) -> DVector<f64> {
        let mut start = DVector::zeros(self.unknowns.len);
        let gains = self.unknowns.gain.iter().flatten();
        gains.for_each(|at| start[*at] = 1.0);
        self.solved(&|_| true, &start)
    }

    /// Weighs each joint by its own noise; `torque` is that of each joint.
    pub fn weigh_joints(&mut self, torque: &[f64]) {
        let left = self.residual(&(0..self.poses), &self.fitted());
        let largest = torque.iter().copied().fold(0.0, f64::max);
        let of = |j: usize| 1.0 / of_joint(&left, j).max(1e-4 * largest);
        self.weights = (0..torque.len()).map(of).collect();
    }

    /// Derivatives of the torque of an equation by the unknowns, and the torque.
    pub fn row(&self, e: &HeldEquation, x: &DVector<f64>) -> (DVector<f64>, f64) {
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
    pub fn residual(&self, of: &Range<usize>, x: &DVector<f64>) -> Vec<(usize, f64)> {
        let inside = self.equations.iter().filter(|e| of.contains(&e.pose));
        inside
            .map(|e| (e.joint, e.tau - self.row(e, x).1))
            .collect()
    }
}

/// One over the root of each diagonal entry.
fn scale_of(normal: &DMatrix<f64>) -> DVector<f64> {
    normal
        .diagonal()
        .map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 })
}

/// A normal matrix in scaled unknowns, with a ridge.
fn scaled(normal: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    let n = scale.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    scaled + DMatrix::identity(n, n) * 1e-10
}

/// Root mean square of the errors of a joint.
pub(super) fn of_joint(left: &[(usize, f64)], j: usize) -> f64 {
    rms(left
        .iter()
        .filter(|(joint, _)| *joint == j)
        .map(|(_, e)| *e))
}

pub(super) fn rms(all: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for x in all {
        sum += x * x;
        count += 1;
    }
    (sum / f64::from(count.max(1))).sqrt()
}
