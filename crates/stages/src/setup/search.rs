//! Which mistake is reported, if any: refused is the absurd that one mistake explains and no other does.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::LIMITS;
use super::correction::{Change, Correction};
use super::estimate::{SetupEstimate, estimates};
use super::found::{Found, Searched};
use super::hypotheses::{self, same_place};
use super::physics::Broken;
use super::problem::Problem;
use super::trial::{Compared, Trial};
use super::undecided::undecided;
use super::undelivered::undelivered;
use super::weight::weights;
use cft_ident_core::judge::NUMBERS;

/// A reading with all that decides on it.
pub(super) struct Judged {
    pub trial: Trial,
    pub broken: Broken,
}

impl Judged {
    /// Joints that their friction drives, or whose inertia is below zero.
    pub fn turned(&self) -> usize {
        self.broken.turned.len()
    }
}

/// Looks for one mistake, and for a second one when the first is put right; `stopped` ends it early.
pub fn search(problem: &Problem, stopped: &(dyn Fn() -> bool + Sync)) -> Searched {
    let n = problem.robot.joints();
    let mut out = Searched::default();
    let least = 4 * problem.robot.parameters().len() / n.max(1) + 40;
    if problem.channels_that_move().is_empty() || problem.sample.len() < least {
        return out;
    }
    let look = Look { problem, stopped };
    let mut base = Correction::none(n);
    let mut declared = None;
    for _ in 0..2 {
        declared = look.whole(&base, None, None);
        let (found, estimate) = look.round(&base, declared.as_ref());
        let driven = declared.as_ref().map(|d| d.broken.friction.clone());
        out.driven = driven.unwrap_or_default();
        out.estimate = estimate.filter(|_| out.found.is_empty());
        let Some(found) = found else { break };
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
        && let Some(declared) = declared
    {
        out.without_gravity = look.without_gravity(&declared.trial);
        out.weights = weights(problem);
        out.found.extend(look.within_limits(&declared));
        out.undelivered = undelivered(problem, &declared.trial);
        if out.estimate.is_none() && out.found.is_empty() {
            out.undecided = undecided(problem, &declared.trial);
            let limits = &out.undelivered;
            let limited = |j: usize| limits.iter().any(|limit| limit.joint == j);
            out.undecided.retain(|of| !limited(of.joint));
        }
    }
    out
}

type OneEstimate = Option<(SetupEstimate, [Vec<f64>; 2])>;

pub(super) struct Look<'a> {
    pub problem: &'a Problem<'a>,
    stopped: &'a (dyn Fn() -> bool + Sync),
}

