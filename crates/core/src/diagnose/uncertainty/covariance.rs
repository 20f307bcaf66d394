//! Standard deviations of a fit: what correlated residuals leave open, what was done to the positions, and how far
//! shapes may go before the data say no.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

use super::{bias, profile};
use crate::diagnose::candidates::score::LAG;
use crate::diagnose::problem::data_split::{Piece, RowRole};
use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::normal_equations::{NormalEquations, PieceSums};
use crate::diagnose::problem::unknowns::Unknown;
use crate::effect::AugmentedModel;
use crate::math::long_run::long_run;
use crate::math::rank_revealing::RankRevealingInverse;
use crate::motion::MotionError;

/// Covariance of all unknowns. What these data do not determine beside the others has an infinite variance.
///
/// # Errors
/// [`MotionError`] of the filters.
pub fn covariance(
    at: &FittedModel,
    problem: &FitProblem,
    cutoff_hz: f64,
) -> Result<DMatrix<f64>, MotionError> {
    let mut covariance = of_residual(at, problem);
    for bias in [
        bias::from_smoothing(at, problem)?,
        bias::from_noise(at, problem)?,
        bias::from_rests(at, problem, cutoff_hz),
    ] {
        covariance += &bias * bias.transpose();
    }
    profile::widen(at, problem, &|_| true, &mut covariance)?;
    Ok(covariance)
}

/// Covariance of (shape, linear) of one effect, row-major, by that of all unknowns; zeros for what is held or chosen
/// from a few.
pub fn of_effect(
    unknowns: &[Unknown],
    covariance: &DMatrix<f64>,
    model: &AugmentedModel,
    effect: usize,
) -> Vec<f64> {
    let added = &model.effects[effect];
    let (count, shapes) = (added.parameters(), added.shape.len());
    let wanted = |i: usize| match i.checked_sub(shapes) {
        None => Unknown::Shape { effect, k: i },
        Some(k) => Unknown::Linear { effect, k },
    };
    let place = |i: usize| unknowns.iter().position(|u| *u == wanted(i));
    let places: Vec<Option<usize>> = (0..count).map(place).collect();
    let mut out = vec![0.0; count * count];
    for (a, pa) in places.iter().enumerate() {
        for (b, pb) in places.iter().enumerate() {
            if let (Some(pa), Some(pb)) = (pa, pb) {
                out[a * count + b] = covariance[(*pa, *pb)];
            }
        }
    }
    out
}

/// Covariance of all unknowns without the bias of the positions, which takes fits of its own, and with the profile of
/// one effect's shapes.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn without_bias(
    at: &FittedModel,
    problem: &FitProblem,
    effect: usize,
) -> Result<DMatrix<f64>, MotionError> {
    let mut covariance = of_residual(at, problem);
    let own = |u: &Unknown| matches!(u, Unknown::Shape { effect: e, .. } if *e == effect);
    profile::widen(at, problem, &own, &mut covariance)?;
    Ok(covariance)
}

