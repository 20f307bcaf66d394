//! The best of the hypotheses that were fitted to all rows, and whether the evidence for it is enough.

use super::confirm;
use super::correction::{Change, Correction};
use super::finding::ChannelKind;
use super::fitted::{self, Fitted};
use super::normal::Problem;
use super::physics::{Positive, Quantity, credit, positives};
use super::sizes::sizes;
use super::trial::Trial;

/// Blocks of time that are held out in turn.
pub(super) const BLOCKS: usize = 24;
/// Log-likelihood that one right hypothesis must gain: odds of e^8, some 3000 to 1.
pub(super) const ODDS: f64 = 8.0;
/// The same for a reading that is likely, and no more: 20 to 1.
const LIKELY: f64 = 3.0;
/// Times what is needed that physics alone must say where the fit does not confirm it.
const FORCED: f64 = 2.0;
/// Share of the most that any reading gains, below which another one is not looked at.
const SHADOW: f64 = 0.5;
/// Readings that are as likely to within e^3, 20 to 1, are reported as tied.
pub(super) const TIED: f64 = 3.0;
/// The error must move by more than a tenth..
pub(super) const TENTH: f64 = 1.1;
/// .. or a quantity that is negative by so many deviations become positive.
const FORBIDDEN: f64 = -4.0;
/// Ratio by which its relative error over the joints may be larger by chance, where physics decides ..
const NO_WORSE: f64 = 1.005;
/// .. and below which it must be where the residual does.
const BETTER: f64 = 0.99;
/// Log-probability of sizes that need not be confirmed in every block.
const SIZES: f64 = 3.0;
/// A relative error that is more than what real machines leave of a right set-up.
pub(super) const THIRD: f64 = 0.33;
/// Deviations by which the mean gain of the blocks is above zero ..
pub(super) const DEVIATIONS: f64 = 2.5;
/// .. and where there are few rows.
pub(super) const MORE_DEVIATIONS: f64 = 4.0;
/// Share of these deviations at which a reading that gains what is needed is likely.
const ALMOST: f64 = 0.5;
/// Independent rows for each unknown that are few.
pub(super) const FEW: f64 = 3.0;
/// Strokes of all joints, and of these for each unknown, that show a wrong set-up in all its motions: what fewer
/// say must be said by each half of them.
pub(super) const STROKES: [f64; 2] = [20.0, 0.4];
/// Strokes for each unknown below which a residual is no evidence.
pub(super) const HARDLY: f64 = 0.2;
/// Share of a gain that one half of the logs may lose.
pub(super) const LOST: f64 = 0.1;
/// Log-likelihood by which what is right may predict worse by chance.
const WORSE: f64 = 1.0;
/// Logarithm of a factor by which scales differ that cannot both be right.
const FLAT: f64 = 2.5;
/// Logarithm of a factor below which a torque constant is badly known, and no unit mistaken.
const CALIBRATION: f64 = 0.25;
/// Share of what a fitted factor gains that a round one beside it must gain.
const MOST: f64 = 0.7;
/// A deviation that says nothing.
const UNKNOWN: f64 = 1e5;
/// A quantity is reported as negative beyond so many deviations.
pub(super) const NEGATIVE: f64 = -2.0;

/// A correction that was found.
#[derive(Debug, Clone)]
pub struct Found {
    pub change: Change,
    /// Deviation of the number in it, where it was fitted.
    pub std: Option<f64>,
    /// Mean relative error over the joints before and after it.
    pub error: [f64; 2],
    /// Log-likelihood gained on held-out blocks, physics included, and what is needed.
    pub gain: f64,
    pub needed: f64,
    pub tried: usize,
    /// Joints with an inertia or a friction power below zero, before and after it.
    pub violated: [Vec<String>; 2],
    /// Other changes that explain as much.
    pub tied: Vec<Change>,
    pub sure: bool,
}

/// Power of a joint's friction, where it is negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Negative {
    pub joint: usize,
    pub power: f64,
    pub std: f64,
}

