//! Errors of each block by the fit of all others, for the terms in use and for more.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::NUMBERS;
use super::bounded::{self, Bound};
use super::sums::{BlockSums, Term, Terms};
use crate::math::cholesky::substitute;
use crate::math::gram::quadratic_form;

/// What a hypothesis takes off the squared errors of blocks that were left out.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorGain {
    /// Sum over joints and blocks, each joint in its weight.
    pub value: f64,
    /// Its standard error.
    pub se: f64,
    /// The same of each joint by itself.
    pub joints: Vec<[f64; 2]>,
    /// Of each block, over the joints.
    pub blocks: Vec<f64>,
}

/// Gain of the second hypothesis over the first: errors `[block][joint]` of blocks that neither was fitted to.
pub fn compare(before: &[Vec<f64>], after: &[Vec<f64>], weights: &[f64]) -> ErrorGain {
    let of_block = |(a, b): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
        let pairs = a.iter().zip(b).zip(weights);
        pairs.map(|((a, b), w)| w * (a - b)).collect()
    };
    let gains: Vec<Vec<f64>> = before.iter().zip(after).map(of_block).collect();
    ErrorGain::of(&gains, None)
}

/// Change of the squared error of a joint's rows in a block, and the square of the change of torque that makes it.
struct BlockChange {
    error: f64,
    torque: f64,
}

impl ErrorGain {
    /// Of weighted gains `[block][joint]`, and the weighted squares of the changes of torque that make them where these
    /// are known: an effect that acts in few blocks gains in those, which is no chance.
    pub(super) fn of(gains: &[Vec<f64>], torques: Option<&[Vec<f64>]>) -> Self {
        let sums = |of: &[Vec<f64>]| -> Vec<f64> { of.iter().map(|g| g.iter().sum()).collect() };
        let column = |of: &[Vec<f64>], j: usize| -> Vec<f64> { of.iter().map(|g| g[j]).collect() };
        let with_error = |gains: &[f64], torques: Option<Vec<f64>>| {
            let [sum, error] = sum_and_error(gains.iter().copied());
            let about_line = torques.map(|q| NUMBERS.about_line * error_about_line(gains, &q));
            [sum, about_line.map_or(error, |about| error.min(about))]
        };
        let blocks = sums(gains);
        let joints = gains.first().map_or(0, Vec::len);
        let of_joint = |j: usize| with_error(&column(gains, j), torques.map(|q| column(q, j)));
        let [value, se] = with_error(&blocks, torques.map(sums));
        ErrorGain {
            value,
            se,
            joints: (0..joints).map(of_joint).collect(),
            blocks,
        }
    }

    /// Whether the whole gain and that of each of these joints is above so many standard errors.
    pub fn is_beyond(&self, errors: f64, own: Option<usize>) -> bool {
        let beyond = |[value, se]: [f64; 2]| value > 0.0 && value > errors * se;
        beyond([self.value, self.se]) && own.is_none_or(|j| beyond(self.joints[j]))
    }

    /// Whether it is that of another within so many standard errors of their difference.
    pub(crate) fn is_near(&self, other: &ErrorGain, errors: f64) -> bool {
        let pairs = self.blocks.iter().zip(&other.blocks);
        let [value, se] = sum_and_error(pairs.map(|(a, b)| a - b));
        value.abs() <= errors * se
    }
}

/// Sum of errors `[block][joint]` in the weights of the joints.
pub fn weighted(errors: &[Vec<f64>], weights: &[f64]) -> f64 {
    let each = errors.iter().flat_map(|e| e.iter().zip(weights));
    each.map(|(e, w)| e * w).sum()
}

/// A sum over blocks, and its standard error from their scatter.
fn sum_and_error(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let count = values.clone().count() as f64;
    let sum: f64 = values.clone().sum();
    let mean = sum / count.max(1.0);
    let scatter: f64 = values.map(|x| (x - mean) * (x - mean)).sum();
    [sum, (scatter / (count - 1.0).max(1.0) * count).sqrt()]
}

