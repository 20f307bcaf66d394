//! The function that a search makes small: a criterion, and the limits by an augmented Lagrangian,
//! with the derivative by every coefficient.
//!
//! The regressor is differentiated along the path by the coordinates themselves. It is linear in
//! the accelerations and quadratic in the speeds, so that differences by these are exact; by the
//! positions a five-point rule is good to 1e-11. The sum that is differentiated is one number per
//! sample, 2 (F S) . F + sum kappa c, with S and kappa fixed: the chain rule through the singular
//! vectors and the multipliers.

use cft_ident_core::explain::Explain;
use nalgebra::DMatrix;

use cft_ident_core::math::MathError;
use cft_ident_core::robot::RobotError;

use super::criterion::{Criterion, Slope};
use super::limits::BoundedQuantity;
use super::machine::{ForeseenRobot, LinearisedFriction, State};
use super::series::{HarmonicBasis, Kinematics, MAX_COORDINATES, Series};
use super::usage::along_period;
use super::variables::DesignVariables;

/// Step in a position, as a share of half its span.
const STEP_SHARE_OF_SPAN: f64 = 2e-3;

/// Samples of a limit for each of the regressor.
const FINER: usize = 4;

/// Why a point has no value.
#[derive(Debug, Clone, PartialEq, Explain, thiserror::Error)]
pub enum NoValue {
    #[explain(_0.explanation())]
    Robot(#[from] RobotError),
    #[explain(_0.explanation())]
    Math(#[from] MathError),
}

/// Information that is there before the design, and how much the design adds.
#[derive(Debug, Clone)]
pub struct PriorInformation {
    /// F'F of the logs that exist, rows weighted as the criterion wants them (p x p).
    pub information: DMatrix<f64>,
    /// Rows per joint that the design will add.
    pub rows: f64,
}

/// Multipliers and weight of the augmented Lagrangian.
#[derive(Debug, Clone)]
pub(super) struct LagrangeMultipliers {
    /// One per constraint of [`Objective::constraints`].
    pub lambda: Vec<f64>,
    /// Weight rho of a violation's square.
    pub weight: f64,
}

/// The function and all that it needs.
#[derive(Debug, Clone)]
pub(super) struct Objective<'a> {
    pub machine: &'a ForeseenRobot,
    pub criterion: &'a Criterion,
    pub variables: DesignVariables,
    pub prior: Option<&'a PriorInformation>,
    /// Samples at which the regressor is taken.
    basis: HarmonicBasis,
    /// Samples at which limits are kept: friction turns round between those of the regressor.
    fine: HarmonicBasis,
    /// Linear channels, then the others, as the search keeps them.
    linear: Vec<BoundedQuantity>,
    curved: Vec<BoundedQuantity>,
    /// Weight of each joint's rows.
    weights: Vec<f64>,
}

/// What an evaluation writes into: nothing is allocated per sample.
#[derive(Debug, Clone)]
pub(super) struct ObjectiveWorkspace {
    pub series: Series,
    states: Vec<State>,
    /// Beside them, where differences are taken.
    beside: State,
    lines: Vec<LinearisedFriction>,
    /// Rows of the fit, sample after sample.
    rows: Vec<f64>,
    weights: Vec<f64>,
    shifted: Vec<f64>,
    kappas: Vec<f64>,
    by_coefficients: Vec<f64>,
}

impl<'a> Objective<'a> {
    /// `channels` are the limits as the search keeps them; `samples` those of the period.
    pub fn new(
        machine: &'a ForeseenRobot,
        criterion: &'a Criterion,
        channels: &[BoundedQuantity],
        variables: DesignVariables,
        prior: Option<&'a PriorInformation>,
        samples: usize,
    ) -> Self {
        let (linear, curved) =
            (channels.iter().cloned()).partition(|c: &BoundedQuantity| c.quantity.is_linear());
        let weights = match criterion.weighted() {
            true => machine.noise.iter().map(|s| 1.0 / (s * s)).collect(),
            false => vec![1.0; machine.coordinates()],
        };
        Self {
            machine,
            criterion,
            prior,
            basis: HarmonicBasis::new(samples, variables.harmonics),
            fine: HarmonicBasis::new(FINER * samples, variables.harmonics),
            linear,
            curved,
            weights,
            variables,
        }
    }

