//! Unknowns of a diagnosis by the names that model files have for them.

use cft_ident_core::diagnose::Unknown;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::robot::model::JointFriction;

/// Name and joint of an unknown, as model files have them.
pub(crate) fn key_of(model: &AugmentedModel, unknown: Unknown) -> (String, Option<String>) {
    let robot = &model.model.robot;
    let (name, joint) = match unknown {
        Unknown::Theta(k) => (robot.parameters()[k].name.to_string(), None),
        Unknown::Offset(j) => ("offset".to_owned(), Some(j)),
        Unknown::Friction { joint, k } => {
            let name = match &model.model.friction[joint] {
                JointFriction::None => "",
                JointFriction::DoubleTanh(_) => DoubleTanh::NAMES[k],
                JointFriction::ViscousCoulomb(_) => ViscousCoulomb::NAMES[k],
            };
            (name.to_owned(), Some(joint))
        }
    };
    (name, joint.map(|j| robot.joint_names()[j].clone()))
}
