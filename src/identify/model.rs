//! Between model files and models with effects.

use std::collections::BTreeMap;

use super::error::IdentifyError;
use super::logged_robot::LoggedRobot;
use crate::config::ModelFile;
use crate::config::model_file::{Effect, EffectParameter, ModelProvenance};
use crate::effect::{self, Added, AugmentedModel, EffectNumber};
use crate::log::{DataRole, Provenance};
use crate::robot::model::Model;

/// The model of a file with its effects; `name` names the file in errors.
///
/// # Errors
/// A file that lacks a parameter, or an effect that cannot be.
pub fn refined(file: &ModelFile, name: &str) -> Result<AugmentedModel, IdentifyError> {
    with_effects(file, name, file.model(name)?)
}

/// The same of a file that may hold friction alone, with inertias of 0 then: for what asks for no torque.
///
/// # Errors
/// Those of [`refined`].
pub fn refined_or_friction(file: &ModelFile, name: &str) -> Result<AugmentedModel, IdentifyError> {
    with_effects(file, name, file.model_or_friction(name)?)
}

fn with_effects(
    file: &ModelFile,
    name: &str,
    model: Model,
) -> Result<AugmentedModel, IdentifyError> {
    let effects = file.effects.iter().map(|e| {
        let values = e.parameters.iter().map(|(k, p)| (k.clone(), p.value));
        effect::read(&model.robot, &e.name, e.joint.as_deref(), &values.collect()).map_err(
            |error| IdentifyError::Effect {
                model: name.to_owned(),
                error,
            },
        )
    });
    let effects = effects.collect::<Result<_, _>>()?;
    Ok(AugmentedModel { model, effects })
}

/// An effect as a model file holds it.
pub(super) fn in_file(effect: &Added, machine: &LoggedRobot, told: &[EffectNumber]) -> Effect {
    Effect {
        name: effect.name().to_owned(),
        joint: effect.place.name(&machine.robot),
        parameters: told
            .iter()
            .map(|t| {
                let parameter = EffectParameter {
                    value: t.value,
                    std: t.std,
                    unit: t.unit.clone(),
                };
                (t.key.clone(), parameter)
            })
            .collect(),
    }
}

/// An empty model of the robot.
pub fn new_model(machine: &LoggedRobot, command: &str, inputs: &[Provenance]) -> ModelFile {
    ModelFile {
        robot: machine.file.clone(),
        parameters: Vec::new(),
        covariance: None,
        residual_std: BTreeMap::new(),
        friction_prior: Vec::new(),
        held_out: Vec::new(),
        excesses: None,
        effects: Vec::new(),
        links: Vec::new(),
        drive_inertia: BTreeMap::new(),
        provenance: ModelProvenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
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