impl Look<'_> {
    fn whole(
        &self,
        base: &Correction,
        change: Option<&Change>,
        same: Option<&Trial>,
    ) -> Option<Judged> {
        let rows = (1, f64::INFINITY);
        let trial = Trial::new(self.problem, (base, change), rows, same.as_slice())?;
        let broken = Broken::of(self.problem, &trial);
        Some(Judged { trial, broken })
    }

    fn quick(
        &self,
        base: &Correction,
        change: Option<&Change>,
        same: &[&Trial],
        most: f64,
    ) -> Option<Trial> {
        let rows = (self.problem.few(), most);
        match (self.stopped)() {
            true => None,
            false => Trial::new(self.problem, (base, change), rows, same),
        }
    }

    fn round(&self, base: &Correction, declared: Option<&Judged>) -> (Option<Found>, OneEstimate) {
        let moving = self.problem.channels_that_move();
        let (mut doubt, mut turned) = (moving.clone(), 0);
        if let Some(d) = declared {
            let errors = d.trial.errors();
            doubt.retain(|j| errors[*j] > LIMITS.doubtful);
            turned = d.broken.turned.len();
        }
        if doubt.is_empty() && turned == 0 {
            return (None, None);
        }
        let few = self.quick(base, None, &[], f64::INFINITY);
        let all = hypotheses::all(self.problem);
        let own: Vec<&Trial> = few.iter().collect();
        let mut list = self.judged(base, all, (&own, declared));
        let mut fitted: Option<(SetupEstimate, Trial)> = None;
        if let (Some(few), Some(whole), true) = (&few, declared, moving.len() > 1) {
            let both = (few, &whole.trial);
            let best = list.iter().map(|j| &j.trial).min_by(|a, b| a.order(b));
            let change = best.and_then(|best| best.change.as_ref());
            // neighbours of a listed value may fit better, and what is beyond its limits has some other factor
            let mut asked = self.problem.beyond_limits(base);
            asked.extend(change.and_then(Change::joint_of_value));
            for estimate in estimates(self.problem, base, (&doubt, &asked), both) {
                let mistakes = estimate.mistakes(&self.problem.known.ratios);
                let known = |c: &Change| list.iter().any(|j| j.trial.change.as_ref() == Some(c));
                let new: Vec<Change> = mistakes.into_iter().filter(|c| !known(c)).collect();
                let of = |c: &Change| self.whole(base, Some(c), Some(&whole.trial));
                let better = |j: &Judged| {
                    let old = j.trial.change.as_ref();
                    new.iter().any(|c| old.is_some_and(|old| c.replaces(old)))
                };
                list.retain(|j| !better(j));
                list.extend(new.iter().filter_map(of));
                let least = fitted.as_ref().map(|f| f.1.whole());
                if let Some(Judged { trial, .. }) = of(&estimate.change)
                    && least.is_none_or(|least| trial.whole() < least)
                {
                    fitted = Some((estimate, trial));
                }
            }
        }
        let free = self.take_free(base, &mut list, declared);
        let fitted_trial = fitted.as_ref().map(|f| &f.1);
        let mut found = self.decide(declared, &list, (fitted_trial, free.as_ref()));
        // two mistakes are sure where one is: beside what is absurd
        let absurd = declared.is_some_and(|d| {
            let errors = d.trial.errors();
            turned > 0 || errors.iter().any(|e| *e > LIMITS.unexplained)
        });
        if absurd && found.as_ref().is_none_or(|f| !f.sure) {
            let (firsts, pairs) = self.pairs(&list);
            let first = |c: &Change| self.quick(base, Some(c), &own, f64::INFINITY);
            let firsts: Vec<Trial> = firsts.iter().filter_map(first).collect();
            // a second mistake in the torques has the columns of the first
            let same: Vec<&Trial> = few.iter().chain(&firsts).collect();
            let mut list = self.judged(base, pairs, (&same, declared));
            let free = self.take_free(base, &mut list, declared);
            let both = self.decide(declared, &list, (None, free.as_ref()));
            found = both.filter(|f| f.sure).or(found);
        }
        let estimated = fitted
            .filter(|_| found.is_none())
            .and_then(|(estimate, trial)| {
                let before = &declared?.trial;
                let compared = Compared::of(self.problem, before, &trial);
                let clear = compared.agreed >= NUMBERS.confirmed && !compared.harms;
                (clear && estimate.is_known())
                    .then(|| (estimate, [before.errors(), trial.errors()]))
            });
        (found, estimated)
    }

    /// The hypotheses of a list that few rows like best, fitted to all rows; with them those that turn what drives.
    fn judged(
        &self,
        base: &Correction,
        list: Vec<Change>,
        (few, declared): (&[&Trial], Option<&Judged>),
    ) -> Vec<Judged> {
        let turned = declared.map_or(&[][..], |d| &d.broken.turned);
        let turns = |i: &usize| match &list[*i] {
            Change::Scale(_, joints, -1.0) => joints.iter().any(|j| turned.contains(j)),
            _ => false,
        };
        let best = Mutex::new(Vec::new());
        let score = |i: usize| {
            // what is surely above the best so far is none of them
            let most = match turns(&i) {
                true => f64::INFINITY,
                false => last_of(&best),
            };
            let trial = self.quick(base, Some(&list[i]), few, most);
            let score = trial.map_or(f64::INFINITY, |trial| trial.whole());
            keep(&best, score);
            score
        };
        let scores: Vec<f64> = (0..list.len()).into_par_iter().map(score).collect();
        let mut order: Vec<usize> = (0..list.len()).filter(|i| scores[*i].is_finite()).collect();
        order.sort_by(|a, b| scores[*a].total_cmp(&scores[*b]));
        let (best, rest) = order.split_at(LIMITS.short_list.min(order.len()));
        let mut chosen: Vec<usize> = best.to_vec();
        chosen.extend(rest.iter().copied().filter(turns));
        let same = declared.map(|d| &d.trial);
        (chosen.par_iter())
            .filter_map(|i| self.whole(base, Some(&list[*i]), same))
            .collect()
    }

    /// Takes readings out of a list whose factor the data do not determine; the best of them.
    fn take_free(
        &self,
        base: &Correction,
        list: &mut Vec<Judged>,
        declared: Option<&Judged>,
    ) -> Option<Trial> {
        let all = std::mem::take(list).into_iter();
        let (known, free): (Vec<_>, Vec<_>) =
            all.partition(|judged| self.has_a_factor(base, judged, declared));
        *list = known;
        let trials = free.into_iter().map(|judged| judged.trial);
        trials.min_by(|a, b| a.order(b))
    }

    /// Whether the data determine the factor of a hypothesis: any that is far off frees a joint from all others.
    fn has_a_factor(&self, base: &Correction, judged: &Judged, declared: Option<&Judged>) -> bool {
        let trial = &judged.trial;
        let seen = match declared {
            Some(d) => Compared::of(self.problem, &d.trial, trial).better,
            None => self.problem.channels_that_move(),
        };
        let same = declared.map(|d| &d.trial);
        let rows = (1, f64::INFINITY);
        let far = |by: f64| {
            let other = trial.change.as_ref().and_then(|c| c.times(by));
            let fit = |c| Trial::new(self.problem, (base, Some(&c)), rows, same.as_slice());
            let other = other.and_then(fit);
            other.is_none_or(|other| other.square(&seen) > LIMITS.far * trial.square(&seen))
        };
        far(LIMITS.yardstick) && far(LIMITS.yardstick.recip())
    }

    /// The best of a list, and each with every other hypothesis.
    fn pairs(&self, list: &[Judged]) -> (Vec<Change>, Vec<Change>) {
        let mut best: Vec<&Trial> = list.iter().map(|j| &j.trial).collect();
        best.sort_by(|a, b| a.order(b));
        let firsts = best.iter().take(LIMITS.short_list / 4);
        let all = hypotheses::all(self.problem);
        let with = |first: &Change| -> Vec<Change> {
            let other = |c: &&Change| {
                let alike = c.is_of_torques() == first.is_of_torques();
                **c != *first && !(c.joints() == first.joints() && alike)
            };
            let pair = |c: &Change| Change::Two(Box::new(first.clone()), Box::new(c.clone()));
            all.iter().filter(other).map(pair).collect()
        };
        let firsts: Vec<Change> = firsts.filter_map(|trial| trial.change.clone()).collect();
        let pairs = firsts.iter().flat_map(with).collect();
        (firsts, pairs)
    }

    /// A mistake that the limits of the file show and the errors do not; a factor is for the fit to estimate.
    fn within_limits(&self, declared: &Judged) -> Option<Found> {
        let beyond_limits = self.problem.beyond_limits(&declared.trial.by);
        if beyond_limits.is_empty() {
            return None;
        }
        let before = declared.trial.errors();
        let mends = |change: &Change| -> Option<Trial> {
            let by = declared.trial.by.with(change);
            if change.times(1.0).is_some() || !self.problem.beyond_limits(&by).is_empty() {
                return None;
            }
            let same = Some(&declared.trial);
            let trial = self.whole(&declared.trial.by, Some(change), same)?.trial;
            let worse = |(b, a): (&f64, &f64)| *a > b * (1.0 + LIMITS.same);
            let after = trial.errors();
            (!before.iter().zip(&after).any(worse)).then_some(trial)
        };
        let all = hypotheses::all(self.problem);
        let mut all: Vec<Trial> = all.iter().filter_map(mends).collect();
        all.sort_by(|a, b| a.order(b));
        let (best, others) = all.split_first()?;
        let change = best.change.clone()?;
        let everyone = self.problem.channels_that_move();
        let tied = |j: &&Trial| !j.gain(best, &everyone).is_beyond(NUMBERS.screen, None);
        let tied = others.iter().filter(tied).filter_map(|j| j.change.clone());
        let tied: Vec<Change> = tied.collect();
        Some(Found {
            errors: [before, best.errors()],
            sure: false,
            conditions: Vec::new(),
            open: !tied.iter().all(|other| same_place(&change, other)),
            tied,
            change,
            together: None,
            beyond_limits,
        })
    }

    /// Errors with gravity and without, where the fit needs none: fewer parameters, and no joint is worse.
    fn without_gravity(&self, declared: &Trial) -> Option<[Vec<f64>; 2]> {
        if declared.robot.tree().gravity() == [0.0; 3] {
            return None;
        }
        let base = Correction::none(self.problem.robot.joints());
        let none = Change::Gravity([0.0; 3]);
        let none = self.whole(&base, Some(&none), None)?.trial;
        let fewer = none.robot.parameters().len() < declared.robot.parameters().len();
        let sound = none.errors().iter().all(|e| *e <= LIMITS.unexplained);
        let harms = Compared::of(self.problem, declared, &none).harms;
        (fewer && sound && !harms).then(|| [declared.errors(), none.errors()])
    }
}

/// The error that a hypothesis may have and still be on the short list.
fn last_of(best: &Mutex<Vec<f64>>) -> f64 {
    let best = best.lock().unwrap_or_else(PoisonError::into_inner);
    let last = best.get(LIMITS.short_list - 1);
    last.copied().unwrap_or(f64::INFINITY)
}

fn keep(best: &Mutex<Vec<f64>>, score: f64) {
    let mut best = best.lock().unwrap_or_else(PoisonError::into_inner);
    let at = best.partition_point(|other| *other <= score);
    best.insert(at, score);
    best.truncate(LIMITS.short_list);
}
