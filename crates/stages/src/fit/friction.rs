//! The friction of single joints from one-joint logs, by the Kalman filter.

use std::collections::BTreeMap;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::input::control::Control;
use crate::input::dataset::Dataset;
use crate::input::error::IdentifyError;
use crate::input::log_data::LogData;
use crate::input::model::new_model;
use crate::input::one_joint::{self, OneJointLog};
use crate::input::repeated::{each_row_once, identities};
use crate::input::robot_setup::RobotSetup;
use crate::note::{FrictionNote, StageNote};
use crate::setup::Finding;
use cft_ident_core::friction::estimate::{FrictionOptions, JointEstimate, estimate};
use cft_ident_core::friction::excitation::{FrictionError, moving_joint};
use cft_ident_core::friction::inputs::FrictionInputs;
use cft_ident_core::friction::passes::GivenNoise;
use cft_ident_core::friction::prepare::{SensorModel, SmoothedMotion, prepare, resolution};
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_core::number;
use cft_ident_core::robot::friction::DoubleTanh;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::identified::{friction_meaning, friction_unit};
use cft_ident_files::config::model_file::{FrictionPrior, Parameter};
use cft_ident_logs::log::Provenance;

/// How friction is estimated.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrictionSettings {
    /// The joint that the logs move; found from the data where absent.
    pub joint: Option<String>,
}

/// Friction of every joint that the logs move.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct IdentifiedFriction {
    /// In joint order.
    pub joints: Vec<FrictionOfJoint>,
    /// What the check of the set-up found, where it was made.
    pub setup: Vec<Finding>,
    #[serde(skip)]
    pub inputs: Vec<Provenance>,
    #[serde(skip)]
    pub notes: Vec<StageNote>,
}

/// Friction of one joint.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FrictionOfJoint {
    pub joint: String,
    /// Place of the joint in the robot.
    #[serde(skip)]
    pub index: usize,
    /// The logs that moved it.
    #[serde(skip)]
    pub logs: Vec<Provenance>,
    pub converged: bool,
    pub parameters: LawParameters,
    #[serde(flatten)]
    pub estimate: JointEstimate,
}

/// Parameters of the double-tanh law (18); slope_1 is the steeper one.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LawParameters {
    pub viscous: LawParameter,
    pub coulomb_1: LawParameter,
    pub coulomb_2: LawParameter,
    pub slope_1: LawParameter,
    pub slope_2: LawParameter,
}

/// One parameter of a law.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LawParameter {
    /// Estimate \[unit\]; a lower bound where the verdict says so, null where nothing determines it.
    pub value: Option<f64>,
    /// Its standard deviation \[unit\].
    pub std: Option<f64>,
    pub unit: String,
    /// Number in the report's Table 4, where it has one.
    pub theta: Option<u32>,
    pub verdict: Verdict,
}