/// A hypothesis that was fitted, with what physics says of it.
pub(super) struct Judged {
    pub change: Option<Change>,
    /// Deviation of the number in it, or the curvature of the likelihood by which it comes.
    pub std: Option<f64>,
    pub trial: Trial,
    pub positives: Vec<Positive>,
    /// Log-probability of all that physics says, and of the sizes alone.
    pub credit: f64,
    sizes: f64,
    /// Log-posterior but for a constant.
    pub worth: f64,
}

pub(super) fn judged(
    problem: &Problem,
    change: Option<Change>,
    std: Option<f64>,
    trial: Trial,
) -> Judged {
    let positives = positives(problem, &trial.robot, &trial.by, &trial.normal, &trial.fit);
    let sizes = sizes(problem, &trial.by);
    Judged {
        change,
        std,
        worth: 0.0,
        credit: credit(&positives) + sizes,
        sizes,
        positives,
        trial,
    }
}

/// A change of the base as it is fitted to all rows; where its number was `fitted`, with the one that does best there.
/// `declared` is the set-up as it is on these rows, where they are poses by it.
pub(super) fn on_all_rows(
    problem: &Problem,
    (base, change): (&Correction, &Change),
    fitted: bool,
    rows: &[usize],
    declared: Option<&Trial>,
) -> Option<Judged> {
    let trial = |change: &Change| Trial::new(problem, base.with(change), rows, BLOCKS, declared);
    let (mut change, mut std) = (change.clone(), None);
    if fitted {
        let own = match declared {
            Some(_) => None,
            None => Some(trial(&change)?),
        };
        let fitted = Fitted {
            problem,
            base,
            rows,
            blocks: BLOCKS,
            declared: declared.or(own.as_ref())?,
        };
        let (better, curvature) = fitted.polished(&change);
        (change, std) = (better, Some(curvature));
    }
    let trial = trial(&change)?;
    Some(judged(problem, Some(change), std, trial))
}

impl Judged {
    /// Log-posterior but for a constant, where this share of the rows is independent.
    fn worth_at(&self, share: f64) -> f64 {
        let normal = &self.trial.normal;
        let rows = (share * normal.rows as f64).max(1.0);
        let unknowns = normal.unknowns + usize::from(self.std.is_some());
        share * self.trial.fit.score + self.credit - 0.5 * unknowns as f64 * rows.ln()
    }

    /// Takes this share of the rows as independent: the curvature becomes a deviation.
    pub fn weigh(&mut self, share: f64) {
        self.worth = self.worth_at(share);
        let deviation = |curvature: f64| (share * curvature).max(1e-12).sqrt().recip();
        self.std = self.std.map(deviation);
    }
}

/// The best of the list, where it is better than the set-up as it is.
pub(super) fn decide(
    problem: &Problem,
    declared: &Judged,
    mut list: Vec<Judged>,
    tried: usize,
) -> Option<Found> {
    let likeliest = list
        .iter()
        .max_by(|a, b| a.trial.fit.score.total_cmp(&b.trial.fit.score))
        .filter(|j| j.trial.fit.score > declared.trial.fit.score)
        .unwrap_or(declared);
    let t = &likeliest.trial;
    let independent = confirm::independent(problem, &t.robot, &t.by, &t.fit);
    let moving = problem.moving();
    let of_moving = independent
        .iter()
        .zip(moving)
        .filter(|(_, m)| **m)
        .map(|(x, _)| *x);
    let share = of_moving.clone().sum::<f64>() / of_moving.count().max(1) as f64;
    list.iter_mut().for_each(|judged| judged.weigh(share));
    drop_flat(&mut list);
    let judge = Judge {
        problem,
        declared,
        share,
        independent: &independent,
        needed: ODDS + (tried.max(1) as f64).ln(),
        tried,
    };
    let from = declared.worth_at(share);
    let best = list.iter().map(|j| j.worth).fold(from, f64::max);
    let mut likely = None;
    while let Some(at) = choose(&list, from) {
        // what explains much less than another one is a shadow of it
        if list[at].worth - from < SHADOW * (best - from) {
            break;
        }
        match judge.found(&list, at) {
            Some(found) if found.sure => return Some(found),
            Some(found) => likely = likely.or(Some(found)),
            None => {}
        }
        // blocks that were held out do not confirm it
        let place = list[at].change.clone();
        list.retain(|j| !same_place(&j.change, &place));
    }
    likely
}

