//! The least squares: all rows, and all rows but those of each block.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::NUMBERS;
use super::effect::WrenchEffect;
use super::equations::{LinearisedAt, RowEquations};
use super::physics::{BaseColumns, columns};
use super::wrench_log::{PoseRow, of_turn, turn_of};
use cft_ident_core::judge::jackknife;
use cft_ident_core::robot::tree::space::{UNTURNED, product};

/// Rows of one way to read a log, and how much their equations weigh.
#[derive(Debug, Clone)]
pub(super) struct WrenchProblem {
    pub rows: Vec<PoseRow>,
    pub base: BaseColumns,
    /// Weights of force and moment: one over the deviation that the model without effects leaves.
    pub weights: [f64; 2],
}

/// A model fitted to all rows, and without each block.
#[derive(Debug, Clone)]
pub(super) struct WrenchFit {
    pub effects: Vec<WrenchEffect>,
    /// Unknowns: those of [`BaseColumns`], then those of each effect.
    pub x: DVector<f64>,
    pub covariance: DMatrix<f64>,
    pub blocks: Vec<Range<usize>>,
    /// Left of each row by the fit to all.
    pub residual: Vec<[f64; 6]>,
    /// Left of each row by the fit without its block.
    pub held_out: Vec<[f64; 6]>,
    /// Normal matrix of the equations, each weighted.
    pub normal: DMatrix<f64>,
}

/// Rows in blocks of neighbours, at most `most`.
pub(super) fn blocks(rows: usize, size: usize) -> Vec<Range<usize>> {
    let count = (rows / size.max(1)).clamp(1, NUMBERS.blocks);
    let end = |k: usize| k * rows / count;
    (0..count).map(|k| end(k)..end(k + 1)).collect()
}

/// The blocks that are left out to ask for the error on rows that were not fitted: ten neighbouring poses each, fewer
/// where there are less than a hundred.
pub(super) fn held_out_blocks(rows: usize) -> Vec<Range<usize>> {
    blocks(
        rows,
        NUMBERS
            .neighbours
            .min(rows.div_ceil(NUMBERS.neighbours))
            .max(1),
    )
}

/// Mean norm of forces and of moments.
pub(super) fn mean_norms(errors: &[[f64; 6]]) -> [f64; 2] {
    [0, 3].map(|from| {
        let norm = |e: &[f64; 6]| e[from..from + 3].iter().map(|x| x * x).sum::<f64>().sqrt();
        errors.iter().map(norm).sum::<f64>() / errors.len().max(1) as f64
    })
}

/// The solution of a normal equation; directions that the equations do not determine stay 0.
fn solved(normal: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let scale = normal
        .diagonal()
        .map(|x| if x > 0.0 { 1.0 / x.sqrt() } else { 0.0 });
    let n = right.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    let right = right.component_mul(&scale);
    if let Some(factor) = Cholesky::new(scaled.clone()) {
        let least = factor.l_dirty().diagonal().min();
        if least * least > NUMBERS.singular {
            return factor.solve(&right).component_mul(&scale);
        }
    }
    let eigen = SymmetricEigen::new(scaled);
    let most = eigen.eigenvalues.max();
    let mut along = eigen.eigenvectors.tr_mul(&right);
    for (x, value) in along.iter_mut().zip(eigen.eigenvalues.iter()) {
        *x = match *value > NUMBERS.singular * most {
            true => *x / value,
            false => 0.0,
        };
    }
    (eigen.eigenvectors * along).component_mul(&scale)
}

impl WrenchProblem {
    /// Rows with equal weights of force and moment.
    pub fn new(rows: Vec<PoseRow>, inertia: bool) -> Self {
        Self {
            rows,
            base: BaseColumns { inertia },
            weights: [1.0; 2],
        }
    }

    /// The same, force and moment weighted by what the model without effects leaves of them.
    pub fn weighted(mut self) -> Self {
        let residual = self.fit(&[], &held_out_blocks(self.rows.len())).residual;
        let rms = |from: usize| {
            let squares = residual
                .iter()
                .flat_map(|e| &e[from..from + 3])
                .map(|x| x * x);
            (squares.sum::<f64>() / (3 * residual.len().max(1)) as f64).sqrt()
        };
        let [force, moment] = [rms(0), rms(3)];
        // a channel without any error would be all that counts
        let least = NUMBERS.singular.sqrt();
        self.weights = [force, moment].map(|x| 1.0 / x.max(least * (force + moment)).max(1e-12));
        self
    }

    /// Place of a row between the first (-1) and the last (1), by its time.
    fn place(&self, row: &PoseRow) -> f64 {
        let ends = (self.rows.first(), self.rows.last());
        let (first, last) = ends.0.zip(ends.1).map_or((0.0, 0.0), |(a, b)| (a.t, b.t));
        match last > first {
            true => 2.0 * (row.t - first) / (last - first) - 1.0,
            false => 0.0,
        }
    }