impl LawParameters {
    /// Names and parameters, in the order of the law.
    pub fn each(&self) -> [(&'static str, &LawParameter); 5] {
        let all = [
            &self.viscous,
            &self.coulomb_1,
            &self.coulomb_2,
            &self.slope_1,
            &self.slope_2,
        ];
        std::array::from_fn(|k| (DoubleTanh::NAMES[k], all[k]))
    }
}

impl FrictionOfJoint {
    fn of(
        setup: &RobotSetup,
        index: usize,
        logs: Vec<Provenance>,
        estimate: JointEstimate,
    ) -> Self {
        let parameter = |k: usize| {
            let v = &estimate.values[k];
            let known = v.verdict != Verdict::NotIdentifiable;
            let (name, torque) = (DoubleTanh::NAMES[k], setup.file.torque_unit(index));
            LawParameter {
                value: known.then_some(v.value),
                std: known.then_some(v.std),
                unit: friction_unit(&setup.robot, index, name, torque),
                theta: setup.robot.friction_theta(index, k),
                verdict: v.verdict,
            }
        };
        FrictionOfJoint {
            joint: setup.robot.joint_names()[index].clone(),
            index,
            logs,
            converged: estimate.ending == IterationEnding::Converged,
            parameters: LawParameters {
                viscous: parameter(0),
                coulomb_1: parameter(1),
                coulomb_2: parameter(2),
                slope_1: parameter(3),
                slope_2: parameter(4),
            },
            estimate,
        }
    }
}

/// Estimates the friction from one-joint logs; several logs of one joint are used together.
///
/// # Errors
/// Logs that cannot be used, and logs that do not move one joint through zero speed.
pub fn friction(
    data: &Dataset,
    settings: &FrictionSettings,
    control: &Control,
) -> Result<IdentifiedFriction, IdentifyError> {
    let (setup, logs) = (&data.setup, data.logs.as_slice());
    setup.check_gains()?;
    data.check_rows()?;
    each_row_once(&[("fit", identities(logs))])?;
    let (groups, inputs, of_logs) = by_joint(setup, logs, settings, control)?;
    let mut notes: Vec<StageNote> = StageNote::of_robot(&setup.file).chain(of_logs).collect();
    let work = control.begin("friction filter", Some(groups.len() as u64));
    let parameters = setup.robot.parameters().iter();
    let parameter_names: Vec<String> = parameters.map(|p| p.name.to_string()).collect();
    // joints do not know of one another: they run in parallel, and are collected in joint order
    let found: Vec<Result<FrictionOfJoint, IdentifyError>> = groups
        .into_par_iter()
        .map(|(j, group)| {
            control.check()?;
            let estimate = one_joint(setup, j, &group, &parameter_names)?;
            work.advance(1);
            Ok(FrictionOfJoint::of(setup, j, group.inputs, estimate))
        })
        .collect();
    let joints = found.into_iter().collect::<Result<Vec<_>, _>>()?;
    control.check()?;
    notes.extend(joints.iter().flat_map(joint_notes));
    Ok(IdentifiedFriction {
        joints,
        setup: Vec::new(),
        inputs,
        notes,
    })
}

/// Logs by the joint that they move, with their inputs and what was noticed of them.
type LogsByJoint = (BTreeMap<usize, JointLogs>, Vec<Provenance>, Vec<StageNote>);

fn by_joint(
    setup: &RobotSetup,
    logs: &[LogData],
    settings: &FrictionSettings,
    control: &Control,
) -> Result<LogsByJoint, IdentifyError> {
    let names = setup.robot.joint_names();
    let place = |name: &String| {
        let found = names.iter().position(|n| n == name);
        found.ok_or_else(|| IdentifyError::NoJoint {
            joint: name.clone(),
            known: names.join(", "),
        })
    };
    let named = settings.joint.as_ref().map(place).transpose()?;
    let _work = control.begin("reading logs", None);
    let ranges = setup.ranges();
    let mut groups: BTreeMap<usize, JointLogs> = BTreeMap::new();
    let (mut inputs, mut notes) = (Vec::new(), Vec::new());
    for log in logs {
        let OneJointLog {
            motions,
            narrower,
            zero_order_hold,
            provenance,
            notes: of_log,
        } = one_joint::read(setup, log, control)?;
        inputs.push(provenance.clone());
        notes.extend(of_log);
        let moving = match named {
            Some(j) => j,
            None => {
                moving_joint(names, &motions, &ranges).map_err(|error| IdentifyError::Friction {
                    logs: log.name(),
                    error,
                })?
            }
        };
        let group = groups.entry(moving).or_default();
        group.zero_order_hold |= zero_order_hold;
        group.motions.extend(motions);
        group.narrower.extend(narrower);
        group.logs.push(log.name());
        group.inputs.push(provenance);
    }
    Ok((groups, inputs, notes))
}

/// Logs of one joint.
#[derive(Default)]
struct JointLogs {
    motions: Vec<SmoothedMotion>,
    narrower: Vec<SmoothedMotion>,
    zero_order_hold: bool,
    logs: Vec<String>,
    inputs: Vec<Provenance>,
}

fn one_joint(
    setup: &RobotSetup,
    j: usize,
    group: &JointLogs,
    parameter_names: &[String],
) -> Result<JointEstimate, IdentifyError> {
    let name = &setup.robot.joint_names()[j];
    let place = group.logs.join(", ");
    let undetermined = |error: FrictionError| IdentifyError::Friction {
        logs: place.clone(),
        error,
    };
    let noise = setup.file.noise.joint.get(name);
    let given = noise.and_then(|n| n.position_resolution);
    let resolution = given.unwrap_or_else(|| resolution(&group.motions, setup.robot.joints(), j));
    let variance = |q: &[f64]| -> f64 {
        let known = match given {
            Some(_) => None,
            None => setup.robot.transmission().encoder_variance(j, q),
        };
        known.unwrap_or(resolution * resolution / 12.0)
    };
    let sensors = SensorModel {
        variance: &variance,
        zero_order_hold: group.zero_order_hold,
    };
    let prepared = prepare(&setup.robot, j, &group.motions, &sensors).ok_or_else(|| {
        undetermined(FrictionError::StandsStill {
            joint: name.clone(),
        })
    })?;
    let options = FrictionOptions {
        start: start_of(setup, name),
        noise: GivenNoise {
            torque: noise.and_then(|n| n.torque_std),
            position_factor: None,
        },
        ..FrictionOptions::default()
    };
    let inputs = FrictionInputs {
        robot: &setup.robot,
        joint: j,
        motions: &group.motions,
        narrower: &group.narrower,
        sensors: &sensors,
    };
    estimate(name, parameter_names, &prepared, Some(&inputs), &options).map_err(undetermined)
}

/// The user's starting values, where all five are given.
fn start_of(setup: &RobotSetup, joint: &str) -> Option<DoubleTanh> {
    let s = setup.file.friction.joint.get(joint)?;
    Some(DoubleTanh {
        viscous: s.viscous?,
        coulomb_1: s.coulomb_1?,
        coulomb_2: s.coulomb_2?,
        slope_1: s.slope_1?,
        slope_2: s.slope_2?,
    })
}

/// What a reader of the estimate should know.
fn joint_notes(found: &FrictionOfJoint) -> impl Iterator<Item = StageNote> {
    let e = &found.estimate;
    let mut out = Vec::new();
    if e.ending != IterationEnding::Converged {
        out.push(FrictionNote::NotConverged(e.ending));
    }
    out.extend(e.drives_at().map(|speed| FrictionNote::Drives { speed }));
    let (mean, bounds) = (e.nis.mean, [e.nis.lower_95, e.nis.upper_95]);
    if mean > bounds[1] {
        out.push(FrictionNote::NisAbove { mean, bounds });
    } else if mean < bounds[0] {
        out.push(FrictionNote::NisBelow { mean, bounds });
    }
    if e.widening > 1.5 {
        let factor = e.widening.sqrt();
        out.push(FrictionNote::Coloured { factor });
    }
    if e.coulomb_terms == 1 {
        out.push(FrictionNote::OneCoulombTerm);
    } else if e.cancels() {
        out.push(FrictionNote::TermsCancel {
            coulomb: [e.law.coulomb_1, e.law.coulomb_2],
            uncertainty: e.curve_uncertainty(),
        });
    }
    // the mean torque at constant speed took no part in the fit
    let missed = e.missed_plateaus();
    if !missed.is_empty() {
        out.push(FrictionNote::MissedPlateaus(missed));
    }
    let settled = e.ending == IterationEnding::Converged;
    for (k, value) in e.values.iter().enumerate() {
        let parameter = DoubleTanh::NAMES[k];
        match value.verdict {
            Verdict::LowerBound => out.push(FrictionNote::LowerBound {
                parameter,
                above: value.value,
            }),
            Verdict::NotIdentifiable if settled && !e.one_term_lacks(k) => {
                out.push(FrictionNote::NotDetermined { parameter });
            }
            Verdict::NotIdentifiable | Verdict::Identified | Verdict::Weak => {}
        }
    }
    let joint = found.joint.clone();
    out.into_iter().map(move |note| StageNote::Friction {
        joint: joint.clone(),
        note,
    })
}

/// The parameters of a joint as a model file holds them; a slope with a bound keeps its likeliest value.
fn file_parameters(found: &FrictionOfJoint) -> Vec<Parameter> {
    let e = &found.estimate;
    let law = e.law.parameters();
    let each = found.parameters.each().into_iter().enumerate();
    each.map(|(k, (name, p))| {
        let v = &e.values[k];
        let mut meaning = friction_meaning(name).to_owned();
        if v.verdict == Verdict::LowerBound {
            meaning += &format!(
                "; only known to be above {} (95 %)",
                number::significant(v.value, 3)
            );
        }
        Parameter {
            name: name.to_owned(),
            theta: p.theta,
            joint: Some(found.joint.clone()),
            value: law[k],
            consistent: None,
            std: v.std.is_finite().then_some(v.std),
            unit: p.unit.clone(),
            meaning,
            verdict: Some(v.verdict),
        }
    })
    .collect()
}

impl IdentifiedFriction {
    /// The model of these joints, with all that `old` has of the others and their inertias, where there is one.
    pub fn model(&self, setup: &RobotSetup, old: Option<&ModelFile>) -> ModelFile {
        let mut model = new_model(setup, "friction", &self.inputs);
        if let Some(old) = old {
            model.parameters.clone_from(&old.parameters);
            model.covariance.clone_from(&old.covariance);
            model.residual_std.clone_from(&old.residual_std);
            model.friction_prior.clone_from(&old.friction_prior);
            model.effects.clone_from(&old.effects);
        }
        self.write_into(&mut model);
        model
    }

    /// Writes the estimates into a model, in place of what it has of these joints.
    pub fn write_into(&self, model: &mut ModelFile) {
        for found in &self.joints {
            let joint = &found.joint;
            model.replace_joint(joint, file_parameters(found));
            let keys: Vec<String> = DoubleTanh::NAMES
                .iter()
                .map(|n| format!("{n}:{joint}"))
                .collect();
            model.replace_covariance(&keys, &|a, b| found.estimate.covariance[a][b]);
            model.friction_prior.retain(|prior| prior.joint != *joint);
            model.friction_prior.push(FrictionPrior {
                joint: joint.clone(),
                speeds_covered: Some(found.estimate.speeds.covered),
                values: None,
                covariance: None,
                logs: found.logs.clone(),
                refined_by: Vec::new(),
            });
        }
    }
}
