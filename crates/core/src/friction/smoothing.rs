//! Other smoothings of the known inputs: which one the innovations like best, and what another changes.

use nalgebra::DVector;

use super::inputs::Inputs;
use super::passes::{GivenNoise, Maximum, RefinedParameters, refine_others, settle, spread};
use super::prepare::Prepared;
use super::problem::{FrictionProblem, NoiseLevels};
use crate::math::descent::Ending;

/// Factor on the encoder's variance in the other weighting.
const COARSER: f64 = 4.0;
/// Cut-offs that an acceleration of another joint is tried at [Hz].
const BANDS_HZ: [f64; 5] = [60.0, 36.0, 22.0, 13.0, 8.0];
/// Log-likelihood that a narrower one has to gain: that of a parameter more (Akaike 1974).
const LIKELIER: f64 = 1.0;
/// Steps to the maximum of a problem that differs only in a choice of the processing.
const CHOICE_STEPS: usize = 6;

/// Narrows the accelerations of the other joints one after the other as long as the innovations
/// grow likelier by it. Returns the cut-offs [Hz], one per joint, with the problem and its maximum;
/// `None` where the motions as they are do best.
pub(super) fn bands(
    prepared: &Prepared,
    inputs: &Inputs,
    maximum: &Maximum,
    given: &GivenNoise,
) -> Option<(Vec<f64>, FrictionProblem, Maximum)> {
    let spread = spread(&prepared.problem);
    let fixed = maximum.fixed;
    let mut cutoffs = vec![f64::INFINITY; inputs.robot.joints()];
    let mut best: Option<(FrictionProblem, RefinedParameters)> = None;
    let mut top = maximum.score.log_likelihood;
    for i in (0..cutoffs.len()).filter(|i| *i != inputs.joint) {
        for band in BANDS_HZ {
            let before = std::mem::replace(&mut cutoffs[i], band);
            let start = best
                .as_ref()
                .map_or(&maximum.parameters, |b| &b.1.parameters);
            let found = inputs.problem(prepared, &cutoffs).map(|problem| {
                let p = start.clone();
                let noise = maximum.noise;
                let refined = refine_others(&problem, p, noise, &spread, CHOICE_STEPS, fixed);
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
    let (noise, starts) = (maximum.noise, maximum.starts);
    let settled = settle(&problem, refined, noise, given, fixed, starts)?;
    Some((cutoffs, problem, settled))
}

/// Adds to the covariance what another smoothing of the known inputs, and another weight of the
/// encoder, change in the estimate: the innovations cannot show an error that is the same at every
/// reversal.
pub(super) fn add_choices(
    problem: &FrictionProblem,
    again: &FrictionProblem,
    maximum: &mut Maximum,
) {
    let spread = spread(again);
    let p = maximum.parameters.clone();
    let coarser = NoiseLevels {
        position_factor: COARSER * maximum.noise.position_factor,
        ..maximum.noise
    };
    for (problem, noise) in [(again, maximum.noise), (problem, coarser)] {
        let from = p.clone();
        let moved = refine_others(problem, from, noise, &spread, CHOICE_STEPS, maximum.fixed);
        if moved.ending != Ending::Diverged {
            let change = DVector::from_fn(p.len(), |i, _| moved.parameters[i] - p[i]);
            maximum.covariance.ger(1.0, &change, &change, 1.0);
        }
    }
}