/// The most probable of the list; where several are, the simplest, and a round number before a fitted one.
/// `from` is what the set-up as it is declared is worth.
pub(super) fn choose(list: &[Judged], from: f64) -> Option<usize> {
    let most = list
        .iter()
        .map(|j| j.worth)
        .fold(f64::NEG_INFINITY, f64::max);
    // the simplest of those that are worth as much
    let simplest = list.iter().position(|j| j.worth >= most - 0.5)?;
    // a round number before a fitted one that is hardly better, or that differs as calibrations do
    let rounds = list.iter().enumerate().filter(|(_, j)| {
        let alike = same_place(&j.change, &list[simplest].change) && j.std.is_none();
        let near =
            calibrated(&j.change, &list[simplest].change) && j.worth - from > MOST * (most - from);
        alike && (j.worth >= most - TIED || near)
    });
    let round = rounds
        .max_by(|a, b| a.1.worth.total_cmp(&b.1.worth).then(b.0.cmp(&a.0)))
        .map(|(i, _)| i);
    Some(round.unwrap_or(simplest)).filter(|best| list[*best].worth > from)
}

/// What a reading is judged by.
struct Judge<'a> {
    problem: &'a Problem<'a>,
    declared: &'a Judged,
    /// Share of the rows that are independent, over all joints and of each.
    share: f64,
    independent: &'a [f64],
    needed: f64,
    tried: usize,
}

impl Judge<'_> {
    /// A reading of the list as it is told; none where blocks that did not choose it do not confirm it.
    fn found(&self, list: &[Judged], at: usize) -> Option<Found> {
        let (problem, declared, chosen) = (self.problem, self.declared, &list[at]);
        let (b, a) = (&declared.trial, &chosen.trial);
        let held_out = confirm::gain(
            (&b.fit, &b.normal, &b.power),
            (&a.fit, &a.normal, &a.power),
            self.independent,
        )?;
        let physics = chosen.credit - declared.credit;
        let gain = held_out.all + physics;
        let fitted = self.share * (a.fit.score - b.fit.score);
        let sure = gain >= self.needed;
        let needed = if sure {
            self.needed
        } else {
            self.needed - ODDS + LIKELY
        };
        // few independent rows for each unknown: what the model lacks repeats itself in them
        let rows = self.independent.iter().sum::<f64>() * a.normal.rows as f64;
        let unknowns = a.normal.unknowns as f64;
        let deviations = match rows < FEW * unknowns {
            true => MORE_DEVIATIONS,
            false => DEVIATIONS,
        };
        let strokes = problem.sample.strokes();
        // what physics says alone needs no residual
        let deviations = if physics > needed { 0.0 } else { deviations };
        let plausible = chosen.sizes - declared.sizes;
        let (no_worse, deviations) = match (physics > 0.5 * needed, plausible > SIZES) {
            (true, false) => (NO_WORSE, deviations),
            (false, false) => (BETTER, deviations),
            // a motion or a torque that no robot has, beside ones that it has
            (_, true) => (NO_WORSE, 0.0),
        };
        if gain < needed {
            return None;
        }
        // what is right predicts no worse, and wins in both halves of the logs and in most blocks, unless what physics
        // forbids by itself outweighs what the fit loses
        let confirmed = held_out.all >= -WORSE
            && fitted >= -0.5 * WORSE
            && (a.fit.error() <= no_worse * b.fit.error() || typical(a, b) <= no_worse)
            && held_out.half + 0.5 * physics >= -LOST * held_out.all
            && held_out.deviations >= ALMOST * deviations;
        let everywhere = held_out.deviations >= deviations;
        // what physics forbids tells a turned or exchanged channel though the rows fit worse; a direction, a zero or a factor
        // that is chosen among many only where they do not
        let turned = matches!(
            chosen.change,
            Some(Change::Sign(..) | Change::Exchange(..) | Change::Reverse)
        );
        let worse = a.fit.error() > NO_WORSE * b.fit.error();
        if !(confirmed && (sure || everywhere)) && (physics < FORCED * needed || (worse && !turned))
        {
            return None;
        }
        if (strokes < HARDLY * unknowns && physics < needed)
            || (strokes < STROKES[0].max(STROKES[1] * unknowns)
                && !wins_in_halves(problem, declared, chosen, self.share, 0.5 * needed))
        {
            return None;
        }
        let error = [b.fit.error(), a.fit.error()];
        let pairs = b.fit.left.iter().zip(&a.fit.left);
        let largest = pairs
            .filter(|(b, a)| **b > 0.0 && **a > 0.0)
            .map(|(b, a)| (b / a).sqrt())
            .fold(error[0] / error[1], f64::max);
        let forbidden = !joints_below(&declared.positives, FORBIDDEN).is_empty()
            && joints_below(&chosen.positives, FORBIDDEN).is_empty();
        if largest <= TENTH && !forbidden {
            return None;
        }
        // what leaves a third of the torque unexplained must explain much more than that
        let poor = error[1] > THIRD && error[0] < 1.5 * error[1];
        let name = |p: &Positive| {
            let joint = &problem.robot.joint_names()[p.joint];
            match p.quantity {
                Quantity::Inertia => format!("inertia of {joint}"),
                Quantity::FrictionPower => format!("friction power of {joint}"),
            }
        };
        let violated = |of: &[Positive]| -> Vec<String> {
            let below = of.iter().filter(|p| p.told && p.deviations() < NEGATIVE);
            below.map(name).collect()
        };
        Some(Found {
            tied: tied(list, chosen),
            change: chosen.change.clone()?,
            // of a direction there is none
            std: chosen.std.filter(|std| *std < UNKNOWN),
            error,
            gain,
            needed: self.needed,
            tried: self.tried,
            violated: [violated(&declared.positives), violated(&chosen.positives)],
            sure: sure && (everywhere || physics >= FORCED * needed) && !poor,
        })
    }
}

