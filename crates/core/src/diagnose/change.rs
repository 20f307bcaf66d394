//! Friction that changes from a time on: the columns of a joint's friction law again, in the blocks from there on.

use rayon::prelude::*;

use super::outcome::FrictionChange;
use super::prepared::PreparedCase;
use super::problem::unknowns::Unknown;
use super::searched::SearchedCase;

/// Standard errors from which on a change is reported: there are as many places as blocks and joints.
const REPORTED: f64 = 3.0;

/// The greatest change of each joint, where it is beyond doubt. It is reported as a change, and no law of it is fitted.
pub fn friction_changes(prepared: &PreparedCase, searched: &SearchedCase) -> Vec<FrictionChange> {
    let field = prepared.field(&searched.candidates, &searched.summed);
    let terms = field.terms(&searched.chosen);
    let Ok(left_out) = field.left_out(&terms) else {
        return Vec::new();
    };
    let joints = 0..prepared.case.given.model.robot.joints();
    let of_joint = |j: usize| {
        let of_law =
            |u: &Unknown| matches!(*u, Unknown::Friction { joint, k } if joint == j && k < 2);
        let declared = prepared.unknowns.list.iter().zip(&terms.list);
        let own = declared.filter(|(u, _)| of_law(u));
        let columns: Vec<_> = own.map(|(_, term)| term.clone()).collect();
        let blocks = &prepared.blocks.list;
        let begins = (1..blocks.len()).filter(|b| blocks[*b].log == blocks[b - 1].log);
        let gains = begins.map(|b| {
            // until the log's end: another log is another day
            let end = blocks[b..].iter().position(|x| x.log != blocks[b].log);
            let until = end.map_or(blocks.len(), |e| b + e);
            (b, left_out.gain_within(&columns, b..until), until)
        });
        let (b, gain, until) = gains.max_by(|a, b| a.1.value.total_cmp(&b.1.value))?;
        if columns.is_empty() || !gain.is_beyond(REPORTED, Some(j)) {
            return None;
        }
        let amplitude = left_out.amplitude_within(&columns, b..until);
        let gradient = [prepared.cover.joints[j].speed_rms, 1.0];
        let by = amplitude.iter().zip(gradient).map(|(x, g)| x * g).sum();
        let (stretch, rows) = blocks[b].pieces.first()?;
        let s = &prepared.case.stretches[*stretch];
        Some(FrictionChange {
            joint: j,
            log: blocks[b].log,
            at_s: s.own_time(prepared.case.filters.of(s).sample_of(rows.start)),
            by,
            certainty: gain.value / gain.se.max(f64::MIN_POSITIVE),
        })
    };
    joints.into_par_iter().filter_map(of_joint).collect()
}
