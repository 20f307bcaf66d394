//! The estimate of one joint: parameters with verdicts, curve, consistency.

use nalgebra::DVector;

use super::departure::departure;
use super::excitation::{FrictionError, SpeedCoverage, speeds};
use super::inputs::FrictionInputs;
pub use super::joint_estimate::{
    EstimatedValue, FilterNoise, FrictionCurvePoint, JointEstimate, NisStatistic, NuisanceQuantity,
};
use super::passes::{GivenNoise, LikelihoodMaximum, fewer_terms, maximise, settle_on};
use super::plateau::plateaus;
use super::prepare::PreparedProblem;
use super::problem::{FRICTION, FrictionProblem};
use super::slope::{open_above, profile_slope};
use super::smoothing::{add_choices, bands};
use super::start::{FilterStart, constant_inertia, from_log};
use super::thinned::thinned;
use crate::math::descent::IterationEnding;
use crate::robot::friction::DoubleTanh;
use crate::verdict::{Verdict, verdict_of};

/// What the user may give beside the logs.
#[derive(Debug, Clone, Default)]
pub struct FrictionOptions {
    /// Friction law to start from, beside the starts that the log gives.
    pub start: Option<DoubleTanh>,
    /// Inertia to start from [kg or kg m^2]; only with `start`.
    pub start_inertia: Option<f64>,
    /// Only the user's start, none from the log.
    pub only_start: bool,
    /// Noise levels that the user overrides.
    pub noise: GivenNoise,
}

/// Points of the curve in each direction.
const CURVE_STEPS: usize = 50;
/// The same beyond the speeds covered, and how far it goes there as a factor on the fastest of them.
const BEYOND_STEPS: usize = 10;
pub const BEYOND: f64 = 2.0;
/// Samples that the search sees of a longer log.
const SEARCHED: usize = 60_000;
/// Starts taken from the log.
const LOG_STARTS: usize = 4;

/// Factor from the position filter's cut-off to the narrower one of [`FrictionInputs::narrower`].
pub const NARROWER: f64 = 0.7;

/// Estimates the friction of one joint. With `inputs`, the motion of the other joints is narrowed as
/// far as this joint's innovations want it, and what a narrower smoothing changes is part of the
/// standard deviations.
///
/// # Errors
/// [`FrictionError`] where the motion cannot show friction, or no start ends at a finite estimate.
pub fn estimate(
    joint: &str,
    names: &[String],
    prepared: &PreparedProblem,
    inputs: Option<&FrictionInputs>,
    options: &FrictionOptions,
) -> Result<JointEstimate, FrictionError> {
    let problem = &prepared.problem;
    let speeds = speeds(joint, &prepared.velocity, problem.parameters())?;
    let thinned = thinned(prepared, SEARCHED);
    let searched = thinned.as_ref().unwrap_or(prepared);
    let mut starts = Vec::new();
    if !options.only_start || options.start.is_none() {
        starts.extend(from_log(searched, LOG_STARTS));
    }
    if let Some(law) = &options.start {
        let mut p = vec![0.0; problem.parameters()];
        problem.coordinates(law, &mut p);
        if let Some(inertia) = options.start_inertia {
            p[FRICTION..].copy_from_slice(&constant_inertia(prepared, inertia));
        } else if let Some(log) = starts.first() {
            p[FRICTION..].copy_from_slice(&log.parameters[FRICTION..]);
        }
        let given = FilterStart {
            parameters: p,
            residual: f64::INFINITY,
        };
        starts.insert(0, given);
    }
    let no_estimate = || FrictionError::NoEstimate {
        joint: joint.to_owned(),
    };
    let mut maximum = maximise(searched, &starts, &options.noise).ok_or_else(no_estimate)?;
    if thinned.is_some() {
        maximum = settle_on(problem, &maximum, &options.noise).ok_or_else(no_estimate)?;
    }
    if let Some(one) = fewer_terms(problem, &maximum, &options.noise) {
        maximum = one;
    }
    let Some(inputs) = inputs else {
        return judged(joint, assemble(names, prepared, maximum, speeds));
    };
    let mut cutoffs = vec![f64::INFINITY; inputs.robot.joints()];
    let mut banded = None;
    if let Some((found, problem, settled)) = bands(prepared, inputs, &maximum, &options.noise) {
        cutoffs = found;
        maximum = settled;
        banded = Some(PreparedProblem {
            problem,
            ..prepared.clone()
        });
    }
    let prepared = banded.as_ref().unwrap_or(prepared);
    if let Some(again) = inputs.narrower(prepared, &cutoffs, NARROWER) {
        add_choices(&prepared.problem, &again, &mut maximum);
    }
    let mut e = assemble(names, prepared, maximum, speeds);
    e.cutoffs = cutoffs;
    judged(joint, e)
}