/// Ratio of the errors of two fits, the geometric mean over the joints: one large error does not hide the others.
fn typical(after: &Trial, before: &Trial) -> f64 {
    let pairs = after.fit.left.iter().zip(&before.fit.left);
    let both = pairs.filter(|(a, b)| **a > 0.0 && **b > 0.0);
    let count = both.clone().count().max(1) as f64;
    (both.map(|(a, b)| (a / b).ln()).sum::<f64>() / (2.0 * count)).exp()
}

/// Readings that explain as much as a chosen one: of other places, else another factor of the same channel.
pub(super) fn tied(list: &[Judged], chosen: &Judged) -> Vec<Change> {
    let fitted = |j: &Judged| j.std.is_some();
    let as_much = |j: &&Judged| j.worth >= chosen.worth - TIED;
    let mut order: Vec<&Judged> = list.iter().filter(as_much).collect();
    // a round number stands for a fitted one that is hardly better
    order.sort_by(|a, b| fitted(a).cmp(&fitted(b)).then(b.worth.total_cmp(&a.worth)));
    let mut tied: Vec<Change> = Vec::new();
    for change in order.into_iter().filter_map(|j| j.change.clone()) {
        let there = |other: &Change| same_place(&Some(change.clone()), &Some(other.clone()));
        if !tied.iter().any(there) && !chosen.change.as_ref().is_some_and(there) {
            tied.push(change);
        }
    }
    if tied.is_empty() {
        // a round one first
        let others = list
            .iter()
            .filter(|j| as_much(j) && other_factor(chosen, j));
        let beside =
            others.max_by(|a, b| fitted(b).cmp(&fitted(a)).then(a.worth.total_cmp(&b.worth)));
        tied.extend(beside.and_then(|j| j.change.clone()));
    }
    tied.truncate(3);
    tied
}

/// Whether two changes are of the same kind and channels, with other numbers.
fn same_place(a: &Option<Change>, b: &Option<Change>) -> bool {
    match (a, b) {
        (Some(Change::Zero(i, _)), Some(Change::Zero(j, _))) => i == j,
        (Some(Change::Gravity(_)), Some(Change::Gravity(_))) => true,
        (Some(Change::Scale(c, i, _)), Some(Change::Scale(d, j, _))) => c == d && i == j,
        _ => a == b,
    }
}

