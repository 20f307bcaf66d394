//! One step of a model's forward dynamics.

use nalgebra::{DMatrix, DVector};

use cft_ident_core::effect::{AugmentedModel, SampledModel};
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::dynamics::RobotDynamics;
use cft_ident_core::robot::model::JointFriction;

/// Sweeps over the joints in which impulses of friction settle.
const SWEEPS: usize = 50;

/// A model in motion.
pub struct ModelStepper {
    model: AugmentedModel,
    effects: SampledModel,
    dynamics: RobotDynamics,
    dt: f64,
    /// Joints whose friction jumps at rest and is held there by it.
    jumps: Vec<bool>,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    a: Vec<f64>,
    mass: Vec<f64>,
    bias: Vec<f64>,
    with: Vec<f64>,
    plain: Vec<f64>,
    force: Vec<f64>,
    /// Greatest impulse of friction that jumps.
    limit: Vec<f64>,
    change: Vec<f64>,
}

impl ModelStepper {
    /// For steps of `dt` seconds.
    pub fn new(model: &AugmentedModel, dt: f64) -> Self {
        let n = model.model.robot.joints();
        let remembers = |j: usize| {
            let mut at = model.effects.iter().filter(|e| e.place.joint() == Some(j));
            at.any(|e| e.law.memory.is_some())
        };
        let laws = model.model.friction.iter().enumerate();
        ModelStepper {
            effects: SampledModel::new(model.clone(), dt),
            dynamics: model.model.robot.dynamics(&model.model.theta),
            dt,
            // what remembers has a friction of its own at rest
            jumps: laws.map(|(j, law)| law.jumps() && !remembers(j)).collect(),
            q: vec![0.0; n],
            v: vec![0.0; n],
            a: vec![0.0; n],
            mass: vec![0.0; n * n],
            bias: vec![0.0; n],
            with: vec![0.0; n],
            plain: vec![0.0; n],
            force: vec![0.0; n],
            limit: vec![0.0; n],
            change: vec![0.0; n],
            model: model.clone(),
        }
    }

    /// Begins at positions and velocities.
    pub fn begin(&mut self, q: &[f64], v: &[f64]) {
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        self.a.fill(0.0);
        self.effects.begin();
    }

    /// Takes the temperatures of sample `k` for the steps from here on.
    pub fn set_temperatures(&mut self, stretch: &Stretch, k: usize) {
        let of = |j: usize| stretch.temperature.get(j)?.get(k).copied();
        self.effects.set_temperatures(of);
    }

    /// One step on, `since` seconds after the log began; false without an inertia or where the motion is not finite.
    pub fn step(&mut self, since: f64, tau: &[f64]) -> bool {
        let (n, dt) = (self.q.len(), self.dt);
        self.dynamics
            .inertia_and_bias(&self.q, &self.v, &mut self.mass, &mut self.bias);
        let model = &self.model.model;
        if !self.model.effects.is_empty() {
            let motion = [&self.q[..], &self.v, &self.a];
            self.effects.torque(since, motion, &mut self.with);
            model.torque(&self.q, &self.v, &self.a, &mut self.plain);
        }
        for (j, tau) in tau.iter().enumerate() {
            let of = held(&model.friction[j], self.jumps[j], self.v[j], dt);
            self.limit[j] = of.limit;
            let added = self.with[j] - self.plain[j];
            self.force[j] = tau - self.bias[j] - of.torque - model.offset[j] - added;
            self.mass[j * n + j] += dt * of.slope;
        }
        let found = match n {
            1 => {
                let push = self.force[0] * dt;
                let change = stopped_by(self.limit[0], push, self.mass[0], self.v[0]);
                self.change[0] = change.unwrap_or(0.0);
                change.is_some()
            }
            _ => self.change_of_all(),
        };
        if !found {
            return false;
        }
        for (j, change) in self.change.iter().enumerate() {
            // constant acceleration over the step
            self.q[j] += dt * (self.v[j] + 0.5 * change);
            self.v[j] += change;
            self.a[j] = change / dt;
        }
        self.q.iter().chain(&self.v).all(|x| x.is_finite())
    }