/// Refuses a law that explains nothing or drives the joint; what a search that did not converge left is not identified.
fn judged(joint: &str, mut e: JointEstimate) -> Result<JointEstimate, FrictionError> {
    let joint = joint.to_owned();
    let without = e.without_law.min(1.0);
    if e.relative_error >= without {
        let [left, without] = [e.relative_error, without].map(|x| 100.0 * x);
        return Err(FrictionError::ExplainsNothing {
            joint,
            left,
            without,
        });
    }
    if e.power() <= 0.0 {
        return Err(FrictionError::Drives { joint });
    }
    if e.ending != IterationEnding::Converged {
        // a bound holds wherever the search was left: it is what the rows show of one side
        for value in &mut e.values {
            if value.verdict != Verdict::LowerBound {
                value.verdict = Verdict::NotIdentifiable;
            }
        }
    }
    Ok(e)
}

fn assemble(
    names: &[String],
    prepared: &PreparedProblem,
    maximum: LikelihoodMaximum,
    speeds: SpeedCoverage,
) -> JointEstimate {
    let problem = &prepared.problem;
    let maximum = steeper_first(maximum);
    let p = &maximum.parameters;
    let law = problem.friction(p);
    let mut covariance = covariance(problem, &maximum);
    // the level of friction is known no better than the law follows it over the speed
    covariance[1][1] += departure(prepared, p, &|v| law.torque(v));
    let [_, fastest] = speeds.covered;
    let next = fastest + (BEYOND - 1.0) * fastest / BEYOND_STEPS as f64;
    let (rmse, relative_error) = residual(prepared, p, &|v| law.torque(v));
    let (_, without_law) = residual(prepared, p, &|_| 0.0);
    let s = &maximum.score;
    let half = 1.96 * (2.0 / s.windows.max(1) as f64).sqrt();
    JointEstimate {
        values: std::array::from_fn(|i| value(problem, &maximum, &law, &covariance, i)),
        law,
        covariance,
        nuisance: nuisance(names, prepared, &maximum),
        speeds,
        curve: curve(&law, &covariance, speeds.covered, CURVE_STEPS),
        curve_beyond: curve(&law, &covariance, [next, BEYOND * fastest], BEYOND_STEPS),
        plateaus: plateaus(prepared, p),
        nis: NisStatistic {
            mean: s.window_nis,
            lower_95: (1.0 - half).max(0.0),
            upper_95: 1.0 + half,
            windows: s.windows,
            per_sample: s.mean_nis,
            share_inside: s.share_inside,
        },
        rmse,
        relative_error,
        without_law,
        samples: problem.samples(),
        starts: maximum.starts,
        ending: maximum.ending,
        widening: maximum.widening,
        coulomb_terms: if maximum.one_term() { 1 } else { 2 },
        noise: FilterNoise {
            torque_std: maximum.noise.torque,
            position_variance_factor: maximum.noise.position_factor,
        },
        cutoffs: Vec::new(),
    }
}

/// The same maximum with slope_1 the steeper one: a swap of the two tanh terms is the same law.
fn steeper_first(mut maximum: LikelihoodMaximum) -> LikelihoodMaximum {
    if maximum.one_term() {
        maximum.parameters[4] = maximum.parameters[3];
    } else if maximum.parameters[3] < maximum.parameters[4] {
        for (a, b) in [(1, 2), (3, 4)] {
            maximum.parameters.swap(a, b);
            maximum.covariance.swap_rows(a, b);
            maximum.covariance.swap_columns(a, b);
        }
        maximum.at_limit.swap(0, 1);
    }
    maximum
}

/// Covariance of the law's parameters in SI units.
fn covariance(
    problem: &FrictionProblem,
    maximum: &LikelihoodMaximum,
) -> [[f64; FRICTION]; FRICTION] {
    let jacobian = problem.jacobian(&maximum.parameters);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| jacobian[i] * jacobian[j] * maximum.covariance[(i, j)])
    })
}

/// Parameter i of the law with its verdict; a slope that is open has a bound from below, where the log gives one.
fn value(
    problem: &FrictionProblem,
    maximum: &LikelihoodMaximum,
    law: &DoubleTanh,
    covariance: &[[f64; FRICTION]; FRICTION],
    i: usize,
) -> EstimatedValue {
    let si = law.parameters();
    let std = |i: usize| covariance[i][i].max(0.0).sqrt();
    let verdict = verdict_of(si[i], std(i));
    let of = |value: f64, std: f64, verdict: Verdict| EstimatedValue {
        value,
        std,
        verdict,
    };
    if maximum.fixed.contains(&i) {
        return of(si[i], f64::NAN, Verdict::NotIdentifiable);
    }
    let plain = of(si[i], std(i), verdict);
    if i < 3 {
        return plain;
    }
    // a slope is open where its term is: two terms that the data cannot part are one
    let height = verdict_of(si[i - 2], std(i - 2));
    let open = maximum.at_limit[i - 3]
        || verdict == Verdict::NotIdentifiable
        || height == Verdict::NotIdentifiable
        || (verdict == Verdict::Weak && open_above(problem, maximum, i));
    if !open {
        return plain;
    }
    // the steeper one has a bound as long as there is Coulomb friction at all; the other only
    // where its own term is there
    let term = i == 3 || height != Verdict::NotIdentifiable;
    match profile_slope(problem, maximum, i).filter(|_| term) {
        Some(bound) => of(bound, f64::NAN, Verdict::LowerBound),
        None => of(si[i], std(i), Verdict::NotIdentifiable),
    }
}

