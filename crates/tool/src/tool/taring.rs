//! Changes of the bias at instants: where they are, several of them, gaps of the clock first.

use super::effect::WrenchEffect;
use super::fit::{WrenchFit, WrenchProblem};
use super::wrench_log::PoseRow;

/// Rows on each side of a change of the bias, at least.
const BESIDE: usize = 3;
/// Most changes that are asked for together. Half: four programs, each of which tares, look like a drift; twice: of fifty
/// poses every third has a bias of its own.
const MOST: usize = 6;
/// Rows at which a change is tried. Half: of many small ones a larger jump of the pose hides one; twice: a log of
/// thousands of rows takes minutes.
const TRIED: usize = 40;

impl WrenchProblem {
    /// When a change of the bias is, time \[s\] or number of the row; none of other effects.
    pub fn begins(&self, effect: WrenchEffect) -> Option<f64> {
        let WrenchEffect::Taring { row } = effect else {
            return None;
        };
        let first = self.rows.iter().find(|of| of.number >= row);
        first.map(|of| of.t)
    }
}

fn is_taring(effect: &WrenchEffect) -> bool {
    matches!(effect, WrenchEffect::Taring { .. })
}

/// Sets of effects with one, two, .. changes of the bias beside the others of `chosen`.
pub(super) fn with_tarings(
    problem: &WrenchProblem,
    chosen: &[WrenchEffect],
) -> Vec<Vec<WrenchEffect>> {
    let others: Vec<WrenchEffect> = chosen.iter().filter(|e| !is_taring(e)).copied().collect();
    let had = chosen.len() - others.len();
    let mut rows: Vec<usize> = Vec::new();
    let mut out = Vec::new();
    for _ in 0..MOST {
        let Some(best) = next(problem, &others, &rows) else {
            break;
        };
        rows.push(best);
        settle(problem, &others, &mut rows);
        rows.sort_unstable();
        if rows.len() > had {
            out.push(set(problem, &others, &rows));
        }
    }
    out
}

fn set(problem: &WrenchProblem, others: &[WrenchEffect], rows: &[usize]) -> Vec<WrenchEffect> {
    let tarings = rows.iter().map(|row| WrenchEffect::Taring {
        row: problem.rows[*row].number,
    });
    others.iter().copied().chain(tarings).collect()
}

fn fit_of(problem: &WrenchProblem, others: &[WrenchEffect], rows: &[usize]) -> WrenchFit {
    let whole = std::iter::once(0..problem.rows.len()).collect::<Vec<_>>();
    problem.fit(&set(problem, others, rows), &whole)
}

/// Squared weighted errors of a fit.
fn cost(problem: &WrenchProblem, others: &[WrenchEffect], rows: &[usize]) -> f64 {
    let [wf, wt] = problem.weights;
    let residual = fit_of(problem, others, rows).residual;
    let each = residual
        .iter()
        .flat_map(|e| (0..6).map(|k| (if k < 3 { wf } else { wt } * e[k]).powi(2)));
    each.sum()
}

/// Rows at which the bias may change: behind the longest steps of the clock, and where what is left jumps most.
fn places(problem: &WrenchProblem, others: &[WrenchEffect], rows: &[usize]) -> Vec<usize> {
    let n = problem.rows.len();
    let ends = [0, n];
    let free = |row: &usize| {
        let mut taken = rows.iter().chain(&ends);
        taken.all(|other| row.abs_diff(*other) >= BESIDE)
    };
    let all: Vec<usize> = (1..n).filter(free).collect();
    if all.len() <= TRIED {
        return all;
    }
    let [wf, wt] = problem.weights;
    let residual = fit_of(problem, others, rows).residual;
    let jump = |row: &usize| {
        let of =
            |k: usize| (if k < 3 { wf } else { wt }) * (residual[*row][k] - residual[*row - 1][k]);
        (0..6).map(|k| of(k).powi(2)).sum::<f64>()
    };
    let step = |rows: &[PoseRow], row: usize| rows[row].t - rows[row - 1].t;
    let mut by_gap = all.clone();
    by_gap.sort_by(|a, b| step(&problem.rows, *b).total_cmp(&step(&problem.rows, *a)));
    let mut by_jump = all;
    by_jump.sort_by(|a, b| jump(b).total_cmp(&jump(a)));
    let half = TRIED / 2;
    by_gap
        .into_iter()
        .take(half)
        .chain(by_jump.into_iter().take(half))
        .collect()
}

/// The row at which one more change leaves least.
fn next(problem: &WrenchProblem, others: &[WrenchEffect], rows: &[usize]) -> Option<usize> {
    let with = |row: usize| cost(problem, others, &[rows, &[row]].concat());
    let tried = places(problem, others, rows).into_iter();
    let costs = tried.map(|row| (row, with(row)));
    costs.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(row, _)| row)
}

/// Moves each change to where it leaves least beside the others, once.
fn settle(problem: &WrenchProblem, others: &[WrenchEffect], rows: &mut [usize]) {
    for k in 0..rows.len() {
        let rest: Vec<usize> = (0..rows.len())
            .filter(|i| *i != k)
            .map(|i| rows[i])
            .collect();
        if let Some(best) = next(problem, others, &rest) {
            rows[k] = best;
        }
    }
}