/// Whether a hypothesis gains in the first half of the rows and in the second, each fitted by itself.
fn wins_in_halves(
    problem: &Problem,
    declared: &Judged,
    chosen: &Judged,
    share: f64,
    needed: f64,
) -> bool {
    let rows = problem.sample.len();
    [(0, rows / 2), (rows / 2, rows)]
        .into_iter()
        .all(|(from, to)| {
            let half: Vec<usize> = (from..to).collect();
            let Some(before) = Trial::new(problem, declared.trial.by.clone(), &half, BLOCKS, None)
            else {
                return false;
            };
            let by = chosen.trial.by.clone();
            let Some(after) = Trial::new(problem, by, &half, BLOCKS, Some(&before)) else {
                return false;
            };
            let gain = share * (after.fit.score - before.fit.score);
            let before = judged(problem, None, None, before);
            let after = judged(problem, None, None, after);
            gain + after.credit - before.credit > needed
        })
}

/// Whether two factors of the same channel differ by no more than badly known torque constants do, or two zeros of the
/// same joint by no more than calibration.
fn calibrated(a: &Option<Change>, b: &Option<Change>) -> bool {
    match (a, b) {
        (Some(Change::Scale(_, _, f)), Some(Change::Scale(_, _, g))) => {
            (f / g).ln().abs() < CALIBRATION
        }
        (Some(Change::Zero(_, a)), Some(Change::Zero(_, b))) => (a - b).abs() < fitted::CALIBRATION,
        _ => false,
    }
}

/// Leaves out a scale of a joint where another one, ten times as large, is worth as much: such a scale only takes
/// the joint's torque out of the fit of the others, which leaves no trace of its size.
fn drop_flat(list: &mut Vec<Judged>) {
    let scale = |j: &Judged| match &j.change {
        Some(Change::Scale(channel, joints, f)) if joints.len() == 1 => {
            Some((*channel, joints.clone(), f.ln(), j.worth))
        }
        _ => None,
    };
    let scales: Vec<_> = list.iter().filter_map(scale).collect();
    let flat = |of: &(ChannelKind, Vec<usize>, f64, f64)| {
        let same = scales.iter().filter(|s| s.0 == of.0 && s.1 == of.1);
        let most = same.clone().map(|s| s.3).fold(f64::NEG_INFINITY, f64::max);
        let near: Vec<f64> = same.filter(|s| s.3 >= most - TIED).map(|s| s.2).collect();
        let (low, high) = near
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
                (l.min(*x), h.max(*x))
            });
        high - low > FLAT
    };
    list.retain(|j| scale(j).is_none_or(|of| !flat(&of)));
}

/// Whether two readings have different factors of the same channel: by more than a deviation where one is fitted.
fn other_factor(a: &Judged, b: &Judged) -> bool {
    match (&a.change, &b.change) {
        (Some(Change::Scale(_, _, f)), Some(Change::Scale(_, _, g))) => {
            let std = a.std.or(b.std).unwrap_or(0.0);
            same_place(&a.change, &b.change) && (f - g).abs() > std && f != g
        }
        _ => false,
    }
}

/// Joints with a quantity below so many deviations.
pub(super) fn joints_below(of: &[Positive], deviations: f64) -> Vec<usize> {
    let mut out: Vec<usize> = of
        .iter()
        .filter(|p| p.told && p.deviations() < deviations)
        .map(|p| p.joint)
        .collect();
    out.dedup();
    out
}

pub(super) fn negative(of: &[Positive]) -> Vec<Negative> {
    let powers = || of.iter().filter(|p| p.quantity == Quantity::FrictionPower);
    // a joint that stands takes none but by rounding
    let least = 1e-6 * powers().map(|p| p.value.abs()).fold(0.0, f64::max);
    powers()
        .filter(|p| p.value < NEGATIVE * p.std && p.value.abs() >= least)
        .map(|p| Negative {
            joint: p.joint,
            power: p.value,
            std: p.std,
        })
        .collect()
}
