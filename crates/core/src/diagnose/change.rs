//! Friction or a constant torque that changes from a time on: the columns of a joint's friction law, or that of its
//! offset, again in the blocks from there on.

use std::ops::Range;

use rayon::prelude::*;

use super::outcome::{ChangedTorque, TorqueChange};
use super::problem::unknowns::Unknown;
use super::search::{ChosenCandidate, Field, own_joint};
use crate::effect::Family;
use crate::judge::{BlocksLeftOut, ErrorGain, Term};

/// Standard errors from which on a change is reported: there are as many places as blocks and joints.
const REPORTED: f64 = 3.0;

/// What terms of a joint gain that are there from a block of a log on, until the log's end: another log is another day.
struct LateTerms {
    within: Range<usize>,
    gain: ErrorGain,
}

/// The terms of what of a joint's torque may change.
fn changing_terms(field: &Field, joint: usize, of: ChangedTorque) -> Vec<Term> {
    let is_own = |unknown: &Unknown| match (of, *unknown) {
        (ChangedTorque::Friction, Unknown::Friction { joint: j, k }) => j == joint && k < 2,
        (ChangedTorque::Offset, Unknown::Offset(j)) => j == joint,
        _ => false,
    };
    let declared = field.prepared.unknowns.list.iter();
    let declared = declared.zip(&field.summed.declared.list);
    let own = declared.filter(|(unknown, _)| is_own(unknown));
    own.map(|(_, term)| term.clone()).collect()
}

impl LateTerms {
    /// Of each log the begin that gains most.
    fn of_logs(field: &Field, left_out: &BlocksLeftOut, terms: &[Term]) -> Vec<Self> {
        if terms.is_empty() {
            return Vec::new();
        }
        let blocks = &field.prepared.blocks.list;
        let mut from = 0;
        let logs = blocks.chunk_by(|a, b| a.log == b.log).map(|log| {
            from += log.len();
            from - log.len()..from
        });
        let best = |log: Range<usize>| {
            let begins = (log.start + 1..log.end).map(|b| b..log.end);
            let late = begins.map(|within| LateTerms {
                gain: left_out.gain_within(terms, within.clone()),
                within,
            });
            late.max_by(|a, b| a.gain.value.total_cmp(&b.gain.value))
        };
        logs.filter_map(best).collect()
    }

    /// Whether the gain is beyond doubt.
    fn is_sure(&self, joint: usize) -> bool {
        self.gain.is_beyond(REPORTED, Some(joint))
    }
}

/// The greatest change of each joint, where it is beyond doubt and takes off the joint's error what one would notice. It
/// is reported as a change, and no law of it is fitted.
pub fn torque_changes(field: &Field, chosen: &[ChosenCandidate]) -> Vec<TorqueChange> {
    let prepared = field.prepared;
    let terms = field.terms(chosen);
    let Ok(left_out) = field.left_out(&terms) else {
        return Vec::new();
    };
    let errors = left_out.errors();
    let of_joint = |j: usize| {
        let kinds = [ChangedTorque::Friction, ChangedTorque::Offset].into_iter();
        let all = kinds.flat_map(|of| {
            let late = LateTerms::of_logs(field, &left_out, &changing_terms(field, j, of));
            let late = late.into_iter();
            late.map(move |late| (of, late))
        });
        let (of, late) = all.max_by(|a, b| a.1.gain.value.total_cmp(&b.1.gain.value))?;
        let error = terms.weights[j] * errors.iter().map(|e| e[j]).sum::<f64>();
        let left = (1.0 - field.numbers().noticeable).powi(2) * error;
        if !late.is_sure(j) || error - late.gain.joints[j][0] > left {
            return None;
        }
        let amplitude =
            left_out.amplitude_within(&changing_terms(field, j, of), late.within.clone());
        let by = match of {
            ChangedTorque::Offset => amplitude[0],
            ChangedTorque::Friction => {
                let gradient = [prepared.cover.joints[j].speed_rms, 1.0];
                amplitude.iter().zip(gradient).map(|(x, g)| x * g).sum()
            }
        };
        let block = &prepared.blocks.list[late.within.start];
        let (stretch, rows) = block.pieces.first()?;
        let s = &prepared.case.stretches[*stretch];
        Some(TorqueChange {
            joint: j,
            log: block.log,
            at_s: s.own_time(prepared.case.filters.of(s).sample_of(rows.start)),
            of,
            by,
            certainty: late.gain.value / late.gain.se.max(f64::MIN_POSITIVE),
        })
    };
    let joints = 0..prepared.case.given.model.robot.joints();
    joints.into_par_iter().filter_map(of_joint).collect()
}

/// Joints of which steps of the constant torque, one in a log, explain more than any law that goes by time alone: what is
/// seen there is a step of the channel, and no drift.
pub fn stepped_joints(field: &Field, left_out: &BlocksLeftOut) -> Vec<usize> {
    let is_stepped = |j: &usize| {
        let offset = changing_terms(field, *j, ChangedTorque::Offset);
        let steps = LateTerms::of_logs(field, left_out, &offset).into_iter();
        let sure = steps.filter(|late| late.is_sure(*j));
        let by_steps: f64 = sure.map(|late| late.gain.value).sum();
        let slow = (0..field.candidates.len()).filter(|c| {
            let effect = &field.candidates[*c].effect;
            effect.family() == Family::Slow && own_joint(effect.place) == Some(*j)
        });
        let by_time = slow.map(|c| left_out.gain(field.terms_of(c)).value);
        by_steps > by_time.fold(0.0, f64::max)
    };
    let joints = 0..field.prepared.case.given.model.robot.joints();
    joints.into_par_iter().filter(is_stepped).collect()
}
