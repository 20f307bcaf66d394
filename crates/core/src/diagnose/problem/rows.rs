//! Filtered, decimated rows of every joint.

use std::sync::Arc;

use super::rests::{standing, weigh};
use super::unknowns::{Unknown, Unknowns};
use crate::effect::{AugmentedModel, Scene, Torques, shifted};
use crate::motion::{MotionError, Parallel, Stretch};
use crate::robot::Robot;
use crate::robot::model::JointFriction;

/// A column of filtered rows; those of the inertial parameters are shared by the models of a diagnosis.
pub type Column = Arc<Vec<f64>>;

/// Derivative columns and residual of one stretch, `[joint][column][row]`.
pub struct Filtered {
    pub columns: Vec<Vec<Column>>,
    pub residual: Vec<Vec<f64>>,
}

/// Filtered regressor of the inertial parameters along one stretch, `[joint][parameter][row]`; nothing of
/// joints whose rows are ignored. It is the same for every model that is tried on the motion, but for one that is
/// late.
pub type Inertial = Vec<Vec<Column>>;

/// The filtered regressor of a robot along one stretch.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn inertial(
    robot: &Robot,
    stretch: &Stretch,
    parallel: &Parallel,
    ignored: &dyn Fn(usize) -> bool,
) -> Result<Inertial, MotionError> {
    let n = robot.joints();
    let mut out = vec![Vec::new(); n];
    if (0..n).all(ignored) {
        return Ok(out);
    }
    let raw = regressor(robot, stretch);
    for (j, out) in out.iter_mut().enumerate().filter(|(j, _)| !ignored(*j)) {
        let channels: Vec<&[f64]> = raw[j].iter().map(Vec::as_slice).collect();
        *out = parallel.run(&channels)?.into_iter().map(Arc::new).collect();
    }
    Ok(out)
}

/// Regressor of the inertial parameters along a stretch, `[joint][parameter][sample]`.
fn regressor(robot: &Robot, stretch: &Stretch) -> Vec<Vec<Vec<f64>>> {
    let (n, p) = (robot.joints(), robot.parameters().len());
    let samples = stretch.len();
    let mut out = vec![vec![vec![0.0; samples]; p]; n];
    let mut y = vec![0.0; n * p];
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for k in 0..samples {
        stretch.at(k, &mut q, &mut v, &mut a);
        robot.regressor(&q, &v, &a, &mut y);
        for (j, columns) in out.iter_mut().enumerate() {
            for (c, column) in columns.iter_mut().enumerate() {
                column[k] = y[j * p + c];
            }
        }
    }
    out
}

/// Columns of all unknowns and the residual along one stretch; zeros for joints whose rows are ignored. Rows in which
/// a joint stands have its `rest_weight`, and say nothing of its friction.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn filtered(
    model: &AugmentedModel,
    unknowns: &Unknowns,
    (stretch, inertial): (&Stretch, &Inertial),
    (parallel, rest_weight): (&Parallel, &[f64]),
    ignored: &dyn Fn(usize) -> bool,
) -> Result<Filtered, MotionError> {
    let n = model.model.robot.joints();
    let rows = parallel.rows(stretch.len());
    let nothing: Column = Arc::new(vec![0.0; rows]);
    let zeros = |(j, own): (usize, &Vec<usize>)| match ignored(j) {
        true => own.iter().map(|_| Arc::clone(&nothing)).collect(),
        false => Vec::new(),
    };
    let mut out = Filtered {
        columns: unknowns.columns.iter().enumerate().map(zeros).collect(),
        residual: vec![vec![0.0; rows]; n],
    };
    if (0..n).all(ignored) {
        return Ok(out);
    }
    let torques = model.torques(stretch);
    let scene = scene(model, stretch, &torques);
    let late = |j: usize| model.shift(j) / stretch.dt;
    let mut of_late = match (0..n).any(|j| !ignored(j) && late(j) != 0.0) {
        true => regressor(&model.model.robot, stretch),
        false => vec![Vec::new(); n],
    };
    for j in (0..n).filter(|j| !ignored(*j)) {
        let late = late(j);
        let mut raw = raw_columns(model, unknowns, &scene, j, late, &mut of_late[j]);
        let mut residual = torques.hat[j].clone();
        shifted(&mut residual, late);
        for (hat, tau) in residual.iter_mut().zip(&stretch.tau[j]) {
            *hat = tau - *hat;
        }
        raw.push(residual);
        let channels: Vec<&[f64]> = raw.iter().map(Vec::as_slice).collect();
        let mut rows = parallel.run(&channels)?.into_iter();
        let known = |i: usize| match unknowns.list[i] {
            Unknown::Theta(c) if late == 0.0 => Some(Arc::clone(&inertial[j][c])),
            _ => None,
        };
        let of = unknowns.columns[j].iter();
        let mut columns: Vec<Column> = of
            .filter_map(|&i| known(i).or_else(|| rows.next().map(Arc::new)))
            .collect();
        let mut residual = rows.next().unwrap_or_default();
        let still = standing(model, stretch, parallel, j);
        if !still.is_empty() {
            let at_rest = own_at_rest(model, unknowns, j);
            for (column, at_rest) in columns.iter_mut().zip(at_rest) {
                let weight = if at_rest { rest_weight[j] } else { 0.0 };
                weigh(Arc::make_mut(column).as_mut_slice(), &still, weight);
            }
            weigh(&mut residual, &still, rest_weight[j]);
        }
        out.residual[j] = residual;
        out.columns[j] = columns;
    }
    Ok(out)
}