    fn start(&self) -> LinearisedAt {
        LinearisedAt {
            mass: 0.0,
            first_moment: [0.0; 3],
            turn: UNTURNED,
            lean: [0.0; 2],
        }
    }

    /// Fits base columns and effects; what is not linear is linearised until it stands still.
    pub fn fit(&self, effects: &[WrenchEffect], blocks: &[Range<usize>]) -> WrenchFit {
        self.fit_from(effects, blocks, self.start())
    }

    pub fn fit_from(
        &self,
        effects: &[WrenchEffect],
        blocks: &[Range<usize>],
        mut at: LinearisedAt,
    ) -> WrenchFit {
        let curved = |e: &WrenchEffect| {
            matches!(
                e,
                WrenchEffect::LeaningBase | WrenchEffect::TurnedSensor | WrenchEffect::Gains
            )
        };
        let rounds = if effects.iter().any(curved) {
            NUMBERS.rounds
        } else {
            1
        };
        let mut fitted = self.fit_at(effects, blocks, &at);
        for _ in 1..rounds {
            let before = at.clone();
            at = self.moved(&fitted, at);
            fitted = self.fit_at(effects, blocks, &at);
            if at.is_near(&before) {
                break;
            }
        }
        self.absolute(&mut fitted, &at);
        fitted
    }

    /// Where to linearise next.
    fn moved(&self, fitted: &WrenchFit, at: LinearisedAt) -> LinearisedAt {
        let x = &fitted.x;
        let mut next = LinearisedAt {
            mass: x[BaseColumns::MASS],
            first_moment: std::array::from_fn(|k| x[BaseColumns::FIRST_MOMENT + k]),
            ..at
        };
        let mut column = self.base.len();
        for effect in &fitted.effects {
            match effect {
                // a first round has no mass to turn yet
                WrenchEffect::LeaningBase => {
                    for k in 0..2 {
                        next.lean[k] = (next.lean[k] + x[column + k]).clamp(-0.7, 0.7);
                    }
                }
                WrenchEffect::TurnedSensor => {
                    let turn = std::array::from_fn(|k| x[column + k]);
                    next.turn = product(&next.turn, &of_turn(&turn));
                }
                _ => {}
            }
            column += effect.numbers();
        }
        next
    }

    /// Steps of what is not linear become its numbers.
    fn absolute(&self, fitted: &mut WrenchFit, at: &LinearisedAt) {
        let mut column = self.base.len();
        for effect in &fitted.effects {
            match effect {
                WrenchEffect::LeaningBase => {
                    fitted.x[column] += at.lean[0];
                    fitted.x[column + 1] += at.lean[1];
                }
                WrenchEffect::TurnedSensor => {
                    let step = std::array::from_fn(|k| fitted.x[column + k]);
                    let turn = turn_of(&product(&at.turn, &of_turn(&step)));
                    for (k, x) in turn.iter().enumerate() {
                        fitted.x[column + k] = *x;
                    }
                }
                _ => {}
            }
            column += effect.numbers();
        }
    }

    fn fit_at(
        &self,
        effects: &[WrenchEffect],
        blocks: &[Range<usize>],
        at: &LinearisedAt,
    ) -> WrenchFit {
        let p = self.base.len() + effects.iter().map(WrenchEffect::numbers).sum::<usize>();
        let mut design = vec![0.0; 6 * p * self.rows.len()];
        for (row, numbers) in self.rows.iter().zip(design.chunks_exact_mut(6 * p)) {
            let mut out = RowEquations { p, numbers };
            columns(row, self.place(row), self.base, effects, at, &mut out);
        }
        let of_block = |block: &Range<usize>| self.normal(&design, p, block.clone());
        let parts: Vec<_> = blocks.iter().map(of_block).collect();
        let mut normal = DMatrix::zeros(p, p);
        let mut right = DVector::zeros(p);
        for (n, r) in &parts {
            normal += n;
            right += r;
        }
        let x = solved(&normal, &right);
        let without = parts
            .iter()
            .map(|(n, r)| solved(&(&normal - n), &(&right - r)));
        let left_out: Vec<DVector<f64>> = without.collect();
        let residual = self.residual(&design, p, 0..self.rows.len(), &x);
        let held_out = blocks.iter().zip(&left_out);
        let held_out = held_out.flat_map(|(block, x)| self.residual(&design, p, block.clone(), x));
        WrenchFit {
            effects: effects.to_vec(),
            held_out: held_out.collect(),
            covariance: jackknife(&x, &left_out),
            x,
            blocks: blocks.to_vec(),
            residual,
            normal,
        }
    }

