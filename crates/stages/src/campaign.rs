//! The whole way: friction of single joints, inertias, validation, and what the model lacks.

use crate::find::diagnose::{DiagnoseEnd, DiagnoseSettings, diagnose};
use crate::fit::dynamics::IdentifiedDynamics;
use crate::fit::friction::{FrictionSettings, IdentifiedFriction, friction};
use crate::fit::lsq::lsq;
use crate::fit::lsq_problem::LsqSettings;
use crate::held_out::validate::{ValidateSettings, Validated, validate};
use crate::input::control::Control;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::error_kind::ErrorKind;
use crate::input::model::new_model;
use crate::input::repeated::{each_row_once, identities, without_rows_of};
use crate::note::StageNote;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_logs::log::{DataRole, Provenance};

/// How a campaign is run.
#[derive(Debug, Clone, Default)]
pub struct IdentifySettings {
    /// Estimator of the inertial parameters.
    pub estimator: EstimatorKind,
    /// Physically consistent parameters beside those of the plain fit.
    pub consistent: bool,
    /// The friction of the one-joint logs stays as it is.
    pub hold_friction: bool,
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
    pub notes: Vec<StageNote>,
}

/// Runs a campaign; without one-joint logs friction is fitted with the inertias. Friction is fitted again beside an effect, so the diagnosis has the one-joint logs
/// too; the validation logs are held out of it. `ended` receives each stage's result as it is there,
/// so that what was finished can be kept whatever follows.
pub fn identify<E: From<IdentifyError>>(
    data: &Dataset,
    settings: &IdentifySettings,
    control: &Control,
    ended: &mut dyn FnMut(StageEnd) -> Result<(), E>,
) -> Result<Campaigned, E> {
    data.check_rows()?;
    let setup = &data.setup;
    // a one-joint log may serve both fits, but no log of a fit the validation
    for (role, fitted) in [
        ("friction", &data.one_joint),
        ("identification", &data.logs),
    ] {
        let validation = ("validation", identities(&data.held_out));
        each_row_once(&[(role, identities(fitted)), validation])?;
    }
    let (mut inputs, mut notes) = (Vec::new(), Vec::new());
    let mut keep = |from: &[Provenance], noted: &[StageNote], role: DataRole| {
        inputs.extend(from.iter().cloned().map(|input| input.used_as(role)));
        notes.extend_from_slice(noted);
    };
    let known = match data.one_joint.as_slice() {
        [] => None,
        some => {
            let alone = Dataset::new(setup, some);
            let found = friction(&alone, &FrictionSettings::default(), control)?;
            let mut model = new_model(setup, "identify", &found.inputs);
            found.write_into(&mut model);
            ended(StageEnd::Friction(&found, &model))?;
            keep(&found.inputs, &found.notes, DataRole::Fitted);
            Some((found, GivenModel::new("friction.toml", model)))
        }
    };
    let of_friction = known.as_ref().map(|(_, given)| given);
    let lsq_settings = LsqSettings {
        estimator: settings.estimator,
        consistent: settings.consistent,
        friction: of_friction,
        hold_friction: settings.hold_friction,
        ..LsqSettings::default()
    };
    let dynamics = lsq(data, &lsq_settings, control)?;
    let model = dynamics.model(setup, of_friction.map(|given| &given.file));
    let given = GivenModel::new("model.toml", model);
    ended(StageEnd::Dynamics(&dynamics, &given.file))?;
    keep(&dynamics.inputs, &dynamics.notes, DataRole::Fitted);
    let numbers = given.numbers()?;
    let mut validated = None;
    if !data.held_out.is_empty() {
        let unseen = Dataset::new(setup, &data.held_out);
        let settings = ValidateSettings::of(&given);
        let found = validate(&unseen, &settings, control, &mut |_, _| {})?;
        ended(StageEnd::Validated(&found))?;
        keep(&found.inputs, &found.notes, DataRole::HeldOut);
        validated = Some(found);
    }
    let one_joint = without_rows_of(&data.one_joint, &data.logs);
    let train = [data.logs.as_slice(), &one_joint].concat();
    let roles = Dataset::new(setup, &train).with_held_out(&data.held_out);
    let diagnosed = diagnose(&roles, &DiagnoseSettings::of(&given), control);
    let refined = match &diagnosed {
        Ok(DiagnoseEnd::Diagnosed(found)) if found.diagnosis.changes_model() => {
            let refined = found.model(setup, &given.file);
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
        friction: known.map(|(found, given)| (found, given.file)),
        dynamics,
        model: given.file,
        numbers,
        validated,
        diagnosed,
        refined,
        inputs,
        notes,
    })
}
