//! The amplitude of an effect in the joint fit over its own deviation, by leaving out each block: the interval that is
//! printed is the one that judges.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::Numbers;
use super::bounded::{self, Bound};
use super::chance::{ChanceReading, SILENT, floor};
use super::jackknife::jackknife;
use super::sums::{BlockSums, Term, Terms};

/// Places of an effect's terms: its coefficients, and the slopes by which its shape is free.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectTerms {
    pub coefficients: Range<usize>,
    pub slopes: Vec<usize>,
}

/// Fits of all terms together, to all blocks and with each of them left out.
pub struct JointFit {
    terms: Terms,
    total: Vec<DMatrix<f64>>,
    /// Values of the terms by all blocks.
    pub values: DVector<f64>,
    /// The same without each block; what the fit to all has at a bound is held there.
    without: Vec<DVector<f64>>,
    at_bound: Vec<bool>,
    /// Sums of products of every block, `[block][joint]`.
    blocks: Vec<Vec<DMatrix<f64>>>,
    /// Rows of each joint.
    rows: Vec<f64>,
    /// Covariance of the values by what was known before, in the unit of [`JointFit::covariance`].
    known: DMatrix<f64>,
}

/// What the blocks say of an effect's amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectAmplitude {
    /// Coefficients of the joint fit.
    pub values: Vec<f64>,
    /// Square of its torque over its standard deviation, over the number k of its free coefficients.
    pub f: f64,
    /// The F that chance exceeds as rarely as five deviations of one number; none where too few blocks tell.
    pub floor: Option<f64>,
    /// Number of blocks of equal information that would say as much.
    pub blocks: f64,
    /// Root mean square of its torque over the rows of the joints that it acts on, and the standard deviation.
    pub torque: [f64; 2],
    /// Factor of its amplitude in predictions, 0..1.
    pub s: f64,
    /// The variance that judged over that which [`JointFit::covariance`] gives its torque.
    pub over_covariance: f64,
}

impl EffectAmplitude {
    /// How many of its deviations one number would have to be off zero to be as sure.
    pub fn deviations(&self, numbers: &Numbers) -> f64 {
        let floor = self.floor.unwrap_or(f64::INFINITY);
        numbers.deviations * (self.f / floor).sqrt()
    }

    /// F over its floor; 0 where there is none.
    pub fn certainty(&self) -> f64 {
        self.floor.map_or(0.0, |floor| self.f / floor)
    }
}

impl JointFit {
    /// Fits terms to the first `fitted` blocks; information of what is known beforehand counts in rows of which so many
    /// are one independent row. None where the data determine nothing.
    pub fn new(sums: &BlockSums, fitted: usize, terms: Terms, rows: f64) -> Option<Self> {
        let total = sums.over(0..fitted);
        let own = terms.own_of_all();
        let all = terms.normal(&total);
        let diagonal: Vec<f64> = all.0.diagonal().iter().map(|x| x.max(1e-300)).collect();
        let (mut normal, mut side) = all.clone();
        terms.firm(&mut normal, &mut side, &diagonal);
        let mut bounds: Vec<Bound> = terms.list.iter().map(|t| t.bound).collect();
        let values = bounded::solve(&normal, &side, &bounds);
        if !values.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut at_bound = vec![false; terms.len()];
        for ((bound, x), at) in bounds.iter_mut().zip(&values).zip(&mut at_bound) {
            *at = *x <= bound.least || *x >= bound.most;
            if *at {
                (bound.least, bound.most) = (*x, *x);
            }
        }
        let without = sums.blocks[..fitted].iter().map(|block| {
            let mut others = all.clone();
            terms.add_normal(&own, block, -1.0, &mut others);
            let (mut normal, mut side) = others;
            terms.firm(&mut normal, &mut side, &diagonal);
            bounded::solve(&normal, &side, &bounds)
        });
        let without = without.collect();
        let known = terms.known_before(&total)? * rows;
        Some(JointFit {
            without,
            at_bound,
            blocks: sums.blocks[..fitted].to_vec(),
            rows: (0..total.len()).map(|j| sums.rows_of(j)).collect(),
            known,
            terms,
            total,
            values,
        })
    }

