//! The joint fit of everything: Gauss-Newton on the filtered rows, linear parameters exactly in one
//! step, with the friction stage's covariance as a prior.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::plan::{Plan, Role};
use super::rows::{Base, Inertial, inertial};
use super::unknowns::{Open, Unknown, Unknowns, step};
use crate::effect::{AugmentedModel, Cover, Torques};
use crate::motion::{MotionError, Parallel, Stretch};
use crate::robot::Robot;

/// Everything that a fit works on.
pub struct Ground<'a> {
    pub stretches: &'a [Stretch],
    /// What the inertial parameters do along each of them.
    pub inertial: Vec<Inertial>,
    pub parallel: &'a Parallel,
    pub plan: Plan,
    pub open: &'a Open,
    pub prior: &'a Prior,
    pub cover: Cover,
}

/// The filtered regressors of all stretches.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn inertial_of(
    robot: &Robot,
    stretches: &[Stretch],
    parallel: &Parallel,
    plan: &Plan,
) -> Result<Vec<Inertial>, MotionError> {
    let all = stretches.par_iter().enumerate();
    all.map(|(i, stretch)| inertial(robot, stretch, parallel, &|j| plan.holds(i, j)))
        .collect()
}

impl Ground<'_> {
    /// Torques of a model along every stretch; none along those that decide nothing.
    pub fn torques(&self, model: &AugmentedModel) -> Vec<Torques> {
        let stretches = self.stretches.par_iter().enumerate();
        let of = |(i, stretch): (usize, &Stretch)| {
            if self.plan.idle(i) {
                Torques::default()
            } else {
                model.torques(stretch)
            }
        };
        stretches.map(of).collect()
    }
}

/// What is known of parameters before: their values and how firmly, in units of independent rows.
#[derive(Debug, Clone)]
pub struct Prior {
    /// The model about which it is centred.
    pub centre: AugmentedModel,
    /// Information (inverse covariance) in the order of [`crate::robot::model::Model::gradient`],
    /// row-major.
    pub information: DMatrix<f64>,
    /// Rows that count as one independent row.
    pub rows_per_independent: f64,
}

impl Prior {
    /// Index of an unknown in the model's own order; none for effects.
    fn place(&self, unknown: Unknown) -> Option<usize> {
        let model = &self.centre.model;
        let theta = model.theta.len();
        match unknown {
            Unknown::Theta(i) => Some(i),
            Unknown::Friction { joint, k } => {
                let before: usize = model.friction[..joint].iter().map(|f| f.parameters()).sum();
                Some(theta + before + k)
            }
            Unknown::Offset(j) => {
                let all: usize = model.friction.iter().map(|f| f.parameters()).sum();
                Some(theta + all + j)
            }
            Unknown::Linear { .. } | Unknown::Shape { .. } => None,
        }
    }

    /// How far a model is from the centre; effects have none.
    fn off(&self, unknowns: &Unknowns, model: &AugmentedModel) -> DVector<f64> {
        let off = unknowns.list.iter().map(|x| match self.place(*x) {
            Some(_) => value(&self.centre, *x) - value(model, *x),
            None => 0.0,
        });
        DVector::from_iterator(unknowns.len(), off)
    }

    /// Information and its pull on the present model, over the unknowns.
    fn over(&self, unknowns: &Unknowns, model: &AugmentedModel) -> (DMatrix<f64>, DVector<f64>) {
        let u = unknowns.len();
        let places: Vec<Option<usize>> = unknowns.list.iter().map(|x| self.place(*x)).collect();
        let mut information = DMatrix::zeros(u, u);
        for (a, pa) in places.iter().enumerate() {
            for (b, pb) in places.iter().enumerate() {
                if let (Some(pa), Some(pb)) = (pa, pb) {
                    information[(a, b)] = self.rows_per_independent * self.information[(*pa, *pb)];
                }
            }
        }
        let pull = &information * self.off(unknowns, model);
        (information, pull)
    }
}

/// Value of an unknown in a model; 0 for an effect that it does not have.
pub fn value(model: &AugmentedModel, unknown: Unknown) -> f64 {
    match unknown {
        Unknown::Theta(i) => model.model.theta[i],
        Unknown::Offset(j) => model.model.offset[j],
        Unknown::Friction { joint, k } => {
            use crate::robot::model::JointFriction as F;
            match &model.model.friction[joint] {
                F::None => 0.0,
                F::DoubleTanh(law) => law.parameters()[k],
                F::ViscousCoulomb(law) => [law.viscous, law.coulomb][k],
            }
        }
        Unknown::Linear { effect, k } => model.effects.get(effect).map_or(0.0, |e| e.linear[k]),
        Unknown::Shape { effect, k } => model.effects.get(effect).map_or(0.0, |e| e.shape[k]),
    }
}

/// A fitted model with the linear system at its solution.
pub struct Fitted {
    pub model: AugmentedModel,
    pub base: Base,
    /// 1 / residual rms of each joint.
    pub weights: Vec<f64>,
    /// Weighted normal matrix of the fitted rows, prior included.
    pub normal: DMatrix<f64>,
    /// Prior information over the unknowns.
    pub information: DMatrix<f64>,
    /// Pull of the prior at the solution.
    pub pull: DVector<f64>,
    /// Weighted squared residual of the fitted rows.
    pub square: f64,
}

