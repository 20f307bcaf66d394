//! Disturbances: episodes in time whose residual stands far above that of all the rest, as of somebody
//! who pushes. What depends on the motion comes again with the motion; an episode does not. It is cut
//! out, and said so: no law is fitted to it.

use crate::diagnose::problem::data_split::{DataSplit, RowRole};
use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::rests::near_rests;
use crate::motion::{ParallelFilters, Stretch};

/// An episode that was cut out.
#[derive(Debug, Clone, PartialEq)]
pub struct CutDisturbance {
    pub log: usize,
    /// The joint on which it stands out most.
    pub joint: usize,
    pub from_s: f64,
    pub to_s: f64,
    /// Mean squared residual over that of the middle piece of the joint.
    pub over: f64,
}

/// Mean squared residual of a piece, over that of the middle one, from which on it stands out.
const STANDS_OUT: f64 = 100.0;
/// The same of the highest piece that does not stand out, at most: a distribution with a tail is no
/// episode.
const REST: f64 = 15.0;
/// Most of a joint's rows that an episode may hold.
const MOST: f64 = 0.1;
/// Least pieces from which to say what is usual.
const LEAST: usize = 20;
/// Most runs of neighbouring pieces.
const RUNS: usize = 3;

/// Pieces that stand out, with joint and by how much: index in the split. What friction at rest does alone, of
/// which a law that jumps says too much, is no episode.
pub fn find(at: &FittedModel, problem: &FitProblem, cutoff_hz: f64) -> Vec<(usize, usize, f64)> {
    let (base, split) = (&at.base, &problem.split);
    let joints = base.unknowns.columns.len();
    let mut found: Vec<(usize, usize, f64)> = Vec::new();
    for j in 0..joints {
        let near = |stretch| {
            let filter = problem.filters.of(stretch);
            near_rests(&at.model, stretch, filter, cutoff_hz, j)
        };
        let near: Vec<Vec<bool>> = problem.stretches.iter().map(near).collect();
        // an episode among the rows that may veto would veto what is right
        let looked_at = |i: &usize| {
            let piece = &split.pieces[*i];
            let used = piece.role.fitted() || piece.role == RowRole::Veto;
            used && !split.ignores(piece.stretch, j)
        };
        let pieces: Vec<usize> = (0..split.pieces.len()).filter(looked_at).collect();
        let mean = |i: usize| base.sums[i][j].square / split.pieces[i].rows.len().max(1) as f64;
        let mut all: Vec<f64> = pieces.iter().map(|i| mean(*i)).collect();
        all.sort_by(f64::total_cmp);
        let middle = all.get(all.len() / 2).copied().unwrap_or(0.0);
        if middle <= 0.0 || pieces.len() < LEAST {
            continue;
        }
        let out: Vec<usize> = pieces
            .iter()
            .copied()
            .filter(|i| mean(*i) > REST * middle)
            .collect();
        let rows = |of: &[usize]| {
            of.iter()
                .map(|i| split.pieces[*i].rows.len())
                .sum::<usize>()
        };
        let runs = 1 + out.windows(2).filter(|w| w[1] > w[0] + 1).count();
        let few = rows(&out) as f64 <= MOST * rows(&pieces) as f64 && runs <= RUNS;
        // one piece at least must stand out by rows of its own that are near no rest
        let moving = |i: usize| {
            let piece = &split.pieces[i];
            let near = &near[piece.stretch];
            let residual = &base.stretches[piece.stretch].residual[j];
            let rows = piece.rows.clone().filter(|row| !near[*row]);
            let squares = rows.map(|row| residual[row].powi(2));
            let (rows, sum) = squares.fold((0, 0.0), |(n, sum), x| (n + 1, sum + x));
            // of few rows that are left one that rings would stand for all
            match 2 * rows >= piece.rows.len().max(1) {
                true => sum / rows as f64,
                false => 0.0,
            }
        };
        let highest = out.iter().map(|i| moving(*i)).fold(0.0, f64::max);
        if highest > STANDS_OUT * middle && few {
            found.extend(out.into_iter().map(|i| (i, j, mean(i) / middle)));
        }
    }
    found
}

/// Takes the pieces, and their neighbours into which the filter carries them, out of the split.
pub fn cut(
    found: &[(usize, usize, f64)],
    split: &mut DataSplit,
    stretches: &[Stretch],
    filters: &ParallelFilters,
) -> Vec<CutDisturbance> {
    let mut episodes: Vec<CutDisturbance> = Vec::new();
    let mut last = None;
    for &(i, joint, over) in found {
        let piece = split.pieces[i].clone();
        let stretch = &stretches[piece.stretch];
        let filter = filters.of(stretch);
        let time = |row: usize| stretch.own_time(filter.sample_of(row));
        let (from_s, to_s) = (time(piece.rows.start), time(piece.rows.end));
        match episodes.last_mut() {
            Some(e) if last == Some((i, joint)) => {
                e.to_s = to_s;
                e.over = e.over.max(over);
            }
            _ => episodes.push(CutDisturbance {
                log: stretch.log,
                joint,
                from_s,
                to_s,
                over,
            }),
        }
        last = Some((i + 1, joint));
        for k in i.saturating_sub(1)..=(i + 1).min(split.pieces.len() - 1) {
            let near = &mut split.pieces[k];
            if near.stretch == piece.stretch && near.role != RowRole::Holdout {
                near.role = RowRole::Cut;
            }
        }
    }
    episodes
}