    /// The same with the curved limits tightened that the motion at z exceeds by more than a share; `None` without any.
    pub(super) fn tightened(&self, z: &[f64], most: f64) -> Option<Self> {
        let mut series = self.work().series;
        self.variables.series(z, &mut series);
        let uses = along_period(self.machine, &self.curved, &series);
        let mut any = false;
        let mut out = self.clone();
        for (channel, found) in out.curved.iter_mut().zip(uses) {
            if found.share > 1.0 + most && found.share.is_finite() {
                any = true;
                *channel = channel.reserved(1.0 - 1.0 / found.share);
            }
        }
        any.then_some(out)
    }

    /// Empty buffers.
    pub fn work(&self) -> ObjectiveWorkspace {
        let (n, p) = (self.machine.coordinates(), self.machine.unknowns());
        let samples = self.basis.samples;
        let rest = self.machine.linearised(&State::EMPTY);
        ObjectiveWorkspace {
            series: Series::still(self.variables.fundamental, n, self.variables.harmonics),
            states: vec![State::EMPTY; samples],
            beside: State::EMPTY,
            lines: vec![rest; samples],
            rows: vec![0.0; samples * n * p],
            weights: vec![0.0; n * p],
            shifted: vec![0.0; n * p],
            kappas: vec![0.0; self.curved.len()],
            by_coefficients: vec![0.0; n * (1 + 2 * self.variables.harmonics)],
        }
    }

    /// Number of constraints: two sides of every channel at every sample.
    pub(super) fn constraints(&self) -> usize {
        2 * (self.linear.len() + self.curved.len()) * self.fine.samples
    }

    /// Rows of the fit along the period, and F'F of them (with the prior).
    fn information(&self, work: &mut ObjectiveWorkspace) -> Result<DMatrix<f64>, NoValue> {
        let (n, p) = (self.machine.coordinates(), self.machine.unknowns());
        let mut g = DMatrix::zeros(p, p);
        for m in 0..self.basis.samples {
            let k = self.kinematics(&self.basis, &work.series, m);
            let state = &mut work.states[m];
            self.machine.follow(&k, state)?;
            let line = self.machine.linearised(state);
            let y = &mut work.rows[m * n * p..(m + 1) * n * p];
            self.machine.rows(state, &line, false, y)?;
            for (row, weight) in y.chunks_exact(p).zip(&self.weights) {
                for j in 0..p {
                    let scaled = weight * row[j];
                    for (i, other) in row[..=j].iter().enumerate() {
                        g[(i, j)] += scaled * other;
                    }
                }
            }
            work.lines[m] = line;
        }
        g.fill_lower_triangle_with_upper_triangle();
        if let Some(prior) = self.prior {
            g *= prior.rows / self.basis.samples as f64;
            g += &prior.information;
        }
        Ok(g)
    }

    /// Value at z; writes the derivative by z into `gradient`. `sharpness` is that of
    /// [`Criterion::slope`].
    ///
    /// # Errors
    /// [`NoValue`] where the machine cannot reach a sample.
    pub fn evaluate(
        &self,
        z: &[f64],
        sharpness: f64,
        multipliers: &LagrangeMultipliers,
        work: &mut ObjectiveWorkspace,
        gradient: &mut [f64],
    ) -> Result<f64, NoValue> {
        self.variables.series(z, &mut work.series);
        let g = self.information(work)?;
        let Slope { value, matrix } = self.criterion.slope(&g, sharpness)?;
        let mut total = value;
        work.by_coefficients.fill(0.0);
        total += self.linear_penalty(multipliers, work);
        total += self.curved_penalty(multipliers, work)?;
        self.along_the_path(&matrix, work)?;
        self.variables.pull_back(&work.by_coefficients, gradient);
        Ok(total)
    }