/// Most Gauss-Newton steps; nearly linear problems take two or three.
const STEPS: usize = 12;
/// Steps in which the shapes of effects are held.
const SHAPES_HELD: usize = 2;
/// Most halvings of one step.
const HALVINGS: usize = 6;

/// Fits all unknowns of a model from where it stands.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn fit(start: &AugmentedModel, ground: &Ground) -> Result<Fitted, MotionError> {
    descend(evaluate(start.clone(), ground, None)?, ground, None)
}

/// Fits a fitted model on other ground in the weights that it has; what these data did not determine stays.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn refit(at: &Fitted, ground: &Ground) -> Result<Fitted, MotionError> {
    let begun = at.with(at.model.clone(), ground)?;
    descend(begun, ground, Some(&Inverse::of(&at.normal)))
}

/// Gauss-Newton steps to the least square; `known` says what stays where it is, and that the weights do.
fn descend(
    mut at: Fitted,
    ground: &Ground,
    known: Option<&Inverse>,
) -> Result<Fitted, MotionError> {
    for k in 0..STEPS {
        // an effect that has just come meets parameters fitted without it: its coefficients first
        let early = |u: Unknown| k < SHAPES_HELD && matches!(u, Unknown::Shape { .. });
        let list = &at.base.unknowns.list;
        let rests = |i: usize| known.is_some_and(|inverse| inverse.at_rest(i));
        let (delta, gain) = newton(&at, &|i| early(list[i]) || rests(i));
        let mut factor = 1.0;
        let mut next = None;
        for _ in 0..HALVINGS {
            let mut model = at.model.clone();
            let scaled: Vec<f64> = delta.iter().map(|d| factor * d).collect();
            step(&mut model, &at.base.unknowns, &scaled, &ground.cover);
            let tried = evaluate(model, ground, Some(&at.weights))?;
            if objective(&tried, ground) <= objective(&at, ground) * (1.0 + 1e-12) {
                next = Some(tried);
                break;
            }
            factor *= 0.5;
        }
        let Some(next) = next else { break };
        let done = gain <= 1e-9 * at.square.max(f64::MIN_POSITIVE);
        at = next;
        // weights follow the residual in the first steps, then stay so that the steps converge
        if k < 2 {
            if known.is_none() {
                at = reweighted(at, ground);
            }
        } else if done {
            break;
        }
    }
    Ok(at)
}

/// Weighted squares and the prior's share.
fn objective(at: &Fitted, ground: &Ground) -> f64 {
    let off = ground.prior.off(&at.base.unknowns, &at.model);
    at.square + (off.transpose() * &at.information * &off)[(0, 0)]
}

/// The rows and sums of a model as it stands.
fn evaluate(
    model: AugmentedModel,
    ground: &Ground,
    weights: Option<&[f64]>,
) -> Result<Fitted, MotionError> {
    let unknowns = Unknowns::of(&model, ground.open, &ground.cover);
    let base = Base::of(
        &model,
        unknowns,
        (ground.stretches, &ground.inertial),
        ground.parallel,
        &ground.plan,
    )?;
    let weights = match weights {
        Some(w) => w.to_vec(),
        None => weights_of(&base, ground),
    };
    Ok(summed(model, base, weights, ground))
}

fn reweighted(at: Fitted, ground: &Ground) -> Fitted {
    let weights = weights_of(&at.base, ground);
    summed(at.model, at.base, weights, ground)
}

fn weights_of(base: &Base, ground: &Ground) -> Vec<f64> {
    base.residual_rms(&ground.plan)
        .iter()
        .map(|s| if *s > 0.0 { 1.0 / s } else { 0.0 })
        .collect()
}

fn summed(model: AugmentedModel, base: Base, weights: Vec<f64>, ground: &Ground) -> Fitted {
    let total = base.total(&ground.plan, &weights, &Role::fitted);
    let (information, pull) = ground.prior.over(&base.unknowns, &model);
    Fitted {
        normal: total.normal + &information,
        pull,
        information,
        square: total.square,
        weights,
        model,
        base,
    }
    .with_score(total.score)
}

/// The least that the objective comes to from here by a linear step, with one unknown held.
pub fn least_with_held(at: &Fitted, ground: &Ground, held: Option<usize>) -> f64 {
    let (mut normal, mut pull) = (at.normal.clone(), at.pull.clone());
    if let Some(i) = held {
        hold(&mut normal, &mut pull, i);
    }
    objective(at, ground) - Inverse::of(&normal).solve(&pull).dot(&pull)
}

impl Fitted {
    /// Another model in the weights of this one.
    ///
    /// # Errors
    /// [`MotionError`] of the filter.
    pub fn with(&self, model: AugmentedModel, ground: &Ground) -> Result<Fitted, MotionError> {
        evaluate(model, ground, Some(&self.weights))
    }

