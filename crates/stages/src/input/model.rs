//! Between model files and models with effects.

use std::collections::BTreeMap;

use super::error::IdentifyError;
use super::robot_setup::RobotSetup;
use cft_ident_core::effect::{self, AugmentedModel, EffectNumber, Law, ModelEffect, formula, own};
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::model::Model;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::candidates::CandidateSection;
use cft_ident_files::config::model_file::{EffectParameter, EffectSection, ModelProvenance};
use cft_ident_logs::log::{DataRole, Provenance};

/// The model of a file with its effects; `name` names the file in errors.
///
/// # Errors
/// A file that lacks a parameter, or an effect that cannot be.
pub fn refined(file: &ModelFile, name: &str) -> Result<AugmentedModel, IdentifyError> {
    with_effects(file, name, file.model(name)?)
}

/// The same of a file that may hold friction alone, with inertias of 0 then: for what asks for no torque.
pub fn refined_or_friction(file: &ModelFile, name: &str) -> Result<AugmentedModel, IdentifyError> {
    with_effects(file, name, file.model_or_friction(name)?)
}

fn with_effects(
    file: &ModelFile,
    name: &str,
    model: Model,
) -> Result<AugmentedModel, IdentifyError> {
    let own = own_laws(&file.candidates, &model.robot)?;
    let effects = file.effects.iter().map(|e| {
        let values = e.parameters.iter().map(|(k, p)| (k.clone(), p.value));
        let (joint, values) = (e.joint.as_deref(), values.collect());
        let bound = |key: &str| e.parameters.get(key).is_some_and(|p| p.bound);
        let read = match own.iter().find(|law| law.entry.name == e.name) {
            Some(law) => effect::read_as(law, &model.robot, joint, &values),
            None => effect::read(&model.robot, &e.name, joint, &values),
        };
        let mut added = read.map_err(|error| IdentifyError::Effect {
            model: name.to_owned(),
            error,
        })?;
        added.hold(&bound);
        Ok(added)
    });
    let effects = effects.collect::<Result<_, IdentifyError>>()?;
    Ok(AugmentedModel { model, effects })
}

/// The laws of a user's own effects on a robot.
pub(crate) fn own_laws(
    candidates: &[CandidateSection],
    robot: &Robot,
) -> Result<Vec<&'static Law>, IdentifyError> {
    let of = |candidate: &CandidateSection| {
        let unit = |name: &String| candidate.units.get(name).cloned().unwrap_or_default();
        let coefficients = candidate.formulas.iter();
        let shapes = candidate
            .shapes
            .iter()
            .map(|(name, range)| formula::FormulaShape {
                name: name.clone(),
                unit: range.unit.clone(),
                range: [range.from, range.to],
            });
        let definition = formula::FormulaDefinition {
            name: candidate.name.clone(),
            joints: candidate.joints.clone(),
            coefficients: coefficients
                .map(|(name, formula)| [name.clone(), unit(name), formula.clone()])
                .collect(),
            shapes: shapes.collect(),
            friction: candidate.friction,
            at_rest: candidate.at_rest,
            meaning: candidate.meaning.clone(),
        };
        own::law(&definition, robot).map_err(IdentifyError::Formula)
    };
    candidates.iter().map(of).collect()
}

/// An effect as a model file holds it.
pub(crate) fn in_file(
    effect: &ModelEffect,
    setup: &RobotSetup,
    numbers: &[EffectNumber],
) -> EffectSection {
    EffectSection {
        name: effect.name().to_owned(),
        joint: effect.place.name(&setup.robot),
        shrinkage: None,
        accepted_by_user: false,
        prediction_only: false,
        parameters: numbers
            .iter()
            .map(|t| {
                let parameter = EffectParameter {
                    value: t.value,
                    std: t.std,
                    unit: t.unit.clone(),
                    bound: t.bound,
                };
                (t.key.clone(), parameter)
            })
            .collect(),
    }
}

/// An empty model of the robot.
pub fn new_model(setup: &RobotSetup, command: &str, inputs: &[Provenance]) -> ModelFile {
    ModelFile {
        robot: setup.file.clone(),
        parameters: Vec::new(),
        covariance: None,
        residual_std: BTreeMap::new(),
        friction_prior: Vec::new(),
        held_out: Vec::new(),
        excesses: None,
        candidates: Vec::new(),
        effects: Vec::new(),
        estimates: Vec::new(),
        estimate_covariance: None,
        links: Vec::new(),
        drive_inertia: BTreeMap::new(),
        provenance: ModelProvenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            estimator: None,
            as_declared: setup.as_declared,
            seed: None,
            inputs: inputs
                .iter()
                .cloned()
                .map(|input| match input.role {
                    None => input.used_as(DataRole::Fitted),
                    Some(_) => input,
                })
                .collect(),
        },
    }
}
