//! `coupling`: a torque that follows another joint j, viscous v_j + coulomb_from sgn(v_j) + inertia a_j, turned
//! about where r is negative, and coulomb sgn(v_i + r v_j).
//!
//! `from` is the number of joint j, counted from one. The torque acts on joint i alone: M is then no longer
//! symmetric, and the plant solves it by elimination.

use super::{BuiltLaw, Effect, PlantLaw, PlantState, sign};
use crate::simulate::SimulateError;
use cft_ident_core::effect::coupling::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    // the neighbour towards the base, and of the first joint the next
    defaults: |site| {
        let from = match site.joint() {
            0 => 2.0,
            joint => joint as f64,
        };
        vec![from, 0.2 * site.scale / site.speed, 0.0, 0.0, 0.0, 1.0]
    },
    build: |site, machine, values| {
        if machine.joints() < 2 {
            return Err(site.refuse(ENTRY.name, "there is no other joint to follow"));
        }
        let Some(from) = machine.other_joint(site.joint(), values[0]) else {
            let known = machine.joints();
            let rule = format!("must be the number of another joint, 1 to {known}");
            return Err(SimulateError::number(ENTRY.name, "from", values[0], rule));
        };
        let ratio = values[5];
        let way = if ratio < 0.0 { -1.0 } else { 1.0 };
        BuiltLaw::plant(CouplingEffect {
            joint: site.joint(),
            from,
            viscous: way * values[1],
            coulomb: values[2],
            inertia: way * values[3],
            alone: way * values[4],
            ratio,
            slope: site.slope(),
        })
    },
};

/// Friction and inertia that a joint has by the motion of another one.
struct CouplingEffect {
    joint: usize,
    from: usize,
    viscous: f64,
    coulomb: f64,
    inertia: f64,
    /// By the other joint's direction alone.
    alone: f64,
    ratio: f64,
    slope: f64,
}

impl Effect for CouplingEffect {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let other = motion.v[self.from];
        let together = motion.v[self.joint] + self.ratio * other;
        torque[self.joint] += self.viscous * other
            + self.alone * sign(self.slope, other)
            + self.coulomb * sign(self.slope, together);
    }

    fn inertia(&self, motion: &PlantState, mass: &mut [f64], _torque: &mut [f64]) {
        mass[self.joint * motion.q.len() + self.from] += self.inertia;
    }
}
