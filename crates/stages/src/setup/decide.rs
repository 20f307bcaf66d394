//! Which reading of a list is reported, if any, and whether it is sure.

use super::LIMITS;
use super::channels::Drive;
use super::condition::{SetupCondition, SetupCriterion};
use super::correction::Change;
use super::found::Found;
use super::hypotheses::{oddity, same_line, same_place};
use super::search::{Judged, Look};
use super::trial::{Compared, Trial};
use super::undecided::proportion;
use cft_ident_core::judge::NUMBERS;

/// What the best reading gains over the declared set-up.
struct GainOverDeclared {
    /// Joints in which it shows.
    seen: Vec<usize>,
    /// Their errors as declared; not finite where the declared positions belong to no pose.
    before: Vec<f64>,
    /// Physics is whole that was not.
    mended: bool,
    /// How far the parts of the logs agree, 0..1.
    agreed: f64,
}

impl GainOverDeclared {
    /// Over a set-up whose positions belong to no pose.
    fn without_errors(everyone: Vec<usize>, best: &Judged) -> Self {
        Self {
            seen: everyone,
            before: vec![f64::NAN; best.trial.errors().len()],
            mended: false,
            agreed: 1.0,
        }
    }
}

/// Readings that these data do not distinguish from the best.
struct TiedReadings {
    changes: Vec<Change>,
    /// Some of them are of other joints.
    open: bool,
}