/// Standard error of a sum of gains, by their scatter about parts of it that are as the squares of the changes of torque
/// in the blocks: the greater of the scatter itself and that of noise which is alike in all blocks.
fn error_about_line(gains: &[f64], torques: &[f64]) -> f64 {
    let (sum, all) = (gains.iter().sum::<f64>(), torques.iter().sum::<f64>());
    if all <= 0.0 {
        return f64::INFINITY;
    }
    let told = gains.iter().zip(torques).filter(|(_, q)| **q > 0.0);
    let count = told.clone().count() as f64;
    let squares = told.map(|(g, q)| ((g - sum * q / all).powi(2), q / all));
    let (mut scatter, mut alike) = (0.0, 0.0);
    for (square, part) in squares {
        scatter += square / (1.0 - part).max(f64::EPSILON);
        alike += square / part;
    }
    scatter.max(alike / count).sqrt()
}

/// The fit of the terms in use without one block.
struct Without {
    /// None for a block that is never fitted.
    block: Option<usize>,
    factor: Cholesky<f64, Dyn>,
    values: DVector<f64>,
    /// What pulls each term still, in the rows of the block itself, by joint.
    pull: Vec<DVector<f64>>,
    /// Products of the terms of each joint among each other in these rows, closely packed.
    products: Vec<DMatrix<f64>>,
}

/// The fit of the terms in use to all fitted blocks.
pub struct WholeFit {
    factor: Cholesky<f64, Dyn>,
    values: DVector<f64>,
}

/// Fits of terms with each block left out.
pub struct BlocksLeftOut<'a> {
    terms: &'a Terms,
    sums: &'a BlockSums,
    /// Of all fitted blocks, by joint.
    total: Vec<DMatrix<f64>>,
    own: Vec<Vec<(usize, usize)>>,
    without: Vec<Without>,
}

impl<'a> BlocksLeftOut<'a> {
    /// Of all blocks; the last `judging` of them are never fitted. None where these data determine nothing.
    pub fn new(sums: &'a BlockSums, judging: usize, terms: &'a Terms) -> Option<Self> {
        let fitted = sums.blocks.len() - judging;
        let total = sums.over(0..fitted);
        let all = terms.normal(&total);
        let diagonal: Vec<f64> = all.0.diagonal().iter().map(|x| x.max(1e-300)).collect();
        let own = terms.own_of_all();
        let mut without = Vec::new();
        for (b, block) in sums.blocks.iter().enumerate() {
            let mut others = all.clone();
            let times = if b < fitted { -1.0 } else { 0.0 };
            terms.add_normal(&own, block, times, &mut others);
            let (mut normal, mut side) = others;
            terms.firm(&mut normal, &mut side, &diagonal);
            let factor = normal.cholesky()?;
            let values = factor.solve(&side);
            let joints = block.iter().zip(&own);
            let pull = |(sums, own): (_, &Vec<_>)| pull(sums, own, &values);
            let products = |(sums, own): (&DMatrix<f64>, &Vec<(usize, usize)>)| {
                DMatrix::from_fn(own.len(), own.len(), |r, c| sums[(own[r].1, own[c].1)])
            };
            without.push(Without {
                block: (b < fitted).then_some(b),
                pull: joints.clone().map(pull).collect(),
                products: joints.map(products).collect(),
                factor,
                values,
            });
        }
        Some(BlocksLeftOut {
            terms,
            sums,
            total,
            own,
            without,
        })
    }

    /// Errors of every block by the terms in use, `[block][joint]`.
    pub fn errors(&self) -> Vec<Vec<f64>> {
        let blocks = self.without.iter().zip(&self.sums.blocks);
        let errors = blocks.map(|(w, block)| self.terms.squares(block, &w.values));
        errors.collect()
    }

    /// Squared error of all blocks and joints, in the weights of the joints.
    pub(crate) fn error(&self) -> f64 {
        weighted(&self.errors(), &self.terms.weights)
    }

    /// Values of the terms without each fitted block.
    pub fn values(&self) -> impl Iterator<Item = &DVector<f64>> {
        let fitted = self.without.iter().filter(|w| w.block.is_some());
        fitted.map(|w| &w.values)
    }

    /// Gain of more terms beside those in use, all refitted without each block.
    pub fn gain(&self, more: &[Term]) -> ErrorGain {
        self.gain_of(more, Beside::of(self, more, &self.total), &|_| true)
    }

    /// The same of terms that are there in some blocks alone.
    pub(crate) fn gain_within(&self, more: &[Term], there: Range<usize>) -> ErrorGain {
        self.gain_of(more, self.within(more, &there), &|b| there.contains(&b))
    }

