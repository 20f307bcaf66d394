//! Several starts, annealed passes, and the end at the maximum of the innovation likelihood.
//!
//! A pass of the filter far from the truth linearises wrongly and grows sure of it. So the first
//! passes run with both noises raised (the gains stay, the parameters learn slower), each next
//! one from the last estimate with the prior widened again. The best ends are then taken to the
//! maximum of the likelihood at fixed parameters, the noise levels with them, and the covariance
//! is linearised there.

use std::convert::Infallible;

use nalgebra::{DMatrix, DVector};

use super::filter::ExtendedKalmanFilter;
use super::prepare::PreparedProblem;
use super::problem::{FRICTION, FilterParameters, FrictionProblem, NoiseLevels};
use super::score::{LikelihoodScore, log_likelihood, score};
use super::start::FilterStart;
use crate::math::descent::{IterationEnding, StepControl, Trial, descend};
use crate::math::minimise;

/// Factors on both noises in the annealed passes from a start that may be far off, and from one of a linear fit.
const ANNEALING: [f64; 4] = [100.0, 30.0, 10.0, 3.0];
const ANNEALING_FROM_LOG: [f64; 1] = [10.0];
/// Ends that are refined, and steps until the best of them is chosen.
const REFINED: usize = 3;
const FIRST_STEPS: usize = 6;
/// Prior standard deviations: friction terms and nuisance of the size of the torque, slopes within a factor of five.
const SPREAD_LINEAR: f64 = 2.0;
const SPREAD_SLOPE: f64 = 1.6;
/// Samples per block of the score's outer product, in seconds.
const BLOCK_SECONDS: f64 = 0.25;
/// The noise levels' search ends at this difference of log-likelihoods, or after so many of them.
const TUNE_TOLERANCE: f64 = 0.3;
const TUNE_EVALUATIONS: u64 = 24;
/// Most Gauss-Newton steps of one refinement.
const MOST_STEPS: usize = 40;
/// A step that gains less log-likelihood than this is the last.
const MIN_LIKELIHOOD_GAIN: f64 = 1e-4;
/// Log-likelihood that a second Coulomb term has to gain: that of its two parameters (Akaike 1974).
const SECOND_TERM: f64 = 2.0;
/// What stands still where there is one Coulomb term: Bf2 and w2.
pub(super) const ONE_TERM: [usize; 2] = [2, 4];
/// Slopes within this factor of one another are hardly apart.
const HARDLY_APART: f64 = 2.0;
/// Most steps to the maximum with one term.
const ONE_TERM_STEPS: usize = 15;
/// Damping of the steps.
const DAMPING: StepControl = StepControl {
    rejected_from: 1e-4,
    ..StepControl::damping(10.0, 10.0, [1e-9, 1e8])
};

/// Levels that the user gives; what is not given comes from the log.
#[derive(Debug, Clone, Copy, Default)]
pub struct GivenNoise {
    /// Standard deviation of the torque noise [N or Nm].
    pub torque: Option<f64>,
    /// Factor on the position variance.
    pub position_factor: Option<f64>,
}

/// Maximum of the innovation likelihood of one joint.
#[derive(Debug, Clone)]
pub(super) struct LikelihoodMaximum {
    pub parameters: FilterParameters,
    /// Covariance in the filter's coordinates, widened where the score is coloured.
    pub covariance: DMatrix<f64>,
    pub noise: NoiseLevels,
    pub score: LikelihoodScore,
    pub ending: IterationEnding,
    /// Factor by which coloured innovations widened the covariance.
    pub widening: f64,
    /// A slope stands at an end of its range.
    pub at_limit: [bool; 2],
    /// Parameters that are no unknowns: those of a Coulomb term that the log does as well without.
    pub fixed: &'static [usize],
    pub starts: usize,
}

impl LikelihoodMaximum {
    /// Whether one Coulomb term does.
    pub fn one_term(&self) -> bool {
        !self.fixed.is_empty()
    }
}

