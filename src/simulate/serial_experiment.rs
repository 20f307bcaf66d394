//! What a serial robot is simulated with: its truth from a model, and its motions.

use std::f64::consts::TAU;

use super::SimulateError;
use super::from_files::{LadderOf, SECONDS, fourier, points, single_joint_ladder};
use super::order::{Motion, Order};
use super::plant::Plant;
use super::reference::{Fourier, Frame, Path, Reference};
use super::serial::SerialTruth;
use super::single_joint::{SingleJointFriction, SingleJointTruth};
use crate::config::robot_file::FrictionLawKind;
use crate::config::trajectory::Trajectory;
use crate::robot::friction::ViscousCoulomb;

/// Fundamental of the usual motion \[Hz\], its harmonics, and the share of a joint's half travel that
/// their amplitudes sum to.
const FUNDAMENTAL_HZ: f64 = 0.1;
const HARMONICS: usize = 4;
const SHARE: f64 = 0.8;
/// Time in which the motion sets in \[s\].
const BLEND: f64 = 2.0;

/// The true parameters that a model gives.
///
/// # Errors
/// [`SimulateError::Unsupported`] without a model, [`SimulateError::Config`] where it lacks a parameter,
/// [`SimulateError::NotPositiveDefinite`] where it is that of no body.
pub(super) fn truth<const J: usize>(order: &Order) -> Result<SerialTruth<J>, SimulateError> {
    let Some((file, model)) = order.model else {
        return Err(SimulateError::Unsupported {
            what: "a serial robot has no parameters of its own; give a model with -m".to_owned(),
        });
    };
    model.belongs_to(file, order.robot)?;
    let robot = order.robot.robot();
    let names = robot.joint_names();
    let still = SingleJointFriction::viscous_coulomb(
        ViscousCoulomb {
            viscous: 0.0,
            coulomb: 0.0,
        },
        1.0,
    );
    let joints: [SingleJointTruth; J] = std::array::from_fn(|j| {
        let name = names[j].clone();
        let noise = order.robot.noise.joint.get(&name);
        let limits = order.robot.limits.get(&name).and_then(|l| l.position);
        SingleJointTruth {
            kind: robot.joint_kind(j),
            inertia: 1.0,
            friction: still,
            offset: model.offset(&name),
            gain: 1.0,
            resolution: noise.and_then(|n| n.position_resolution).unwrap_or(0.0),
            limits: limits.map_or((f64::NEG_INFINITY, f64::INFINITY), |[low, high]| {
                (low, high)
            }),
            name,
        }
    });
    let mut laws = Vec::with_capacity(J);
    for name in names {
        laws.push(match order.robot.friction_law() {
            FrictionLawKind::DoubleTanh => (Some(model.double_tanh(file, name)?), None),
            FrictionLawKind::ViscousCoulomb => (None, Some(model.viscous_coulomb(file, name)?)),
        });
    }
    let theta = model.inertial(file)?;
    SerialTruth::new(robot.clone(), theta, joints, |j, inertia| match laws[j] {
        (Some(law), _) => SingleJointFriction::DoubleTanh(law),
        (None, law) => law.map_or(still, |law| {
            SingleJointFriction::viscous_coulomb(law, inertia)
        }),
    })
}

/// The reference of the order; `None` where volts are played back.
///
/// # Errors
/// [`SimulateError`] where a trajectory names what the robot does not have, or does not fit.
pub(super) fn reference<const J: usize>(
    order: &Order,
    truth: &SerialTruth<J>,
) -> Result<Option<Reference<J>>, SimulateError> {
    let names = truth.joint_names();
    let seconds = order.seconds.unwrap_or(SECONDS);
    let along = |name: &str, ladder: LadderOf| -> Result<Reference<J>, SimulateError> {
        let Some(moving) = names.iter().position(|n| n == name) else {
            return Err(SimulateError::UnknownJoint {
                name: name.to_owned(),
                known: names.join(", "),
            });
        };
        let joint = &truth.joints[moving];
        let one = single_joint_ladder(order.robot, joint, ladder, seconds, order.seed)?;
        let Path::Ladder { ladder, .. } = one.path else {
            return Err(SimulateError::Reference {
                what: "a ladder was asked for".to_owned(),
            });
        };
        let mut pose = truth.middle();
        pose[moving] = ladder.at(0.0).0;
        Ok(Reference {
            frame: Frame::Joints,
            path: Path::Ladder {
                moving,
                pose,
                ladder,
            },
        })
    };
    Ok(match order.motion {
        Motion::Usual => Some(usual(truth)),
        Motion::Move { joint, part } => Some(along(joint, LadderOf::Usual { part })?),
        Motion::Trajectory(Trajectory::SingleJoint(file)) => {
            Some(along(&file.joint, LadderOf::File(file))?)
        }
        Motion::Trajectory(Trajectory::Fourier(file)) => {
            let names = std::array::from_fn(|j| names[j].as_str());
            Some(fourier(file, Frame::Joints, names, truth.middle())?)
        }
        Motion::Trajectory(Trajectory::Points(file)) => Some(points(file, Frame::Joints)?),
        Motion::Volts { .. } => None,
    })
}

/// All joints over most of their travel, each with phases of its own.
fn usual<const J: usize>(truth: &SerialTruth<J>) -> Reference<J> {
    let (mut a, mut b) = (vec![[0.0; J]; HARMONICS], vec![[0.0; J]; HARMONICS]);
    let sum: f64 = (1..=HARMONICS).map(|k| 1.0 / k as f64).sum();
    for k in 0..HARMONICS {
        for j in 0..J {
            let (low, high) = truth.travel(j);
            let amplitude = SHARE * 0.5 * (high - low) / (sum * (k + 1) as f64);
            let phase = TAU * ((3 * k + 1) as f64 * (j as f64 + 0.7).sqrt()).fract();
            a[k][j] = amplitude * phase.cos();
            b[k][j] = amplitude * phase.sin();
        }
    }
    Reference {
        frame: Frame::Joints,
        path: Path::Fourier(Fourier {
            offset: truth.middle(),
            a,
            b,
            fundamental: TAU * FUNDAMENTAL_HZ,
            start: 0.0,
            blend: BLEND,
            periods: None,
        }),
    }
}