    fn within(&self, more: &[Term], there: &Range<usize>) -> Beside {
        Beside::of(self, more, &self.sums.over(there.clone()))
    }

    fn gain_of(&self, more: &[Term], all: Beside, there: &dyn Fn(usize) -> bool) -> ErrorGain {
        let joints = self.total.len();
        let bounds: Vec<Bound> = more.iter().map(|t| t.bound).collect();
        let diagonal: Vec<f64> = all.own.diagonal().iter().copied().collect();
        let mut gains = Vec::with_capacity(self.without.len());
        let mut torques = Vec::with_capacity(self.without.len());
        let mut others = all.clone();
        for (b, without) in self.without.iter().enumerate() {
            others.copy_from(&all);
            if without.block.is_some() && there(b) {
                others.add(self, more, (&self.sums.blocks[b], -1.0));
            }
            let mut beyond = others.beyond(&without.factor, &without.values);
            for (i, x) in diagonal.iter().enumerate() {
                beyond.own[(i, i)] += self.terms.ridge * x;
            }
            let amplitude = bounded::solve(&beyond.own, &beyond.right, &bounds);
            let moved = &beyond.through * -&amplitude;
            let values = &without.values + &moved;
            let added = if there(b) { more } else { &[] };
            let moves = (without, &moved, &values);
            let changes = (0..joints).map(|j| self.change((b, j), added, moves, &amplitude));
            let changes: Vec<BlockChange> = changes.collect();
            let weighted = |of: &dyn Fn(&BlockChange) -> f64| -> Vec<f64> {
                let pairs = changes.iter().zip(&self.terms.weights);
                pairs.map(|(change, w)| w * of(change)).collect()
            };
            gains.push(weighted(&|change| -change.error));
            torques.push(weighted(&|change| change.torque));
        }
        ErrorGain::of(&gains, Some(&torques))
    }

    /// Change of a joint's squared error in a block by more terms, for which those in use have moved to `values`.
    fn change(
        &self,
        (b, j): (usize, usize),
        more: &[Term],
        (without, moved, values): (&Without, &DVector<f64>, &DVector<f64>),
        amplitude: &DVector<f64>,
    ) -> BlockChange {
        let own = &self.own[j];
        let step: Vec<f64> = own.iter().map(|(i, _)| moved[*i]).collect();
        let pulled = step.iter().zip(without.pull[j].iter()).map(|(x, p)| x * p);
        let mut torque = quadratic_form(&without.products[j], &step);
        let mut error = torque - 2.0 * pulled.sum::<f64>();
        let block = &self.sums.blocks[b][j];
        let tau = block.nrows() - 1;
        let added = more.iter().zip(amplitude.iter());
        let added = added.filter(|(_, x)| **x != 0.0);
        let added = added.filter_map(|(term, x)| Some((term.column(j)?, *x)));
        let added: Vec<(usize, f64)> = added.collect();
        for &(c, x) in &added {
            let column = block.column(c);
            let used: f64 = own.iter().map(|&(i, a)| column[a] * values[i]).sum();
            let among: f64 = added.iter().map(|&(d, y)| column[d] * y).sum();
            let moves: f64 = own.iter().map(|&(i, a)| column[a] * moved[i]).sum();
            error += x * (among + 2.0 * used - 2.0 * column[tau]);
            torque += x * (among + 2.0 * moves);
        }
        BlockChange {
            error,
            torque: torque.max(0.0),
        }
    }

    /// Fits the terms in use to all fitted blocks; none where these determine nothing.
    pub fn whole_fit(&self) -> Option<WholeFit> {
        let (normal, right) = self.terms.firm_normal(&self.total);
        let factor = normal.cholesky()?;
        let values = factor.solve(&right);
        Some(WholeFit { factor, values })
    }

    /// Gain of more terms in the weighted squares of all fitted blocks, each of which the fits hold.
    pub fn gain_of_fit(&self, more: &[Term], whole: &WholeFit) -> f64 {
        let all = Beside::of(self, more, &self.total);
        let (beyond, amplitude) = self.amplitude_beside(more, &all, whole);
        2.0 * beyond.right.dot(&amplitude) - quadratic_form(&beyond.own, amplitude.as_slice())
    }