/// Whether each unknown of a joint has a part in its torque at rest.
fn own_at_rest<'a>(
    model: &'a AugmentedModel,
    unknowns: &'a Unknowns,
    j: usize,
) -> impl Iterator<Item = bool> + 'a {
    unknowns.columns[j].iter().map(|i| match unknowns.list[*i] {
        Unknown::Theta(_) | Unknown::Offset(_) => true,
        Unknown::Friction { .. } => false,
        Unknown::Linear { effect, .. } | Unknown::Shape { effect, .. } => {
            model.effects[effect].at_rest()
        }
    })
}

/// Columns of a joint's unknowns before the filter, `late` samples late; without those of the inertial parameters
/// where the joint is not late, which are known filtered. Otherwise they are taken out of `regressor`.
fn raw_columns(
    model: &AugmentedModel,
    unknowns: &Unknowns,
    scene: &Scene,
    j: usize,
    late: f64,
    regressor: &mut [Vec<f64>],
) -> Vec<Vec<f64>> {
    let own = &unknowns.columns[j];
    let mut raw: Vec<Vec<f64>> = Vec::with_capacity(own.len() + 1);
    let mut effect_columns: Vec<Option<Vec<Vec<f64>>>> = vec![None; model.effects.len()];
    let mut friction = friction_columns(&model.model.friction[j], &scene.stretch.v[j]);
    for &i in own {
        let mut column = match unknowns.list[i] {
            Unknown::Theta(_) if late == 0.0 => continue,
            Unknown::Theta(c) => std::mem::take(&mut regressor[c]),
            Unknown::Friction { k, .. } => std::mem::take(&mut friction[k]),
            Unknown::Offset(_) => vec![1.0; scene.stretch.len()],
            Unknown::Linear { effect, k } => {
                let columns = effect_columns[effect]
                    .get_or_insert_with(|| model.effects[effect].columns(scene, j));
                std::mem::take(&mut columns[k])
            }
            Unknown::Shape { effect, k } => shape_derivative(model, scene, effect, k, j),
        };
        shifted(&mut column, late);
        raw.push(column);
    }
    raw
}

/// Gradient of a friction law along a motion, `[parameter][sample]`.
pub(crate) fn friction_columns(law: &JointFriction, v: &[f64]) -> Vec<Vec<f64>> {
    let mut columns = vec![vec![0.0; v.len()]; law.parameters()];
    let mut gradient = [0.0; 5];
    for (i, v) in v.iter().enumerate() {
        law.gradient(*v, &mut gradient);
        for (column, g) in columns.iter_mut().zip(&gradient) {
            column[i] = *g;
        }
    }
    columns
}

/// The scene of a model along a stretch.
pub fn scene<'a>(
    model: &'a AugmentedModel,
    stretch: &'a Stretch,
    torques: &'a Torques,
) -> Scene<'a> {
    Scene {
        robot: &model.model.robot,
        theta: &model.model.theta,
        laws: &model.model.friction,
        stretch,
        hat: &torques.hat,
        load: &torques.load,
        direction: &torques.direction,
        tilt: Some(&torques.tilt),
    }
}