/// Prior standard deviations of all parameters.
pub fn spread(problem: &FrictionProblem) -> Vec<f64> {
    let mut s = vec![SPREAD_LINEAR; problem.parameters()];
    s[3] = SPREAD_SLOPE;
    s[4] = SPREAD_SLOPE;
    s
}

/// Noise levels to begin with, from the log alone: the torque's second differences and the encoder's resolution.
pub(super) fn first_noise(problem: &FrictionProblem, given: &GivenNoise) -> NoiseLevels {
    let second = |w: &[f64]| (w[0] - 2.0 * w[1] + w[2]).abs();
    let records = problem.records.iter();
    let mut d: Vec<f64> = records.flat_map(|r| r.tau.windows(3).map(second)).collect();
    d.sort_by(f64::total_cmp);
    let median = d.get(d.len() / 2).copied().unwrap_or(0.0);
    // median of |N(0, 6 s^2)| is 0.6745 sqrt(6) s
    let torque = (median / 1.652).max(1e-3 * problem.torque_scale);
    NoiseLevels {
        torque: given.torque.unwrap_or(torque),
        position_factor: given.position_factor.unwrap_or(1.0).max(1.0),
    }
}

/// Runs every start through the annealed passes, then refines the best.
pub(super) fn maximise(
    prepared: &PreparedProblem,
    starts: &[FilterStart],
    given: &GivenNoise,
) -> Option<LikelihoodMaximum> {
    let problem = &prepared.problem;
    let noise = first_noise(problem, given);
    let spread = spread(problem);
    let mut filter = ExtendedKalmanFilter::new(problem);
    let mut ends: Vec<(FilterParameters, f64)> = Vec::new();
    for start in starts {
        let mut p = start.parameters.clone();
        problem.clamp(&mut p);
        let annealing: &[f64] = match start.residual.is_finite() {
            true => &ANNEALING_FROM_LOG,
            false => &ANNEALING,
        };
        for &factor in annealing {
            let raised = NoiseLevels {
                torque: noise.torque * factor,
                position_factor: noise.position_factor * factor * factor,
            };
            let pass = filter.pass(problem, &p, &spread, raised);
            if !pass.log_likelihood.is_finite() || pass.parameters.iter().any(|x| !x.is_finite()) {
                break;
            }
            p = pass.parameters;
        }
        problem.clamp(&mut p);
        // the start itself stands where the passes lost the way
        for candidate in [p, start.parameters.clone()] {
            let l = log_likelihood(problem, &candidate, noise);
            if l.is_finite() {
                ends.push((candidate, l));
            }
        }
    }
    ends.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut best: Option<RefinedParameters> = None;
    for (p, _) in ends.into_iter().take(REFINED) {
        let refined = refine(problem, p, noise, FIRST_STEPS, &[]);
        let likelihood = refined.score.log_likelihood;
        if (best.as_ref()).is_none_or(|b| likelihood > b.score.log_likelihood) {
            best = Some(refined);
        }
    }
    settle(problem, best?, noise, given, &[], starts.len())
}

/// The maximum of `problem` from that of a share of its rows.
pub(super) fn settle_on(
    problem: &FrictionProblem,
    maximum: &LikelihoodMaximum,
    given: &GivenNoise,
) -> Option<LikelihoodMaximum> {
    let (p, noise) = (maximum.parameters.clone(), maximum.noise);
    let refined = refine(problem, p, noise, FIRST_STEPS, &[]);
    let (fixed, starts) = (maximum.fixed, maximum.starts);
    settle(problem, refined, noise, given, fixed, starts)
}

/// Noise levels and parameters in turn: each is little moved by the other.
pub(super) fn settle(
    problem: &FrictionProblem,
    mut refined: RefinedParameters,
    mut noise: NoiseLevels,
    given: &GivenNoise,
    fixed: &'static [usize],
    starts: usize,
) -> Option<LikelihoodMaximum> {
    for _ in 0..2 {
        noise = tune(problem, &refined.parameters, noise, given);
        refined = refine(problem, refined.parameters, noise, MOST_STEPS, fixed);
    }
    finish(problem, refined, noise, fixed, starts)
}

