//! What a motion says about the parameters: the stacked regressor (42), reduced.

use nalgebra::DMatrix;

use cft_ident_core::math::jacobi::SvdFactors;
use cft_ident_core::math::rank;
use cft_ident_core::math::rfactor::RFactor;
use cft_ident_core::robot::RobotError;

use super::criterion::Criterion;
use super::machine::ForeseenRobot;
use super::objective::{NoValue, PriorInformation};
use super::series::{Kinematics, Series};

/// R factors of the rows of each joint along a motion.
#[derive(Debug, Clone)]
pub struct InformationFactors {
    /// Upper triangles, p x p.
    pub joints: Vec<DMatrix<f64>>,
    /// Rows per joint.
    pub rows: u64,
}

impl InformationFactors {
    /// Of whole periods of a series, at `samples` equal steps of one period.
    ///
    /// # Errors
    /// [`RobotError`] where the machine cannot follow.
    pub fn of_period(
        machine: &ForeseenRobot,
        series: &Series,
        samples: usize,
    ) -> Result<Self, RobotError> {
        let step = series.period() / samples as f64;
        Self::of_path(machine, samples, &|m| series.at(step * m as f64))
    }

    /// Of any motion, given by its samples.
    pub(super) fn of_path(
        machine: &ForeseenRobot,
        samples: usize,
        at: &dyn Fn(usize) -> Kinematics,
    ) -> Result<Self, RobotError> {
        let (n, p) = (machine.coordinates(), machine.unknowns());
        let mut factors = vec![RFactor::new(p); n];
        let mut y = vec![0.0; n * p];
        for m in 0..samples {
            let state = machine.joints(&at(m))?;
            machine.exact_rows(&state, &mut y);
            for (factor, row) in factors.iter_mut().zip(y.chunks_exact(p)) {
                factor.fold(row);
            }
        }
        Ok(Self {
            joints: factors.iter().map(RFactor::r).collect(),
            rows: samples as u64,
        })
    }

    /// R factor of all joints' rows, joint j's times `weights[j]`.
    pub fn stacked(&self, weights: &[f64]) -> DMatrix<f64> {
        let p = self.joints.first().map_or(0, DMatrix::ncols);
        let mut factor = RFactor::new(p);
        let mut row = vec![0.0; p];
        for (r, weight) in self.joints.iter().zip(weights) {
            for i in 0..p {
                for (c, x) in row.iter_mut().enumerate() {
                    *x = weight * r[(i, c)];
                }
                factor.fold(&row);
            }
        }
        factor.r()
    }

    /// The criterion as it is: the condition number itself, -log det / p, or log of the trace;
    /// smaller is better.
    ///
    /// # Errors
    /// [`NoValue`] where the rows are not finite.
    pub fn value(
        &self,
        machine: &ForeseenRobot,
        criterion: &Criterion,
        prior: Option<&PriorInformation>,
    ) -> Result<f64, NoValue> {
        let weights = match criterion.weighted() {
            true => machine.weights(),
            false => vec![1.0; machine.coordinates()],
        };
        let r = self.stacked(&weights);
        if prior.is_none() {
            match criterion {
                Criterion::Condition => return Ok(rank::condition(&rank::svd(&r)?.s)),
                Criterion::ConditionNormalised => return Ok(rank::condition(&normalised(&r)?.s)),
                _ => {}
            }
        }
        let mut g = r.tr_mul(&r);
        if let Some(prior) = prior {
            g *= prior.rows / self.rows as f64;
            g += &prior.information;
        }
        let value = criterion.slope(&g, f64::INFINITY)?.value;
        Ok(match criterion {
            Criterion::Condition | Criterion::ConditionNormalised => value.exp(),
            _ => value,
        })
    }
}

/// Singular values of the columns scaled to norm 1; columns of zeros stay.
pub(super) fn normalised(r: &DMatrix<f64>) -> Result<SvdFactors, NoValue> {
    let mut scaled = r.clone();
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    Ok(rank::svd(&scaled)?)
}