/// What correlated residuals leave open: the sandwich over pieces (Newey and West 1987), at least that of
/// independent rows.
fn of_residual(at: &FittedModel, problem: &FitProblem) -> DMatrix<f64> {
    let base = &at.base;
    let u = base.unknowns.len();
    let inverse = RankRevealingInverse::of(&at.normal);
    let jackknife = Jackknife::of(&at.normal, &inverse);
    let pieces = problem.split.pieces.par_iter().zip(&base.sums);
    let fitted = pieces.filter(|(piece, _)| piece.role.fitted());
    let of_piece = |(piece, sums): (&Piece, &Vec<PieceSums>)| {
        let own = base.sum_of(sums, &at.weights);
        let score = jackknife
            .as_ref()
            .and_then(|jackknife| jackknife.score(&own));
        let moving = (0..sums.len()).filter(|j| !problem.split.ignores(piece.stretch, *j));
        let rows = moving.count() * piece.rows.len();
        (rows, (piece.stretch, score.unwrap_or(own.score)))
    };
    let found: Vec<(usize, (usize, DVector<f64>))> = fitted.map(of_piece).collect();
    let rows = found.iter().map(|(rows, _)| *rows as f64).sum::<f64>();
    let scores: Vec<(usize, DVector<f64>)> = found.into_iter().map(|(_, score)| score).collect();
    let mut middle = long_run(&scores, u, LAG as f64);
    // the prior is data too
    middle += &at.information * problem.prior.rows_per_independent.max(1.0);
    let total = base.total(&problem.split, &at.weights, &RowRole::fitted);
    let variance = total.square / rows.max(1.0);
    for i in 0..u {
        let least = variance * total.normal[(i, i)];
        if middle[(i, i)] < least {
            middle[(i, i)] = least;
        }
    }
    let mut covariance = inverse.times(&(middle * inverse.matrix()));
    for i in (0..u).filter(|i| inverse.redundant(*i)) {
        covariance[(i, i)] = f64::INFINITY;
    }
    covariance
}

/// Scores of pieces, as large as leaving each of them out would move the unknowns, for the fit has taken its part of
/// a piece's noise for itself (the cluster jackknife CR3; Bell and McCaffrey 2002, MacKinnon, Nielsen and Webb
/// 2023).
struct Jackknife {
    /// Unknowns that the data determine.
    kept: Vec<usize>,
    /// Root of their diagonal in N, and the Cholesky factor of N with that diagonal taken out.
    scale: DVector<f64>,
    factor: DMatrix<f64>,
}

/// Least part of what is known of a direction that must be the other pieces': with less, a linear step says nothing
/// of how far it goes without this one.
const LEAST_OTHERS: f64 = 0.1;
/// Most turns of the eigenvalues' search; it takes some tens.
const TURNS: usize = 10_000;

impl Jackknife {
    /// None where the data determine nothing, or the normal matrix has no Cholesky factor.
    fn of(normal: &DMatrix<f64>, inverse: &RankRevealingInverse) -> Option<Self> {
        let kept: Vec<usize> = (0..normal.nrows())
            .filter(|i| !inverse.redundant(*i))
            .collect();
        if kept.is_empty() {
            return None;
        }
        let scale =
            DVector::from_iterator(kept.len(), kept.iter().map(|i| normal[(*i, *i)].sqrt()));
        let factor = scaled(normal, &kept, &scale).cholesky()?.l();
        Some(Jackknife {
            kept,
            scale,
            factor,
        })
    }

    /// N (N - N_i)^-1 g_i by the eigenvalues of N_i in N, each at most 1 - [`LEAST_OTHERS`].
    fn score(&self, own: &NormalEquations) -> Option<DVector<f64>> {
        let half =
            self.factor
                .solve_lower_triangular(&scaled(&own.normal, &self.kept, &self.scale))?;
        let part = self.factor.solve_lower_triangular(&half.transpose())?;
        let right = self
            .kept
            .iter()
            .zip(&self.scale)
            .map(|(i, s)| own.score[*i] / s);
        let right = DVector::from_iterator(self.kept.len(), right);
        let right = self.factor.solve_lower_triangular(&right)?;
        let eigen = SymmetricEigen::try_new(part, f64::EPSILON, TURNS)?;
        let mut along = eigen.eigenvectors.tr_mul(&right);
        for (x, share) in along.iter_mut().zip(&eigen.eigenvalues) {
            *x /= (1.0 - share).clamp(LEAST_OTHERS, 1.0);
        }
        let larger = &self.factor * (eigen.eigenvectors * along);
        let mut score = own.score.clone();
        for ((i, s), x) in self.kept.iter().zip(&self.scale).zip(&larger) {
            score[*i] = s * x;
        }
        Some(score)
    }
}