/// The maximum with one Coulomb term, where the log is as likely without a second.
pub(super) fn fewer_terms(
    problem: &FrictionProblem,
    maximum: &LikelihoodMaximum,
    given: &GivenNoise,
) -> Option<LikelihoodMaximum> {
    if maximum.one_term() || second_is_known(maximum) {
        return None;
    }
    let p = &maximum.parameters;
    let sum = p[1] + p[2];
    let starts = [(sum, p[3]), (sum, p[4]), (sum, 0.5 * (p[3] + p[4]))];
    let refined = starts.map(|(height, slope)| {
        let mut start = p.clone();
        (start[1], start[2]) = (height, 0.0);
        (start[3], start[4]) = (slope, slope);
        refine(problem, start, maximum.noise, ONE_TERM_STEPS, &ONE_TERM)
    });
    let likelihood = |r: &RefinedParameters| r.score.log_likelihood;
    let refined = refined.into_iter().filter(|r| likelihood(r).is_finite());
    let best = refined.max_by(|a, b| likelihood(a).total_cmp(&likelihood(b)))?;
    // coloured innovations count for less, as in the covariance
    let gain = (maximum.score.log_likelihood - likelihood(&best)) / maximum.widening;
    if gain >= SECOND_TERM {
        return None;
    }
    let (noise, starts) = (maximum.noise, maximum.starts);
    settle(problem, best, noise, given, &ONE_TERM, starts)
}

/// Whether height and slope of both terms are known to a tenth, and the slopes are well apart.
fn second_is_known(maximum: &LikelihoodMaximum) -> bool {
    let (p, c) = (&maximum.parameters, &maximum.covariance);
    let height = |i: usize| c[(i, i)] < (0.1 * p[i]).powi(2);
    // slopes are logarithms
    let slope = |i: usize| c[(i, i)] < 0.1 * 0.1;
    height(1) && height(2) && slope(3) && slope(4) && (p[3] - p[4]).abs() > HARDLY_APART.ln()
}

/// Parameters at which a refinement ended.
pub(super) struct RefinedParameters {
    pub parameters: FilterParameters,
    pub score: LikelihoodScore,
    pub ending: IterationEnding,
}

fn block(problem: &FrictionProblem) -> usize {
    let record = &problem.records[0];
    let n = record.t.len();
    let step = (record.t[n - 1] - record.t[0]) / (n - 1) as f64;
    ((BLOCK_SECONDS / step).round() as usize).max(1)
}

/// The step, which the prior only limits: about zero it would bias the linear part.
fn damped(
    score: &LikelihoodScore,
    spread: &[f64],
    damping: f64,
    fixed: &[usize],
) -> Option<DVector<f64>> {
    let mut h = score.information.clone();
    let mut gradient = score.gradient.clone();
    hold(&mut h, fixed);
    for &j in fixed {
        gradient[j] = 0.0;
    }
    for (j, s) in spread.iter().enumerate() {
        h[(j, j)] = h[(j, j)] * (1.0 + damping) + 1e-6 / (s * s);
    }
    Some(h.cholesky()?.solve(&gradient))
}

/// Parts some parameters from all others in an information matrix.
fn hold(information: &mut DMatrix<f64>, fixed: &[usize]) {
    for &j in fixed {
        information.row_mut(j).fill(0.0);
        information.column_mut(j).fill(0.0);
        information[(j, j)] = 1.0;
    }
}

