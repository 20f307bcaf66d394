//! Which effect a later one made superfluous.

use nalgebra::DVector;

use crate::diagnose::candidates::columns::columns;
use crate::diagnose::candidates::score::{CandidateScore, CandidateTest};
use crate::diagnose::problem::case::SelectionLimits;
use crate::diagnose::problem::cross_products::CrossProducts;
use crate::diagnose::problem::fit::{FittedModel, fit};
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::normal_equations::{Base, PieceSums};
use crate::diagnose::problem::unknowns::{Unknown, Unknowns};
use crate::motion::MotionError;

/// How many times what an effect must remove it has to remove by the linear test, for the model without it not to be
/// fitted: the others' shapes are held near where they are in that test.
const PLAINLY: f64 = 3.0;

/// An effect without which the model is as good: it no longer passes what let it in.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn superfluous(
    at: &FittedModel,
    problem: &FitProblem,
    limits: &SelectionLimits,
) -> Result<Option<usize>, MotionError> {
    if at.model.effects.len() < 2 {
        return Ok(None);
    }
    let passes = |s: &CandidateScore, least: f64| {
        s.cv_gain >= least && s.delta_bic > 0.0 && s.p_value <= limits.false_alarm
    };
    let mut worst: Option<(usize, f64)> = None;
    for (i, effect) in at.model.effects.iter().enumerate() {
        let linear = without_by_sums(at, problem, i);
        if linear.is_some_and(|s| passes(&s, PLAINLY * limits.cv_gain)) {
            continue;
        }
        let mut model = at.model.clone();
        model.effects.remove(i);
        let without = fit(&model, problem)?;
        let test = CandidateTest::new(&without, problem);
        let torques = problem.torques(&without.model);
        let columns = columns(&without.model, problem, &torques, effect)?;
        let score = test.score(&columns, effect.linear.len(), effect.shape.len());
        let needed = score.as_ref().is_some_and(|s| passes(s, limits.cv_gain));
        let gain = score.map_or(0.0, |s| s.cv_gain);
        if !needed && worst.is_none_or(|(_, least)| gain < least) {
            worst = Some((i, gain));
        }
    }
    Ok(worst.map(|(i, _)| i))
}

/// What the data say of an effect of the model as if it were a candidate beside the others, from the sums of the fit:
/// the parameters of the others move along their columns, shapes too. None where its absence changes these columns,
/// or where a coefficient of it is no unknown.
fn without_by_sums(at: &FittedModel, problem: &FitProblem, i: usize) -> Option<CandidateScore> {
    let effect = &at.model.effects[i];
    if effect.law.direction.is_some() || effect.shift(effect.place.joint().unwrap_or(0)) != 0.0 {
        return None;
    }
    let mut model = at.model.clone();
    model.effects.remove(i);
    let all = &at.base.unknowns;
    let reduced = Unknowns::of(&model, problem.open, &problem.cover);
    let place = |wanted: Unknown| all.list.iter().position(|u| *u == wanted);
    // where each of the other unknowns stands among all of them
    let of_others = reduced.list.iter().map(|u| place(beside(*u, i)));
    let of_others = of_others.collect::<Option<Vec<usize>>>()?;
    let k = effect.linear.len();
    let own = (0..k).map(|k| place(Unknown::Linear { effect: i, k }));
    let own = own.collect::<Option<Vec<usize>>>()?;

    let (joints, u) = (at.weights.len(), reduced.len());
    // columns of the others and of the effect in each joint's rows, the same in every piece
    let of_joint = |j: usize| -> [Vec<usize>; 2] {
        let column = |global: usize| all.columns[j].iter().position(|x| *x == global);
        let others = reduced.columns[j].iter();
        [
            others.filter_map(|x| column(of_others[*x])).collect(),
            own.iter().filter_map(|x| column(*x)).collect(),
        ]
    };
    let of_joints: Vec<[Vec<usize>; 2]> = (0..joints).map(of_joint).collect();
    let mut sums = Vec::with_capacity(at.base.sums.len());
    let mut cross = Vec::with_capacity(at.base.sums.len());
    for of_piece in &at.base.sums {
        let mut crossed = CrossProducts::none(u, k);
        let each = of_piece.iter().zip(&of_joints).enumerate();
        let each = each.map(|(j, (s, [rest, own]))| {
            let mut out = PieceSums {
                normal: s.normal.select_rows(rest).select_columns(rest),
                score: s.score.select_rows(rest),
                square: s.square,
            };
            if own.len() == k {
                let beta = DVector::from_column_slice(&effect.linear);
                let with_rest = s.normal.select_rows(rest).select_columns(own);
                let of_own = s.normal.select_rows(own).select_columns(own);
                let score = s.score.select_rows(own);
                // e + C beta in place of e
                out.score += &with_rest * &beta;
                out.square += 2.0 * beta.dot(&score) + beta.dot(&(&of_own * &beta));
                let w = at.weights[j] * at.weights[j];
                for (row, x) in with_rest.row_iter().zip(&reduced.columns[j]) {
                    let mut into = crossed.with_base.row_mut(*x);
                    into += w * row;
                }
                crossed.score += w * (score + &of_own * &beta);
                crossed.own += w * of_own;
            }
            out
        });
        sums.push(each.collect());
        cross.push(crossed);
    }
    let without = FittedModel::of_sums(
        model,
        Base {
            unknowns: reduced,
            stretches: Vec::new(),
            sums,
        },
        at.weights.clone(),
        problem,
    );
    let test = CandidateTest::new(&without, problem);
    // the test asks of the columns themselves only where there are any
    let touched = |j| match effect.place.touches(j) {
        true => vec![Vec::new(); k],
        false => Vec::new(),
    };
    let stretches = problem.stretches.iter();
    let columns = stretches.map(|_| (0..joints).map(touched).collect());
    let columns: Vec<_> = columns.collect();
    test.score_of(&columns, &cross, (k, effect.shape.len()))
}

/// An unknown of the model without effect i as it is called in the model with it.
fn beside(unknown: Unknown, i: usize) -> Unknown {
    let moved = |effect: usize| effect + usize::from(effect >= i);
    match unknown {
        Unknown::Linear { effect, k } => Unknown::Linear {
            effect: moved(effect),
            k,
        },
        Unknown::Shape { effect, k } => Unknown::Shape {
            effect: moved(effect),
            k,
        },
        other => other,
    }
}