/// The law with its band at speeds from `from` to `to` in equal steps, in both directions.
fn curve(
    law: &DoubleTanh,
    covariance: &[[f64; FRICTION]; FRICTION],
    [from, to]: [f64; 2],
    steps: usize,
) -> Vec<FrictionCurvePoint> {
    let step = |i: usize| from + (to - from) * i as f64 / (steps - 1) as f64;
    let point = |v: f64| FrictionCurvePoint {
        v,
        torque: law.torque(v),
        std: curve_std(law, covariance, v),
    };
    let backward = (0..steps).rev().map(|i| -step(i));
    let speeds = backward.chain((0..steps).map(step));
    speeds.map(point).collect()
}

/// Standard deviation of F(v).
pub fn curve_std(law: &DoubleTanh, covariance: &[[f64; FRICTION]; FRICTION], v: f64) -> f64 {
    let g = law.gradient(v);
    let mut variance = 0.0;
    for i in 0..FRICTION {
        for j in 0..FRICTION {
            variance += g[i] * covariance[i][j] * g[j];
        }
    }
    variance.max(0.0).sqrt()
}

/// Residual torque along the smoothed motion under a law of friction, and the same over the torque.
fn residual(prepared: &PreparedProblem, p: &[f64], law: &dyn Fn(f64) -> f64) -> (f64, f64) {
    let problem = &prepared.problem;
    let (eta, e) = (&p[FRICTION..], problem.nuisance);
    let (mut square, mut torque, mut n) = (0.0, 0.0, 0usize);
    let mut first = 0;
    for record in &problem.records {
        for k in 0..record.tau.len() {
            let mean = |x: &[f64]| 0.5 * (x[first + k] + x[first + k + 1]);
            let (v, a) = (mean(&prepared.velocity), mean(&prepared.acceleration));
            let row = k * e..(k + 1) * e;
            let known = record.m[row.clone()].iter().zip(&record.h[row]).zip(eta);
            let known: f64 = known.map(|((m, h), x)| (m * a + h) * x).sum();
            let d = record.tau[k] - known - law(v);
            square += d * d;
            torque += record.tau[k] * record.tau[k];
            n += 1;
        }
        first += record.t.len();
    }
    ((square / n.max(1) as f64).sqrt(), (square / torque).sqrt())
}

/// Mean inertia, offset, and every direction that the log determined.
fn nuisance(
    names: &[String],
    prepared: &PreparedProblem,
    maximum: &LikelihoodMaximum,
) -> Vec<NuisanceQuantity> {
    let problem = &prepared.problem;
    let e = problem.nuisance;
    let eta = DVector::from_column_slice(&maximum.parameters[FRICTION..]);
    let cov = maximum.covariance.view((FRICTION, FRICTION), (e, e));
    let of = |g: &DVector<f64>| (g.dot(&eta), (g.dot(&(cov * g))).max(0.0).sqrt());
    let (mut mean, mut count) = (DVector::zeros(e), 0.0);
    for m in problem.records.iter().flat_map(|r| r.m.chunks_exact(e)) {
        mean += DVector::from_column_slice(m);
        count += 1.0;
    }
    mean /= count;
    let (inertia, inertia_std) = of(&mean);
    let offset_row = prepared.back.row(prepared.back.nrows() - 1).transpose();
    let (offset, offset_std) = of(&offset_row);
    let nuisance = |name: String, value: f64, std: f64, unit: &str| NuisanceQuantity {
        name,
        value,
        std,
        unit: unit.to_owned(),
    };
    let mut out = vec![
        nuisance(
            "mean inertia".into(),
            inertia,
            inertia_std,
            "torque/acceleration",
        ),
        nuisance("offset".into(), offset, offset_std, "torque"),
    ];
    for k in 0..e {
        let column = prepared.back.column(k);
        let mut terms: Vec<usize> = (0..column.len()).collect();
        terms.sort_by(|a, b| column[*b].abs().total_cmp(&column[*a].abs()));
        let word = |i: &usize| {
            let name = names.get(*i).map_or("offset", String::as_str);
            format!("{:+.2} {name}", column[*i])
        };
        let words = terms.iter().take(3).filter(|i| column[**i] != 0.0);
        let words: Vec<String> = words.map(word).collect();
        let name = format!("direction {} ({} ...)", k + 1, words.join(" "));
        out.push(nuisance(name, eta[k], cov[(k, k)].max(0.0).sqrt(), "1"));
    }
    out
}

#[cfg(test)]
mod tests;