    /// Changes of all speeds; false where the inertia matrix is none.
    fn change_of_all(&mut self) -> bool {
        let n = self.v.len();
        let implicit = DMatrix::from_row_slice(n, n, &self.mass);
        let Some(factor) = implicit.cholesky() else {
            return false;
        };
        let force = DVector::from_column_slice(&self.force);
        let mut change = factor.solve(&(force * self.dt));
        let limit = &self.limit;
        if limit.iter().any(|limit| *limit > 0.0) {
            let inverse = factor.inverse();
            let mut impulse = vec![0.0; n];
            for _ in 0..SWEEPS {
                let mut moved = 0.0f64;
                for j in (0..n).filter(|j| limit[*j] > 0.0) {
                    let next = self.v[j] + change[j];
                    let wanted = impulse[j] - next / inverse[(j, j)];
                    let allowed = wanted.clamp(-limit[j], limit[j]);
                    let step = allowed - impulse[j];
                    impulse[j] = allowed;
                    moved = moved.max(step.abs() / limit[j]);
                    for i in 0..n {
                        change[i] += inverse[(i, j)] * step;
                    }
                }
                if moved < 1e-10 {
                    break;
                }
            }
        }
        self.change.copy_from_slice(change.as_slice());
        true
    }
}

/// The friction of a joint in one step.
pub(super) struct StepFriction {
    pub torque: f64,
    pub slope: f64,
    /// Greatest impulse of friction that jumps.
    pub limit: f64,
}

/// That of a law at a speed; `jumps` says that it holds the joint at rest.
#[inline]
pub(super) fn held(law: &JointFriction, jumps: bool, v: f64, dt: f64) -> StepFriction {
    let (torque, slope) = match law {
        JointFriction::None => (0.0, 0.0),
        JointFriction::DoubleTanh(law) => (law.torque(v), law.slope(v).max(0.0)),
        // what is proportional to the speed by the trapezoidal rule: its error falls with dt^2
        JointFriction::ViscousCoulomb(law) if jumps => {
            (law.viscous * v, 0.5 * law.viscous.max(0.0))
        }
        JointFriction::ViscousCoulomb(law) => (law.torque(v), 0.5 * law.viscous.max(0.0)),
    };
    let limit = match law {
        JointFriction::ViscousCoulomb(law) if jumps => law.coulomb.max(0.0) * dt,
        _ => 0.0,
    };
    StepFriction {
        torque,
        slope,
        limit,
    }
}

/// Change of the speed of a single axis that an impulse pushes: friction takes as much as stops it, up to its limit.
#[inline]
pub(super) fn stopped_by(limit: f64, push: f64, mass: f64, v: f64) -> Option<f64> {
    let free = push / mass;
    let impulse = (-(v + free) * mass).clamp(-limit, limit);
    (mass > 0.0).then_some(free + impulse / mass)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::open_loop::one_axis::model;
    use cft_ident_core::robot::friction::ViscousCoulomb;

    /// A mass of 2 kg.
    fn mass(viscous: f64, coulomb: f64) -> AugmentedModel {
        let law = ViscousCoulomb { viscous, coulomb };
        model(2.0, JointFriction::ViscousCoulomb(law))
    }

    #[test]
    fn a_mass_that_slides_stops_where_its_friction_says_and_stays() {
        // 2 kg at 1 m/s against 4 N: 0.5 s and 0.25 m; 3.9 N do not move it after
        let mut stepper = ModelStepper::new(&mass(0.0, 4.0), 1e-3);
        stepper.begin(&[0.0], &[1.0]);
        for k in 0..2000 {
            let tau = if k < 600 { 0.0 } else { 3.9 };
            assert!(stepper.step(f64::from(k) * 1e-3, &[tau]));
        }
        assert!((stepper.q[0] - 0.25).abs() < 1e-9, "{}", stepper.q[0]);
        assert!(stepper.v[0].abs() < 1e-12, "{}", stepper.v[0]);
    }

    #[test]
    fn a_driven_mass_moves_as_the_closed_solution_says() {
        // m v' = u - b v - c from rest
        let (b, c, u) = (3.0, 1.0, 7.0);
        let mut stepper = ModelStepper::new(&mass(b, c), 1e-4);
        stepper.begin(&[0.0], &[0.0]);
        for k in 0..10_000 {
            assert!(stepper.step(f64::from(k) * 1e-4, &[u]));
        }
        let end = (u - c) / b;
        let decay = (-b / 2.0f64).exp();
        let wanted = end * (1.0 - 2.0 / b * (1.0 - decay));
        assert!((stepper.v[0] - end * (1.0 - decay)).abs() < 1e-4);
        assert!((stepper.q[0] - wanted).abs() < 1e-4, "{}", stepper.q[0]);
    }
}