/// Gauss-Newton with step control on the innovation likelihood, some parameters fixed.
pub(super) fn refine(
    problem: &FrictionProblem,
    start: FilterParameters,
    noise: NoiseLevels,
    most: usize,
    fixed: &[usize],
) -> RefinedParameters {
    let (block, spread) = (block(problem), spread(problem));
    let score = |p: &[f64]| score(problem, p, noise, block);
    let first = score(&start);
    let Ok(((parameters, score), ending, _)) =
        descend((start, first), &DAMPING, most, &mut |(p, at), damping| {
            let Some(step) = damped(at, &spread, damping, fixed) else {
                return Ok::<_, Infallible>(Trial::NoStep);
            };
            // no step longer than the prior: the Gauss-Newton model is local
            let parts = step.iter().zip(&spread).map(|(d, s)| d.abs() / s);
            let shorten = 0.5 / parts.fold(0.5, f64::max);
            let mut trial: FilterParameters =
                p.iter().zip(&step).map(|(x, d)| x + shorten * d).collect();
            problem.clamp(&mut trial);
            let next = score(&trial);
            let gain = next.log_likelihood - at.log_likelihood;
            let rounding = 1e-9 * at.log_likelihood.abs();
            Ok(match gain.is_finite() {
                true if gain >= MIN_LIKELIHOOD_GAIN => Trial::Accepted((trial, next)),
                true if gain >= 0.0 => Trial::Last((trial, next)),
                true if gain > -MIN_LIKELIHOOD_GAIN * (1.0 + rounding) => Trial::Settled,
                _ => Trial::Rejected,
            })
        });
    RefinedParameters {
        parameters,
        score,
        ending,
    }
}

/// Noise levels of highest likelihood at fixed parameters; the position's never below the resolution's own.
fn tune(
    problem: &FrictionProblem,
    p: &[f64],
    noise: NoiseLevels,
    given: &GivenNoise,
) -> NoiseLevels {
    let free = (given.torque.is_none(), given.position_factor.is_none());
    if !free.0 && !free.1 {
        return noise;
    }
    let at = |x: &[f64]| {
        let [torque, beyond] = [x[0], x[1]].map(|x| x.clamp(-30.0, 30.0).exp());
        // 1 + exp keeps the floor without a kink that a simplex could hang on
        let position_factor = 1.0 + beyond;
        NoiseLevels {
            torque: if free.0 { torque } else { noise.torque },
            position_factor: if free.1 {
                position_factor
            } else {
                noise.position_factor
            },
        }
    };
    let beyond = (noise.position_factor - 1.0).max(0.1);
    let found = minimise::nelder_mead(
        &mut |x: &[f64]| -log_likelihood(problem, p, at(x)),
        &[noise.torque.ln(), beyond.ln()],
        &[0.7, 1.5],
        TUNE_TOLERANCE,
        TUNE_EVALUATIONS,
    );
    let best = at(&found.x);
    let likelier = log_likelihood(problem, p, best) > log_likelihood(problem, p, noise);
    if likelier { best } else { noise }
}

/// Covariance at the maximum.
fn finish(
    problem: &FrictionProblem,
    refined: RefinedParameters,
    noise: NoiseLevels,
    fixed: &'static [usize],
    starts: usize,
) -> Option<LikelihoodMaximum> {
    let mut h = refined.score.information.clone();
    for (j, s) in spread(problem).iter().enumerate() {
        h[(j, j)] += 1.0 / (s * s);
    }
    hold(&mut h, fixed);
    let mut covariance = h.cholesky()?.inverse();
    for &j in fixed {
        covariance[(j, j)] = 0.0;
    }
    // white innovations give outer = information; the mean ratio over the friction directions says
    // by how much colour widens
    let spread_of_score = &covariance * &refined.score.outer * &covariance;
    let free = (0..FRICTION).filter(|j| !fixed.contains(j));
    let ratios = free.map(|j| spread_of_score[(j, j)] / covariance[(j, j)]);
    let ratios: Vec<f64> = ratios.collect();
    let widening = match refined.score.blocks > 2 * problem.parameters() {
        true => (ratios.iter().sum::<f64>() / ratios.len() as f64).max(1.0),
        false => 1.0,
    };
    let (lo, hi) = problem.slope_range;
    let at_limit = [3, 4].map(|j| {
        let w = refined.parameters[j].exp() / problem.velocity_scale;
        w > 0.99 * hi || w < 1.01 * lo
    });
    Some(LikelihoodMaximum {
        parameters: refined.parameters,
        covariance: covariance * widening,
        noise,
        score: refined.score,
        ending: refined.ending,
        widening,
        at_limit,
        fixed,
        starts,
    })
}
