//! What a fit of the inertial parameters found, and the model that it is.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;

use super::consistent::ConsistentLinks;
use super::estimate::EstimatorAccount;
use super::gains::{Gain, LSQ_WITH_GAINS};
use super::known_friction::FrictionOfFit;
use super::motion_fit::MotionFit;
use super::weakest::WeakestPart;
use crate::held_out::hold_out::Held;
use crate::held_out::residual::{JointResidual, RelativeError};
use crate::input::model::new_model;
use crate::input::position_cutoff::PositionCutoff;
use crate::input::robot_setup::RobotSetup;
use crate::input::unknowns::FittedUnknown;
use crate::note::StageNote;
use crate::setup::Finding;
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::inertia::solution::ConditionNumbers;
use cft_ident_core::inertia::solve::Fit;
use cft_ident_core::motion::Summary;
use cft_ident_core::robot::friction::DoubleTanh;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::identified::friction_meaning;
use cft_ident_files::config::model_file::{FrictionPrior, Parameter};
use cft_ident_logs::log::Provenance;

/// What `lsq` found.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct IdentifiedDynamics {
    #[serde(rename = "parameters")]
    pub unknowns: Vec<FittedUnknown>,
    /// The friction that was known, before and after the fit.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub friction: Vec<FrictionOfFit>,
    /// Gains of the torque channels, where they were fitted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gains: Vec<Gain>,
    pub essential: EssentialFit,
    /// Physically consistent links and what they cost, where they were asked for.
    #[serde(rename = "feasible")]
    pub consistent: Option<ConsistentLinks>,
    pub condition: ConditionNumbers,
    /// Directions of the parameters that the rows determine.
    pub rank: usize,
    /// The combination of parameters that they determine least.
    pub weakest_direction: Vec<WeakestPart>,
    /// Rows of all joints.
    pub samples: u64,
    /// Effective sample size, of all joints.
    pub effective_samples: f64,
    /// Residual of the model that is written, on the logs that were fitted, as `validate` gives it.
    pub joints: Vec<JointResidual>,
    /// Residual of the plain fit in the rows in which each joint moves, where the model computes with physically consistent parameters.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unconstrained_residual: Vec<RelativeError>,
    /// The fit to the motion, where one was asked for; `parameters` and `joints` are its own then.
    #[serde(rename = "open_loop", skip_serializing_if = "Option::is_none")]
    pub by_motion: Option<MotionFit>,
    /// By which filter positions became velocities; joints that never move are left out.
    pub position_cutoffs: Vec<PositionCutoff>,
    #[serde(rename = "estimator")]
    pub account: EstimatorAccount,
    #[serde(rename = "processing")]
    pub summary: Summary,
    /// What the check of the set-up found, where it was made.
    pub setup: Vec<Finding>,
    #[serde(skip)]
    pub columns: RegressorColumns,
    #[serde(skip)]
    pub fit: Fit,
    /// Covariance of the unknowns and of the known friction of each joint.
    #[serde(skip)]
    pub covariance: DMatrix<f64>,
    /// What a model file keeps of the friction before the fit.
    #[serde(skip)]
    pub friction_prior: Vec<FrictionPrior>,
    /// What the model leaves of data set aside.
    #[serde(skip)]
    pub held: Held,
    #[serde(skip)]
    pub inputs: Vec<Provenance>,
    #[serde(skip)]
    pub notes: Vec<StageNote>,
}

/// The unknowns that the data are really about.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EssentialFit {
    /// How many they are.
    pub count: usize,
    /// Residual of the fit with those alone.
    pub joints: Vec<RelativeError>,
}

impl IdentifiedDynamics {
    /// The model: friction as it was known, and what was fitted, with their joint covariance.
    pub fn model(&self, setup: &RobotSetup, friction: Option<&ModelFile>) -> ModelFile {
        let command = if self.gains.is_empty() {
            "lsq"
        } else {
            LSQ_WITH_GAINS
        };
        let mut model = new_model(setup, command, &self.inputs);
        let estimator = self.account.estimator;
        model.provenance.estimator = (estimator != EstimatorKind::Wls).then_some(estimator);
        model.parameters = self.unknowns.iter().map(FittedUnknown::parameter).collect();
        let robot = &setup.robot;
        let mut keys: Vec<String> = model.parameters.iter().map(Parameter::key).collect();
        if let Some(friction) = friction {
            let known = &self.columns.known;
            let names = robot.joint_names().iter().enumerate();
            // where it was refined it is among what was fitted
            for (j, joint) in names.filter(|(j, _)| known[*j].is_some()) {
                for name in DoubleTanh::NAMES {
                    let Some(p) = friction.find(name, Some(joint)) else {
                        continue;
                    };
                    keys.push(p.key());
                    let found = self.friction.get(j).and_then(|f| f.parameters.get(name));
                    model.parameters.push(match found {
                        Some(found) if !found.held => Parameter {
                            value: found.value,
                            std: found.std,
                            verdict: found.verdict,
                            meaning: friction_meaning(name).to_owned(),
                            ..p.clone()
                        },
                        found => Parameter {
                            value: found.map_or(p.value, |found| found.value),
                            ..p.clone()
                        },
                    });
                }
            }
            model.effects = friction.effects.clone();
            model.friction_prior.clone_from(&self.friction_prior);
        }
        if let Some(by_motion) = &self.by_motion {
            model.effects.clone_from(&by_motion.effects);
        }
        let fit = &self.fit;
        model.replace_covariance(&keys, &|a, b| self.covariance[(a, b)]);
        for (joint, std) in robot.joint_names().iter().zip(&fit.residual_std) {
            model.residual_std.insert(joint.clone(), *std);
        }
        if let Some(consistent) = &self.consistent {
            consistent.write_into(&mut model);
        }
        self.held.write_into(&mut model);
        model
    }
}
