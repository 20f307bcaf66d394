//! What a diagnosis takes as known of the model that it is given.

use nalgebra::DMatrix;

use crate::input::robot_setup::RobotSetup;
use cft_ident_core::diagnose::{FreeParameters, LogRole};
use cft_ident_core::effect::{AugmentedModel, stationary_joints};
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::ModelFile;

/// Which parameters the fit may move: all but those that the friction stage left open; held friction by its prior.
pub(crate) fn open(
    setup: &RobotSetup,
    file: &ModelFile,
    given: &AugmentedModel,
    hold_friction: bool,
) -> FreeParameters {
    let joints = setup.robot.joint_names();
    let friction = joints
        .iter()
        .zip(&given.model.friction)
        .map(|(joint, law)| {
            let names = names_of(law);
            if hold_friction {
                let spread = |name: &str| file.find(name, Some(joint)).and_then(|p| p.std);
                let known = |name: &&str| spread(name).is_some_and(|s| s > 0.0);
                return names.iter().map(known).collect();
            }
            if matches!(law, JointFriction::ViscousCoulomb(_)) {
                return vec![true; names.len()];
            }
            let known = |name: &&str| {
                file.find(name, Some(joint)).is_some_and(|p| {
                    p.std.is_some_and(|s| s > 0.0)
                        && !matches!(
                            p.verdict,
                            Some(Verdict::LowerBound | Verdict::NotIdentifiable)
                        )
                })
            };
            let mut open: Vec<bool> = names.iter().map(known).collect();
            if open.iter().all(|o| !o) {
                // a law without any uncertainty: its linear part is fitted freely
                for o in open.iter_mut().take(3) {
                    *o = true;
                }
            }
            open
        })
        .collect();
    FreeParameters {
        offset: joints
            .iter()
            .map(|joint| file.find("offset", Some(joint)).is_some())
            .collect(),
        friction,
    }
}

/// Names of a law's parameters.
fn names_of(law: &JointFriction) -> &'static [&'static str] {
    match law {
        JointFriction::None => &[],
        JointFriction::ViscousCoulomb(_) => &ViscousCoulomb::NAMES,
        JointFriction::DoubleTanh(_) => &DoubleTanh::NAMES,
    }
}

/// Puts deviations of friction parameters without a covariance into it, row-major, by [`Model::gradient`].
fn with_deviations(file: &ModelFile, model: &Model, covariance: &mut [f64]) {
    let size = model.parameters();
    let joints = model.robot.joint_names().iter();
    let keys = joints
        .zip(&model.friction)
        .flat_map(|(joint, law)| names_of(law).iter().map(move |name| (*name, joint)));
    for (i, (name, joint)) in (model.theta.len()..).zip(keys) {
        let std = file.find(name, Some(joint)).and_then(|p| p.std);
        if let Some(std) = std.filter(|_| covariance[i * size + i] <= 0.0) {
            covariance[i * size + i] = std * std;
        }
    }
}

/// Joints that move in a log in which all others are stationary.
pub(crate) fn moved_alone(
    given: &AugmentedModel,
    stretches: &[Stretch],
    roles: &[LogRole],
) -> Vec<bool> {
    let robot = &given.model.robot;
    let fitted = stretches.iter().filter(|s| roles[s.log] == LogRole::Train);
    let fitted: Vec<Stretch> = fitted.cloned().collect();
    let mut alone = vec![false; robot.joints()];
    for stationary in stationary_joints(robot, &fitted) {
        let mut moving = (0..stationary.len()).filter(|j| !stationary[*j]);
        if let (Some(j), None, true) = (moving.next(), moving.next(), stationary.len() > 1) {
            alone[j] = true;
        }
    }
    alone
}

/// Factor on deviations of the friction stage: its model lacked what is looked for here, too.
const FRICTION_DOUBT: f64 = 3.0;

/// Inverse covariance of the friction stage; a joint that moves alone in these logs is fitted from them.
pub(crate) fn information(
    file: &ModelFile,
    given: &AugmentedModel,
    open: &FreeParameters,
    hold_friction: bool,
    alone: &[bool],
) -> DMatrix<f64> {
    let model = &given.model;
    let size = model.parameters();
    let mut covariance = file.model_covariance(model);
    if hold_friction {
        with_deviations(file, model, &mut covariance);
    }
    let mut wanted = vec![false; size];
    let mut at = model.theta.len();
    for ((law, open), alone) in model.friction.iter().zip(&open.friction).zip(alone) {
        for (k, open) in open.iter().enumerate() {
            let of_stage = matches!(law, JointFriction::DoubleTanh(_)) && !alone;
            if of_stage || hold_friction {
                wanted[at + k] = *open;
            }
        }
        at += law.parameters();
    }
    let doubt = if hold_friction { 1.0 } else { FRICTION_DOUBT };
    let index: Vec<usize> = (0..size)
        .filter(|i| wanted[*i] && covariance[i * size + i] > 0.0)
        .collect();
    let scale: Vec<f64> = index
        .iter()
        .map(|i| covariance[i * size + i].sqrt())
        .collect();
    let k = index.len();
    let scaled = DMatrix::from_fn(k, k, |a, b| {
        let ridge = if a == b { 1e-9 } else { 0.0 };
        covariance[index[a] * size + index[b]] / (scale[a] * scale[b]) + ridge
    });
    let mut out = DMatrix::zeros(size, size);
    let inverse = match scaled.cholesky() {
        Some(c) => c.inverse(),
        // a covariance edited by hand: its diagonal still says how firm each one is
        None => DMatrix::identity(k, k),
    };
    for a in 0..k {
        for b in 0..k {
            out[(index[a], index[b])] = inverse[(a, b)] / (scale[a] * scale[b] * doubt * doubt);
        }
    }
    out
}
