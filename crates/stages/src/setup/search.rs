//! Which mistake is reported, if any: refused is the absurd that one mistake explains and no other does.

use rayon::prelude::*;

use super::LIMITS;
use super::correction::{Change, Correction};
use super::factor::{Factor, factors};
use super::finding::ChannelKind::Torque;
use super::hypotheses;
use super::physics::{Broken, Driven};
use super::problem::Problem;
use super::trial::{Trial, compared, gain};
use super::weight::{Weight, weights};

/// Rows that hypotheses are chosen by, and their blocks.
const FEW: usize = 400;
const FEW_BLOCKS: usize = 6;
/// Mistakes in one file: the second is looked for when the first is put right.
const MISTAKES: usize = 2;
/// Mistakes to which each other one is joined.
const FIRST: usize = 3;

/// A mistake, with the errors of every joint on blocks left out.
#[derive(Debug, Clone)]
pub struct Found {
    pub change: Change,
    /// As declared, and put right; not finite where the declared positions belong to no pose.
    pub errors: [Vec<f64>; 2],
    /// Beyond doubt: a fit refuses the logs.
    pub sure: bool,
    /// Other readings that these data do not tell from it.
    pub tied: Vec<Change>,
}

/// What a search found.
#[derive(Debug, Clone, Default)]
pub struct Searched {
    pub found: Vec<Found>,
    /// All that is sure, together.
    pub correction: Option<Correction>,
    /// Joints whose friction drives them, where no mistake explains it.
    pub driven: Vec<Driven>,
    /// A factor that is no round number: an estimate.
    pub factor: Option<(Factor, [Vec<f64>; 2])>,
    /// Errors with gravity and without, where the torques hold none.
    pub without_gravity: Option<[Vec<f64>; 2]>,
    /// Gain of the measured weight over that of the file's own masses.
    pub weights: Vec<Weight>,
}

/// A reading with all that decides on it.
struct Judged {
    trial: Trial,
    broken: Broken,
}

/// Looks for what is wrong with the set-up. `stopped` ends it early with what is found so far.
pub fn search(problem: &Problem, stopped: &(dyn Fn() -> bool + Sync)) -> Searched {
    let n = problem.robot.joints();
    let mut out = Searched::default();
    let moving = problem.channels_that_move();
    let least = 4 * problem.robot.parameters().len() / n.max(1) + 40;
    if moving.is_empty() || problem.sample.len() < least {
        return out;
    }
    let look = Look::new(problem, stopped);
    let mut base = Correction::none(n);
    for _ in 0..MISTAKES {
        let declared = look.whole(&base, None, None);
        let round = look.round(&base, declared.as_ref());
        out.driven = declared.map_or_else(Vec::new, |d| d.broken.friction);
        out.factor = round.factor.filter(|_| out.found.is_empty());
        let Some(found) = round.found else { break };
        let sure = found.sure;
        if sure {
            base = base.with(&found.change);
            out.correction = Some(base.clone());
            out.driven.clear();
        }
        out.found.push(found);
        if !sure || stopped() {
            break;
        }
    }
    if out.found.is_empty()
        && let Some(declared) = look.whole(&base, None, None)
    {
        out.without_gravity = look.without_gravity(&declared.trial);
        out.weights = weights(problem, &look.all);
    }
    out
}

/// What one round found.
#[derive(Default)]
struct Round {
    found: Option<Found>,
    factor: Option<(Factor, [Vec<f64>; 2])>,
}

