//! The whole way: friction of single joints, inertias, validation, and what the model lacks.

use super::control::Control;
use super::diagnose::{DiagnoseEnd, DiagnoseLogs, DiagnoseSettings, diagnose};
use super::error::IdentifyError;
use super::error_kind::ErrorKind;
use super::friction::{FrictionSettings, IdentifiedFriction, friction};
use super::log::Log;
use super::logged_robot::LoggedRobot;
use super::lsq::{IdentifiedDynamics, LsqSettings, lsq};
use super::model::{new_model, refined};
use super::repeated::{each_row_once, without_rows_of};
use super::validate::{Validated, validate};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_logs::log::{DataRole, Provenance};

/// Logs by role.
#[derive(Debug, Clone, Default)]
pub struct RoleLogs {
    /// One-joint logs for the friction filter; without any, friction is fitted with the inertias.
    pub friction: Vec<Log>,
    /// Logs that the inertial parameters are fitted to.
    pub identification: Vec<Log>,
    /// Held-out logs: what the model is tried on.
    pub validation: Vec<Log>,
}

/// How a campaign is run.
#[derive(Debug, Clone, Default)]
pub struct IdentifySettings {
    /// Estimator of the inertial parameters.
    pub estimator: EstimatorKind,
    /// Physically consistent parameters beside those of the plain fit.
    pub consistent: bool,
    /// The friction of the one-joint logs stays as it is.
    pub hold_friction: bool,
    /// How effects are looked for.
    pub diagnose: DiagnoseSettings,
}

/// A stage of a campaign that has ended, with the model that it leaves.
pub enum StageEnd<'a> {
    Friction(&'a IdentifiedFriction, &'a ModelFile),
    Dynamics(&'a IdentifiedDynamics, &'a ModelFile),
    Validated(&'a Validated),
    /// The model with the effects that it lacked.
    Refined(&'a ModelFile),
}

/// What a campaign found.
pub struct Campaigned {
    /// Friction of single joints and the model of it alone, where there are logs of it.
    pub friction: Option<(IdentifiedFriction, ModelFile)>,
    pub dynamics: IdentifiedDynamics,
    /// The model as it was declared.
    pub model: ModelFile,
    /// The same as numbers.
    pub numbers: AugmentedModel,
    /// Absent where there is no validation log.
    pub validated: Option<Validated>,
    /// What the model lacks; an error where the logs are too short to look for effects.
    pub diagnosed: Result<DiagnoseEnd, IdentifyError>,
    /// The model with the effects that were found, where there are some.
    pub refined: Option<ModelFile>,
    pub inputs: Vec<Provenance>,
    pub warnings: Vec<String>,
}

/// Runs a campaign. Friction is fitted again beside an effect, so the diagnosis has the one-joint logs
/// too; the validation logs are held out of it. `ended` receives each stage's result as it is there,
/// so that what was finished can be kept whatever follows.
pub fn identify<E: From<IdentifyError>>(
    machine: &LoggedRobot,
    logs: &RoleLogs,
    settings: &IdentifySettings,
    control: &Control,
    ended: &mut dyn FnMut(StageEnd) -> Result<(), E>,
) -> Result<Campaigned, E> {
    // a one-joint log may serve both fits, but no log of a fit the validation
    let validation = ("validation", logs.validation.as_slice());
    for (role, fitted) in [
        ("friction", &logs.friction),
        ("identification", &logs.identification),
    ] {
        each_row_once(machine, &[(role, fitted), validation])?;
    }
    let (mut inputs, mut warnings) = (Vec::new(), Vec::new());
    let mut keep = |from: &[Provenance], shown: &[String], role: DataRole| {
        inputs.extend(from.iter().cloned().map(|input| input.used_as(role)));
        warnings.extend_from_slice(shown);
    };
    let known = match logs.friction.as_slice() {
        [] => None,
        some => {
            let found = friction(machine, some, &FrictionSettings::default(), control)?;
            let mut model = new_model(machine, "identify", &found.inputs);
            found.write_into(&mut model);
            ended(StageEnd::Friction(&found, &model))?;
            keep(&found.inputs, &found.warnings, DataRole::Fitted);
            Some((found, model))
        }
    };
    let of_friction = known.as_ref().map(|(_, model)| model);
    let lsq_settings = LsqSettings {
        estimator: settings.estimator,
        consistent: settings.consistent,
        friction: of_friction.map(|model| ("friction.toml", model)),
        hold_friction: settings.hold_friction,
        gains: None,
    };
    let dynamics = lsq(machine, &logs.identification, &lsq_settings, control)?;
    let model = dynamics.model(machine, of_friction);
    ended(StageEnd::Dynamics(&dynamics, &model))?;
    keep(&dynamics.inputs, &dynamics.warnings, DataRole::Fitted);
    let numbers = refined(&model, "model.toml")?;
    let mut validated = None;
    if !logs.validation.is_empty() {
        let given = (&numbers, Some(&model));
        let found = validate(machine, given, &logs.validation, control, &mut |_, _| {})?;
        ended(StageEnd::Validated(&found))?;
        keep(&found.inputs, &found.warnings, DataRole::HeldOut);
        validated = Some(found);
    }
    let one_joint = without_rows_of(machine, &logs.friction, &logs.identification);
    let train = [logs.identification.as_slice(), &one_joint].concat();
    let roles = DiagnoseLogs {
        train: &train,
        veto: &[],
        holdout: &logs.validation,
    };
    let given = ("model.toml", &model);
    let diagnosed = diagnose(machine, given, &roles, &settings.diagnose, control);
    let refined = match &diagnosed {
        Ok(DiagnoseEnd::Diagnosed(found)) if found.diagnosis.written().next().is_some() => {
            let refined = found.model(machine, &model);
            ended(StageEnd::Refined(&refined))?;
            Some(refined)
        }
        _ => None,
    };
    // logs too short to look for effects are no reason to lose the fit
    let diagnosed = match diagnosed {
        Err(error) if error.kind() != ErrorKind::Undetermined => return Err(error.into()),
        ended => ended,
    };
    Ok(Campaigned {
        friction: known,
        dynamics,
        model,
        numbers,
        validated,
        diagnosed,
        refined,
        inputs,
        warnings,
    })
}
