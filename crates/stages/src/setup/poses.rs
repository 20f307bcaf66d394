//! A set-up by which the logged positions belong to no pose of the robot: which change makes poses of them.

use rayon::prelude::*;

use super::confirm;
use super::correction::{Change, Correction};
use super::decide::{Found, Judged, ODDS, THIRD, choose, on_all_rows, tied};
use super::fitted::Fitted;
use super::hypotheses;
use super::normal::Problem;
use super::trial::Trial;

/// Changes that are fitted to all rows.
const SHORT_LIST: usize = 10;

/// The change of the positions by which most rows are poses and the torques fit best; none where no change makes them
/// fit, or none does it much better than no model. `few` and `all` are rows of the sample.
pub(super) fn impossible(
    problem: &Problem,
    base: &Correction,
    moving: &[usize],
    [few, all]: [&[usize]; 2],
) -> Option<Found> {
    let mut changes = hypotheses::of_positions(problem, moving);
    let trial = |change: &Change| Trial::new(problem, base.with(change), few, 1, None);
    let score = |change: &Change| trial(change).map(|trial| trial.fit.score);
    let mut scores: Vec<Option<f64>> = changes.par_iter().map(score).collect();
    let best = (scores.iter().enumerate())
        .filter_map(|(i, s)| Some((i, (*s)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    // a factor beside a round one, from the best of them
    let declared = trial(&changes[best.0])?;
    let near = Fitted {
        problem,
        base,
        rows: few,
        blocks: 1,
        declared: &declared,
    };
    let fixed = changes.len();
    for (change, score) in near.beside(&changes, &scores) {
        changes.push(change);
        scores.push(Some(score));
    }
    let mut order: Vec<usize> = (0..changes.len())
        .filter(|i| scores[*i].is_some())
        .collect();
    order.sort_by(|a, b| {
        let of = |i: &usize| scores[*i].unwrap_or(0.0);
        of(b).total_cmp(&of(a))
    });
    order.truncate(SHORT_LIST);
    order.sort_unstable();
    let whole = |i: &usize| on_all_rows(problem, (base, &changes[*i]), *i >= fixed, all, None);
    let mut list: Vec<Judged> = order.par_iter().filter_map(whole).collect();
    let likeliest = list
        .iter()
        .max_by(|a, b| a.trial.fit.score.total_cmp(&b.trial.fit.score))?;
    let t = &likeliest.trial;
    let independent = confirm::independent(problem, &t.robot, &t.by, &t.fit);
    let share = independent.iter().sum::<f64>() / independent.len().max(1) as f64;
    list.iter_mut().for_each(|judged| judged.weigh(share));
    let most = list
        .iter()
        .map(|j| j.worth)
        .fold(f64::NEG_INFINITY, f64::max);
    let chosen = choose(&list, 0.0)?;
    let chosen = &list[chosen];
    let tried = changes.len();
    let needed = ODDS + (tried.max(1) as f64).ln();
    let error = chosen.trial.fit.error();
    if most < needed || error > THIRD {
        return None;
    }
    Some(Found {
        change: chosen.change.clone()?,
        std: chosen.std,
        // no row had a pose
        error: [f64::NAN, error],
        gain: chosen.worth,
        needed,
        tried,
        violated: Default::default(),
        tied: tied(&list, chosen),
        sure: true,
    })
}
