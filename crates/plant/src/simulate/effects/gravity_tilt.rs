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
use super::{BuiltLaw, EffectSite, PlantLaw, PlantRobot};
use crate::simulate::SimulateError;
use cft_ident_core::effect::gravity_tilt::ENTRY;
use cft_ident_core::robot::cft::dynamics::ReportCoefficients;
use cft_ident_core::robot::standard::STANDARD;
use cft_ident_core::robot::tree::Tree;
use cft_ident_core::robot::{JointKind, Robot};

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![0.1, 0.1],
    build,
};

fn build(
    site: &EffectSite,
    machine: &PlantRobot,
    values: &[f64],
) -> Result<BuiltLaw, SimulateError> {
    let [gx, gy] = [values[0], values[1]];
    let PlantRobot { robot, theta } = *machine;
    if let Some(chain) = robot.coefficients(theta) {
        return of_cft(chain, gx, gy);
    }
    if robot.knows_links() {
        let moments = moments(robot, theta);
        return of_links(robot.tree().clone(), moments, Vector3::new(gx, gy, 0.0));
    }
    match robot.joint_kind(0) {
        // The base's x lies along the axis; y is across it and does no work.
        JointKind::Prismatic => {
            let force = -theta[0] * gx;
            BuiltLaw::inertia(move |_, _, torque| torque[0] += force)
        }
        JointKind::Revolute => Err(site.refuse(
            ENTRY.name,
            "a single turning joint has an inertia and no centre of gravity; use `torque-offset` or \
             `ripple` with order 1",
        )),
    }
}

fn of_cft(chain: ReportCoefficients, gx: f64, gy: f64) -> Result<BuiltLaw, SimulateError> {
    BuiltLaw::inertia(move |motion, _, torque| {
        let (Some(&[_, q2, q4, q5]), [tau1, tau2, tau4, tau5]) = (motion.q.first_chunk(), torque)
        else {
            return;
        };
        let (s2, c2) = q2.sin_cos();
        let (s4, c4) = q4.sin_cos();
        let (s, c) = (q4 + q5).sin_cos();
        let [a, b, cc, e] = chain.h;
        let radial = chain.h0 + a * s4 + b * s + cc * c4 + e * c;
        let by_psi = b * c - e * s;
        let by_q4 = a * c4 - cc * s4 + by_psi;
        let o = chain.o;
        // Along the arm and across it.
        let (along, across) = (gx * s2 - gy * c2, gx * c2 + gy * s2);
        *tau1 -= gy * (chain.t1 + chain.mr);
        *tau2 += o * along + radial * across;
        *tau4 += by_q4 * along;
        *tau5 += by_psi * along;
    })
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

/// Gravity beside the declared one, in the base's frame \[m/s^2\].
fn of_links(
    chain: Tree,
    moments: Vec<(f64, Vector3<f64>)>,
    gravity: Vector3<f64>,
) -> Result<BuiltLaw, SimulateError> {
    BuiltLaw::inertia(move |motion, _, torque| {
        frames(&chain, motion.q, motion.v, |link, frame: &Frame| {
            let (mass, moment) = moments[link];
            let arm = frame.rotation * moment;
            for (i, torque) in torque.iter_mut().enumerate() {
                let moved = mass * frame.slides[i] + frame.turns[i].cross(&arm);
                *torque -= gravity.dot(&moved);
            }
        });
    })
}
