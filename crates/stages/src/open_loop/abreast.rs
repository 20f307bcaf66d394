//! Windows of one axis side by side: all of them a step on at a time, so that a law of speed is asked once for all.
//! Effects depend on the speed of now alone.

use super::stepper::{StepFriction, held, stopped_by};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::dynamics::RobotDynamics;

/// Windows of one length that are rolled out abreast.
pub(super) struct ParallelWindows<'a> {
    model: &'a AugmentedModel,
    dynamics: RobotDynamics,
    dt: f64,
    jumps: bool,
    /// Mass of an axis without links, the same everywhere; nothing else acts on it.
    mass: Option<f64>,
    /// States, a window in the place of a sample.
    at: Stretch,
}

impl<'a> ParallelWindows<'a> {
    /// Begins at these samples of a stretch, for steps of `dt` seconds.
    pub fn begin(
        model: &'a AugmentedModel,
        stretch: &Stretch,
        begins: impl Iterator<Item = usize> + Clone,
        dt: f64,
    ) -> Self {
        let of = |x: &[Vec<f64>]| vec![begins.clone().map(|k| x[0][k]).collect::<Vec<f64>>()];
        let (q, v) = (of(&stretch.q), of(&stretch.v));
        let zeros = vec![0.0; q[0].len()];
        let robot = &model.model.robot;
        let dynamics = robot.dynamics(&model.model.theta);
        let mass = (!robot.knows_links()).then(|| {
            let (mut mass, mut bias) = ([0.0], [0.0]);
            dynamics.inertia_and_bias(&[0.0], &[0.0], &mut mass, &mut bias);
            mass[0]
        });
        Self {
            dynamics,
            mass,
            dt,
            jumps: model.model.friction[0].jumps(),
            at: Stretch {
                dt,
                a: vec![zeros.clone()],
                tau: vec![zeros.clone()],
                t: zeros,
                q,
                v,
                ..Stretch::default()
            },
            model,
        }
    }

    /// Position in each window.
    pub fn positions(&self) -> &[f64] {
        &self.at.q[0]
    }

    /// Goes one step on under the torque of each window; false where there is no mass or a motion is no longer finite.
    pub fn step(&mut self, tau: &[f64]) -> bool {
        let model = &self.model.model;
        let added = self.added();
        let Stretch { q, v, a, .. } = &mut self.at;
        let (friction, offset, dt) = (&model.friction[0], model.offset[0], self.dt);
        let (mut mass, mut bias) = ([self.mass.unwrap_or(0.0)], [0.0]);
        for (i, tau) in tau.iter().enumerate() {
            let (q, v, a) = (&mut q[0][i], &mut v[0][i], &mut a[0][i]);
            if self.mass.is_none() {
                (self.dynamics).inertia_and_bias(&[*q], &[*v], &mut mass, &mut bias);
            }
            let StepFriction {
                torque,
                slope,
                limit,
            } = held(friction, self.jumps, *v, dt);
            let added = added.as_ref().map_or(0.0, |added| added[i]);
            let force = tau - bias[0] - torque - offset - added;
            let Some(change) = stopped_by(limit, force * dt, mass[0] + dt * slope, *v) else {
                return false;
            };
            *q += dt * (*v + 0.5 * change);
            *v += change;
            *a = change / dt;
            if !(q.is_finite() && v.is_finite()) {
                return false;
            }
        }
        true
    }

    /// What effects add to the torque of each window.
    fn added(&self) -> Option<Vec<f64>> {
        if self.model.effects.is_empty() {
            return None;
        }
        let mut torques = self.model.torques(&self.at);
        let mut added = torques.hat.swap_remove(0);
        let (friction, offset) = (&self.model.model.friction[0], self.model.model.offset[0]);
        let parts = torques.load[0].iter().zip(&self.at.v[0]);
        for (added, (load, v)) in added.iter_mut().zip(parts) {
            *added -= load + friction.torque(*v) + offset;
        }
        Some(added)
    }
}
