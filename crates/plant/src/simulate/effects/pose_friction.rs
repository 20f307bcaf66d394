//! `pose-friction`: friction whose level another joint's position sets, `from` its number, counted from one.
//!
//! E = sgn(v_i) (sin sin(k q_j) + cos cos(k q_j)), k as in `ripple` of joint j, the sign as steep as the joint allows.

use super::{BuiltLaw, PlantLaw, sign};
use crate::simulate::SimulateError;
use cft_ident_core::effect::pose_friction::ENTRY;
use cft_ident_core::robot::JointKind;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| {
        let from = match site.joint() {
            0 => 2.0,
            joint => joint as f64,
        };
        vec![from, 1.0, 0.15 * site.scale, 0.0]
    },
    build: |site, machine, values| {
        if machine.joints() < 2 {
            return Err(site.refuse(ENTRY.name, "there is no other joint whose pose could count"));
        }
        let joint = site.joint();
        let Some(other) = machine.other_joint(joint, values[0]) else {
            let known = machine.joints();
            let rule = format!("must be the number of another joint, 1 to {known}");
            return Err(SimulateError::number(ENTRY.name, "from", values[0], rule));
        };
        let wavenumber = match machine.robot.joint_kind(other) {
            JointKind::Revolute => values[1],
            JointKind::Prismatic => std::f64::consts::TAU * values[1],
        };
        let (sin, cos, slope) = (values[2], values[3], site.slope());
        BuiltLaw::torques(move |motion, torque| {
            let (s, c) = (wavenumber * motion.q[other]).sin_cos();
            torque[joint] += sign(slope, motion.v[joint]) * (sin * s + cos * c);
        })
    },
};