    /// The pull of prior and data together.
    fn with_score(mut self, score: DVector<f64>) -> Self {
        self.pull += score;
        self
    }
}

/// Takes an unknown out of a linear step: it stays where it is.
fn hold(normal: &mut DMatrix<f64>, pull: &mut DVector<f64>, i: usize) {
    normal.row_mut(i).fill(0.0);
    normal.column_mut(i).fill(0.0);
    pull[i] = 0.0;
}

/// The step to the minimum of the linearised problem, and the squares that it promises to remove.
fn newton(at: &Fitted, held: &dyn Fn(usize) -> bool) -> (Vec<f64>, f64) {
    let (mut normal, mut pull) = (at.normal.clone(), at.pull.clone());
    for i in (0..pull.len()).filter(|i| held(*i)) {
        hold(&mut normal, &mut pull, i);
    }
    let delta = Inverse::of(&normal).solve(&pull);
    let gain = delta.dot(&pull);
    (delta.iter().copied().collect(), gain)
}

/// Inverse of a positive semidefinite matrix over the unknowns that it determines. Taken one after the other,
/// what those before it stand in for is left at rest: its row and column are zero. What is declared comes
/// first, so that an effect gives way, and not the declared model.
#[derive(Debug, Clone)]
pub struct Inverse {
    matrix: DMatrix<f64>,
    at_rest: Vec<bool>,
}

/// Least part of an unknown's squared column that those before it do not stand in for.
const LEAST_OWN: f64 = 1e-9;

impl Inverse {
    /// Inverts.
    pub fn of(normal: &DMatrix<f64>) -> Self {
        let u = normal.nrows();
        let scale: Vec<f64> = (0..u).map(|i| normal[(i, i)].max(0.0).sqrt()).collect();
        // Cholesky factor of the scaled matrix, row by row, without the rows at rest
        let mut factor: DMatrix<f64> = DMatrix::zeros(u, u);
        let mut kept: Vec<usize> = Vec::with_capacity(u);
        for i in (0..u).filter(|i| scale[*i] > 0.0 && scale[*i].is_finite()) {
            let mut own = 1.0;
            for (k, &l) in kept.iter().enumerate() {
                let before: f64 = (0..k).map(|m| factor[(i, m)] * factor[(l, m)]).sum();
                let x = (normal[(i, l)] / (scale[i] * scale[l]) - before) / factor[(l, k)];
                factor[(i, k)] = x;
                own -= x * x;
            }
            if own > LEAST_OWN {
                factor[(i, kept.len())] = own.sqrt();
                kept.push(i);
            }
        }
        let n = kept.len();
        let lower = DMatrix::from_fn(n, n, |a, b| if b <= a { factor[(kept[a], b)] } else { 0.0 });
        let mut matrix = DMatrix::zeros(u, u);
        let mut at_rest = vec![true; u];
        if let Some(half) = lower.solve_lower_triangular(&DMatrix::identity(n, n)) {
            let inverse = half.tr_mul(&half);
            for (a, &i) in kept.iter().enumerate() {
                at_rest[i] = false;
                for (b, &l) in kept.iter().enumerate() {
                    matrix[(i, l)] = inverse[(a, b)] / (scale[i] * scale[l]);
                }
            }
        }
        Inverse { matrix, at_rest }
    }

    /// Whether the matrix says nothing of unknown `i` that those before it do not stand in for.
    pub fn at_rest(&self, i: usize) -> bool {
        self.at_rest[i]
    }

    /// Inverse times a vector.
    pub fn solve(&self, b: &DVector<f64>) -> DVector<f64> {
        &self.matrix * b
    }

    /// Inverse times a matrix.
    pub fn times(&self, b: &DMatrix<f64>) -> DMatrix<f64> {
        &self.matrix * b
    }

    /// The inverse itself.
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_that_earlier_ones_stand_in_for_rests_and_the_others_are_inverted() {
        // the third column is the first plus twice the second, the fourth is empty
        let x = DMatrix::from_row_slice(
            4,
            5,
            &[
                1.0, 0.2, 1.4, 0.0, 3.0, //
                -1.0, 0.5, 0.0, 0.0, 1.0, //
                2.0, 1.0, 4.0, 0.0, -1.0, //
                0.3, -2.0, -3.7, 0.0, 0.5,
            ],
        );
        let normal = x.tr_mul(&x);
        let inverse = Inverse::of(&normal);
        assert_eq!(
            (0..5).map(|i| inverse.at_rest(i)).collect::<Vec<_>>(),
            [false, false, true, true, false]
        );
        let kept = [0, 1, 4];
        let small = DMatrix::from_fn(3, 3, |a, b| normal[(kept[a], kept[b])]);
        let wanted = small.try_inverse().unwrap();
        for (a, i) in kept.into_iter().enumerate() {
            for (b, l) in kept.into_iter().enumerate() {
                let off = (inverse.matrix()[(i, l)] - wanted[(a, b)]).abs();
                assert!(off < 1e-12 * wanted[(a, a)].abs().max(1.0), "{i} {l}");
            }
        }
        assert!(inverse.matrix().column(2).iter().all(|x| *x == 0.0));
    }
}
