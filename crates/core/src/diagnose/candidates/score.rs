//! One candidate effect against the fitted model: its columns projected off everything that is
//! declared, its significance under correlated residuals, and cross-validation.
//!
//! All from sums over pieces. With A = X'WX + prior, c = X'WC and T = A^-1 c, the candidate's own
//! part is C - X T; its coefficients solve S beta = C'We - T'X'We with S = C'WC - c'T.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::columns::CandidateColumns;
use crate::diagnose::placebo::blocks::Blocks;
use crate::diagnose::placebo::processing::Artefact;
use crate::diagnose::placebo::scores::BlockScores;
use crate::diagnose::problem::cross_products::CrossProducts;
use crate::diagnose::problem::data_split::{Piece, RowRole};
use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::normal_equations::{NormalEquations, dot};
use crate::math::long_run::long_run;
use crate::math::rank_revealing::RankRevealingInverse;

/// What the data say of a candidate.
#[derive(Debug, Clone)]
pub struct CandidateScore {
    /// Coefficients of its columns.
    pub beta: Vec<f64>,
    /// Fraction of the weighted squared residual that it removes in the fit.
    pub gain: f64,
    /// Share of its torque that nothing declared can explain.
    pub unique_share: f64,
    /// Chance of a test value as large without the effect, one candidate alone.
    pub p_value: f64,
    /// Improvement of the Bayesian information criterion with the effective number of rows.
    pub delta_bic: f64,
    pub effective_rows: f64,
    /// Fraction of the cross-validated squared error removed, and its standard error over folds.
    pub cv_gain: f64,
    pub cv_std: f64,
    /// Squared error of each fold left out, with the candidate.
    pub folds: Vec<f64>,
    /// Squared error on each piece that may veto, without and with the candidate.
    pub vetoes: [Vec<f64>; 2],
}

/// The fitted model, prepared for many candidates.
pub struct CandidateTest<'a> {
    at: &'a FittedModel,
    problem: &'a FitProblem<'a>,
    inverse: RankRevealingInverse,
    folds: Vec<Fold>,
    /// Sums of each piece that may veto.
    of_vetoes: Vec<NormalEquations>,
    /// Squared error of each fold left out, without a candidate.
    pub base_folds: Vec<f64>,
    /// Squared error of each piece that may veto, without a candidate.
    pub base_vetoes: Vec<f64>,
    /// What candidates are tried on where nothing is missing.
    pub blocks: Blocks,
}

/// One fold left out.
struct Fold {
    inverse: RankRevealingInverse,
    score: DVector<f64>,
    held_out: NormalEquations,
}

impl<'a> CandidateTest<'a> {
    /// Prepares the folds.
    pub fn new(at: &'a FittedModel, problem: &'a FitProblem<'a>) -> Self {
        let sum =
            |wanted: &dyn Fn(RowRole) -> bool| at.base.total(&problem.split, &at.weights, wanted);
        let all = sum(&RowRole::fitted);
        let prior_pull = &at.pull - &all.score;
        let in_folds = sum(&|r| matches!(r, RowRole::Fold(_)));
        let folds: Vec<Fold> = (0..problem.split.folds)
            .map(|f| {
                let held_out = sum(&|r| r == RowRole::Fold(f));
                let normal = &in_folds.normal - &held_out.normal + &at.information;
                Fold {
                    inverse: RankRevealingInverse::of(&normal),
                    score: &in_folds.score - &held_out.score + &prior_pull,
                    held_out,
                }
            })
            .collect();
        let inverse = RankRevealingInverse::of(&at.normal);
        let rest = inverse.solve(&at.pull);
        let of_vetoes = at
            .base
            .each(&problem.split, &at.weights, &|r| r == RowRole::Veto);
        let base_folds = folds
            .iter()
            .map(|f| square_after(&f.held_out, &f.inverse.solve(&f.score)))
            .collect();
        let base_vetoes = of_vetoes.iter().map(|v| square_after(v, &rest)).collect();
        CandidateTest {
            at,
            problem,
            inverse,
            folds,
            of_vetoes,
            base_folds,
            base_vetoes,
            blocks: Blocks::of(at, &problem.split, problem.prior.rows_per_independent),
        }
    }

