//! The search for what a drive has beside gain, damping, dry friction and armature.
//!
//! Every effect is fitted with everything else free from a few starts; of those that help the blocks left out the one that
//! helps most joins, and again; once more from the second best, and the better of both models stands. Then the jackknife
//! judges: what is not sure leaves, the least sure first, and the rest is fitted and asked again, until nothing is left
//! without which other blocks are foretold as well.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::candidate::DriveEffect;
use super::estimate::{LawEstimate, fit, fit_limits, with, without};
use super::fit::DriveProblem;
use super::judge::{self, JudgedDriveEffect, NUMBERS};
use super::roll_out::FINE_STEP;
use super::unknown::DriveUnknown;

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

impl FoundDrive {
    /// Gives effects that stand the sizes of the fit in which they stand: others may have left since they joined.
    pub fn take_sizes(&mut self) {
        let refined = &self.refined;
        for step in self.steps.iter_mut().filter(|step| step.written()) {
            for (k, unknown) in step.unknowns.iter().enumerate() {
                if let Some(i) = refined.unknowns.iter().position(|own| own == unknown) {
                    step.values[k] = refined.values[i];
                    step.stds[k] = refined.jackknife.std(i);
                }
            }
        }
    }
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

/// Candidates that are fitted to the end before one of them is chosen. One: the order of short fits decides; more: the
/// same choices.
const RIVALS: usize = 2;

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

/// An effect that joined, with its gain then and what stood beside it.
type JoinedEffect = (DriveEffect, [f64; 2], Vec<DriveEffect>);

/// A model on its way: what it is fitted as, what joined, and what was tried last and not taken.
#[derive(Clone)]
struct GrowingLaw {
    at: LawEstimate,
    joined: Vec<JoinedEffect>,
    tried: Vec<TriedStep>,
}

/// The search, from the declared drive on: steps of at most `longest_step` choose effects, finer ones estimate and judge.
pub fn search(
    problem: &DriveProblem,
    given: LawEstimate,
    possible: &[DriveEffect],
    doing: &dyn Fn(&str),
) -> FoundDrive {
    let mut begin = GrowingLaw {
        at: given,
        joined: Vec::new(),
        tried: Vec::new(),
    };
    let (firsts, tried) = rivals(problem, &begin, possible, doing);
    begin.tried = tried;
    // one effect may stand for two others, which show where it does not come first
    let grown = (0..firsts.len().min(RIVALS)).map(|k| {
        let law = begin.clone().joined_by(problem, &firsts, k);
        grow(problem, law, possible, doing)
    });
    let best = grown.reduce(|best, other| {
        let scales = &best.at.scales;
        let same = LawEstimate::at(problem, &other.at.unknowns, other.at.values.clone(), scales);
        match judge::gain(&best.at.left_out(), &same.left_out())[0] > 0.0 {
            true => other,
            false => best,
        }
    });
    let best = best.unwrap_or_else(|| begin.clone());
    let fine = problem.by_steps(FINE_STEP);
    let refit = |law: &LawEstimate| fit(&fine, &law.unknowns, &law.values, Some(&law.scales));
    let given = refit(&begin.at);
    let mut found = settle(&fine, given, refit(&best.at), best.joined);
    found.tried = best.tried;
    found
}

/// Lets effects join a model one by one, the best first, as long as one helps.
fn grow(
    problem: &DriveProblem,
    mut law: GrowingLaw,
    possible: &[DriveEffect],
    doing: &dyn Fn(&str),
) -> GrowingLaw {
    while law.joined.len() < NUMBERS.steps {
        let (sorted, tried) = rivals(problem, &law, possible, doing);
        law.tried = tried;
        if sorted.is_empty() {
            break;
        }
        law = law.joined_by(problem, &sorted, 0);
    }
    law
}

impl GrowingLaw {
    /// The same with the effect at a place of the list of rivals.
    fn joined_by(mut self, problem: &DriveProblem, sorted: &[RivalEffect], place: usize) -> Self {
        let own = &sorted[place];
        let others = sorted.iter().filter(|other| other.effect != own.effect);
        let near = others.filter(|other| other.is_near(own));
        let alternatives = near.map(|other| other.effect).collect();
        self.joined.push((own.effect, own.gain, alternatives));
        let scales = Some(&self.at.scales);
        self.at = fit(problem, &own.with.unknowns, &own.with.values, scales);
        self
    }
}

/// Effects that help the blocks left out beside a model, the best first, and all that were tried.
fn rivals(
    problem: &DriveProblem,
    law: &GrowingLaw,
    possible: &[DriveEffect],
    doing: &dyn Fn(&str),
) -> (Vec<RivalEffect>, Vec<TriedStep>) {
    let (mut fitted, mut tried) = (Vec::new(), Vec::new());
    if problem.blocks <= 1 {
        return (fitted, tried);
    }
    let before = law.at.left_out();
    let is_new = |effect: &&DriveEffect| law.joined.iter().all(|(known, ..)| known != *effect);
    for effect in possible.iter().filter(is_new) {
        doing(effect.name());
        let with = with(problem, &law.at, *effect);
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
    settle_rivals(problem, &law.at, &before, &mut fitted);
    (fitted, tried)
}

/// Lets what is not sure leave, the least sure first, until all that stand pass.
fn settle(
    problem: &DriveProblem,
    given: LawEstimate,
    mut at: LawEstimate,
    joined: Vec<JoinedEffect>,
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
        let (least, left) = match least {
            Some(least) => (least, without(problem, &at, joined[least].0)),
            None => match idle(problem, &at, &joined, &standing) {
                Some(found) => found,
                None => break,
            },
        };
        standing.retain(|place| *place != least);
        if let Some(step) = steps.get_mut(&least).filter(|step| step.written()) {
            step.status = StepCertainty::Seen;
        }
        at = left;
    }
    FoundDrive {
        given,
        refined: at,
        steps: steps.into_values().collect(),
        tried: Vec::new(),
    }
}

/// The step without which blocks left out are foretold as well, all else fitted anew, and the law without it: deviations are
/// of one place where a fit may settle, and two delays that trade with friction and armature have several.
fn idle(
    problem: &DriveProblem,
    at: &LawEstimate,
    joined: &[JoinedEffect],
    standing: &[usize],
) -> Option<(usize, LawEstimate)> {
    let with = at.left_out();
    let without_it = standing.iter().filter_map(|place| {
        let law = without(problem, at, joined[*place].0);
        let same = LawEstimate::at(problem, &law.unknowns, law.values.clone(), &at.scales);
        let gain = judge::gain(&same.left_out(), &with);
        judge::is_near(gain).then_some((gain[0], *place, law))
    });
    let least = without_it.min_by(|a, b| a.0.total_cmp(&b.0));
    least.map(|(_, place, law)| (place, law))
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
