//! The bilinear problem on R factors: its unknowns, residuals and derivatives.

use nalgebra::{DMatrix, DVector};

use super::GainRows;
use crate::inertia::accumulate::BlockFactors;
use crate::inertia::columns::RegressorColumns;
use crate::inertia::solution::FitError;
use crate::math::rank;
use crate::math::rfactor::RFactor;
use crate::robot::Robot;
use crate::robot::standard::STANDARD;

/// What a body at the last link adds to the base parameters.
#[derive(Debug, Clone)]
pub struct PayloadColumns {
    /// Base parameters of 1 kg in the origin of the link's frame, p.
    mass: DVector<f64>,
    /// Orthonormal columns that span those of its first moments and its inertia, p x r.
    rest: DMatrix<f64>,
}

/// Singular values below this share of the largest are rounding: entries are lengths and their squares.
const SPAN: f64 = 1e-9;

impl PayloadColumns {
    /// Of a body that is fixed to the last link of a robot.
    ///
    /// # Errors
    /// [`FitError::Math`].
    pub fn of(robot: &Robot) -> Result<Self, FitError> {
        let map = robot.standard_map();
        let first = STANDARD * map.links.len().saturating_sub(1);
        // the mass is the last of a link's standard parameters
        let mass = map.matrix.column(first + STANDARD - 1).into_owned();
        let moments = map.matrix.columns(first, STANDARD - 1).into_owned();
        let svd = rank::svd(&moments)?;
        let kept = svd.s.iter().filter(|s| **s > SPAN * svd.s[0]).count();
        Ok(PayloadColumns {
            mass,
            rest: svd.u.columns(0, kept).into_owned(),
        })
    }

    /// Whether the mass shows beside any centre and inertia.
    pub fn shows_mass(&self) -> bool {
        let beside = &self.mass - &self.rest * self.rest.tr_mul(&self.mass);
        beside.norm() > SPAN * self.mass.norm()
    }

    /// Mass and the rest, p x (1 + r).
    fn columns(&self) -> DMatrix<f64> {
        let mut all = self.rest.clone().insert_column(0, 0.0);
        all.set_column(0, &self.mass);
        all
    }
}

/// One of the two sets of logs.
pub(super) struct LogSet<'a> {
    pub factors: &'a BlockFactors,
    /// R factor of each joint's rows.
    pub joints: Vec<DMatrix<f64>>,
    pub loaded: bool,
}

/// Residual and its derivatives by the unknowns of one joint's triangle.
pub(super) struct Rows {
    /// Derivatives of the model by \[c_j | theta | load | psi_j\].
    pub slopes: DMatrix<f64>,
    pub residual: DVector<f64>,
}

/// Unknowns are \[c (n) | theta (p) | load: mass, rest | psi of each joint\].
pub(super) struct GainProblem<'a> {
    pub columns: &'a RegressorColumns,
    pub sets: Vec<LogSet<'a>>,
    /// Base parameters of the payload's unknowns, p x loads.
    pub load: DMatrix<f64>,
    /// Root mean square of each joint's channel.
    pub channel_rms: Vec<f64>,
    /// Rows of each joint in which it moves.
    pub rows: Vec<f64>,
}