    /// Sums of a candidate over every piece.
    pub(crate) fn cross(&self, columns: &CandidateColumns, k: usize) -> Vec<CrossProducts> {
        let base = &self.at.base;
        let u = base.unknowns.len();
        let piece = |piece: &Piece| {
            let mut cross = CrossProducts::none(u, k);
            let rows = &base.stretches[piece.stretch];
            for (j, own) in columns[piece.stretch].iter().enumerate() {
                if own.is_empty() {
                    continue;
                }
                let w = self.at.weights[j] * self.at.weights[j];
                let range = piece.rows.clone();
                for (b, c) in own.iter().enumerate() {
                    let c = &c[range.clone()];
                    for (x, &i) in rows.columns[j].iter().zip(&base.unknowns.columns[j]) {
                        cross.with_base[(i, b)] += w * dot(&x[range.clone()], c);
                    }
                    for (a, d) in own.iter().enumerate().take(b + 1) {
                        let x = w * dot(&d[range.clone()], c);
                        cross.own[(a, b)] += x;
                        if a != b {
                            cross.own[(b, a)] += x;
                        }
                    }
                    cross.score[b] += w * dot(&rows.residual[j][range.clone()], c);
                }
            }
            cross
        };
        self.problem.split.pieces.iter().map(piece).collect()
    }

    fn over(
        &self,
        cross: &[CrossProducts],
        k: usize,
        wanted: &dyn Fn(RowRole) -> bool,
    ) -> CrossProducts {
        let mut total = CrossProducts::none(self.at.base.unknowns.len(), k);
        for (piece, c) in self.problem.split.pieces.iter().zip(cross) {
            if wanted(piece.role) {
                total.add(c);
            }
        }
        total
    }

    /// Fraction of the weighted squared residual that a candidate removes: all that a search over
    /// shapes needs.
    pub fn gain(&self, columns: &CandidateColumns, k: usize) -> f64 {
        let total = self.over(&self.cross(columns, k), k, &RowRole::fitted);
        let (solution, _) = partial(&total, &self.inverse, &self.at.pull, SHARE);
        solution.map_or(0.0, |s| s.removed / self.at.square.max(f64::MIN_POSITIVE))
    }

    /// The same, with what it is pulled by block by block; none where no column has a part of its own.
    pub(crate) fn gain_by_blocks(
        &self,
        cross: &[CrossProducts],
        k: usize,
    ) -> (f64, Option<BlockScores>) {
        let mut sums: Vec<CrossProducts> = self
            .blocks
            .sums
            .iter()
            .map(|_| CrossProducts::none(self.at.base.unknowns.len(), k))
            .collect();
        let mut total = CrossProducts::none(self.at.base.unknowns.len(), k);
        for (block, c) in self.blocks.signs.of_piece.iter().zip(cross) {
            if let Some(block) = *block {
                sums[block].add(c);
                total.add(c);
            }
        }
        let (solution, _) = partial(&total, &self.inverse, &self.at.pull, SHARE);
        let Some(s) = solution else {
            return (0.0, None);
        };
        let gain = s.removed / self.at.square.max(f64::MIN_POSITIVE);
        let scores = BlockScores::of(
            &self.blocks,
            &sums,
            &s.projection,
            (&s.own, &s.right),
            &s.kept,
        );
        (gain, Some(scores))
    }

    /// Everything; none where no column has a part of its own.
    pub fn score(
        &self,
        columns: &CandidateColumns,
        k: usize,
        shapes: usize,
    ) -> Option<CandidateScore> {
        self.score_of(columns, &self.cross(columns, k), (k, shapes))
    }