    /// Least part of the square of a column of more terms that is not in the span of those in use, over all fitted blocks;
    /// 0 where a column is nil.
    pub(crate) fn share_of_its_own(&self, more: &[Term]) -> f64 {
        let all = Beside::of(self, more, &self.total);
        let Some(whole) = self.whole_fit() else {
            return 0.0;
        };
        let own = all.beyond(&whole.factor, &whole.values).own;
        let part = |i: usize| own[(i, i)] / all.own[(i, i)].max(f64::MIN_POSITIVE);
        (0..more.len()).map(part).fold(f64::INFINITY, f64::min)
    }

    /// Amplitudes of terms that are there in some blocks alone, beside those in use over all fitted blocks.
    pub(crate) fn amplitude_within(&self, more: &[Term], there: Range<usize>) -> DVector<f64> {
        let all = self.within(more, &there);
        match self.whole_fit() {
            Some(whole) => self.amplitude_beside(more, &all, &whole).1,
            None => DVector::zeros(more.len()),
        }
    }

    fn amplitude_beside(
        &self,
        more: &[Term],
        all: &Beside,
        whole: &WholeFit,
    ) -> (BeyondUsed, DVector<f64>) {
        let bounds: Vec<Bound> = more.iter().map(|t| t.bound).collect();
        let mut beyond = all.beyond(&whole.factor, &whole.values);
        for i in 0..more.len() {
            beyond.own[(i, i)] += self.terms.ridge * all.own[(i, i)];
        }
        let amplitude = bounded::solve(&beyond.own, &beyond.right, &bounds);
        (beyond, amplitude)
    }
}

/// What is left to pull each of a joint's terms in some rows.
fn pull(sums: &DMatrix<f64>, own: &[(usize, usize)], values: &DVector<f64>) -> DVector<f64> {
    let tau = sums.nrows() - 1;
    let of_term = |&(_, a): &(usize, usize)| -> f64 {
        let column = sums.column(a);
        column[tau] - own.iter().map(|&(l, b)| column[b] * values[l]).sum::<f64>()
    };
    DVector::from_iterator(own.len(), own.iter().map(of_term))
}

/// Weighted products of more terms with those in use and with one another.
#[derive(Clone)]
struct Beside {
    with: DMatrix<f64>,
    own: DMatrix<f64>,
    right: DVector<f64>,
}

/// What a fit of the terms in use leaves of more terms.
struct BeyondUsed {
    /// What the terms in use take over for a unit of each.
    through: DMatrix<f64>,
    own: DMatrix<f64>,
    right: DVector<f64>,
}

impl Beside {
    /// What the terms in use leave of these products, by the factor of their normal matrix and their values.
    fn beyond(&self, factor: &Cholesky<f64, Dyn>, values: &DVector<f64>) -> BeyondUsed {
        let mut through = self.with.clone();
        substitute(factor.l_dirty(), &mut through);
        BeyondUsed {
            own: &self.own - self.with.tr_mul(&through),
            right: &self.right - self.with.tr_mul(values),
            through,
        }
    }

    fn of(used: &BlocksLeftOut, more: &[Term], sums: &[DMatrix<f64>]) -> Self {
        let (u, k) = (used.terms.len(), more.len());
        let mut out = Beside {
            with: DMatrix::zeros(u, k),
            own: DMatrix::zeros(k, k),
            right: DVector::zeros(k),
        };
        out.add(used, more, (sums, 1.0));
        out
    }

    /// Adds the products of some rows so many times.
    fn add(&mut self, used: &BlocksLeftOut, more: &[Term], (sums, times): (&[DMatrix<f64>], f64)) {
        for (c, term) in more.iter().enumerate() {
            for &(j, column) in &term.columns {
                let w = times * used.terms.weights[j];
                let products = sums[j].column(column);
                let mut with = self.with.column_mut(c);
                for &(i, a) in &used.own[j] {
                    with[i] += w * products[a];
                }
                for (d, other) in more.iter().enumerate() {
                    if let Some(other) = other.column(j) {
                        self.own[(d, c)] += w * products[other];
                    }
                }
                self.right[c] += w * products[products.len() - 1];
            }
        }
    }

    fn copy_from(&mut self, other: &Beside) {
        self.with.copy_from(&other.with);
        self.own.copy_from(&other.own);
        self.right.copy_from(&other.right);
    }
}