struct Look<'a> {
    problem: &'a Problem<'a>,
    few: Vec<usize>,
    all: Vec<usize>,
    stopped: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> Look<'a> {
    fn new(problem: &'a Problem<'a>, stopped: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self {
            problem,
            few: problem.sample.spread(FEW),
            all: (0..problem.sample.len()).collect(),
            stopped,
        }
    }

    fn whole(
        &self,
        base: &Correction,
        change: Option<&Change>,
        same: Option<&Trial>,
    ) -> Option<Judged> {
        let rows = (&self.all[..], LIMITS.blocks);
        let trial = Trial::new(self.problem, (base, change), rows, same)?;
        let broken = Broken::of(self.problem, &trial);
        Some(Judged { trial, broken })
    }

    fn quick(
        &self,
        base: &Correction,
        change: Option<&Change>,
        same: Option<&Trial>,
    ) -> Option<Trial> {
        match (self.stopped)() {
            true => None,
            false => Trial::new(self.problem, (base, change), (&self.few, FEW_BLOCKS), same),
        }
    }

    fn round(&self, base: &Correction, declared: Option<&Judged>) -> Round {
        let moving = self.problem.channels_that_move();
        let doubt = match declared {
            None => moving.clone(),
            Some(d) => {
                let errors = d.trial.errors();
                (moving.iter().copied())
                    .filter(|j| errors[*j] > LIMITS.doubtful)
                    .collect()
            }
        };
        let turned = declared.map_or_else(Vec::new, |d| d.broken.turned());
        if doubt.is_empty() && turned.is_empty() {
            return Round::default();
        }
        let few = self.quick(base, None, None);
        let mut list = self.judged(
            base,
            hypotheses::all(self.problem),
            (few.as_ref(), declared),
        );
        let mut fitted = None;
        if let (Some(few), Some(whole), true) = (&few, declared, moving.len() > 1) {
            fitted = self.fitted(base, &doubt, (few, whole), &mut list);
        }
        let mut found = self.decide(declared, &list, fitted.as_ref().map(|f| &f.1));
        if found.as_ref().is_none_or(|f| !f.sure) && declared.is_some() {
            let pairs = self.pairs(&list);
            let list = self.judged(base, pairs, (few.as_ref(), declared));
            let both = self.decide(declared, &list, None);
            found = both.filter(|f| f.sure).or(found);
        }
        let factor = fitted
            .filter(|_| found.is_none())
            .and_then(|(factor, trial)| {
                let before = &declared?.trial;
                let (better, no_worse) = compared(before, &trial);
                let clear = no_worse && gain(before, &trial, &better) > LIMITS.sure;
                clear.then(|| (factor, [before.errors(), trial.errors()]))
            });
        Round { found, factor }
    }

    /// The hypotheses of a list that few rows like best, fitted to all rows; with them those that turn what drives.
    fn judged(
        &self,
        base: &Correction,
        list: Vec<Change>,
        (few, declared): (Option<&Trial>, Option<&Judged>),
    ) -> Vec<Judged> {
        let everyone: Vec<usize> = (0..self.problem.robot.joints()).collect();
        let score = |change: &Change| Some(self.quick(base, Some(change), few)?.square(&everyone));
        let scores: Vec<f64> = (list.par_iter())
            .map(|change| score(change).unwrap_or(f64::INFINITY))
            .collect();
        let mut order: Vec<usize> = (0..list.len()).filter(|i| scores[*i].is_finite()).collect();
        order.sort_by(|a, b| scores[*a].total_cmp(&scores[*b]));
        let turned = declared.map_or_else(Vec::new, |d| d.broken.turned());
        let turns = |i: &usize| match &list[*i] {
            Change::Sign(_, joints) => joints.iter().any(|j| turned.contains(j)),
            _ => false,
        };
        let (best, rest) = order.split_at(LIMITS.short_list.min(order.len()));
        let mut chosen: Vec<usize> = best.to_vec();
        chosen.extend(rest.iter().copied().filter(turns));
        let same = declared.map(|d| &d.trial);
        (chosen.par_iter())
            .filter_map(|i| self.whole(base, Some(&list[*i]), same))
            .collect()
    }

    /// Factors of the joints in doubt: those that may be mistakes join the list, the best one that is none is returned.
    fn fitted(
        &self,
        base: &Correction,
        doubt: &[usize],
        (few, whole): (&Trial, &Judged),
        list: &mut Vec<Judged>,
    ) -> Option<(Factor, Trial)> {
        let rows = [(&self.few[..], FEW_BLOCKS), (&self.all[..], LIMITS.blocks)];
        let found = factors(self.problem, base, doubt, (few, &whole.trial), rows);
        let mut estimates: Vec<(Factor, Trial)> = Vec::new();
        for factor in found {
            let (own, round) = factor.changes(&self.problem.known.ratios);
            let known =
                |change: &Change| list.iter().any(|j| j.trial.change.as_ref() == Some(change));
            let new: Vec<Change> = round.into_iter().filter(|c| !known(c)).collect();
            list.extend(
                new.iter()
                    .filter_map(|c| self.whole(base, Some(c), Some(&whole.trial))),
            );
            if let Some(judged) = self.whole(base, Some(&own), Some(&whole.trial)) {
                estimates.push((factor, judged.trial));
            }
        }
        let everyone: Vec<usize> = (0..self.problem.robot.joints()).collect();
        estimates
            .into_iter()
            .min_by(|a, b| a.1.square(&everyone).total_cmp(&b.1.square(&everyone)))
    }

    /// The best of a list each with every other hypothesis.
    fn pairs(&self, list: &[Judged]) -> Vec<Change> {
        let everyone: Vec<usize> = (0..self.problem.robot.joints()).collect();
        let mut best: Vec<&Judged> = list.iter().collect();
        best.sort_by(|a, b| {
            a.trial
                .square(&everyone)
                .total_cmp(&b.trial.square(&everyone))
        });
        let firsts: Vec<&Change> = best
            .iter()
            .take(FIRST)
            .filter_map(|j| j.trial.change.as_ref())
            .collect();
        let all = hypotheses::all(self.problem);
        let with = |first: &Change| -> Vec<Change> {
            let own = first.joints();
            let other = |c: &&Change| {
                **c != *first && !(c.joints() == own && c.is_of_torques() == first.is_of_torques())
            };
            let pair = |c: &Change| Change::Two(Box::new(first.clone()), Box::new(c.clone()));
            all.iter().filter(other).map(pair).collect()
        };
        firsts.into_iter().flat_map(with).collect()
    }

    /// The reading of the list that is told, if any. `fitted` is the best factor that is no round number.
    fn decide(
        &self,
        declared: Option<&Judged>,
        list: &[Judged],
        fitted: Option<&Trial>,
    ) -> Option<Found> {
        let n = self.problem.robot.joints();
        let everyone: Vec<usize> = (0..n).collect();
        let turned = declared.map_or_else(Vec::new, |d| d.broken.turned());
        // what physics breaks counts first, then the error; the simplest of equals is first in the list
        let broken = |j: &Judged| j.broken.turned().len();
        let mut order: Vec<&Judged> = list.iter().collect();
        order.sort_by(|a, b| {
            let errors = (a.trial.square(&everyone)).total_cmp(&b.trial.square(&everyone));
            broken(a).cmp(&broken(b)).then(errors)
        });
        let best = plainer(&order, &everyone)?;
        let after = best.trial.errors();
        let whole = broken(best) < turned.len();
        let (better, before) = match declared {
            Some(d) => {
                // the best one makes a joint worse: nothing on the list is it, and no lesser one takes its place
                let (better, no_worse) = compared(&d.trial, &best.trial);
                if !no_worse {
                    return None;
                }
                (better, d.trial.errors())
            }
            None => (self.problem.channels_that_move(), vec![f64::NAN; n]),
        };
        let of_errors = declared.is_none_or(|d| {
            best.trial.square(&better) <= LIMITS.floor * d.trial.square(&better)
                && gain(&d.trial, &best.trial, &better) > LIMITS.sure
        });
        if !of_errors && !whole {
            return None;
        }
        // physics alone tells where no error changes
        let seen = if better.is_empty() {
            &everyone
        } else {
            &better
        };
        let near = |j: &Trial| {
            let (own, other) = (best.trial.square(seen), j.square(seen));
            other < LIMITS.far * own || gain(j, &best.trial, seen) < LIMITS.sure
        };
        let is_best = |j: &&&Judged| j.trial.change == best.trial.change;
        let others = (order.iter().filter(|j| !is_best(j)))
            .filter(|j| broken(j) <= broken(best) && near(&j.trial));
        let tied: Vec<Change> = others.filter_map(|j| j.trial.change.clone()).collect();
        let change = best.trial.change.clone()?;
        let alike = tied.iter().all(|other| same_line(&change, other));
        let beside = fitted.is_some_and(|f| {
            let own = f
                .change
                .as_ref()
                .is_some_and(|c| c.joints() == change.joints());
            !own && near(f) || f.square(seen) * LIMITS.far < best.trial.square(seen)
        });
        let absurd: Vec<usize> = match declared {
            None => self.problem.channels_that_move(),
            Some(_) => (better.iter().copied())
                .filter(|j| before[*j] > LIMITS.unexplained)
                .collect(),
        };
        let repaired = absurd.iter().all(|j| after[*j] <= LIMITS.sound)
            && (!absurd.is_empty() || whole && broken(best) == 0);
        Some(Found {
            sure: repaired && alike && !beside,
            errors: [before, after],
            tied,
            change,
        })
    }

    /// Errors with gravity and without, where the fit needs none: fewer parameters, and no joint is worse.
    fn without_gravity(&self, declared: &Trial) -> Option<[Vec<f64>; 2]> {
        if declared.robot.tree().gravity() == [0.0; 3] {
            return None;
        }
        let base = Correction::none(self.problem.robot.joints());
        let none = self
            .whole(&base, Some(&Change::Gravity([0.0; 3])), None)?
            .trial;
        let fewer = none.robot.parameters().len() < declared.robot.parameters().len();
        let sound = none.errors().iter().all(|e| *e <= LIMITS.unexplained);
        let (_, no_worse) = compared(declared, &none);
        (fewer && sound && no_worse).then(|| [declared.errors(), none.errors()])
    }
}

