//! The search for what a drive has beside gain, damping, dry friction and armature.
//!
//! Every effect is fitted with everything else free from a few starts; of those that help the blocks left out the one that
//! helps most joins, and again. Then the jackknife judges: what is not sure leaves, the least sure first, and the rest is
//! fitted and asked again.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::candidate::DriveEffect;
use super::fit::{DriveProblem, FittedDrive, NUMBERS as FIT, PieceSums, ResidualScales};
use super::judge::{self, BlockJackknife, JudgedDriveEffect, NUMBERS};
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
    fn at(
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

/// How sure a step is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepCertainty {
    Confirmed,
    Indicated,
    /// It fits, and is not sure: not written.
    Seen,
    /// Held-out logs get worse by it: not written.
    HeldOutWorse,
}

/// An effect that helps the blocks left out.
#[derive(Debug, Clone)]
pub struct Step {
    pub effect: DriveEffect,
    pub unknowns: Vec<DriveUnknown>,
    /// As estimated in the joint fit, with deviations.
    pub values: Vec<f64>,
    pub stds: Vec<Option<f64>>,
    pub judged: JudgedDriveEffect,
    pub status: StepCertainty,
    /// Mean ln(before / after) of the loss of blocks left out, and its standard error.
    pub gain: [f64; 2],
    /// Effects that do nearly as well in its place.
    pub alternatives: Vec<DriveEffect>,
}

impl Step {
    pub fn written(&self) -> bool {
        match self.status {
            StepCertainty::Confirmed => true,
            StepCertainty::Indicated => !self.effect.measurable(),
            StepCertainty::Seen | StepCertainty::HeldOutWorse => false,
        }
    }
}

/// An effect that was tried.
#[derive(Debug, Clone)]
pub struct TriedStep {
    pub effect: DriveEffect,
    pub gain: [f64; 2],
}

/// What a search found.
#[derive(Debug, Clone)]
pub struct FoundDrive {
    /// Without any effect.
    pub given: LawEstimate,
    /// With all that are written.
    pub refined: LawEstimate,
    pub steps: Vec<Step>,
    /// Those that were tried last and not taken.
    pub tried: Vec<TriedStep>,
}

/// Steps of a fit of a candidate from the best of its starts on.
const SHORT: usize = 5;

/// Candidates that are fitted to the end before one of them is chosen. One: the order of short fits decides; more: the
/// same choices.
const RIVALS: usize = 2;

/// Parts of the largest torque that a joint is asked for at which its limit may lie.
const LIMITED: [f64; 3] = [0.9, 0.6, 0.3];