    /// Normal matrix and right side of a range of rows.
    fn normal(&self, design: &[f64], p: usize, rows: Range<usize>) -> (DMatrix<f64>, DVector<f64>) {
        let count = 6 * rows.len();
        let weight = |equation: usize| self.weights[usize::from(equation % 6 >= 3)];
        let part = &design[6 * p * rows.start..6 * p * rows.end];
        let a = DMatrix::from_fn(count, p, |i, j| weight(i) * part[i * p + j]);
        let y = DVector::from_fn(count, |i, _| {
            let row = &self.rows[rows.start + i / 6];
            weight(i) * measured(row)[i % 6]
        });
        (a.tr_mul(&a), a.tr_mul(&y))
    }

    fn residual(
        &self,
        design: &[f64],
        p: usize,
        rows: Range<usize>,
        x: &DVector<f64>,
    ) -> Vec<[f64; 6]> {
        let of = |k: usize| {
            let part = &design[6 * p * k..6 * p * (k + 1)];
            let y = measured(&self.rows[k]);
            std::array::from_fn(|i| {
                let model: f64 = (0..p).map(|j| part[i * p + j] * x[j]).sum();
                y[i] - model
            })
        };
        rows.map(of).collect()
    }

    /// Squared weighted errors by block, of rows that were left out.
    pub fn squares(&self, fitted: &WrenchFit) -> Vec<f64> {
        let [f, t] = self.weights.map(|w| w * w);
        let of = |e: &[f64; 6]| {
            f * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
                + t * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5])
        };
        let block = |block: &Range<usize>| fitted.held_out[block.clone()].iter().map(of).sum();
        fitted.blocks.iter().map(block).collect()
    }

    /// Error on `rows` of a model that is fitted to `known` alone.
    pub fn forecast(
        &self,
        effects: &[WrenchEffect],
        known: Range<usize>,
        rows: Range<usize>,
    ) -> [f64; 2] {
        let start = self.fit(effects, &held_out_blocks(self.rows.len()));
        let at = self.at_of(&start);
        let p = start.x.len();
        let mut design = vec![0.0; 6 * p * self.rows.len()];
        for (row, numbers) in self.rows.iter().zip(design.chunks_exact_mut(6 * p)) {
            let mut out = RowEquations { p, numbers };
            columns(row, self.place(row), self.base, effects, &at, &mut out);
        }
        let (normal, right) = self.normal(&design, p, known);
        mean_norms(&self.residual(&design, p, rows, &solved(&normal, &right)))
    }

    /// What a fit to the rows that are kept leaves of every row.
    pub fn left_by(&self, effects: &[WrenchEffect], kept: &[bool]) -> Vec<[f64; 6]> {
        let whole = 0..self.rows.len();
        let start = self.fit(effects, std::slice::from_ref(&whole));
        let (at, p) = (self.at_of(&start), start.x.len());
        let mut design = vec![0.0; 6 * p * self.rows.len()];
        for (row, numbers) in self.rows.iter().zip(design.chunks_exact_mut(6 * p)) {
            let mut out = RowEquations { p, numbers };
            columns(row, self.place(row), self.base, effects, &at, &mut out);
        }
        let mut sums = (DMatrix::zeros(p, p), DVector::zeros(p));
        for row in whole.clone().filter(|row| kept[*row]) {
            let (normal, right) = self.normal(&design, p, row..row + 1);
            sums = (sums.0 + normal, sums.1 + right);
        }
        self.residual(&design, p, whole, &solved(&sums.0, &sums.1))
    }

    /// What a fit leaves of rows of another log: effects of time stay as they were at the end.
    pub fn left_of(&self, fitted: &WrenchFit, rows: &[PoseRow]) -> Vec<[f64; 6]> {
        let at = self.at_of(fitted);
        let p = fitted.x.len();
        let mut steps = fitted.x.clone();
        self.forget(&mut steps, fitted);
        let of = |row: &PoseRow| {
            let row = PoseRow {
                number: usize::MAX,
                ..*row
            };
            let mut numbers = vec![0.0; 6 * p];
            let mut out = RowEquations {
                p,
                numbers: &mut numbers,
            };
            columns(&row, 1.0, self.base, &fitted.effects, &at, &mut out);
            let y = measured(&row);
            std::array::from_fn(|i| {
                y[i] - (0..p).map(|j| numbers[i * p + j] * steps[j]).sum::<f64>()
            })
        };
        rows.iter().map(of).collect()
    }

    /// What is not linear is where it is linearised: no step is left.
    fn forget(&self, x: &mut DVector<f64>, fitted: &WrenchFit) {
        for (k, effect) in fitted.effects.iter().enumerate() {
            if matches!(
                effect,
                WrenchEffect::LeaningBase | WrenchEffect::TurnedSensor
            ) {
                fitted.of_effect(k).for_each(|at| x[at] = 0.0);
            }
        }
    }

    /// Size of effect `k`: how far the bias goes \[N\], an angle \[rad\], the largest gain error, a
    /// stiffness \[N/m\].
    pub fn size(&self, fitted: &WrenchFit, k: usize) -> f64 {
        let of = fitted.of_effect(k);
        let numbers: Vec<f64> = of.clone().map(|at| fitted.x[at]).collect();
        let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let effect = fitted.effects[k];
        match effect {
            WrenchEffect::Gains => numbers.iter().fold(0.0, |most, x| x.abs().max(most)),
            WrenchEffect::BiasDrift { .. } | WrenchEffect::Taring { .. } => {
                let at = self.at_of(fitted);
                let bias = |row: &PoseRow| {
                    let p = numbers.len();
                    let mut entries = vec![0.0; 6 * p];
                    let mut out = RowEquations {
                        p,
                        numbers: &mut entries,
                    };
                    effect.columns(row, self.place(row), &at, &[0.0; 3], 0, &mut out);
                    let force: [f64; 3] = std::array::from_fn(|i| {
                        (0..p).map(|j| entries[i * p + j] * numbers[j]).sum()
                    });
                    force
                };
                let first = self.rows.first().map_or([0.0; 3], &bias);
                let off = |row: &PoseRow| {
                    let now = bias(row);
                    norm(&[now[0] - first[0], now[1] - first[1], now[2] - first[2]])
                };
                self.rows.iter().map(off).fold(0.0, f64::max)
            }
            _ => norm(&numbers),
        }
    }

    /// Force and moment of the bias at the last row.
    pub fn last_bias(&self, fitted: &WrenchFit) -> [f64; 6] {
        let at = self.at_of(fitted);
        let p = fitted.x.len();
        let mut x = fitted.x.clone();
        let bias = self.base.bias();
        for (k, effect) in fitted.effects.iter().enumerate() {
            if !effect.is_of_time() {
                fitted.of_effect(k).for_each(|at| x[at] = 0.0);
            }
        }
        (0..bias).for_each(|k| x[k] = 0.0);
        let Some(row) = self.rows.last() else {
            return [0.0; 6];
        };
        let mut numbers = vec![0.0; 6 * p];
        let mut out = RowEquations {
            p,
            numbers: &mut numbers,
        };
        columns(row, 1.0, self.base, &fitted.effects, &at, &mut out);
        std::array::from_fn(|i| (0..p).map(|j| numbers[i * p + j] * x[j]).sum())
    }

    fn at_of(&self, fitted: &WrenchFit) -> LinearisedAt {
        let x = &fitted.x;
        let mut at = LinearisedAt {
            mass: x[BaseColumns::MASS],
            first_moment: std::array::from_fn(|k| x[BaseColumns::FIRST_MOMENT + k]),
            ..self.start()
        };
        let mut column = self.base.len();
        for effect in &fitted.effects {
            match effect {
                WrenchEffect::LeaningBase => at.lean = [x[column], x[column + 1]],
                WrenchEffect::TurnedSensor => {
                    at.turn = of_turn(&std::array::from_fn(|k| x[column + k]));
                }
                _ => {}
            }
            column += effect.numbers();
        }
        at
    }
}