/// d(torque of an effect)/d(shape k), by central differences.
fn shape_derivative(
    model: &AugmentedModel,
    scene: &Scene,
    effect: usize,
    k: usize,
    j: usize,
) -> Vec<f64> {
    let added = &model.effects[effect];
    let step = 1e-4 * added.shape[k].abs().max(1e-6);
    let torque = |by: f64| {
        let mut moved = added.clone();
        moved.shape[k] += by;
        let mut out = vec![0.0; scene.len()];
        moved.torque(scene, j, &mut out);
        out
    };
    let (up, down) = (torque(step), torque(-step));
    up.iter()
        .zip(&down)
        .map(|(u, d)| (u - d) / (2.0 * step))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::Cover;
    use crate::motion::FilterSettings;
    use crate::robot::cft::{Setup, Structure};
    use crate::robot::model::Model;
    use std::collections::BTreeMap;

    /// What is kept from fit to fit is what a fit of a model that is late by nothing to speak of finds anew.
    #[test]
    fn kept_regressors_are_those_of_the_model_itself() {
        let robot = Robot::cft(Setup::Tuedacs, Structure::Printed12);
        let samples = 3000;
        let wave = |j: usize, order: i32| -> Vec<f64> {
            let w = 2.0 + 0.7 * j as f64;
            let at = |k: usize| {
                let phase = w * k as f64 * 1e-3 + 0.3 * j as f64;
                w.powi(order) * (phase + f64::from(order) * std::f64::consts::FRAC_PI_2).sin()
            };
            (0..samples).map(at).collect()
        };
        let stretch = Stretch {
            dt: 1e-3,
            t: (0..samples).map(|k| k as f64 * 1e-3).collect(),
            q: (0..4).map(|j| wave(j, 0)).collect(),
            v: (0..4).map(|j| wave(j, 1)).collect(),
            a: (0..4).map(|j| wave(j, 2)).collect(),
            tau: (0..4).map(|j| wave(3 - j, 0)).collect(),
            ..Stretch::default()
        };
        let parallel = Parallel::design(&FilterSettings::default(), stretch.dt).unwrap();
        let ignored = |j: usize| j == 1;
        let kept = inertial(&robot, &stretch, &parallel, &ignored).unwrap();
        let plain = AugmentedModel::plain(Model {
            theta: (0..12).map(|i| 1.0 + f64::from(i)).collect(),
            friction: vec![JointFriction::None; 4],
            offset: vec![0.0; 4],
            robot,
        });
        let late_by = |d: f64| {
            let values = BTreeMap::from([("d".to_owned(), d)]);
            let delay = crate::effect::read(&plain.model.robot, "delay", Some("q4"), &values);
            AugmentedModel {
                effects: vec![delay.unwrap()],
                ..plain.clone()
            }
        };
        let cover = Cover::of(&plain.model.robot, std::slice::from_ref(&stretch), 10.0);
        let open = crate::diagnose::problem::unknowns::FreeParameters {
            offset: vec![true; 4],
            friction: vec![Vec::new(); 4],
        };
        let rows = |model: &AugmentedModel| {
            let unknowns = Unknowns::of(model, &open, &cover);
            filtered(
                model,
                &unknowns,
                (&stretch, &kept),
                (&parallel, &[0.0; 4]),
                &ignored,
            )
            .unwrap()
        };
        // q4 is reckoned anew where it is late; q1 and q5 are kept in both, q2 is ignored
        let (now, late) = (rows(&late_by(0.0)), rows(&late_by(1e-15)));
        for j in 0..4 {
            assert_eq!(now.columns[j].len(), late.columns[j].len());
            let largest = |x: &[f64]| x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let rows = |of: &Filtered| -> Vec<Vec<f64>> {
                let columns = of.columns[j].iter().map(|c| c.to_vec());
                columns.chain([of.residual[j].clone()]).collect()
            };
            let (own, all) = (rows(&now), rows(&late));
            for (c, (a, b)) in own.iter().zip(&all).enumerate() {
                let off: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
                assert!(largest(&off) <= 1e-9 * (1.0 + largest(b)), "{j} {c}");
            }
        }
        assert!(
            now.columns[1]
                .iter()
                .flat_map(|c| c.iter())
                .all(|x| *x == 0.0)
        );
        assert!(
            now.columns[2]
                .iter()
                .flat_map(|c| c.iter())
                .any(|x| *x != 0.0)
        );
    }
}