/// Fits from a start, and again with limits where they act: one that no torque reaches has no slope, and would stay out of
/// reach of every better law that is found beside it.
fn fit_limits(
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
    for part in LIMITED {
        let mut acting = found.clone();
        for i in &out {
            let law = problem.frame.law(unknowns, &found);
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

/// An effect that helps the blocks left out, beside others that do.
struct RivalEffect {
    effect: DriveEffect,
    gain: [f64; 2],
    with: LawEstimate,
    /// Losses of the blocks left out.
    after: Vec<f64>,
}

impl RivalEffect {
    /// Whether it does nearly as well as another one.
    fn is_near(&self, best: &RivalEffect) -> bool {
        judge::is_near(judge::gain(&self.after, &best.after))
    }
}

/// Fits the best rivals of a list, which is sorted, to the end and puts the better one first. A short fit does not tell those
/// apart that look alike where they begin, a late command and a late loop, and each begins where the other ended too, for
/// dry friction has more than one place to settle. Those that are near by the scales of what was there before are told
/// apart by the residual that they leave.
fn settle_rivals(
    problem: &DriveProblem,
    at: &LawEstimate,
    before: &[f64],
    sorted: &mut [RivalEffect],
) {
    let count = sorted.len().min(RIVALS);
    let rivals = &mut sorted[..count];
    let shared = at.unknowns.len();
    let ends: Vec<Vec<f64>> = rivals.iter().map(|r| r.with.values.clone()).collect();
    for rival in &mut *rivals {
        let own = rival.with.values[shared..].to_vec();
        let unknowns = &rival.with.unknowns;
        let starts = ends.iter().flat_map(|end| {
            let by_own = [&end[..shared], &own].concat();
            // lateness of one kind is that of the other
            let other = |end: &Vec<f64>| end.len() == by_own.len() && *end != by_own;
            let whole = Some(end.clone()).filter(other);
            std::iter::once(by_own).chain(whole)
        });
        let fits = starts.map(|start| fit_limits(problem, unknowns, &start, &at.scales));
        if let Some(whole) = fits.min_by(|a, b| a.loss.total_cmp(&b.loss)) {
            rival.with = LawEstimate::at(problem, unknowns, whole.values, &at.scales);
            rival.after = rival.with.left_out();
            rival.gain = judge::gain(before, &rival.after);
        }
    }
    rivals.sort_by(|a, b| b.gain[0].total_cmp(&a.gain[0]));
    let [first, second] = rivals else {
        return;
    };
    if !second.is_near(first) {
        return;
    }
    let scales = problem.scales(&first.with.unknowns, &first.with.values);
    for rival in [&mut *first, &mut *second] {
        let unknowns = &rival.with.unknowns;
        let whole = fit_limits(problem, unknowns, &rival.with.values, &scales);
        rival.with = LawEstimate::at(problem, unknowns, whole.values, &scales);
        rival.after = rival.with.left_out();
    }
    if judge::gain(&first.after, &second.after)[0] > 0.0 {
        std::mem::swap(first, second);
    }
}

/// The search, from the declared drive on.
pub fn search(
    problem: &DriveProblem,
    given: LawEstimate,
    possible: &[DriveEffect],
    doing: &dyn Fn(&str),
) -> FoundDrive {
    let mut at = given.clone();
    let mut joined: Vec<(DriveEffect, [f64; 2], Vec<DriveEffect>)> = Vec::new();
    let mut tried = Vec::new();
    while joined.len() < NUMBERS.steps && problem.blocks > 1 {
        let before = at.left_out();
        tried.clear();
        let mut fitted = Vec::new();
        for effect in possible
            .iter()
            .filter(|e| !joined.iter().any(|(known, ..)| known == *e))
        {
            doing(effect.name());
            let with = with(problem, &at, *effect);
            let after = with.left_out();
            let [gain, se] = judge::gain(&before, &after);
            tried.push(TriedStep {
                effect: *effect,
                gain: [gain, se],
            });
            // a part of the error is half of that of its square
            let noticeable = gain > 2.0 * NUMBERS.noticeable;
            if noticeable && gain > NUMBERS.screen * se {
                fitted.push(RivalEffect {
                    effect: *effect,
                    gain: [gain, se],
                    with,
                    after,
                });
            }
        }
        fitted.sort_by(|a: &RivalEffect, b| b.gain[0].total_cmp(&a.gain[0]));
        settle_rivals(problem, &at, &before, &mut fitted);
        let Some((first, others)) = fitted.split_first() else {
            break;
        };
        let near = others.iter().filter(|other| other.is_near(first));
        let alternatives = near.map(|other| other.effect).collect();
        joined.push((first.effect, first.gain, alternatives));
        at = fit(
            problem,
            &first.with.unknowns,
            &first.with.values,
            Some(&at.scales),
        );
    }
    let mut found = settle(problem, given, at, joined);
    found.tried = tried;
    found
}

/// Lets what is not sure leave, the least sure first, until all that stand pass.
fn settle(
    problem: &DriveProblem,
    given: LawEstimate,
    mut at: LawEstimate,
    joined: Vec<(DriveEffect, [f64; 2], Vec<DriveEffect>)>,
) -> FoundDrive {
    let mut steps: BTreeMap<usize, Step> = BTreeMap::new();
    let mut standing: Vec<usize> = (0..joined.len()).collect();
    loop {
        for place in &standing {
            let (effect, gain, alternatives) = &joined[*place];
            let step = judged(problem, &at, *effect, *gain, alternatives);
            steps.insert(*place, step);
        }
        let sureness = |place: &usize| {
            let judged = steps[place].judged;
            judged.deviations * judged.deviations / judged.floor
        };
        let leaves = standing
            .iter()
            .copied()
            .filter(|place| !steps[place].written());
        let least = leaves.min_by(|a, b| sureness(a).total_cmp(&sureness(b)));
        let Some(least) = least else { break };
        standing.retain(|place| *place != least);
        at = without(problem, &at, joined[least].0);
    }
    FoundDrive {
        given,
        refined: at,
        steps: steps.into_values().collect(),
        tried: Vec::new(),
    }
}

/// A solution fitted anew without an effect.
pub fn without(problem: &DriveProblem, at: &LawEstimate, effect: DriveEffect) -> LawEstimate {
    let gone = effect.unknowns(problem.frame.joints);
    let pairs = at.unknowns.iter().zip(&at.values);
    let kept = pairs.filter(|(unknown, _)| !gone.contains(unknown));
    let (unknowns, values): (Vec<DriveUnknown>, Vec<f64>) = kept.map(|(u, x)| (*u, *x)).unzip();
    fit(problem, &unknowns, &values, Some(&at.scales))
}

/// A solution with another effect in the place of one of its own, fitted to the end; none where it does worse on the blocks
/// left out.
pub fn near_exchange(
    problem: &DriveProblem,
    at: &LawEstimate,
    own: DriveEffect,
    other: DriveEffect,
) -> Option<LawEstimate> {
    let first = with(problem, &without(problem, at, own), other);
    let whole = fit(problem, &first.unknowns, &first.values, Some(&at.scales));
    let law = LawEstimate::at(problem, &whole.unknowns, whole.values, &at.scales);
    let worse = judge::gain(&law.left_out(), &at.left_out());
    judge::is_near(worse).then_some(law)
}

fn judged(
    problem: &DriveProblem,
    at: &LawEstimate,
    effect: DriveEffect,
    gain: [f64; 2],
    alternatives: &[DriveEffect],
) -> Step {
    let unknowns = effect.unknowns(problem.frame.joints);
    let place = |unknown: &DriveUnknown| at.unknowns.iter().position(|u| u == unknown);
    let places: Vec<usize> = unknowns.iter().filter_map(place).collect();
    let free: Vec<usize> = places
        .iter()
        .copied()
        .filter(|i| at.jackknife.free[*i])
        .collect();
    let amplitude = DVector::from_iterator(free.len(), free.iter().map(|i| at.values[*i]));
    let v = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        at.jackknife.covariance[(free[a], free[b])]
    });
    let judged = JudgedDriveEffect::new(&amplitude, &v, problem.blocks);
    let status = match judged.shrinkage {
        s if s > NUMBERS.confirmed => StepCertainty::Confirmed,
        s if s > 0.0 => StepCertainty::Indicated,
        _ => StepCertainty::Seen,
    };
    Step {
        effect,
        values: places.iter().map(|i| at.values[*i]).collect(),
        stds: places.iter().map(|i| at.jackknife.std(*i)).collect(),
        unknowns,
        judged,
        status,
        gain,
        alternatives: alternatives.to_vec(),
    }
}
