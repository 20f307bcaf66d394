//! Rows that tell another story than all others: somebody leans on the tool, or holds it.

use std::ops::Range;

use schemars::JsonSchema;
use serde::Serialize;

use super::NUMBERS;
use super::effect::WrenchEffect;
use super::fit::{WrenchFit, WrenchProblem};
use super::search::{FoundEffects, search};
use cft_ident_core::judge::{GroupError, kept_groups};

/// Groups of neighbours that are looked at. Half: a touch of two poses in fifty is averaged with their neighbours; twice:
/// twice the time.
const GROUPS: usize = 96;
/// Deviations of the others from which on a row is another story.
const FAR: f64 = 5.0;

/// Rows in which something pushes the tool.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ToolTouch {
    /// First and last time \[s\], or numbers of the rows from 0.
    pub span: [f64; 2],
    pub rows: usize,
    /// Mean norm of what is left of force \[N\] and moment \[Nm\] there.
    pub force: f64,
    pub moment: f64,
    /// Whether the moment is as it is in the other rows: the force acts at the sensor's origin.
    pub at_origin: bool,
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Deviations of force and moment of the rows of a mask.
fn deviations(left: &[[f64; 6]], kept: &[bool]) -> [f64; 2] {
    let rows = || left.iter().zip(kept).filter(|(_, kept)| **kept);
    let count = rows().count().max(1) as f64;
    let of = |from: usize| {
        rows()
            .map(|(e, _)| norm(&e[from..from + 3]).powi(2))
            .sum::<f64>()
    };
    [of(0), of(3)].map(|square| (square / count).sqrt().max(f64::MIN_POSITIVE))
}

/// How far a row is from the others, in deviations of force or moment.
fn far(e: &[f64; 6], [force, moment]: [f64; 2]) -> f64 {
    (norm(&e[..3]) / force).max(norm(&e[3..]) / moment)
}

/// Rows that are left out, and the fit to all rows.
pub(super) struct TouchedRows {
    pub touches: Vec<ToolTouch>,
    pub with_all: WrenchFit,
}

/// The effects of a log without rows in which something pushes the tool: its other rows, the effects, and what was left
/// out; of poses that are `alike` all rows stay.
pub(super) fn search_without_touches(
    problem: WrenchProblem,
    alike: bool,
) -> (WrenchProblem, FoundEffects, Option<TouchedRows>) {
    let found = search(&problem);
    let touched = without_touches(&problem, &[])
        .or_else(|| without_touches(&problem, &found.fit.effects))
        .filter(|_| !alike);
    match touched {
        None => (problem, found, None),
        Some((others, touches)) => {
            let others = others.weighted();
            let touched = TouchedRows {
                touches,
                with_all: found.fit,
            };
            let found = search(&others);
            (others, found, Some(touched))
        }
    }
}

/// The problem without rows that are far from all others, and what they were; none where no few rows are.
fn without_touches(
    problem: &WrenchProblem,
    effects: &[WrenchEffect],
) -> Option<(WrenchProblem, Vec<ToolTouch>)> {
    let n = problem.rows.len();
    let size = n.div_ceil(GROUPS).max(1);
    let groups = n.div_ceil(size);
    let of_rows = |groups: &[bool]| -> Vec<bool> { (0..n).map(|k| groups[k / size]).collect() };
    let kept = kept_groups(groups, |kept| {
        let left = problem.left_by(effects, &of_rows(kept));
        let of_group = |rows: &[[f64; 6]]| {
            let channel = |part: Range<usize>| GroupError {
                square: rows.iter().map(|e| norm(&e[part.clone()]).powi(2)).sum(),
                expected: rows.len() as f64,
            };
            vec![channel(0..3), channel(3..6)]
        };
        Some(left.chunks(size).map(of_group).collect())
    })?;
    let kept = of_rows(&kept);
    let left = problem.left_by(effects, &kept);
    let now = deviations(&left, &kept);
    Some(parted(problem, &left, (&kept, size), now))
}

/// Rows beside those that were left out are looked at one by one.
fn parted(
    problem: &WrenchProblem,
    left: &[[f64; 6]],
    (kept, size): (&[bool], usize),
    now: [f64; 2],
) -> (WrenchProblem, Vec<ToolTouch>) {
    let n = kept.len();
    let touched: Vec<bool> = (0..n)
        .map(|k| !kept[k] && far(&left[k], now) > FAR)
        .collect();
    let mut touches = Vec::new();
    let mut rows = problem.rows.clone();
    let mut out = vec![false; n];
    let mut k = 0;
    while k < n {
        if !touched[k] {
            k += 1;
            continue;
        }
        let from = k;
        let mut to = k;
        while let Some(next) = (to + 1..n.min(to + size + 2)).find(|next| touched[*next]) {
            to = next;
        }
        let count = (to + 1 - from) as f64;
        let mean = |part: Range<usize>| {
            left[from..=to]
                .iter()
                .map(|e| norm(&e[part.clone()]))
                .sum::<f64>()
                / count
        };
        let moment = mean(3..6);
        touches.push(ToolTouch {
            span: [problem.rows[from].t, problem.rows[to].t],
            rows: to + 1 - from,
            force: mean(0..3),
            moment,
            at_origin: moment < NUMBERS.screen * now[1],
        });
        out[from..=to].fill(true);
        k = to + 1;
    }
    let mut number = 0;
    rows.retain(|_| {
        number += 1;
        !out[number - 1]
    });
    let problem = WrenchProblem {
        rows,
        ..problem.clone()
    };
    (problem, touches)
}