    /// Penalty of the linear channels, with its derivative.
    fn linear_penalty(
        &self,
        multipliers: &LagrangeMultipliers,
        work: &mut ObjectiveWorkspace,
    ) -> f64 {
        let width = 1 + 2 * self.variables.harmonics;
        let (mut total, mut at) = (0.0, 0);
        for channel in &self.linear {
            let (i, d) = (channel.index, channel.quantity.derivative().unwrap_or(0));
            for m in 0..self.fine.samples {
                let value = self.fine.at(&work.series, i, m)[d];
                let mut by_value = 0.0;
                for (g, slope) in channel.constraints(value) {
                    let (penalty, kappa) = multipliers.penalty(at, g);
                    total += penalty;
                    by_value += kappa * slope;
                    at += 1;
                }
                if by_value != 0.0 {
                    let mut by = [0.0; 3];
                    by[d] = by_value;
                    let out = &mut work.by_coefficients[i * width..(i + 1) * width];
                    self.fine.pull_back(work.series.fundamental, m, by, out);
                }
            }
        }
        total
    }

    /// The criterion's derivative, by way of the rows.
    fn along_the_path(
        &self,
        slope: &DMatrix<f64>,
        work: &mut ObjectiveWorkspace,
    ) -> Result<(), NoValue> {
        let (n, p) = (self.machine.coordinates(), self.machine.unknowns());
        let rows = self
            .prior
            .map_or(1.0, |prior| prior.rows / self.basis.samples as f64);
        for m in 0..self.basis.samples {
            let y = &work.rows[m * n * p..(m + 1) * n * p];
            let pairs = y.chunks_exact(p).zip(work.weights.chunks_exact_mut(p));
            for ((row, out), weight) in pairs.zip(&self.weights) {
                for (k, out) in out.iter_mut().enumerate() {
                    let column = slope.column(k);
                    let sum: f64 = row.iter().zip(column.iter()).map(|(y, s)| y * s).sum();
                    *out = 2.0 * rows * weight * sum;
                }
            }
            let state = work.states[m];
            let line = work.lines[m];
            let mut local = SampleObjective {
                objective: self,
                line: &line,
                weights: Some(&work.weights),
                kappas: &[],
                rows: &mut work.shifted,
                state: &mut work.beside,
            };
            let by = local.derivatives(&state)?;
            self.basis
                .pull_back_all(work.series.fundamental, m, &by, &mut work.by_coefficients);
        }
        Ok(())
    }

    /// Penalty of the channels that are not linear, with its derivative.
    fn curved_penalty(
        &self,
        multipliers: &LagrangeMultipliers,
        work: &mut ObjectiveWorkspace,
    ) -> Result<f64, NoValue> {
        let mut total = 0.0;
        let mut at = 2 * self.linear.len() * self.fine.samples;
        if self.curved.is_empty() {
            return Ok(total);
        }
        let mut state = State::EMPTY;
        for m in 0..self.fine.samples {
            let k = self.kinematics(&self.fine, &work.series, m);
            self.machine.fill(&k, &mut state)?;
            let (mut pressed, quantities) = (false, self.machine.quantities(&state));
            for (channel, sum) in self.curved.iter().zip(&mut work.kappas) {
                *sum = 0.0;
                let value = quantities.of(channel);
                for (g, slope) in channel.constraints(value) {
                    let (penalty, kappa) = multipliers.penalty(at, g);
                    total += penalty;
                    *sum += kappa * slope;
                    pressed |= kappa > 0.0;
                    at += 1;
                }
            }
            if pressed {
                let line = self.machine.linearised(&state);
                let mut local = SampleObjective {
                    objective: self,
                    line: &line,
                    weights: None,
                    kappas: &work.kappas,
                    rows: &mut work.shifted,
                    state: &mut work.beside,
                };
                let by = local.derivatives(&state)?;
                self.fine
                    .pull_back_all(work.series.fundamental, m, &by, &mut work.by_coefficients);
            }
        }
        Ok(total)
    }

    fn kinematics(&self, basis: &HarmonicBasis, series: &Series, m: usize) -> Kinematics {
        let mut k = Kinematics::REST;
        for i in 0..self.machine.coordinates() {
            [k.x[i], k.xd[i], k.xdd[i]] = basis.at(series, i, m);
        }
        k
    }