    /// The same, of sums that are known.
    pub(crate) fn score_of(
        &self,
        columns: &CandidateColumns,
        cross: &[CrossProducts],
        (k, shapes): (usize, usize),
    ) -> Option<CandidateScore> {
        let total = self.over(cross, k, &RowRole::fitted);
        let (solution, share) = partial(&total, &self.inverse, &self.at.pull, SHARE);
        let solution = solution?;
        let (p_value, effective_rows) = self.significance(cross, &total, &solution, columns);
        let (before, after, rows) = self.touched(columns, &solution, &total);
        let effective = effective_rows.min(rows);
        let free = (solution.kept.len() + shapes) as f64;
        let delta_bic = effective * (before / after).ln() - free * effective.max(2.0).ln();

        let in_folds = self.over(cross, k, &|r| matches!(r, RowRole::Fold(_)));
        let mut folds = Vec::with_capacity(self.folds.len());
        for (f, fold) in self.folds.iter().enumerate() {
            let held_out = self.over(cross, k, &|r| r == RowRole::Fold(f));
            let train = in_folds.without(&held_out);
            let (solved, _) = partial(&train, &fold.inverse, &fold.score, 0.0);
            folds.push(match solved {
                None => self.base_folds[f],
                Some(s) => square_with(&fold.held_out, &held_out, &s),
            });
        }
        let base: f64 = self.base_folds.iter().sum();
        let with: f64 = folds.iter().sum();
        let vetoes = [self.base_vetoes.clone(), self.vetoes(cross, &solution)];
        Some(CandidateScore {
            beta: solution.beta.iter().copied().collect(),
            gain: solution.removed / self.at.square.max(f64::MIN_POSITIVE),
            unique_share: share,
            p_value,
            delta_bic,
            effective_rows: effective,
            cv_gain: (base - with) / base.max(f64::MIN_POSITIVE),
            cv_std: spread(&self.base_folds, &folds) / base.max(f64::MIN_POSITIVE),
            folds,
            vetoes,
        })
    }

    /// Chance of what a candidate shows beyond that which processing alone makes of it; 1 where no column has a part
    /// of its own.
    pub fn p_value_beyond(&self, columns: &CandidateColumns, k: usize, artefact: &Artefact) -> f64 {
        let cross = self.cross(columns, k);
        let total = self.over(&cross, k, &RowRole::fitted);
        let (solution, _) = partial(&total, &self.inverse, &self.at.pull, SHARE);
        let (Some(s), (_, Some(scores))) = (solution, self.gain_by_blocks(&cross, k)) else {
            return 1.0;
        };
        let mut pull = -s.projection.tr_mul(&artefact.pull);
        for piece in self.problem.split.pieces.iter().filter(|p| p.role.fitted()) {
            for (j, own) in columns[piece.stretch].iter().enumerate() {
                let rows = &artefact.rows[piece.stretch][j];
                if own.is_empty() || rows.is_empty() {
                    continue;
                }
                let weight = self.at.weights[j].powi(2);
                for (x, column) in pull.iter_mut().zip(own) {
                    *x += weight * dot(&column[piece.rows.clone()], &rows[piece.rows.clone()]);
                }
            }
        }
        scores.p_value_beyond(&pull)
    }

    /// Squared error on each piece that may veto, with a candidate.
    fn vetoes(&self, cross: &[CrossProducts], solution: &CandidateSolution) -> Vec<f64> {
        let pieces = self.problem.split.pieces.iter().zip(cross);
        let vetoing = pieces.filter(|(p, _)| p.role == RowRole::Veto);
        vetoing
            .zip(&self.of_vetoes)
            .map(|((_, cross), total)| square_with(total, cross, solution))
            .collect()
    }

