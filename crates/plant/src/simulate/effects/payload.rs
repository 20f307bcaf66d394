//! `payload`: a body on the last link, its centre at (mx, my, mz)/mass in that link's frame, with the
//! inertia of its own about its centre; a point mass without. It is that about the vertical axis on robots
//! whose tool stays level, and on a serial robot that of a ball, the same about every axis.
//!
//! On the CFT robot the last link is link 8, its frame's x outward, y up, z to the side, its origin at the
//! wrist under the arm; the mass's path p(q) gives m J^T J, m J^T dJ/dt v and m g dp_z/dq. A single joint
//! carries it as mass, or as (mx^2 + my^2)/mass where it turns, and its axis is taken as vertical there.

use nalgebra::Vector3;

use super::frames::{Frame, frames};
use super::rotor_inertia::at_joint;
use super::{BuiltLaw, EffectSite, PlantLaw, PlantRobot};
use crate::simulate::SimulateError;
use cft_ident_core::effect::payload::ENTRY;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::cft::geometry::{D, GRAVITY, L4, L5, L6, L8, U};
use cft_ident_core::robot::tree::Tree;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![1.0, L8, 0.0, 0.0, 0.0],
    build,
};

fn build(_: &EffectSite, machine: &PlantRobot, values: &[f64]) -> Result<BuiltLaw, SimulateError> {
    let [mass, mx, my, mz, inertia] = [values[0], values[1], values[2], values[3], values[4]];
    let robot = machine.robot;
    if !robot.knows_links() {
        let inertia = match robot.joint_kind(0) {
            JointKind::Prismatic => mass,
            JointKind::Revolute => (mx * mx + my * my) / mass + inertia,
        };
        return at_joint(0, inertia);
    }
    if robot.tool_stays_level() {
        return carried(mass, [mx / mass, mz / mass], inertia);
    }
    on_last_link(
        robot.tree().clone(),
        mass,
        Vector3::new(mx, my, mz) / mass,
        inertia,
    )
}

/// At a place in the frame of link 8 \[m\], whose height does not matter, for the tool stays level.
fn carried(
    carried: f64,
    [outward, side]: [f64; 2],
    inertia: f64,
) -> Result<BuiltLaw, SimulateError> {
    BuiltLaw::inertia(move |motion, mass, torque| {
        let (Some(&[_, q2, q4, q5]), Some(&[v1, v2, v4, v5])) =
            (motion.q.first_chunk(), motion.v.first_chunk())
        else {
            return;
        };
        let v = [v1, v2, v4, v5];
        let (s2, c2) = q2.sin_cos();
        let (s4, c4) = q4.sin_cos();
        let (s, c) = (q4 + q5).sin_cos();
        let w = v4 + v5;
        // Reach from the axis of q2, its rate, and the acceleration that the speeds alone give it.
        let reach = outward + D - L6 * s4 - U * s;
        let rate = -L6 * c4 * v4 - U * c * w;
        let bend = L6 * s4 * v4 * v4 + U * s * w * w;
        let (by_q4, by_q5) = (-L6 * c4 - U * c, -U * c);
        // p = (-reach s2 + side c2, q1 + reach c2 + side s2, (L4 + L6) c4 + L5 c) up to constants.
        let jacobian = [
            [0.0, -reach * c2 - side * s2, -s2 * by_q4, -s2 * by_q5],
            [1.0, -reach * s2 + side * c2, c2 * by_q4, c2 * by_q5],
            [0.0, 0.0, -(L4 + L6) * s4 - L5 * s, -L5 * s],
        ];
        let (along, across) = (bend - reach * v2 * v2, 2.0 * rate * v2 + side * v2 * v2);
        let turned = [
            -along * s2 - across * c2,
            along * c2 - across * s2,
            -(L4 + L6) * c4 * v4 * v4 - L5 * c * w * w + GRAVITY,
        ];
        mass[4 + 1] += inertia;
        for i in 0..v.len() {
            for (row, bias) in jacobian.iter().zip(turned) {
                torque[i] += carried * row[i] * bias;
                for j in 0..v.len() {
                    mass[4 * i + j] += carried * row[i] * row[j];
                }
            }
        }
    })
}

/// A ball on the last link of a chain, its centre in that link's frame \[m\]: m J'J + I J_w'J_w; its spin has no torque.
fn on_last_link(
    chain: Tree,
    carried: f64,
    centre: Vector3<f64>,
    inertia: f64,
) -> Result<BuiltLaw, SimulateError> {
    BuiltLaw::inertia(move |motion, mass, torque| {
        let n = chain.joints();
        let last = chain.links().len() - 1;
        let gravity = Vector3::from(chain.gravity());
        frames(&chain, motion.q, motion.v, |link, frame: &Frame| {
            if link != last {
                return;
            }
            let arm = frame.rotation * centre;
            let swept = frame.spin.cross(&frame.spin.cross(&arm));
            let pull = carried * (frame.bias + frame.spin_bias.cross(&arm) + swept - gravity);
            let twist = inertia * frame.spin_bias;
            for i in 0..n {
                let moved = |j: usize| frame.slides[j] + frame.turns[j].cross(&arm);
                let (turns, slides) = (frame.turns[i], moved(i));
                torque[i] += slides.dot(&pull) + turns.dot(&twist);
                for j in 0..=i {
                    let turned = inertia * turns.dot(&frame.turns[j]);
                    let both = carried * slides.dot(&moved(j)) + turned;
                    mass[n * i + j] += both;
                    if i != j {
                        mass[n * j + i] += both;
                    }
                }
            }
        });
    })
}