impl<'a> GainProblem<'a> {
    pub fn new(rows: &GainRows<'a>) -> Result<Self, FitError> {
        let columns = &rows.unloaded.columns;
        let p = columns.shared;
        let set = |factors: &'a BlockFactors, loaded: bool| LogSet {
            factors,
            joints: (0..columns.joints).map(|j| factors.joint(j)).collect(),
            loaded,
        };
        let mut sets = vec![set(rows.unloaded, false)];
        let mut load = DMatrix::zeros(p, 0);
        if let Some((factors, payload)) = rows.loaded {
            sets.push(set(factors, true));
            load = payload.columns();
        }
        let moving = |j: usize| sets.iter().map(move |s| s.factors.moving[j]);
        let count = |j: usize| moving(j).map(|rows| rows.count as f64).sum();
        let counts: Vec<f64> = (0..columns.joints).map(count).collect();
        let rms = |(j, count): (usize, &f64)| {
            let square: f64 = moving(j).map(|rows| rows.torque_square).sum();
            (square / count.max(1.0)).sqrt()
        };
        let channel_rms: Vec<f64> = counts.iter().enumerate().map(rms).collect();
        // each set must determine its own unknowns, and each joint its gain
        for set in &sets {
            let rows = set.factors.moving.iter().map(|rows| rows.count).max();
            let (rows, unknowns) = (rows.unwrap_or(0), columns.unknowns());
            if rows < 2 * unknowns as u64 {
                return Err(FitError::TooFewRows { rows, unknowns });
            }
        }
        if channel_rms.iter().any(|rms| *rms <= 0.0) {
            return Err(FitError::NothingExcited);
        }
        Ok(GainProblem {
            columns,
            load,
            rows: counts,
            channel_rms,
            sets,
        })
    }

    pub fn joints(&self) -> usize {
        self.columns.joints
    }

    pub fn loads(&self) -> usize {
        self.load.ncols()
    }

    pub fn unknowns(&self) -> usize {
        self.joints() + self.columns.unknowns() + self.loads()
    }

    /// Index of the payload's mass among the unknowns.
    pub fn mass(&self) -> usize {
        self.joints() + self.columns.shared
    }

    /// Index among the unknowns of column `c` of joint j's slopes.
    pub fn unknown(&self, j: usize, c: usize) -> usize {
        let (n, shared) = (self.joints(), self.columns.shared + self.loads());
        match c {
            0 => j,
            c if c <= shared => n + c - 1,
            c => n + self.loads() + self.columns.first_own(j) + c - 1 - shared,
        }
    }

    /// Residual and slopes of joint j's triangle `r`, of which the last column is the channel.
    pub fn rows_of(&self, x: &DVector<f64>, r: &DMatrix<f64>, j: usize, loaded: bool) -> Rows {
        let (n, p, loads) = (self.joints(), self.columns.shared, self.loads());
        let own = self.columns.own[j].len();
        let (shared, own_columns) = (r.columns(0, p), r.columns(p, own));
        let mut theta = x.rows(n, p).into_owned();
        if loaded {
            theta += &self.load * x.rows(n + p, loads);
        }
        let torque = shared * theta;
        let psi = DVector::from_fn(own, |c, _| x[self.unknown(j, 1 + p + loads + c)]);
        let residual = r.column(r.ncols() - 1) - &torque * x[j] - own_columns * psi;
        let mut slopes = DMatrix::zeros(r.nrows(), 1 + p + loads + own);
        slopes.set_column(0, &torque);
        slopes.columns_mut(1, p).copy_from(&(shared * x[j]));
        if loaded {
            let load = shared * &self.load * x[j];
            slopes.columns_mut(1 + p, loads).copy_from(&load);
        }
        let mut of_own = slopes.columns_mut(1 + p + loads, own);
        of_own.copy_from(&own_columns);
        Rows { slopes, residual }
    }

    /// R factor of \[slopes | residual\] of all joints' rows, each joint times its weight, columns in the
    /// order of the unknowns.
    pub fn linearised(&self, x: &DVector<f64>, weights: &[f64]) -> DMatrix<f64> {
        let u = self.unknowns();
        let mut factor = RFactor::new(u + 1);
        let mut row = vec![0.0; u + 1];
        for set in &self.sets {
            for (j, r) in set.joints.iter().enumerate() {
                let rows = self.rows_of(x, r, j, set.loaded);
                for i in 0..r.nrows() {
                    row.fill(0.0);
                    for c in 0..rows.slopes.ncols() {
                        row[self.unknown(j, c)] = weights[j] * rows.slopes[(i, c)];
                    }
                    row[u] = weights[j] * rows.residual[i];
                    factor.fold(&row);
                }
            }
        }
        factor.r()
    }

    /// Standard deviation of each joint's residual in the channel's unit.
    pub fn residual_std(&self, x: &DVector<f64>) -> Vec<f64> {
        let std = |j: usize| {
            let residual = |s: &LogSet| self.rows_of(x, &s.joints[j], j, s.loaded).residual;
            let squares = self.sets.iter().map(|s| residual(s).norm_squared());
            let floor = 1e-9 * self.channel_rms[j];
            (squares.sum::<f64>() / self.rows[j].max(1.0))
                .sqrt()
                .max(floor)
        };
        (0..self.joints()).map(std).collect()
    }
}