    /// Adds to the covariance of the values what that of terms does which are held.
    pub fn widen_by_held(&mut self, held: &[Term], covariance: &DMatrix<f64>) {
        let mut across = DMatrix::zeros(self.terms.len(), held.len());
        for ((j, sums), weight) in self.total.iter().enumerate().zip(&self.terms.weights) {
            for (i, own) in self.terms.own(j) {
                for (h, term) in held.iter().enumerate() {
                    if let Some(column) = term.column(j) {
                        across[(i, h)] += weight * sums[(own, column)];
                    }
                }
            }
        }
        if let Some(factor) = self.terms.firm_normal(&self.total).0.cholesky() {
            let moved = factor.solve(&across);
            self.known += &moved * covariance * moved.transpose();
        }
    }

    /// Covariance of all values: their scatter over fits without each block, and what was known before.
    pub fn covariance(&self) -> DMatrix<f64> {
        jackknife(&self.values, &self.without) + &self.known
    }

    /// What the blocks say of an effect. `noisier` are the sums of all blocks with as much noise again in the
    /// positions, which may make an effect, and may hide one that is `measured`.
    pub fn amplitude(
        &self,
        effect: &EffectTerms,
        (noisier, measured): (Option<&[DMatrix<f64>]>, bool),
        numbers: &Numbers,
    ) -> EffectAmplitude {
        let own: Vec<usize> = effect.coefficients.clone().collect();
        let free: Vec<usize> = own.iter().copied().filter(|i| !self.at_bound[*i]).collect();
        let mut out = EffectAmplitude {
            values: own.iter().map(|i| self.values[*i]).collect(),
            f: 0.0,
            floor: None,
            blocks: 0.0,
            torque: [0.0; 2],
            s: 0.0,
            over_covariance: 1.0,
        };
        let joints = 0..self.total.len();
        let of_joint: Vec<DMatrix<f64>> = joints
            .clone()
            .map(|j| self.products(&self.total[j], j, &free, &free))
            .collect();
        let Some((beside, by_shape)) = self.beside_others(&free, &effect.slopes, numbers) else {
            return out;
        };
        let along =
            |x: &DVector<f64>| x.select_rows(&free) + &by_shape * x.select_rows(&effect.slopes);
        let amplitude = along(&self.values);
        let without: Vec<DVector<f64>> = self.without.iter().map(along).collect();
        let places: Vec<usize> = free.iter().chain(&effect.slopes).copied().collect();
        let known = self.known.select_rows(&places).select_columns(&places);
        let k = free.len();
        let mut map = DMatrix::zeros(k, places.len());
        map.view_mut((0, 0), (k, k)).fill_with_identity();
        map.view_mut((0, k), (k, effect.slopes.len()))
            .copy_from(&by_shape);
        let pull = &beside * &amplitude;
        let size = amplitude.dot(&pull);
        if k == 0 || size.is_nan() || size <= 0.0 {
            return out;
        }
        let part = noisier.map_or(0.0, |sums| {
            along(&self.by_noise(sums, &own, &effect.slopes)).dot(&pull) / size
        });
        // noise must not make an effect; a number that can be measured must not be hidden by it either
        let part = if measured { part } else { part.max(0.0) };
        let along_pull = map.tr_mul(&pull);
        let known = along_pull.dot(&(known * &along_pull)) / (size * size) + EXACT;
        let not_chance = known + part * part;
        let changes: Vec<f64> = without.iter().map(|x| x.dot(&pull) / size - 1.0).collect();
        let readings = ChanceReading::both(&changes, &self.leverages(&free, &amplitude), numbers);
        let scatter = readings.as_ref().map_or(0.0, |[plain, _]| plain.variance);
        let surest = readings.into_iter().flatten().filter_map(|reading| {
            let f = 1.0 / ((reading.variance + not_chance) * k as f64);
            let floor = floor(k, reading.blocks, numbers).map(|floor| floor / reading.wide)?;
            Some((f, floor, reading))
        });
        let surest = surest.max_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)));
        let variance = not_chance
            + surest
                .as_ref()
                .map_or(f64::INFINITY, |(_, _, r)| r.variance);
        let strongest = joints.clone().max_by(|a, b| {
            let square =
                |j: usize| self.terms.weights[j] * amplitude.dot(&(&of_joint[j] * &amplitude));
            square(*a).total_cmp(&square(*b))
        });
        if let Some(j) = strongest {
            let square = amplitude.dot(&(&of_joint[j] * &amplitude));
            let rms = (square / self.rows[j].max(1.0)).sqrt();
            out.torque = [rms, rms * variance.sqrt()];
        }
        if let Some((f, floor, reading)) = surest {
            out.over_covariance = (reading.variance + not_chance) / (scatter + known);
            (out.f, out.blocks) = (f, reading.blocks);
            out.floor = (self.blocks.len() >= numbers.least_blocks).then_some(floor);
        }
        out.s = out
            .floor
            .map_or(0.0, |floor| (1.0 - floor / out.f).max(0.0));
        out
    }

    /// Products of the columns of coefficients beside all other terms, and the torque that a change of shape makes along
    /// them: where a spring rests is no part of its amplitude if a torque offset holds it as well.
    fn beside_others(
        &self,
        free: &[usize],
        slopes: &[usize],
        numbers: &Numbers,
    ) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let normal = self.terms.information(&self.total);
        let is_other = |i: &usize| !free.contains(i) && !slopes.contains(i);
        let others: Vec<usize> = (0..self.terms.len()).filter(is_other).collect();
        let part = |a: &[usize], b: &[usize]| normal.select_rows(a).select_columns(b);
        let explained = firm(&part(&others, &others), numbers.ridge)
            .cholesky()?
            .solve(&part(&others, free))
            .transpose();
        let beside = |columns: &[usize]| part(free, columns) - &explained * part(&others, columns);
        let own = beside(free);
        let by_shape = firm(&own, numbers.ridge).cholesky()?.solve(&beside(slopes));
        Some((own, by_shape))
    }

    /// Part of the information on an amplitude that each block holds: of the square of its torque beside what all other
    /// terms explain of it.
    fn leverages(&self, free: &[usize], amplitude: &DVector<f64>) -> Vec<f64> {
        let normal = self.terms.information(&self.total);
        let others: Vec<usize> = (0..self.terms.len())
            .filter(|i| !free.contains(i))
            .collect();
        let own = normal.select_rows(&others).select_columns(&others);
        let across = normal.select_rows(&others).select_columns(free) * amplitude;
        let mut beside = DVector::zeros(self.terms.len());
        if let Some(factor) = firm(&own, f64::EPSILON).cholesky() {
            let explained = factor.solve(&across);
            others
                .iter()
                .zip(explained.iter())
                .for_each(|(i, x)| beside[*i] = -x);
        }
        free.iter()
            .zip(amplitude.iter())
            .for_each(|(i, x)| beside[*i] = *x);
        let in_block = |block: &Vec<DMatrix<f64>>| -> f64 {
            let each = block.iter().enumerate().map(|(j, sums)| {
                let own = self.terms.own(j);
                let through = |(i, a): &(usize, usize)| {
                    let products = sums.column(*a);
                    beside[*i]
                        * own
                            .iter()
                            .map(|(l, b)| products[*b] * beside[*l])
                            .sum::<f64>()
                };
                self.terms.weights[j] * own.iter().map(through).sum::<f64>()
            });
            each.sum::<f64>().max(0.0)
        };
        let each: Vec<f64> = self.blocks.iter().map(in_block).collect();
        let sum = each.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        each.iter().map(|x| x / sum).collect()
    }

    /// EffectAmplitude of an effect in each block, all else as the joint fit has it; none where its torque is next to nothing.
    pub fn by_block(&self, effect: &EffectTerms, numbers: &Numbers) -> Vec<Vec<f64>> {
        let own: Vec<usize> = effect.coefficients.clone().collect();
        let k = own.len();
        let each = self.blocks.iter().map(|block| {
            let (mut gram, mut right) = (DMatrix::zeros(k, k), DVector::zeros(k));
            for (j, sums) in block.iter().enumerate() {
                let w = self.terms.weights[j];
                gram += self.products(sums, j, &own, &own) * w;
                for (at, i) in own.iter().enumerate() {
                    right[at] += w * self.left(sums, j, *i);
                }
            }
            (gram, right)
        });
        let each: Vec<_> = each.collect();
        let total = each.iter().fold(DMatrix::zeros(k, k), |t, (g, _)| t + g);
        let mean = total.trace() / each.len().max(1) as f64;
        let some = each.iter().filter(|(g, _)| g.trace() > SILENT * mean);
        let found = some.filter_map(|(gram, right)| {
            let mut gram = gram.clone();
            for i in 0..k {
                gram[(i, i)] += numbers.ridge * total[(i, i)].max(f64::MIN_POSITIVE);
            }
            let step = gram.cholesky()?.solve(right);
            Some(
                own.iter()
                    .zip(step.iter())
                    .map(|(i, x)| self.values[*i] + x)
                    .collect(),
            )
        });
        found.collect()
    }

    /// Change of the first values by a change of these others, all else held.
    pub fn declared_by(&self, declared: usize, others: &[usize]) -> Option<DMatrix<f64>> {
        let normal = self.terms.information(&self.total);
        let own = normal.view((0, 0), (declared, declared)).into_owned();
        let first: Vec<usize> = (0..declared).collect();
        let across = normal.select_rows(&first).select_columns(others);
        Some(-firm(&own, f64::EPSILON).cholesky()?.solve(&across))
    }

    /// Information matrix of the first terms alone, in independent rows of which each counts so many.
    pub fn information(&self, first: usize, rows: f64) -> DMatrix<f64> {
        let all = self.terms.information(&self.total);
        all.view((0, 0), (first, first)).into_owned() / rows
    }

    /// Products of some terms with others in the rows of a joint; 0 for terms that it does not have.
    fn products(
        &self,
        sums: &DMatrix<f64>,
        j: usize,
        rows: &[usize],
        columns: &[usize],
    ) -> DMatrix<f64> {
        let column = |i: usize| self.terms.list[i].column(j);
        DMatrix::from_fn(rows.len(), columns.len(), |a, b| {
            let both = column(rows[a]).zip(column(columns[b]));
            both.map_or(0.0, |(a, b)| sums[(a, b)])
        })
    }

    /// What is left to pull a term in some rows of a joint.
    fn left(&self, sums: &DMatrix<f64>, j: usize, term: usize) -> f64 {
        let Some(column) = self.terms.list[term].column(j) else {
            return 0.0;
        };
        let own = self.terms.own(j);
        let through: f64 = own
            .iter()
            .map(|(i, c)| sums[(column, *c)] * self.values[*i])
            .sum();
        sums[(column, sums.ncols() - 1)] - through
    }

    /// What noise of the positions adds to the values, all other effects held.
    fn by_noise(&self, noisier: &[DMatrix<f64>], own: &[usize], slopes: &[usize]) -> DVector<f64> {
        let declared = self.terms.prior.1.len();
        let others = declared..self.terms.len();
        let others = others.filter(|i| !own.contains(i) && !slopes.contains(i));
        let held: Vec<(usize, f64)> = others.map(|i| (i, self.values[i])).collect();
        self.terms.fit(noisier, &held).values - &self.values
    }
}

/// A matrix with a part of its diagonal added.
fn firm(of: &DMatrix<f64>, ridge: f64) -> DMatrix<f64> {
    let mut out = of.clone();
    for i in 0..out.nrows() {
        out[(i, i)] += ridge * of[(i, i)] + f64::MIN_POSITIVE;
    }
    out
}

/// Square of the relative deviation of a number that sums of products give exactly.
const EXACT: f64 = 1e-12;
