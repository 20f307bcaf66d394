//! `gravity-tilt`: gravity has components along the base's x and y that the model does not know.
//!
//! Masses m_i at p_i have the potential -sum m_i (gx p_x + gy p_y), and the motors supply its gradient. Of
//! the CFT robot's chain the kinetic energy gives the first moments: the momentum along y is
//! (theta_1 + Mr) v1 + d/dt(O sin q2 + H cos q2), so that sum m p_y = (theta_1 + Mr) q1 + O sin q2 + H cos q2
//! and, a quarter turn on, sum m p_x = O cos q2 - H sin q2, both up to constants. The links of a serial
//! robot have the first moments of its base parameters, and none where those of a link are no parameter:
//! about a vertical first axis they act on that joint alone, as a `ripple` of one wave a turn.

use nalgebra::Vector3;

use super::frames::{Frame, frames};
use super::{Built, Effect, PlantLaw, PlantRobot, PlantState, Site};
use crate::simulate::SimulateError;
use cft_ident_core::effect::gravity_tilt::ENTRY;
use cft_ident_core::robot::cft::dynamics::Coefficients;
use cft_ident_core::robot::standard::STANDARD;
use cft_ident_core::robot::tree::Tree;
use cft_ident_core::robot::{JointKind, Robot};

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![0.1, 0.1],
    build,
};

fn build(site: &Site, machine: &PlantRobot, values: &[f64]) -> Result<Built, SimulateError> {
    let [gx, gy] = [values[0], values[1]];
    let PlantRobot { robot, theta } = *machine;
    if let Some(chain) = robot.coefficients(theta) {
        return Built::plant(Tilt { gx, gy, chain });
    }
    if robot.knows_links() {
        return Built::plant(Askew {
            chain: robot.tree().clone(),
            moments: moments(robot, theta),
            gravity: Vector3::new(gx, gy, 0.0),
        });
    }
    match robot.joint_kind(0) {
        // The base's x lies along the axis; y is across it and does no work.
        JointKind::Prismatic => Built::plant(Constant {
            force: -theta[0] * gx,
        }),
        JointKind::Revolute => Err(site.refuse(
            ENTRY.name,
            "a single turning joint has an inertia and no centre of gravity; use `torque-offset` or \
             `ripple` with order 1",
        )),
    }
}

struct Tilt {
    gx: f64,
    gy: f64,
    chain: Coefficients,
}

impl Effect for Tilt {
    fn inertia(&self, motion: &PlantState, _mass: &mut [f64], torque: &mut [f64]) {
        let (Some(&[_, q2, q4, q5]), [tau1, tau2, tau4, tau5]) = (motion.q.first_chunk(), torque)
        else {
            return;
        };
        let (s2, c2) = q2.sin_cos();
        let (s4, c4) = q4.sin_cos();
        let (s, c) = (q4 + q5).sin_cos();
        let [a, b, cc, e] = self.chain.h;
        let radial = self.chain.h0 + a * s4 + b * s + cc * c4 + e * c;
        let by_psi = b * c - e * s;
        let by_q4 = a * c4 - cc * s4 + by_psi;
        let o = self.chain.o;
        // Along the arm and across it.
        let (along, across) = (self.gx * s2 - self.gy * c2, self.gx * c2 + self.gy * s2);
        *tau1 -= self.gy * (self.chain.t1 + self.chain.mr);
        *tau2 += o * along + radial * across;
        *tau4 += by_q4 * along;
        *tau5 += by_psi * along;
    }
}

struct Constant {
    force: f64,
}

impl Effect for Constant {
    fn inertia(&self, _motion: &PlantState, _mass: &mut [f64], torque: &mut [f64]) {
        if let Some(torque) = torque.first_mut() {
            *torque += self.force;
        }
    }
}

/// Mass and first moments of each link in its own frame, as far as base parameters know them.
fn moments(robot: &Robot, theta: &[f64]) -> Vec<(f64, Vector3<f64>)> {
    let mut moments = vec![(0.0, Vector3::zeros()); robot.tree().links().len()];
    for (grouping, value) in robot.groupings().iter().zip(theta) {
        let Some((mass, moment)) = moments.get_mut(grouping.kept / STANDARD) else {
            continue; // a drive's inertia
        };
        match grouping.kept % STANDARD {
            6 => moment.x = *value,
            7 => moment.y = *value,
            8 => moment.z = *value,
            9 => *mass = *value,
            _ => {}
        }
    }
    moments
}

/// A serial robot in gravity that has something beside what is declared.
struct Askew {
    chain: Tree,
    moments: Vec<(f64, Vector3<f64>)>,
    /// Beside the declared one, in the base's frame \[m/s^2\].
    gravity: Vector3<f64>,
}

impl Effect for Askew {
    fn inertia(&self, motion: &PlantState, _mass: &mut [f64], torque: &mut [f64]) {
        frames(&self.chain, motion.q, motion.v, |link, frame: &Frame| {
            let (mass, moment) = self.moments[link];
            let arm = frame.rotation * moment;
            for (i, torque) in torque.iter_mut().enumerate() {
                let moved = mass * frame.slides[i] + frame.turns[i].cross(&arm);
                *torque -= self.gravity.dot(&moved);
            }
        });
    }
}