    /// Moves the multipliers to what the violations at z ask for, and the weight up.
    pub fn update(
        &self,
        z: &[f64],
        multipliers: &mut LagrangeMultipliers,
        factor: f64,
        work: &mut ObjectiveWorkspace,
    ) -> Result<(), NoValue> {
        self.variables.series(z, &mut work.series);
        let mut state = State::EMPTY;
        let mut at = 0;
        let mut renew = |at: &mut usize, channel: &BoundedQuantity, value: f64| {
            for (g, _) in channel.constraints(value) {
                let moved = multipliers.lambda[*at] + multipliers.weight * g;
                multipliers.lambda[*at] = moved.max(0.0);
                *at += 1;
            }
        };
        for channel in &self.linear {
            for m in 0..self.fine.samples {
                let order = channel.quantity.derivative().unwrap_or(0);
                let value = self.fine.at(&work.series, channel.index, m)[order];
                renew(&mut at, channel, value);
            }
        }
        if !self.curved.is_empty() {
            for m in 0..self.fine.samples {
                let k = self.kinematics(&self.fine, &work.series, m);
                self.machine.fill(&k, &mut state)?;
                let quantities = self.machine.quantities(&state);
                for channel in &self.curved {
                    renew(&mut at, channel, quantities.of(channel));
                }
            }
        }
        multipliers.weight *= factor;
        Ok(())
    }
}

impl LagrangeMultipliers {
    /// All zero, with a first weight.
    pub fn new(constraints: usize, weight: f64) -> Self {
        let lambda = vec![0.0; constraints];
        Self { lambda, weight }
    }

    /// Penalty of constraint `at` with the value g <= 0 where it holds, and its derivative by g.
    #[inline]
    fn penalty(&self, at: usize, g: f64) -> (f64, f64) {
        let lambda = self.lambda[at];
        let pressed = (lambda + self.weight * g).max(0.0);
        let penalty = (pressed * pressed - lambda * lambda) / (2.0 * self.weight);
        (penalty, pressed)
    }
}

/// The number that is differentiated at one sample.
struct SampleObjective<'a> {
    objective: &'a Objective<'a>,
    line: &'a LinearisedFriction,
    /// 2 w F S, n x p.
    weights: Option<&'a [f64]>,
    /// Pressure of each curved channel; empty where only rows count.
    kappas: &'a [f64],
    rows: &'a mut [f64],
    state: &'a mut State,
}

impl SampleObjective<'_> {
    fn value(&mut self, k: &Kinematics) -> Result<f64, RobotError> {
        let (machine, state) = (self.objective.machine, &mut *self.state);
        machine.follow(k, state)?;
        machine.rows(state, self.line, !self.kappas.is_empty(), self.rows)?;
        let mut sum = 0.0;
        if let Some(weights) = self.weights {
            let terms = self.rows.iter().zip(weights);
            sum += terms.map(|(y, w)| y * w).sum::<f64>();
        }
        let quantities = machine.quantities(state);
        for (channel, kappa) in self.objective.curved.iter().zip(self.kappas) {
            if *kappa != 0.0 {
                sum += kappa * quantities.of(channel);
            }
        }
        Ok(sum)
    }

    /// Derivatives by position, speed and acceleration of every coordinate.
    fn derivatives(&mut self, state: &State) -> Result<[[f64; 3]; MAX_COORDINATES], RobotError> {
        let variables = &self.objective.variables;
        let n = self.objective.machine.coordinates();
        let here = self.value(&state.k)?;
        let mut by = [[0.0; 3]; MAX_COORDINATES];
        for (i, by) in by.iter_mut().enumerate().take(n) {
            let mut k = state.k;
            if !self.objective.machine.is_uniform(i) {
                let h = STEP_SHARE_OF_SPAN * variables.span[i].1;
                let x = k.x[i];
                let mut shifted = |steps: f64| {
                    k.x[i] = x + steps * h;
                    self.value(&k)
                };
                let near = shifted(1.0)? - shifted(-1.0)?;
                let far = shifted(2.0)? - shifted(-2.0)?;
                by[0] = (8.0 * near - far) / (12.0 * h);
                k.x[i] = x;
            }
            let h = variables.speed[i];
            k.xd[i] = state.k.xd[i] + h;
            let up = self.value(&k)?;
            k.xd[i] = state.k.xd[i] - h;
            by[1] = (up - self.value(&k)?) / (2.0 * h);
            k.xd[i] = state.k.xd[i];
            let h = h * variables.fundamental * variables.harmonics as f64;
            k.xdd[i] += h;
            by[2] = (self.value(&k)? - here) / h;
        }
        Ok(by)
    }
}

#[cfg(test)]
mod tests;
