//! Which effect makes held-out data worse: charged with what it does itself, and not with what another fit of the declared
//! numbers does.

use super::{EffectEstimates, EffectJudge, PendingEffect, StepResult};
use crate::diagnose::held_out::{EffectChange, HeldOutRows};
use crate::diagnose::unexplained::errors::JointChange;
use crate::effect::AugmentedModel;

/// What held-out rows say of a model with effects.
pub(super) enum HeldOutVerdict {
    /// No joint is worse.
    Harmless,
    /// The absence of this effect mends most of the joints that are worse.
    ByEffect(usize),
    /// Joints are worse, and no effect by itself is why: the refit of the declared numbers is. What leaves where the given
    /// numbers are no better beside the effects: that whose absence costs least, unless what the user wants is to blame.
    ByRefit(Option<usize>),
}

impl EffectJudge<'_> {
    /// What held-out rows say of the model that would be written, beside the declared numbers that the same fit gives
    /// without an effect.
    pub(super) fn harm(
        &self,
        ways: &[PendingEffect],
        written: &AugmentedModel,
    ) -> StepResult<HeldOutVerdict> {
        let rows = self.judging_rows();
        let set: Vec<usize> = (0..ways.len())
            .filter(|i| ways[*i].amplitude.is_some())
            .collect();
        let free: Vec<usize> = set.iter().copied().filter(|i| !ways[*i].accepted).collect();
        if free.is_empty() {
            return Ok(HeldOutVerdict::Harmless);
        }
        // first beside the given numbers, then beside those that the refit makes of them without an effect
        let Some(than_given) = self.worse(&rows, [&self.prepared.case.in_use, written])? else {
            return Ok(HeldOutVerdict::Harmless);
        };
        let than_refit = self.worse(&rows, [&self.alone()?, written])?;
        let charged = than_refit.is_some();
        let worse = than_refit.unwrap_or(than_given);
        let all: Vec<&PendingEffect> = set.iter().map(|i| &ways[*i]).collect();
        let with = self.based(self.fitted(&all));
        let joints = self.prepared.case.given.model.robot.joint_names();
        let (mut most, mut mends) = ((free[0], f64::NEG_INFINITY), false);
        for i in free {
            let others = set.iter().filter(|k| **k != i);
            let others: Vec<&PendingEffect> = others.map(|k| &ways[*k]).collect();
            let without = self.based(self.fitted(&others));
            let Some(own) = rows.0.change([&without, &with])? else {
                continue;
            };
            let place = self.field.effect(&ways[i].chosen).place;
            let acts_on = |name: &str| {
                let joint = joints.iter().position(|joint| joint == name);
                joint.is_some_and(|j| place.touches(j))
            };
            let sure = charged && worse.is_mended(&own, &acts_on);
            let cost = worse.cost(&own);
            if (sure, cost) > (mends, most.1) {
                (most, mends) = ((i, cost), sure);
            }
        }
        Ok(match mends {
            true => HeldOutVerdict::ByEffect(most.0),
            false => {
                // the harm of what the user wants is no reason against the others
                let wanted = set.iter().any(|i| ways[*i].accepted);
                HeldOutVerdict::ByRefit((most.1 > 0.0 || !wanted).then_some(most.0))
            }
        })
    }

    /// Whether held-out rows are no worse by a model than by the given one.
    pub(super) fn is_harmless(&self, written: &AugmentedModel) -> StepResult<bool> {
        let rows = self.judging_rows();
        let worse = self.worse(&rows, [&self.prepared.case.in_use, written])?;
        Ok(worse.is_none())
    }

    /// What the declared numbers leave without an effect, as the refit makes them.
    fn alone(&self) -> StepResult<AugmentedModel> {
        let estimates = EffectEstimates::of(&self.field, &[])?;
        let model = self.based(self.prepared.refitted(&self.fitted(&[]))?);
        self.in_use((&model, None), &estimates)
    }

    /// Where the second model is worse than the first; none where it is nowhere. Rows that were given for it speak joint
    /// by joint; of single joints those that are set aside measure too few, and they speak in the mean.
    fn worse(
        &self,
        (rows, given): &(HeldOutRows, bool),
        models: [&AugmentedModel; 2],
    ) -> StepResult<Option<WorseJoints>> {
        let noticeable = self.field.numbers().noticeable;
        let Some(change) = rows.change(models)? else {
            return Ok(None);
        };
        let worse = (change.joints.iter()).map(|j| *given && j.noticeably_worse(noticeable));
        let worse: Vec<bool> = worse.collect();
        let some = worse.contains(&true) || change.mean[1] > change.mean[0];
        Ok(some.then_some(WorseJoints(worse)))
    }
}

/// Whether each joint is worse; none of them is where all are so in the mean alone.
struct WorseJoints(Vec<bool>);

impl WorseJoints {
    /// What an effect costs the joints that are worse, in squared relative error; the mean where it is that.
    fn cost(&self, by: &EffectChange) -> f64 {
        let own = by.joints.iter().zip(&self.0).filter(|(_, worse)| **worse);
        match self.0.contains(&true) {
            true => own.map(|(joint, _)| squares(joint)).sum(),
            false => by.mean[1] - by.mean[0],
        }
    }

    /// Whether the absence of an effect mends a joint that is worse by more than its standard error, and the joints
    /// together, or this one because the effect acts on it.
    fn is_mended(&self, by: &EffectChange, acts_on: &dyn Fn(&str) -> bool) -> bool {
        if !self.0.contains(&true) {
            return by.mean[1] > by.mean[0];
        }
        let all: f64 = by.joints.iter().map(squares).sum();
        let mended = |joint: &JointChange| {
            let [low, high] = joint.interval_95;
            let error = (high - low) / (2.0 * 1.96);
            joint.after - joint.before > error && (all > 0.0 || acts_on(&joint.joint))
        };
        let mut own = by.joints.iter().zip(&self.0).filter(|(_, worse)| **worse);
        own.any(|(joint, _)| mended(joint))
    }
}

/// What a change adds to the squared relative error of a joint.
fn squares(joint: &JointChange) -> f64 {
    joint.after * joint.after - joint.before * joint.before
}
