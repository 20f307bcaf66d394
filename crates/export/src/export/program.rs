//! A model as the numbers of a recursion: what generated code is written from.

use super::dissipative::driving;
use super::error::ExportError;
use super::recipe::ObserverRecipe;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::effect::as_code::EffectsCode;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::robot::standard::STANDARD;
use cft_ident_core::robot::tree::{JointCoupling, Tree};
use cft_ident_files::config::RobotFile;

/// Tree, link parameters, drives, friction and offsets of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Their kinds.
    pub kinds: Vec<JointKind>,
    /// Links that move as the robot does.
    pub tree: Tree,
    /// Standard parameters of each link that give the model's torques: those that the base
    /// parameters are named after, and 0 for what is grouped into them. No picture of the links.
    pub bodies: Vec<[f64; STANDARD]>,
    /// Drive inertia of each joint [kg or kg m^2]; 0 where it is grouped into a link.
    pub drives: Vec<f64>,
    /// Coupled gear trains, each with inertia, viscous and Coulomb part.
    pub couplings: Vec<(JointCoupling, [f64; 3])>,
    /// Friction of each joint.
    pub friction: Vec<JointFriction>,
    /// Constant torque of each joint [N or Nm].
    pub offset: Vec<f64>,
    /// What effects add.
    pub effects: EffectsCode,
    /// The observer of external torques, where one is asked for.
    pub observer: Option<ObserverRecipe>,
    /// Speeds from and to which the friction of a joint would drive it; none where it always takes power.
    pub drives_at: Vec<Option<[f64; 2]>>,
    /// Speed of each joint below which it may be at rest [m/s or rad/s].
    pub rest: Vec<f64>,
}

/// Speeds below which a joint may be at rest where nothing else is said: 0.01 rad/s, 1 mm/s.
fn slow(kind: JointKind) -> f64 {
    match kind {
        JointKind::Revolute => 1e-2,
        JointKind::Prismatic => 1e-3,
    }
}

impl Program {
    /// The program of a model with its effects.
    ///
    /// # Errors
    /// [`ExportError::Effect`] for an effect that no code is known of.
    pub fn with_effects(refined: &AugmentedModel) -> Result<Self, ExportError> {
        let effects = EffectsCode::of(refined)?;
        Ok(Self {
            drives_at: driving(refined, &effects.of_friction),
            effects,
            ..Self::of(&refined.model)
        })
    }

    /// Speeds of rest by the robot file: a hundredth of what it allows a joint, where it says.
    pub fn rest_by(&mut self, file: &RobotFile) {
        for (joint, rest) in file.joint_names().iter().zip(&mut self.rest) {
            if let Some(top) = file.limits.get(joint).and_then(|limits| limits.speed) {
                *rest = top / 100.0;
            }
        }
    }

    /// The program of a model.
    pub fn of(model: &Model) -> Self {
        let robot = &model.robot;
        let couplings = robot.transmission().couplings().iter().copied();
        let couplings = couplings.zip(robot.coupling_parameters(&model.theta));
        let kinds: Vec<JointKind> = (0..robot.joints()).map(|j| robot.joint_kind(j)).collect();
        Self {
            joints: robot.joint_names().to_vec(),
            rest: kinds.iter().map(|kind| slow(*kind)).collect(),
            kinds,
            tree: robot.tree().clone(),
            bodies: robot.link_parameters(&model.theta),
            drives: robot.drive_parameters(&model.theta),
            couplings: couplings.collect(),
            friction: model.friction.clone(),
            offset: model.offset.clone(),
            effects: EffectsCode {
                lead_s: vec![0.0; robot.joints()],
                ..EffectsCode::default()
            },
            observer: None,
            drives_at: driving(&AugmentedModel::plain(model.clone()), &[]),
        }
    }
}
