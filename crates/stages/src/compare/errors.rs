//! Errors of two models on the same rows, and whether their difference is more than chance.
//!
//! Both models see the same rows, so rows are drawn in pairs: a block bootstrap of the difference of
//! their relative errors (Kuensch 1989), in which what both models miss alike cancels.

use schemars::JsonSchema;
use serde::Serialize;

use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::math::bootstrap::intervals_95;
use cft_ident_core::motion::{MotionError, ParallelFilters, Stretch};

/// How much larger the second model's error is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Difference {
    /// Relative error of B less that of A, a fraction.
    pub difference: f64,
    /// 95 % interval of it; none where the logs are too short to say.
    pub interval_95: Option<[f64; 2]>,
}

impl Difference {
    /// Whether the interval leaves out 0: -1 where B is closer, 1 where A is, 0 where these rows do
    /// not tell.
    pub fn sign(&self) -> i8 {
        match self.interval_95 {
            Some([_, high]) if high < 0.0 => -1,
            Some([low, _]) if low > 0.0 => 1,
            _ => 0,
        }
    }
}

/// Differences of all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorDifferences {
    /// Joint by joint, in the robot's order.
    pub joints: Vec<Difference>,
    /// Of the root mean square over joints of the relative errors.
    pub overall: Difference,
}

/// Pieces that the rows are cut into.
const PIECES: usize = 30;
/// Fewest pieces from which an interval is drawn.
const FEWEST: usize = 12;
/// Rows of a piece, at least.
const MIN_PIECE_ROWS: usize = 10;
const SEED: u64 = 19_890_901;

/// Of one joint over one piece: squared errors of both, squared torque.
type PieceSquares = [f64; 3];

/// Compares two models on stretches that are filtered alike.
pub fn differences(
    models: [&AugmentedModel; 2],
    stretches: &[Stretch],
    filters: &ParallelFilters,
) -> Result<ErrorDifferences, MotionError> {
    let n = models[0].model.robot.joints();
    let total: usize = stretches.iter().map(|s| filters.of(s).rows(s.len())).sum();
    let length = total.div_ceil(PIECES).max(MIN_PIECE_ROWS);
    let mut pieces: Vec<Vec<PieceSquares>> = Vec::new();
    for stretch in stretches {
        let parallel = filters.of(stretch);
        let hats = models.map(|model| model.reconstruct(stretch));
        let channels = stretch.tau.iter().chain(hats.iter().flatten());
        let channels: Vec<&[f64]> = channels.map(Vec::as_slice).collect();
        let rows = parallel.run(&channels)?;
        let count = parallel.rows(stretch.len());
        for first in (0..count).step_by(length) {
            let last = (first + length).min(count);
            let joint = |j: usize| {
                let (tau, a, b) = (&rows[j], &rows[n + j], &rows[2 * n + j]);
                let sum = |of: &dyn Fn(usize) -> f64| (first..last).fold(0.0, |s, i| s + of(i));
                [
                    sum(&|i| (tau[i] - a[i]).powi(2)),
                    sum(&|i| (tau[i] - b[i]).powi(2)),
                    sum(&|i| tau[i] * tau[i]),
                ]
            };
            pieces.push((0..n).map(joint).collect());
        }
    }
    Ok(bootstrapped(&pieces, n))
}

fn bootstrapped(pieces: &[Vec<PieceSquares>], n: usize) -> ErrorDifferences {
    // of each joint, then of the mean over joints
    let of = |picked: &[usize]| -> Vec<f64> {
        let mut squares = [0.0; 2];
        let mut out: Vec<f64> = (0..n)
            .map(|j| {
                let sum = |k: usize| picked.iter().map(|p| pieces[*p][j][k]).sum::<f64>();
                let [a, b] = [sum(0) / sum(2), sum(1) / sum(2)];
                squares[0] += a;
                squares[1] += b;
                b.sqrt() - a.sqrt()
            })
            .collect();
        let [a, b] = squares.map(|s| (s / n as f64).sqrt());
        out.push(b - a);
        out
    };
    let all: Vec<usize> = (0..pieces.len()).collect();
    let found = of(&all);
    let intervals = match pieces.len() >= FEWEST {
        true => intervals_95(pieces.len(), 1, SEED, &mut |picked| of(picked)),
        false => Vec::new(),
    };
    let mut shown = found.iter().enumerate().map(|(k, d)| {
        let interval = intervals.get(k).copied();
        Difference {
            difference: *d,
            interval_95: interval.filter(|ends| ends.iter().all(|x| x.is_finite())),
        }
    });
    let joints = shown.by_ref().take(n).collect();
    let overall = shown.next().unwrap_or(Difference {
        difference: f64::NAN,
        interval_95: None,
    });
    ErrorDifferences { joints, overall }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is found of one joint with these squared errors in each of so many pieces.
    fn found(a: impl Fn(usize) -> f64, b: impl Fn(usize) -> f64, count: usize) -> ErrorDifferences {
        let pieces: Vec<_> = (0..count).map(|k| vec![[a(k), b(k), 1.0]]).collect();
        bootstrapped(&pieces, 1)
    }

    #[test]
    fn what_both_models_miss_alike_cancels_from_the_interval() {
        // the error varies tenfold from piece to piece, and B is better by a tenth in each
        let wild = |k: usize| 0.01 * (1.0 + (k % 10) as f64);
        let found = found(wild, |k| 0.81 * wild(k), 30);
        let [low, high] = found.overall.interval_95.unwrap();
        let expected = -0.1 * (0.055_f64).sqrt();
        assert!((found.overall.difference - expected).abs() < 1e-12);
        assert!(low < expected && expected < high && high < 0.0);
        assert_eq!(found.joints[0].sign(), -1);
    }

    #[test]
    fn a_difference_that_changes_its_sign_from_piece_to_piece_is_none() {
        let even = |k: usize| if k.is_multiple_of(2) { 0.04 } else { 0.05 };
        let odd = |k: usize| if k.is_multiple_of(2) { 0.05 } else { 0.04 };
        assert_eq!(found(even, odd, 30).overall.sign(), 0);
    }

    #[test]
    fn a_few_rows_give_no_interval() {
        let found = found(|_| 0.04, |_| 0.01, 5);
        assert_eq!(found.overall.interval_95, None);
        assert!((found.overall.difference + 0.1).abs() < 1e-12);
        assert_eq!(found.overall.sign(), 0);
    }
}
