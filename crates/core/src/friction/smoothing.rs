//! Other smoothings of the known inputs: which one the innovations like best, and what another changes.

use nalgebra::DVector;

use super::inputs::FrictionInputs;
use super::passes::{GivenNoise, LikelihoodMaximum, RefinedParameters, refine, settle};
use super::prepare::PreparedProblem;
use super::problem::{FrictionProblem, NoiseLevels};
use crate::math::descent::IterationEnding;

/// Factor on the encoder's variance in the other weighting.
const COARSER: f64 = 4.0;
/// Cut-offs that an acceleration of another joint is tried at [Hz].
const BANDS_HZ: [f64; 5] = [60.0, 36.0, 22.0, 13.0, 8.0];
/// Log-likelihood that a narrower one has to gain: that of a parameter more (Akaike 1974).
const LIKELIER: f64 = 1.0;
/// Steps to the maximum of a problem that differs only in a choice of the processing.
const CHOICE_STEPS: usize = 6;

/// Cut-offs [Hz] of the other joints' accelerations by which the innovations grow likelier, the problem and its maximum.
pub(super) fn bands(
    prepared: &PreparedProblem,
    inputs: &FrictionInputs,
    maximum: &LikelihoodMaximum,
    given: &GivenNoise,
) -> Option<(Vec<f64>, FrictionProblem, LikelihoodMaximum)> {
    let (noise, fixed) = (maximum.noise, maximum.fixed);
    let mut cutoffs = vec![f64::INFINITY; inputs.robot.joints()];
    let mut best: Option<(FrictionProblem, RefinedParameters)> = None;
    let mut top = maximum.score.log_likelihood;
    for i in (0..cutoffs.len()).filter(|i| *i != inputs.joint) {
        for band in BANDS_HZ {
            let before = std::mem::replace(&mut cutoffs[i], band);
            let begun = best.as_ref().map(|(_, refined)| &refined.parameters);
            let begun = begun.unwrap_or(&maximum.parameters);
            let found = inputs.problem(prepared, &cutoffs).map(|problem| {
                let refined = refine(&problem, begun.clone(), noise, CHOICE_STEPS, fixed);
                (problem, refined)
            });
            match found {
                Some((problem, refined)) if refined.score.log_likelihood > top + LIKELIER => {
                    top = refined.score.log_likelihood;
                    best = Some((problem, refined));
                }
                _ => {
                    cutoffs[i] = before;
                    break;
                }
            }
        }
    }
    let (problem, refined) = best?;
    let settled = settle(&problem, refined, noise, given, fixed, maximum.starts)?;
    Some((cutoffs, problem, settled))
}

/// Adds to the covariance what another smoothing of the known inputs, and another weight of the encoder, change.
pub(super) fn add_choices(
    problem: &FrictionProblem,
    again: &FrictionProblem,
    maximum: &mut LikelihoodMaximum,
) {
    // innovations cannot show an error that is the same at every reversal
    let p = maximum.parameters.clone();
    let coarser = NoiseLevels {
        position_factor: COARSER * maximum.noise.position_factor,
        ..maximum.noise
    };
    for (problem, noise) in [(again, maximum.noise), (problem, coarser)] {
        let moved = refine(problem, p.clone(), noise, CHOICE_STEPS, maximum.fixed);
        if moved.ending != IterationEnding::Diverged {
            let change = DVector::from_fn(p.len(), |i, _| moved.parameters[i] - p[i]);
            maximum.covariance.ger(1.0, &change, &change, 1.0);
        }
    }
}