/// What the sensor measured.
pub(super) fn measured(row: &PoseRow) -> [f64; 6] {
    let ([a, b, c], [d, e, f]) = (row.force, row.moment);
    [a, b, c, d, e, f]
}

impl WrenchFit {
    /// Places of the numbers of effect `k` among the unknowns.
    pub fn of_effect(&self, k: usize) -> Range<usize> {
        let total: usize = self.effects.iter().map(WrenchEffect::numbers).sum();
        let base = self.x.len() - total;
        let before: usize = self.effects[..k].iter().map(WrenchEffect::numbers).sum();
        base + before..base + before + self.effects[k].numbers()
    }

    /// 1/e time of what is left, in rows: how far neighbours say the same.
    pub fn memory(&self) -> usize {
        let n = self.residual.len();
        let (mut sums, half) = (vec![0.0; n / 2 + 1], n / 2);
        for c in 0..6 {
            let own: Vec<f64> = self.residual.iter().map(|e| e[c]).collect();
            let mean = own.iter().sum::<f64>() / n.max(1) as f64;
            let power: f64 = own.iter().map(|x| (x - mean).powi(2)).sum();
            if power <= 0.0 {
                continue;
            }
            for (lag, sum) in sums.iter_mut().enumerate() {
                let pairs = own.iter().zip(&own[lag..]);
                *sum += pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / power;
            }
        }
        let all = sums.first().copied().unwrap_or_default();
        let below = (1..=half).find(|lag| sums[*lag] < all / std::f64::consts::E);
        below.unwrap_or(half.max(1))
    }
}