impl Look<'_> {
    /// The reading that is reported, beside the best value on no list and the best whose factor is not determined.
    pub fn decide(
        &self,
        declared: Option<&Judged>,
        list: &[Judged],
        (fitted, free): (Option<&Trial>, Option<&Trial>),
    ) -> Option<Found> {
        // what physics breaks counts first, then the error; the simplest of equals is first in the list
        let mut order: Vec<&Judged> = list.iter().collect();
        order.sort_by(|a, b| a.turned().cmp(&b.turned()).then(a.trial.order(&b.trial)));
        let best = self.plainer(&order)?;
        let change = best.trial.change.as_ref()?;
        let gained = match declared {
            Some(declared) => self.gained(declared, best, change)?,
            None => GainOverDeclared::without_errors(self.problem.channels_that_move(), best),
        };
        if self.is_contradicted((best, change), &gained, (fitted, free)) {
            return None;
        }
        let ties = self.ties(&order, (best, change), (&gained.seen, declared))?;
        let conditions = self.conditions((best, change), &gained, &ties, fitted);
        let together = self.moves_with(change);
        Some(Found {
            sure: SetupCondition::all_hold(&conditions),
            conditions,
            errors: [gained.before, best.trial.errors()],
            tied: ties.changes,
            change: change.clone(),
            open: ties.open,
            together,
            beyond_limits: Vec::new(),
        })
    }

    /// What a reading gains over the declared set-up; none where it gains too little, or harms a joint.
    fn gained(
        &self,
        declared: &Judged,
        best: &Judged,
        change: &Change,
    ) -> Option<GainOverDeclared> {
        let compared = Compared::of(self.problem, &declared.trial, &best.trial);
        let (before, after) = (declared.trial.errors(), best.trial.errors());
        let better = &compared.better;
        let absurd = better.iter().any(|j| before[*j] > LIMITS.unexplained);
        let mended = best.turned() < declared.turned();
        let confirmed = compared.agreed >= NUMBERS.confirmed;
        // what is not absurd is a factor, or most of what is missed, and sound machines leave as little
        let left = best.trial.square(better) / declared.trial.square(better);
        let sound = || after.iter().all(|e| *e <= LIMITS.sound);
        let plain = || change.times(1.0).is_some() || left < LIMITS.same && sound();
        let likely = match absurd {
            true => compared.agreed > 0.0,
            false => confirmed && plain(),
        };
        // behind gears and linkages a motor is of several joints
        let own = self.problem.channels.drive != Drive::Joints || own_gain(change, better);
        // the best one makes a joint worse: nothing on the list is it, and no lesser one takes its place
        if compared.harms || !(mended || likely && own) {
            return None;
        }
        // physics alone shows where no error changes
        let seen = match compared.better.is_empty() {
            true => self.problem.channels_that_move(),
            false => compared.better,
        };
        Some(GainOverDeclared {
            seen,
            before,
            mended,
            agreed: compared.agreed,
        })
    }

    /// Whether a value on no list, or one that these data leave open, speaks against a reading.
    fn is_contradicted(
        &self,
        (best, change): (&Judged, &Change),
        gained: &GainOverDeclared,
        (fitted, free): (Option<&Trial>, Option<&Trial>),
    ) -> bool {
        let everyone = self.problem.channels_that_move();
        let seen = &gained.seen;
        let far = |f: &Trial| f.square(seen) * LIMITS.far < best.trial.square(seen);
        // another value of the same thing, clearly better, contradicts that of the list
        let contradicts = |f: &Trial| {
            let value = f.change.as_ref().filter(|_| change.times(1.0).is_some());
            let same = value.is_some_and(|c| c.is_value_of(change));
            let closer = f.whole() * (1.0 + LIMITS.same) < best.trial.whole();
            let gain = || best.trial.gain(f, &everyone);
            same && closer && gain().is_beyond(NUMBERS.screen, None)
        };
        // nor does a lesser one take the place of what is wrong by a factor that these data leave open
        let open = |f: &Trial| f.whole() * LIMITS.far < best.trial.whole();
        fitted.is_some_and(|f| far(f) || contradicts(f)) || !gained.mended && free.is_some_and(open)
    }

    /// Readings that these data do not distinguish from the best; none where it is a ratio that its neighbours are as
    /// good as, and that leaves most of the error: an estimate then.
    fn ties(
        &self,
        order: &[&Judged],
        (best, change): (&Judged, &Change),
        (seen, declared): (&[usize], Option<&Judged>),
    ) -> Option<TiedReadings> {
        let untold = |j: &Trial| self.is_untold(j, best, seen);
        let others = order.iter().filter(|j| j.turned() <= best.turned());
        let others = others.map(|j| &j.trial);
        let others = others.filter(|j| j.change != best.trial.change);
        let others: Vec<&Trial> = others.filter(|j| self.is_near(j, best, seen)).collect();
        let changes: Vec<Change> = others.iter().filter_map(|j| j.change.clone()).collect();
        let ratio = |c: &Change| c.times(1.0).is_some() && self.oddity(c) > 0;
        let neighbour = |c: &Change| ratio(c) && c.joints() == change.joints();
        let most = |d: &Judged| best.trial.whole() <= LIMITS.floor * d.trial.whole();
        if ratio(change) && changes.iter().any(neighbour) && !declared.is_none_or(most) {
            return None;
        }
        let elsewhere = |j: &&&Trial| {
            let other = j.change.as_ref();
            other.is_some_and(|other| !same_place(change, other))
        };
        Some(TiedReadings {
            open: others.iter().filter(elsewhere).any(|j| untold(j)),
            changes,
        })
    }

    /// Whether blocks left out do not show that a trial is worse than the best.
    fn is_untold(&self, trial: &Trial, best: &Judged, seen: &[usize]) -> bool {
        !(trial.gain(&best.trial, seen)).is_beyond(NUMBERS.screen, None)
    }

    /// Whether a trial leaves about what the best does.
    fn is_near(&self, trial: &Trial, best: &Judged, seen: &[usize]) -> bool {
        trial.square(seen) < LIMITS.far * best.trial.square(seen)
            || self.is_untold(trial, best, seen)
    }

    /// What a reading must satisfy to be sure.
    fn conditions(
        &self,
        (best, change): (&Judged, &Change),
        gained: &GainOverDeclared,
        ties: &TiedReadings,
        fitted: Option<&Trial>,
    ) -> Vec<SetupCondition> {
        let (before, after) = (&gained.before, best.trial.errors());
        let missed = |j: &usize| before[*j].is_nan() || before[*j] > LIMITS.unexplained;
        let absurd: Vec<usize> = gained.seen.iter().copied().filter(missed).collect();
        let mut out = SetupCondition::of_errors(&absurd, [before, &after]);
        if absurd.is_empty() {
            // physics alone shows it
            let driven = [f64::from(u8::from(gained.mended)), 0.0];
            out.push(SetupCondition::new(
                SetupCriterion::Driven,
                None,
                driven,
                gained.mended,
            ));
            let count = best.turned();
            out.push(SetupCondition::none_of(
                SetupCriterion::NotDriven,
                None,
                count,
            ));
        }
        if !gained.mended {
            out.push(SetupCondition::agreement(gained.agreed));
        }
        let others = (ties.changes.iter()).filter(|other| !same_line(change, other));
        out.push(SetupCondition::none_of(
            SetupCriterion::NoOther,
            None,
            others.count(),
        ));
        let beside = fitted.is_some_and(|f| {
            let own = f.change.as_ref().map(Change::joints);
            own != Some(change.joints()) && self.is_near(f, best, &gained.seen)
        });
        let beside = usize::from(beside);
        out.push(SetupCondition::none_of(
            SetupCriterion::NoValueBeside,
            None,
            beside,
        ));
        let together = self.moves_with(change);
        let joint = together.map(|[own, _]| own);
        let count = usize::from(joint.is_some());
        out.push(SetupCondition::none_of(
            SetupCriterion::MovesApart,
            joint,
            count,
        ));
        // no line mends a velocity, and `inspect` knows it surely where the log has velocities
        let velocity = usize::from(matches!(change, Change::Velocity(..)));
        out.push(SetupCondition::none_of(
            SetupCriterion::HasALine,
            None,
            velocity,
        ));
        out
    }

    /// A joint of a change that moves in proportion to another, and that one.
    fn moves_with(&self, change: &Change) -> Option<[usize; 2]> {
        let everyone = self.problem.channels_that_move();
        change.joints().into_iter().find_map(|j| {
            let (other, _) = proportion(self.problem, &everyone, j)?;
            Some([j, other])
        })
    }

    /// How far from what people write the factor of a change is; 0 where it has none.
    fn oddity(&self, change: &Change) -> u32 {
        match change {
            Change::Scale(_, _, f) | Change::Gear(_, f) => oddity(*f, &self.problem.known.ratios),
            _ => 0,
        }
    }

    /// The first reading, or another factor of its channel that blocks do not distinguish and people write more often.
    fn plainer<'j>(&self, order: &[&'j Judged]) -> Option<&'j Judged> {
        let best = *order.first()?;
        let odd = |j: &Judged| j.trial.change.as_ref().map_or(0, |c| self.oddity(c));
        let alike = |j: &&&Judged| match (&best.trial.change, &j.trial.change) {
            (Some(best), Some(other)) => other.is_value_of(best),
            _ => false,
        };
        let everyone = self.problem.channels_that_move();
        let tied = |j: &&&Judged| {
            let gain = j.trial.gain(&best.trial, &everyone);
            let near = j.trial.whole() <= best.trial.whole() * (1.0 + LIMITS.same);
            near && !gain.is_beyond(NUMBERS.screen, None)
        };
        let near = order.iter().filter(alike).filter(tied);
        // the first of equals
        Some(near.min_by_key(|j| odd(j)).copied().unwrap_or(best))
    }
}

/// Whether the joints of a change gain by it themselves: each mistake of it shows where it was made.
fn own_gain(change: &Change, better: &[usize]) -> bool {
    match change {
        Change::Two(a, b) => own_gain(a, better) && own_gain(b, better),
        Change::Exchange(_, a, b) => better.contains(a) && better.contains(b),
        Change::Reverse | Change::Gravity(_) => !better.is_empty(),
        one => one.joints().iter().all(|j| better.contains(j)),
    }
}
