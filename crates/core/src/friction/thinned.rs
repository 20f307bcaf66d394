//! A share of a long log for the search: what finds the maximum need not see every row. The
//! maximum itself is then settled on all of them.

use std::ops::Range;

use super::prepare::PreparedProblem;
use super::problem::{FrictionProblem, JointRecord};

/// Samples of one piece.
const PIECE: usize = 1000;

/// At most about `most` samples in pieces, half of them with a turn of the joint; `None` where the log has no more.
pub(super) fn thinned(prepared: &PreparedProblem, most: usize) -> Option<PreparedProblem> {
    let records = &prepared.problem.records;
    if prepared.problem.samples() <= most {
        return None;
    }
    let (mut turning, mut others) = (Vec::new(), Vec::new());
    let mut first = 0;
    for (r, record) in records.iter().enumerate() {
        let samples = record.t.len();
        let count = samples.div_ceil(PIECE);
        for i in 0..count {
            let rows = i * samples / count..(i + 1) * samples / count;
            let v = &prepared.velocity[first + rows.start..first + rows.end];
            let turns = v.iter().any(|x| *x > 0.0) && v.iter().any(|x| *x < 0.0);
            let of_kind = if turns { &mut turning } else { &mut others };
            of_kind.push((r, first, rows));
        }
        first += samples;
    }
    let budget = (most / PIECE).max(2);
    let of_turning = (budget / 2).max(budget.saturating_sub(others.len()));
    let mut kept = evenly(&turning, of_turning);
    kept.extend(evenly(&others, budget - kept.len()));
    kept.sort_by_key(|(record, _, rows)| (*record, rows.start));
    let (mut velocity, mut acceleration) = (Vec::new(), Vec::new());
    let mut parts = Vec::new();
    for (record, first, rows) in kept.into_iter().filter(|(_, _, rows)| rows.len() >= 3) {
        let all = first + rows.start..first + rows.end;
        velocity.extend(&prepared.velocity[all.clone()]);
        acceleration.extend(&prepared.acceleration[all.clone()]);
        let v0 = prepared.velocity[all.start];
        parts.push(part(&records[record], rows, v0, prepared.problem.nuisance));
    }
    Some(PreparedProblem {
        problem: FrictionProblem {
            records: parts,
            ..prepared.problem
        },
        back: prepared.back.clone(),
        velocity,
        acceleration,
    })
}

/// At most `most` of the pieces, spread evenly.
fn evenly(pieces: &[Piece], most: usize) -> Vec<Piece> {
    let count = pieces.len().min(most);
    let at = |i: usize| pieces[i * pieces.len() / count].clone();
    (0..count).map(at).collect()
}

/// Record, first sample of it among all, and samples of the piece.
type Piece = (usize, usize, Range<usize>);

/// Some samples of a record as a record.
fn part(record: &JointRecord, rows: Range<usize>, v0: f64, nuisance: usize) -> JointRecord {
    let intervals = rows.start..rows.end - 1;
    let columns = intervals.start * nuisance..intervals.end * nuisance;
    JointRecord {
        t: record.t[rows.clone()].to_vec(),
        y: record.y[rows.clone()].to_vec(),
        r: record.r[rows].to_vec(),
        tau: record.tau[intervals].to_vec(),
        m: record.m[columns.clone()].to_vec(),
        h: record.h[columns].to_vec(),
        v0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::trial::FrictionTrial;
    use super::*;

    #[test]
    fn a_share_of_a_log_keeps_turning_points_and_what_lies_between_in_their_order() {
        let prepared = FrictionTrial::usual().prepared(1);
        let all = prepared.problem.samples();
        assert!(thinned(&prepared, all).is_none());
        let share = thinned(&prepared, 6000).expect("the log is longer");
        let samples = share.problem.samples();
        assert!((5000..=6000).contains(&samples), "{samples}");
        assert_eq!(share.velocity.len(), samples);
        assert_eq!(share.acceleration.len(), samples);
        let (mut first, mut turns, mut before) = (0, 0, f64::NEG_INFINITY);
        for record in &share.problem.records {
            assert!(record.t[0] > before);
            before = record.t[record.t.len() - 1];
            assert_eq!(record.tau.len() + 1, record.t.len());
            assert_eq!(record.m.len(), record.tau.len() * prepared.problem.nuisance);
            let v = &share.velocity[first..first + record.t.len()];
            assert_eq!(record.v0, v[0]);
            turns += usize::from(v.iter().any(|x| *x > 0.0) && v.iter().any(|x| *x < 0.0));
            first += record.t.len();
        }
        assert!(turns >= 1 && turns < share.problem.records.len());
    }
}