/// A matrix over some of the unknowns, over the scale of each.
fn scaled(matrix: &DMatrix<f64>, kept: &[usize], scale: &DVector<f64>) -> DMatrix<f64> {
    let n = kept.len();
    DMatrix::from_fn(n, n, |a, b| {
        matrix[(kept[a], kept[b])] / (scale[a] * scale[b])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces of rows of two columns, and what they pull where all together are fitted.
    fn pieces(of: &[&[[f64; 3]]]) -> Vec<NormalEquations> {
        let whole = of.iter().copied().flatten();
        let (normal, right) = whole.fold(
            (DMatrix::zeros(2, 2), DVector::zeros(2)),
            |(n, r): (DMatrix<f64>, DVector<f64>), [a, b, y]| {
                let x = DVector::from_vec(vec![*a, *b]);
                (n + &x * x.transpose(), r + x * *y)
            },
        );
        let fitted = normal.try_inverse().unwrap() * right;
        let piece = |rows: &&[[f64; 3]]| {
            let mut total = NormalEquations {
                normal: DMatrix::zeros(2, 2),
                score: DVector::zeros(2),
                square: 0.0,
            };
            for [a, b, y] in *rows {
                let x = DVector::from_vec(vec![*a, *b]);
                let e = y - x.dot(&fitted);
                total.normal += &x * x.transpose();
                total.score += x * e;
            }
            total
        };
        of.iter().map(piece).collect()
    }

    #[test]
    fn the_score_of_a_piece_is_what_leaving_it_out_moves() {
        let rows: [&[[f64; 3]]; 3] = [
            &[[1.0, 0.2, 1.3], [0.5, -1.0, 0.1]],
            &[[-0.7, 0.4, -0.2], [2.0, 0.3, 2.5]],
            &[[0.1, 1.5, 2.0], [1.0, 1.0, 1.7]],
        ];
        let all = pieces(&rows);
        let sum = |of: &[usize]| {
            let none = DMatrix::zeros(2, 2);
            of.iter()
                .fold(none, |n: DMatrix<f64>, i| n + &all[*i].normal)
        };
        let whole = sum(&[0, 1, 2]);
        let right = |of: &[usize]| {
            let rows = of.iter().flat_map(|i| rows[*i]);
            rows.fold(DVector::zeros(2), |r: DVector<f64>, [a, b, y]| {
                r + DVector::from_vec(vec![a * y, b * y])
            })
        };
        let fit = |of: &[usize]| sum(of).try_inverse().unwrap() * right(of);
        let moved = fit(&[0, 1, 2]) - fit(&[0, 2]);
        let told = whole.clone().try_inverse().unwrap() * score(&whole, &all[1]);
        assert!((moved - told).amax() < 1e-12);
    }

    fn score(normal: &DMatrix<f64>, own: &NormalEquations) -> DVector<f64> {
        let jackknife = Jackknife::of(normal, &RankRevealingInverse::of(normal)).unwrap();
        jackknife.score(own).unwrap()
    }

    /// What hangs on one piece alone moves by no more than ten times its score there, in no direction.
    #[test]
    fn a_direction_that_only_one_piece_determines_does_not_run_away() {
        for little in [0.0, 1e-9, 1e-3] {
            let other = [[1.0, little, 1.3], [0.5, -little, 0.1], [0.2, 0.0, 0.5]];
            let own = [[1.0, 1.0, 2.0], [1.0, 1.001, 2.2]];
            let all = pieces(&[&other, &own]);
            let whole = &all[0].normal + &all[1].normal;
            let inverse = whole.clone().try_inverse().unwrap();
            // g' N^-1 g, in white deviations
            let size = |g: &DVector<f64>| g.dot(&(&inverse * g)).sqrt();
            let larger = score(&whole, &all[1]);
            let times = size(&larger) / size(&all[1].score);
            assert!(
                (1.0 - 1e-9..=10.0 + 1e-6).contains(&times),
                "{little} {times}"
            );
        }
    }
}