/// The first reading, or a unit of its channel that the blocks do not tell from it: units are mistaken more often than
/// ratios next to them.
fn plainer<'j>(order: &[&'j Judged], joints: &[usize]) -> Option<&'j Judged> {
    let best = *order.first()?;
    let unit = |j: &&&Judged| match (&best.trial.change, &j.trial.change) {
        (Some(Change::Scale(a, of, _)), Some(Change::Scale(b, other, f))) => {
            let alike = a == b && of == other && hypotheses::is_unit(*f);
            alike && gain(&j.trial, &best.trial, joints) < LIMITS.sure
        }
        _ => false,
    };
    Some(order.iter().find(unit).copied().unwrap_or(best))
}

/// Whether two readings turn the same joint: which of its channels it is, a symmetric machine does not show.
fn same_line(a: &Change, b: &Change) -> bool {
    match (a, b) {
        (Change::Sign(_, a), Change::Sign(_, b)) => a == b,
        (Change::Scale(c, a, unit), Change::Scale(d, b, _)) => {
            c == d && a == b && hypotheses::is_unit(*unit)
        }
        (Change::Scale(Torque, a, _), Change::Gear(b, _))
        | (Change::Gear(b, _), Change::Scale(Torque, a, _)) => a.as_slice() == [*b],
        _ => false,
    }
}
