//! `elasticity`: a spring between the motor, where the encoder sits, and the link.
//!
//! The link's side has `inertia`, the motor's side what is left of the joint's, all its friction and every
//! torque that is no load, so that a stiff spring gives the rigid joint back. Unless it is declared, the motor has a
//! fifth of the joint's inertia ([`ROTOR`]; less where the least inertia of any pose asks for it, so that what is
//! left to the link stays positive). With the deflection z = q_motor - q_link the spring passes on
//! T = stiffness z + d dz/dt, d = 2 damping sqrt(stiffness inertia), and B (a + d2z/dt2) = tau - F - E - T on the
//! motor's side. Both sides are integrated.

use super::{BuiltLaw, Effect, EffectSite, InitialCondition, JointTwist, PlantLaw, PlantState};
use crate::simulate::SimulateError;
use cft_ident_core::effect::elasticity::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| {
        vec![
            (std::f64::consts::TAU * FREQUENCY).powi(2) * site.inertia,
            site.inertia - rotor(site),
            DAMPING,
        ]
    },
    build: |site, _, values| {
        let (stiffness, inertia, damping) = (values[0], values[1], values[2]);
        let sides = TwoSides::of(site, stiffness, inertia, damping);
        if !sides.can_be(site, inertia) {
            let rule = "must be below the joint's, and leave the motor less than the joint's least";
            return Err(SimulateError::number(ENTRY.name, "inertia", inertia, rule));
        }
        BuiltLaw::plant(sides)
    },
};

/// Default frequency of the joint's whole inertia on its spring \[Hz\].
const FREQUENCY: f64 = 20.0;
/// Share of the joint's inertia that is on the motor's side.
const ROTOR: f64 = 0.2;
/// The most that it may be of the joint's least inertia.
const ROTOR_AT_MOST: f64 = 0.3;
/// Damping ratio of the link on its spring.
const DAMPING: f64 = 0.025;

/// Default inertia on the motor's side, kg or kg m^2.
pub(super) fn rotor(site: &EffectSite) -> f64 {
    (ROTOR * site.inertia).min(ROTOR_AT_MOST * site.least_inertia)
}

/// Motor and link with a spring between them, which pushes beyond a gap where there is one.
pub(super) struct TwoSides {
    joint: usize,
    stiffness: f64,
    damping: f64,
    rotor: f64,
    pub(super) gap: f64,
}

impl TwoSides {
    /// Without a gap; `damping` is the ratio of the link on its spring.
    pub(super) fn of(site: &EffectSite, stiffness: f64, inertia: f64, damping: f64) -> Self {
        Self {
            joint: site.joint(),
            stiffness,
            damping: 2.0 * damping * (stiffness * inertia).sqrt(),
            rotor: site.inertia - inertia,
            gap: 0.0,
        }
    }

    /// Whether both sides have an inertia in every pose.
    pub(super) fn can_be(&self, site: &EffectSite, inertia: f64) -> bool {
        self.rotor > 0.0 && inertia > 0.0 && self.rotor < site.least_inertia
    }

    /// What the spring passes on.
    fn passed(&self, deflection: f64, rate: f64) -> f64 {
        let half = 0.5 * self.gap;
        let within = deflection.clamp(-half, half);
        let pull = self.stiffness * (deflection - within) + self.damping * rate;
        match self.gap > 0.0 {
            // an end of a gap pushes and does not pull
            true if deflection > half => pull.max(0.0),
            true if deflection < -half => pull.min(0.0),
            true => 0.0,
            false => pull,
        }
    }
}

impl Effect for TwoSides {
    fn states(&self) -> usize {
        2
    }

    fn inertia(&self, motion: &PlantState, mass: &mut [f64], _torque: &mut [f64]) {
        mass[self.joint * (motion.q.len() + 1)] -= self.rotor;
    }

    fn twist(&self, z: &[f64]) -> Option<JointTwist> {
        let &[deflection, rate] = z else {
            return None;
        };
        Some(JointTwist {
            joint: self.joint,
            deflection,
            rate,
            torque: self.passed(deflection, rate),
        })
    }

    fn rates(&self, motion: &PlantState, dz: &mut [f64]) {
        let (&[deflection, rate], [speed, acceleration]) = (motion.z, dz) else {
            return;
        };
        let passed = self.passed(deflection, rate);
        *speed = rate;
        *acceleration = (motion.net[self.joint] - passed) / self.rotor - motion.a[self.joint];
    }

    fn begin(&mut self, beginning: &InitialCondition, z: &mut [f64]) {
        if let ([deflection, _], Some(load)) = (z, beginning.load.get(self.joint)) {
            let side = if *load < 0.0 { -0.5 } else { 0.5 };
            *deflection = load / self.stiffness + side * self.gap;
        }
    }
}