    /// Weighted squared residual of the joints that a candidate touches, without and with it, and their
    /// rows. Other joints gain too where parameters that they share were bent by the effect's absence.
    fn touched(
        &self,
        columns: &CandidateColumns,
        s: &CandidateSolution,
        total: &CrossProducts,
    ) -> (f64, f64, f64) {
        let (mut before, mut after, mut rows) = (0.0, 0.0, 0.0);
        let unknowns = &self.at.base.unknowns.columns;
        for (piece, sums) in self.problem.split.pieces.iter().zip(&self.at.base.sums) {
            if !piece.role.fitted() {
                continue;
            }
            for (j, own) in columns[piece.stretch].iter().enumerate() {
                if own.is_empty() || self.problem.split.ignores(piece.stretch, j) {
                    continue;
                }
                let w = self.at.weights[j].powi(2);
                let index = unknowns[j].iter().map(|i| s.delta[*i]);
                let delta = DVector::from_iterator(unknowns[j].len(), index);
                let sum = &sums[j];
                before += w * sum.square;
                after += w
                    * (sum.square - 2.0 * delta.dot(&sum.score)
                        + delta.dot(&(&sum.normal * &delta)));
                rows += piece.rows.len() as f64;
            }
        }
        after += 2.0 * s.delta.dot(&(&total.with_base * &s.beta)) - 2.0 * s.beta.dot(&total.score)
            + s.beta.dot(&(&total.own * &s.beta));
        (before, after.max(1e-12 * before), rows)
    }

    /// F test of the coefficients with a covariance that correlation from piece to piece does not
    /// break (Newey and West 1987, Bartlett's weights), and the effective sample size.
    fn significance(
        &self,
        cross: &[CrossProducts],
        total: &CrossProducts,
        s: &CandidateSolution,
        columns: &CandidateColumns,
    ) -> (f64, f64) {
        let k = s.beta.len();
        let mut scores: Vec<(usize, DVector<f64>)> = Vec::new();
        let at = self.at;
        for ((piece, c), sums) in self
            .problem
            .split
            .pieces
            .iter()
            .zip(cross)
            .zip(&at.base.sums)
        {
            if !piece.role.fitted() {
                continue;
            }
            // X'W(e - X delta - C beta) of the piece
            let mut base = DVector::zeros(at.base.unknowns.len());
            for (j, sum) in sums.iter().enumerate() {
                let w = at.weights[j] * at.weights[j];
                let index = &at.base.unknowns.columns[j];
                let own = DVector::from_iterator(index.len(), index.iter().map(|i| s.delta[*i]));
                let left = &sum.score - &sum.normal * own;
                for (x, &i) in left.iter().zip(index) {
                    base[i] += w * x;
                }
            }
            base -= &c.with_base * &s.beta;
            let own = &c.score - c.with_base.tr_mul(&s.delta) - &c.own * &s.beta;
            scores.push((piece.stretch, own - s.projection.tr_mul(&base)));
        }
        let count = scores.len() as f64;
        let lag = LAG.min((count / 8.0) as usize);
        let mut middle = long_run(&scores, k, lag as f64);
        // as if rows were independent: weighted residuals have variance 1 by construction
        let (_, after, rows) = self.touched(columns, s, total);
        let variance = after / rows.max(1.0);
        // redundant columns are not tested
        middle = middle.select_rows(&s.kept).select_columns(&s.kept);
        let tested = s.kept.len() as f64;
        let mut ratio = 0.0;
        for (a, &i) in s.kept.iter().enumerate() {
            let least = variance * s.own[(i, i)];
            ratio += middle[(a, a)] / least.max(f64::MIN_POSITIVE) / tested;
            middle[(a, a)] = middle[(a, a)].max(least);
        }
        // correlation only takes certainty away
        let inflation = ratio.max(1.0);
        let score = (&s.own * &s.beta).select_rows(&s.kept);
        let wald = score.dot(&RankRevealingInverse::of(&middle).solve(&score)) / tested;
        let freedom = (count / (lag + 1) as f64 - tested).max(3.0);
        let p = match FisherSnedecor::new(tested, freedom) {
            Ok(f) if wald.is_finite() && wald > 0.0 => f.sf(wald),
            _ => 1.0,
        };
        (p, rows / inflation)
    }
}

