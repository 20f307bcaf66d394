//! What a fit of the inertial parameters found, and the model that it is.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;

use super::consistent::ConsistentLinks;
use super::estimate::EstimatorAccount;
use super::gains::{Gain, LSQ_WITH_GAINS};
use super::judged_estimate::JudgedEstimate;
use super::known_friction::FrictionOfFit;
use super::lsq_problem::LsqProblem;
use super::motion_fit::MotionFit;
use super::weakest::{WeakestPart, weakest};
use crate::held_out::hold_out::{Held, hold_out, or_note};
use crate::held_out::residual::{ErrorOfLog, JointResidual, RelativeError};
use crate::input::control::Control;
use crate::input::dataset::Dataset;
use crate::input::error::IdentifyError;
use crate::input::lsq_rows::LsqRows;
use crate::input::model::{new_model, refined};
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
    /// The same of each log, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub by_log: Vec<ErrorOfLog>,
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
    /// What a judged estimate found, before anything is said of it on logs.
    pub(crate) fn new(
        problem: &LsqProblem,
        rows: &LsqRows,
        judged: JudgedEstimate,
        notes: Vec<StageNote>,
    ) -> Result<Self, IdentifyError> {
        let (setup, gains) = (&problem.data.setup, problem.settings.gains);
        let unconstrained = match &judged.consistent {
            Some(of) if of.in_use => RelativeError::each(setup, &judged.plain_errors()),
            _ => Vec::new(),
        };
        let (count, errors) = judged.essential;
        let estimate = judged.estimate;
        let mut inputs = rows.inputs();
        let known = problem.before.as_ref().zip(problem.friction_file());
        let friction_prior = known.map(|(before, file)| {
            before.kept(file, (&estimate.columns, &estimate.contradicted), &inputs)
        });
        let fit = estimate.fit;
        // what a fit has among its unknowns is no friction beside them
        let beside = estimate.columns.known.iter().any(Option::is_some);
        let friction = known
            .filter(|_| beside)
            .map(|(before, _)| before.after(setup, &estimate.columns, &estimate.covariance));
        inputs.extend(gains.iter().flat_map(|gains| gains.inputs.clone()));
        Ok(IdentifiedDynamics {
            friction: friction.unwrap_or_default(),
            gains: gains.map_or(Vec::new(), |gains| gains.joints.clone()),
            essential: EssentialFit {
                count,
                joints: RelativeError::each(setup, &errors),
            },
            condition: fit.condition,
            rank: fit.rank,
            weakest_direction: weakest(&fit, &judged.unknowns),
            samples: fit.rows * setup.robot.joints() as u64,
            effective_samples: fit.effective_rows * setup.robot.joints() as f64,
            joints: Vec::new(),
            by_log: Vec::new(),
            unconstrained_residual: unconstrained,
            by_motion: None,
            position_cutoffs: judged.position_cutoffs,
            account: estimate.account,
            summary: rows.summary().cloned().ok_or(IdentifyError::NoLog)?,
            setup: judged.geometry,
            columns: estimate.columns,
            covariance: estimate.covariance,
            friction_prior: friction_prior.unwrap_or_default(),
            held: Held::default(),
            consistent: judged.consistent,
            unknowns: judged.unknowns,
            fit,
            inputs,
            notes,
        })
    }

    /// Sets blocks of the logs aside, one after the other, and keeps what the model `file` leaves of them.
    pub(crate) fn set_blocks_aside(
        &mut self,
        data: &Dataset,
        file: &ModelFile,
        control: &Control,
    ) -> Result<(), IdentifyError> {
        let smoothed = data.setup.smoothed_as(&self.position_cutoffs);
        let model = refined(file, &data.setup.name);
        let held = model.and_then(|model| {
            let logs = (data.logs.as_slice(), self.inputs.as_slice());
            hold_out(&smoothed, (file, &model), logs, control)
        });
        self.held = or_note(held, &mut self.notes)?;
        Ok(())
    }

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
