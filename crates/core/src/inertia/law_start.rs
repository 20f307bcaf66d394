//! Where a friction law begins that no log of one joint gave: columns that are linear, v and tanh(w_k v) for eight
//! slopes w_k, of which every joint takes the two that explain most.

use super::accumulate::BlockFactors;
use super::columns::{GRADIENT, JointTerm, KnownFriction, RegressorColumns};
use super::solution::{FitError, FitInputs};
use super::solve::{Fit, RowWeighting, fit, fit_with, least_square, weights_of};
use crate::robot::friction::DoubleTanh;

/// Slopes of the columns that begin a law, times the joint's rms speed.
const SLOPES: [f64; 8] = [0.7, 1.5, 3.3, 7.0, 15.0, 33.0, 70.0, 150.0];

/// Begins the law of every joint whose own terms name viscous friction: the columns with the laws
/// as known friction of no covariance, without those terms.
///
/// # Errors
/// Those of `pass`, and [`FitError`].
pub fn begin<E: From<FitError>>(
    linear: &RegressorColumns,
    pass: &mut dyn FnMut(&RegressorColumns) -> Result<BlockFactors, E>,
) -> Result<RegressorColumns, E> {
    let plain = fit(&pass(linear)?, RowWeighting::Wls)?;
    let ladder = SlopeLadder::of(linear, &plain);
    let factors = pass(&ladder.columns)?;
    let weights = weights_of(&factors, &plain.residual_std);
    let inputs = FitInputs::weighted(&weights, None);
    // one block of each joint's R factor is all that a choice needs
    let factors = factors.in_one_block();
    let pairs = ladder.best_pairs(&factors, inputs)?;
    Ok(ladder.laws(&factors, inputs, &pairs)?)
}

/// Place of viscous friction among a joint's own terms.
fn viscous(own: &[JointTerm]) -> Option<usize> {
    own.iter().position(|o| *o == JointTerm::Viscous)
}

/// Columns of tanh(w_k v) for all slopes, of every joint with viscous friction.
struct SlopeLadder<'a> {
    linear: &'a RegressorColumns,
    columns: RegressorColumns,
    /// w_k per joint [s/m or s/rad].
    slopes: Vec<[f64; SLOPES.len()]>,
}

impl<'a> SlopeLadder<'a> {
    fn of(linear: &'a RegressorColumns, plain: &Fit) -> Self {
        let mut columns = linear.clone();
        let mut slopes = vec![[0.0; SLOPES.len()]; linear.joints];
        for (j, slopes) in slopes.iter_mut().enumerate() {
            let Some(k) = viscous(&linear.own[j]) else {
                continue;
            };
            let speed = plain.column_rms[(j, linear.first_own(j) + k)];
            let unit = if speed > 0.0 { 1.0 / speed } else { 1.0 };
            *slopes = SLOPES.map(|s| s * unit);
            columns.own[j].retain(|o| *o != JointTerm::Coulomb);
            columns.own[j].extend(slopes.map(JointTerm::Saturating));
        }
        SlopeLadder {
            linear,
            columns,
            slopes,
        }
    }

    /// Places of each joint's own terms beside the ladder.
    fn base(&self) -> Vec<Vec<usize>> {
        self.columns
            .places(|o| !matches!(o, JointTerm::Saturating(_)))
    }

    /// The same with a pair of slopes on each joint.
    fn with_pairs(&self, pairs: &[[usize; 2]]) -> Vec<Vec<usize>> {
        let mut keep = self.base();
        for ((keep, own), pair) in keep.iter_mut().zip(&self.columns.own).zip(pairs) {
            if viscous(own).is_some() {
                keep.extend(pair.map(|k| own.len() - SLOPES.len() + k));
            }
        }
        keep
    }

    /// The two slopes that explain most, joint after joint.
    fn best_pairs(
        &self,
        factors: &BlockFactors,
        inputs: FitInputs,
    ) -> Result<Vec<[usize; 2]>, FitError> {
        let mut pairs = vec![[SLOPES.len() - 2, 2]; self.linear.joints];
        for j in (0..pairs.len()).filter(|j| viscous(&self.linear.own[*j]).is_some()) {
            let mut best = (f64::INFINITY, pairs[j]);
            for steep in 1..SLOPES.len() {
                for flat in 0..steep {
                    pairs[j] = [steep, flat];
                    let chosen = factors.with_own(&self.with_pairs(&pairs));
                    let square = least_square(&chosen, inputs)?;
                    if square < best.0 {
                        best = (square, pairs[j]);
                    }
                }
            }
            pairs[j] = best.1;
        }
        Ok(pairs)
    }

    /// The columns with laws of the chosen slopes in place of viscous and Coulomb friction.
    fn laws(
        &self,
        factors: &BlockFactors,
        inputs: FitInputs,
        pairs: &[[usize; 2]],
    ) -> Result<RegressorColumns, FitError> {
        let chosen = factors.with_own(&self.with_pairs(pairs));
        let found = fit_with(&chosen, inputs)?;
        let mut start = self.linear.clone();
        for (j, pair) in pairs.iter().enumerate() {
            let Some(k) = viscous(&self.linear.own[j]) else {
                continue;
            };
            let at = |k: usize| found.theta[chosen.columns.first_own(j) + k];
            let last = chosen.columns.own[j].len();
            let [steep, flat] = pair.map(|k| self.slopes[j][k]);
            let place = self.base()[j].iter().position(|b| *b == k);
            start.own[j].retain(|o| !matches!(o, JointTerm::Viscous | JointTerm::Coulomb));
            start.known[j] = Some(KnownFriction {
                law: DoubleTanh::from_parameters([
                    at(place.unwrap_or_default()),
                    at(last - 2),
                    at(last - 1),
                    steep,
                    flat,
                ]),
                covariance: [[0.0; GRADIENT]; GRADIENT],
                held: [false; GRADIENT],
            });
        }
        Ok(start)
    }
}