/// Pieces over which scores count as correlated; a piece is some correlation times long.
pub(crate) const LAG: usize = 2;
/// Least share of a column that must be its own.
const SHARE: f64 = 0.001;

/// Coefficients of a candidate and the base step that goes with them.
struct CandidateSolution {
    beta: DVector<f64>,
    delta: DVector<f64>,
    /// A^-1 X'WC.
    projection: DMatrix<f64>,
    /// S.
    own: DMatrix<f64>,
    /// C'We - T'X'We.
    right: DVector<f64>,
    /// Weighted squares removed.
    removed: f64,
    /// Columns with a part of their own; the others are redundant.
    kept: Vec<usize>,
}

/// Solves for a candidate beside the base; the second result is its share of its own. None where
/// no column keeps a share above `least`.
fn partial(
    total: &CrossProducts,
    inverse: &RankRevealingInverse,
    score: &DVector<f64>,
    least: f64,
) -> (Option<CandidateSolution>, f64) {
    let projection = inverse.times(&total.with_base);
    let own = &total.own - total.with_base.tr_mul(&projection);
    let k = own.nrows();
    let shares = (0..k).map(|i| own[(i, i)] / total.own[(i, i)].max(f64::MIN_POSITIVE));
    let largest = shares.fold(0.0, f64::max);
    if largest <= least || !largest.is_finite() {
        return (None, largest.max(0.0));
    }
    // columns that are absorbed, or that stand for one another, are redundant
    let right = &total.score - projection.tr_mul(score);
    let inverse_own = absorbed(&own, &total.own, least.max(1e-6));
    let kept = (0..k).filter(|i| !inverse_own.redundant(*i)).collect();
    let beta = inverse_own.solve(&right);
    let delta = inverse.solve(score) - &projection * &beta;
    let removed = beta.dot(&right);
    let whole = (beta.transpose() * &total.own * &beta)[(0, 0)];
    let unique = (beta.transpose() * &own * &beta)[(0, 0)];
    let share = if whole > 0.0 { unique / whole } else { 0.0 };
    let solution = CandidateSolution {
        beta,
        delta,
        projection,
        own,
        right,
        removed,
        kept,
    };
    (Some(solution), share)
}

/// Inverse of S on its columns with a share above `least`; the others get none.
fn absorbed(own: &DMatrix<f64>, whole: &DMatrix<f64>, least: f64) -> RankRevealingInverse {
    let k = own.nrows();
    let mut cleared = own.clone();
    for i in 0..k {
        if own[(i, i)] <= least * whole[(i, i)] {
            for l in 0..k {
                cleared[(i, l)] = 0.0;
                cleared[(l, i)] = 0.0;
            }
        }
    }
    RankRevealingInverse::of(&cleared)
}

/// |e - X delta|^2 from sums.
fn square_after(total: &NormalEquations, delta: &DVector<f64>) -> f64 {
    total.square - 2.0 * delta.dot(&total.score) + delta.dot(&(&total.normal * delta))
}

/// |e - X delta - C beta|^2 from sums.
fn square_with(total: &NormalEquations, cross: &CrossProducts, s: &CandidateSolution) -> f64 {
    square_after(total, &s.delta) - 2.0 * s.beta.dot(&cross.score)
        + 2.0 * s.delta.dot(&(&cross.with_base * &s.beta))
        + s.beta.dot(&(&cross.own * &s.beta))
}

/// Standard error of a sum of differences over folds.
pub fn spread(base: &[f64], with: &[f64]) -> f64 {
    let n = base.len() as f64;
    if n < 2.0 {
        return f64::INFINITY;
    }
    let differences: Vec<f64> = base.iter().zip(with).map(|(a, b)| a - b).collect();
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (variance * n).sqrt()
}
