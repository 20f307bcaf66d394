//! Standard deviations of a fit: what correlated residuals leave open, what was done to the positions, and how far
//! shapes may go before the data say no.

use nalgebra::{DMatrix, DVector};

use super::candidate::LAG;
use super::fit::{Fitted, Ground, Inverse};
use super::plan::Role;
use super::rows::Total;
use super::{moved, profile};
use crate::math::long_run::long_run;
use crate::motion::MotionError;

/// Covariance of all unknowns. What these data do not determine beside the others has an infinite variance.
///
/// # Errors
/// [`MotionError`] of the filters.
pub fn covariance(
    at: &Fitted,
    ground: &Ground,
    cutoff_hz: f64,
) -> Result<DMatrix<f64>, MotionError> {
    let mut covariance = of_residual(at, ground);
    for moved in [
        moved::by_smoothing(at, ground)?,
        moved::by_noise(at, ground)?,
        moved::by_rests(at, ground, cutoff_hz),
    ] {
        covariance += &moved * moved.transpose();
    }
    profile::widen(at, ground, &mut covariance)?;
    Ok(covariance)
}

/// What correlated residuals leave open: the sandwich over pieces (Newey and West 1987), at least that of
/// independent rows.
fn of_residual(at: &Fitted, ground: &Ground) -> DMatrix<f64> {
    let base = &at.base;
    let u = base.unknowns.len();
    let inverse = Inverse::of(&at.normal);
    let mut scores: Vec<(usize, DVector<f64>)> = Vec::new();
    let mut rows = 0.0;
    for (piece, sums) in ground.plan.pieces.iter().zip(&base.sums) {
        if !piece.role.fitted() {
            continue;
        }
        let held = |j: usize| ground.plan.holds(piece.stretch, j);
        rows += ((0..sums.len()).filter(|j| !held(*j)).count() * piece.rows.len()) as f64;
        let own = base.sum_of(sums, &at.weights);
        scores.push((piece.stretch, deleted(&at.normal, &own)));
    }
    let mut middle = long_run(&scores, u, LAG);
    // the prior is data too
    middle += &at.information * ground.prior.rows_per_independent.max(1.0);
    let total = base.total(&ground.plan, &at.weights, &Role::fitted);
    let variance = total.square / rows.max(1.0);
    for i in 0..u {
        let least = variance * total.normal[(i, i)];
        if middle[(i, i)] < least {
            middle[(i, i)] = least;
        }
    }
    let mut covariance = inverse.times(&(middle * inverse.matrix()));
    for i in (0..u).filter(|i| inverse.at_rest(*i)) {
        covariance[(i, i)] = f64::INFINITY;
    }
    covariance
}

/// Score of a piece, as large as leaving the piece out moves the unknowns: N (N - N_i)^-1 g_i, for the fit has
/// taken its part of the piece's noise for itself (the cluster jackknife CR3; Bell and McCaffrey 2002, MacKinnon,
/// Nielsen and Webb 2023). What only this piece determines keeps the score as it is.
fn deleted(normal: &DMatrix<f64>, own: &Total) -> DVector<f64> {
    let without = Inverse::of(&(normal - &own.normal));
    let moved = normal * without.solve(&own.score);
    let kept = (0..moved.len()).map(|i| match without.at_rest(i) {
        true => own.score[i],
        false => moved[i],
    });
    DVector::from_iterator(moved.len(), kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces of rows of two columns, and what they pull where all together are fitted.
    fn pieces(of: &[&[[f64; 3]]]) -> Vec<Total> {
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
            let mut total = Total {
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
        let told = whole.clone().try_inverse().unwrap() * deleted(&whole, &all[1]);
        assert!((moved - told).amax() < 1e-12);
    }

    #[test]
    fn what_only_one_piece_determines_keeps_its_score() {
        let mut all = pieces(&[
            &[[1.0, 0.0, 1.3], [0.5, 0.0, 0.1]],
            &[[-0.7, 0.4, -0.2], [2.0, 0.3, 2.5], [0.3, 0.1, 0.0]],
        ]);
        let whole = &all[0].normal + &all[1].normal;
        let last = all.pop().unwrap();
        let score = deleted(&whole, &last);
        assert_eq!(score[1], last.score[1]);
        assert!(score.iter().all(|x| x.is_finite()));
    }
}
