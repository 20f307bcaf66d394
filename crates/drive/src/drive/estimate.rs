//! A law fitted with its deviations, and with one effect more or less.

use super::candidate::DriveEffect;
use super::fit::{DriveProblem, FittedDrive, NUMBERS as FIT, PieceSums, ResidualScales};
use super::judge::{BlockJackknife, NUMBERS};
use super::start;
use super::unknown::{DriveQuantity, DriveUnknown};

/// A fitted law with its deviations.
#[derive(Debug, Clone)]
pub struct LawEstimate {
    pub unknowns: Vec<DriveUnknown>,
    pub values: Vec<f64>,
    pub converged: bool,
    pub scales: ResidualScales,
    pub blocks: Vec<PieceSums>,
    pub jackknife: BlockJackknife,
}

impl LawEstimate {
    /// Of values that a fit ended at.
    pub(super) fn at(
        problem: &DriveProblem,
        unknowns: &[DriveUnknown],
        values: Vec<f64>,
        scales: &ResidualScales,
    ) -> Self {
        let blocks = problem.by_block(&problem.linearised(unknowns, &values, scales));
        LawEstimate {
            jackknife: BlockJackknife::new(unknowns, &values, &blocks),
            unknowns: unknowns.to_vec(),
            values,
            converged: true,
            scales: scales.clone(),
            blocks,
        }
    }

    fn loss(&self) -> f64 {
        self.blocks.iter().map(|block| block.loss).sum()
    }

    /// Losses of the blocks, each by the others.
    pub fn left_out(&self) -> Vec<f64> {
        self.jackknife.left_out(&self.blocks)
    }

    pub fn value(&self, unknown: DriveUnknown) -> Option<f64> {
        let at = self.unknowns.iter().position(|u| *u == unknown)?;
        Some(self.values[at])
    }
}

/// Steps of a fit of a candidate from the best of its starts on.
const SHORT: usize = 5;

/// Parts of the largest torque that a joint is asked for at which its limit may lie.
const LIMITED: [f64; 3] = [0.9, 0.6, 0.3];

/// Fits from a start, and again with limits where they act: one that no torque reaches has no slope, and would stay out of
/// reach of every better law that is found beside it.
pub(super) fn fit_limits(
    problem: &DriveProblem,
    unknowns: &[DriveUnknown],
    start: &[f64],
    scales: &ResidualScales,
) -> FittedDrive {
    let mut best = problem.fit(unknowns, start, scales, FIT.steps);
    let limits =
        (0..unknowns.len()).filter(|i| unknowns[*i].quantity == DriveQuantity::TorqueLimit);
    let is_out_of_reach = |i: &usize| {
        let mut none = best.values.clone();
        none[*i] = 0.0;
        problem.loss(unknowns, &none, scales) <= best.loss
    };
    let out: Vec<usize> = limits.filter(is_out_of_reach).collect();
    if out.is_empty() {
        return best;
    }
    let found = best.values.clone();
    let law = problem.frame.law(unknowns, &found);
    for part in LIMITED {
        let mut acting = found.clone();
        for i in &out {
            let j = unknowns[*i].joint.unwrap_or(0);
            let gains = problem.logs.iter().map(|log| log.joints[j].kp);
            let gain = law.joints[j].stiffness * gains.fold(0.0, f64::max);
            acting[*i] = 1.0 / (part * gain * problem.sizes[j].farthest);
        }
        let short = problem.fit(unknowns, &acting, scales, SHORT);
        if short.loss < (1.0 - NUMBERS.noticeable) * best.loss {
            best = problem.fit(unknowns, &short.values, scales, FIT.steps);
        }
    }
    best
}

/// Fits with scales that follow the residual.
pub fn fit(
    problem: &DriveProblem,
    unknowns: &[DriveUnknown],
    start: &[f64],
    scales: Option<&ResidualScales>,
) -> LawEstimate {
    let mut values = start.to_vec();
    let first = match scales {
        Some(scales) => scales.clone(),
        None => problem.scales(unknowns, &values),
    };
    let mut scales = first;
    let mut converged = false;
    for _ in 0..ROUNDS {
        let fitted = fit_limits(problem, unknowns, &values, &scales);
        values = fitted.values;
        converged = fitted.converged;
        scales = problem.scales(unknowns, &values);
    }
    let mut solution = LawEstimate::at(problem, unknowns, values, &scales);
    // a limit that is never reached is none
    for (i, unknown) in unknowns.iter().enumerate() {
        let seen = solution.blocks.iter().any(|block| block.h[(i, i)] > 0.0);
        if unknown.quantity == DriveQuantity::TorqueLimit && !seen {
            solution.values[i] = 0.0;
        }
    }
    solution.converged = converged;
    solution
}

/// Fits in a row whose scales follow the residual. One: scales of the start; more: the same to two digits.
const ROUNDS: usize = 3;

/// The declared drive, from several starts.
pub fn declared(problem: &DriveProblem, unknowns: &[DriveUnknown]) -> LawEstimate {
    let mut best: Option<(f64, LawEstimate)> = None;
    for start in start::starts(problem, unknowns) {
        let scales = problem.scales(unknowns, &start);
        let first = problem.fit(unknowns, &start, &scales, FIT.steps);
        let loss = problem
            .losses_by_joint(unknowns, &first.values)
            .iter()
            .sum();
        if best.as_ref().is_none_or(|(known, _)| loss < *known) {
            best = Some((loss, fit(problem, unknowns, &first.values, None)));
        }
    }
    best.expect("there are starts").1
}

/// The best of the starts of an effect, fitted beside a solution with its scales.
pub fn with(problem: &DriveProblem, beside: &LawEstimate, effect: DriveEffect) -> LawEstimate {
    let mut unknowns = beside.unknowns.clone();
    unknowns.extend(effect.unknowns(problem.frame.joints));
    let mut best: Option<(f64, Vec<f64>)> = None;
    for start in effect.starts(&problem.sizes) {
        let mut values = beside.values.clone();
        values.extend(start);
        let fitted = problem.fit(&unknowns, &values, &beside.scales, 1);
        if best.as_ref().is_none_or(|(loss, _)| fitted.loss < *loss) {
            best = Some((fitted.loss, fitted.values));
        }
    }
    let (loss, mut values) = best.expect("there are starts");
    // what gains nothing where it is fitted gains nothing elsewhere
    if loss < (1.0 - NUMBERS.noticeable) * beside.loss() {
        values = problem
            .fit(&unknowns, &values, &beside.scales, SHORT)
            .values;
    }
    LawEstimate::at(problem, &unknowns, values, &beside.scales)
}

/// A solution fitted anew without an effect.
pub fn without(problem: &DriveProblem, at: &LawEstimate, effect: DriveEffect) -> LawEstimate {
    let gone = effect.unknowns(problem.frame.joints);
    let pairs = at.unknowns.iter().zip(&at.values);
    let kept = pairs.filter(|(unknown, _)| !gone.contains(unknown));
    let (unknowns, values): (Vec<DriveUnknown>, Vec<f64>) = kept.map(|(u, x)| (*u, *x)).unzip();
    fit(problem, &unknowns, &values, Some(&at.scales))
}
