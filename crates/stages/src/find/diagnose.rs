//! What the torque residual still holds, and the effects behind it.

use std::sync::{Mutex, MutexGuard, PoisonError};

use cft_ident_core::explain::Explain;
use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;

use crate::fit::contact::contacts;
use crate::fit::known_friction::before_these;
use crate::fit::own_fit::{OwnFit, OwnRefit};
use crate::fit::prior::{information, moved_alone, open};
use crate::fit::without_load::without_load;
use crate::held_out::hold_out::{Held, hold_out, or_note};
use crate::held_out::open_loop::spoiled;
use crate::input::control::{Control, Progress};
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::error_kind::ErrorKind;
use crate::input::in_memory::{InMemory, read_each};
use crate::input::log_data::LogData;
use crate::input::model::{own_laws, refined};
use crate::input::position_cutoff::known;
use crate::input::repeated::{each_row_once, identities, unseen_by};
use crate::input::robot_setup::RobotSetup;
use crate::input::temperatures;
use crate::note::StageNote;
use crate::open_loop::FreeRun;
use crate::setup::{Finding, FindingKind};
use cft_ident_core::diagnose::{
    self, DiagnoseError, Diagnosis, DiagnosisCase, DiagnosisOptions, DiagnosisProgress,
    DiagnosisWatch, FORMULA_NUMBERS, LogRole, ModelProposal, PREDICTION_NUMBERS, ParameterPrior,
};
use cft_ident_core::effect::{self, AugmentedModel};
use cft_ident_core::judge::NUMBERS;
use cft_ident_core::motion::ParallelFilters;
use cft_ident_core::robot::drive::JointDrive;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::candidates::CandidateSection;
use cft_ident_files::config::model_file::{FrictionPrior, Parameter};
use cft_ident_logs::log::DataRole;

/// How effects are looked for that a model lacks.
#[derive(Debug, Clone)]
pub struct DiagnoseSettings<'a> {
    pub model: &'a GivenModel,
    /// The inertial parameters of the given model stay: finds payload, gain and tilt.
    pub keep: bool,
    /// What the user asks for besides.
    pub wishes: DiagnosisOptions,
    /// Effects of the user's own, tried beside those that are known.
    pub candidates: Vec<CandidateSection>,
    /// The friction of the given model stays as it is; its covariance is in the deviations of the others.
    pub hold_friction: bool,
}

/// What the stage ends with.
pub enum DiagnoseEnd {
    /// A diagnosis.
    Diagnosed(Box<Diagnosed>),
    /// A fault of the data, which comes before any physics.
    DataFault(DataFault),
}

/// What `diagnose` found.
pub struct Diagnosed {
    pub diagnosis: Diagnosis,
    /// The logs that it looked at.
    pub in_memory: InMemory,
    /// Names of the logs, in order: fitted, holdout.
    pub logs: Vec<String>,
    /// Stretches in which something may push the robot, one note each.
    pub contacts: Vec<StageNote>,
    /// The given model as torques are computed with it.
    pub given: AugmentedModel,
    /// The declared numbers as they would be written, without the effects; none where the given model stays.
    pub(crate) fitted: Option<ModelFile>,
    /// They are those of `lsq` beside the effects.
    pub(crate) by_lsq: bool,
    /// What the refined model leaves of data set aside.
    pub held: Held,
    /// The motion that the models make of measured torques on held-out data, or on all where there are none.
    pub free_run: Option<FreeRun>,
    /// What a refined model keeps of the friction before these logs.
    pub(crate) friction_prior: Vec<FrictionPrior>,
    /// Effects of the user's own that were tried.
    pub(crate) candidates: Vec<CandidateSection>,
    /// The friction was held.
    pub(crate) hold_friction: bool,
    /// Formulas were looked for.
    pub searched: bool,
    pub filters: ParallelFilters,
    pub cutoff_hz: f64,
}

/// A fault of the data.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DataFault {
    pub kind: String,
    pub channel: Option<String>,
    pub effect: String,
    pub remedy: String,
}

impl<'a> DiagnoseSettings<'a> {
    /// What is looked for where the user asks for nothing else.
    pub fn of(model: &'a GivenModel) -> Self {
        DiagnoseSettings {
            model,
            keep: false,
            wishes: DiagnosisOptions::default(),
            candidates: Vec::new(),
            hold_friction: false,
        }
    }

    /// Why no model comes out beside the effects: by the names of those that the user wants, where there are any.
    fn refused(&self, error: IdentifyError) -> IdentifyError {
        let wanted: Vec<String> = (self.wishes.accepted.iter())
            .map(ToString::to_string)
            .collect();
        if wanted.is_empty() || error.kind() != ErrorKind::Undetermined {
            return error;
        }
        IdentifyError::Diagnose(DiagnoseError::Accept {
            name: wanted.join(" and "),
            why: error.explanation(),
        })
    }

    /// Refuses effects of a user's own that cannot be tried beside the model.
    ///
    /// # Errors
    /// Formulas that are none on this robot, and a name that the model has for another effect.
    pub fn check_candidates(&self, setup: &RobotSetup) -> Result<(), IdentifyError> {
        own_laws(&self.candidates, &setup.robot)?;
        let other = |own: &&CandidateSection| {
            let mut known = self.model.file.candidates.iter();
            known.any(|known| known.name == own.name && known != *own)
        };
        match self.candidates.iter().find(other) {
            Some(own) => Err(IdentifyError::CandidateOfModel {
                name: own.name.clone(),
                model: self.model.name.clone(),
            }),
            None => Ok(()),
        }
    }
}

/// Diagnoses a model on logs; without held-out ones, blocks of the others are set aside.
///
/// # Errors
/// Logs or a model that cannot be used, and logs too short to look for effects.
pub fn diagnose(
    data: &Dataset,
    settings: &DiagnoseSettings,
    control: &Control,
) -> Result<DiagnoseEnd, IdentifyError> {
    data.check_rows()?;
    let (name, as_given) = (settings.model.name.as_str(), &settings.model.file);
    // what is looked for stands beside the plain fit
    let plain = as_given.as_fitted();
    let file = &plain;
    let given = refined(file, name)?;
    settings.check_candidates(&data.setup)?;
    let judged = |p: &&Parameter| p.std.is_some() && p.verdict.is_some();
    let mut judged = file.parameters.iter().filter(judged).peekable();
    let determined = |p: &Parameter| matches!(p.verdict, Some(Verdict::Identified | Verdict::Weak));
    if judged.peek().is_some() && !judged.any(determined) {
        return Err(IdentifyError::NothingIdentified {
            model: name.to_owned(),
        });
    }
    if let Some(fault) = without_gains(&data.setup).or(refused(&data.logs)?) {
        return Ok(DiagnoseEnd::DataFault(fault));
    }
    // what a load does to a part of a log looks like a course over time
    let unloaded = without_load(data, settings.model, control)?;
    let (data, loads) = (&unloaded.data, unloaded.notes);
    let setup = &data.setup;
    let holdout = ("holdout", identities(&data.held_out));
    each_row_once(&[("fit", identities(&data.logs)), holdout])?;
    let groups = [
        (&data.logs, LogRole::Train),
        (&data.held_out, LogRole::Holdout),
    ];
    let roles = |(logs, role): &(&Vec<LogData>, LogRole)| vec![*role; logs.len()];
    let roles: Vec<LogRole> = groups.iter().flat_map(roles).collect();
    let all = [&*data.logs, &data.held_out].concat();
    let laws = known(&given.model);
    let together = setup.with_position_cutoffs(&all, &laws, control)?;
    let each = setup.settings_of_each(&all, &laws, &together, control)?;
    let setup = &together;
    let mut in_memory = read_each(setup, &each, &all, control)?;
    let contact = contacts(setup, &data.logs, control)?;
    unseen_by((name, as_given), &in_memory.inputs[data.logs.len()..])?;
    in_memory
        .notes
        .splice(0..0, loads.into_iter().chain(contact.iter().cloned()));
    let mut taken = temperatures::of_model(&given);
    taken.extend(temperatures::of_laws(&own_laws(
        &settings.candidates,
        &setup.robot,
    )?));
    setup.check_taken(&taken, &all, &in_memory.stretches)?;
    let fitted = match settings.keep {
        true => &[],
        false => &in_memory.inputs[..data.logs.len()],
    };
    let (before, friction_prior) = match settings.hold_friction {
        true => (file.clone(), file.friction_prior.clone()),
        false => before_these((name, file), fitted)?,
    };
    let fitted = data.logs.len();
    for (at, input) in in_memory.inputs.iter_mut().enumerate() {
        input.role = Some(match at {
            at if at < fitted => DataRole::Fitted,
            _ => DataRole::HeldOut,
        });
    }
    let mut case = case(
        setup,
        (name, file, &before),
        given,
        &mut in_memory,
        (roles, settings),
    )?;
    let work = control.begin("search for effects", None);
    let tell = |heard: DiagnosisProgress| {
        control.report(match heard {
            DiagnosisProgress::Begin(part, steps) => Progress::Begin(part, Some(steps)),
            DiagnosisProgress::Step => Progress::Advance(1),
            DiagnosisProgress::End => Progress::End,
        });
    };
    let watch = DiagnosisWatch {
        tell: &tell,
        stop: &|| control.stopped(),
    };
    let own = OwnFit::of(
        (settings.model, &before),
        &case.given.model.friction,
        &in_memory.inputs[..data.logs.len()],
        (settings.keep, settings.hold_friction),
    );
    let unknowns = case.unknowns();
    let refitting = OwnRefit {
        setup: &data.setup,
        given: settings.model,
        logs: &data.logs,
        stretches: &case.stretches,
        unknowns: &unknowns.list,
        hold_friction: settings.hold_friction,
        own,
        control: control.clone(),
    };
    let files: Mutex<Vec<(AugmentedModel, ModelFile)>> = Mutex::default();
    let failed: Mutex<Option<IdentifyError>> = Mutex::default();
    let refit = |proposal: &ModelProposal| {
        let made = match proposal.numbers_of {
            Some(effects) => {
                let files = lock(&files);
                let base = files.iter().rfind(|(model, _)| model.effects == effects);
                let base = base.map_or((&case.given, as_given), |(model, file)| (model, file));
                Ok(refitting.moved(base, proposal.model))
            }
            None => refitting.file(proposal),
        };
        let made = made.and_then(|file| {
            let mut in_use = refined(&file, name)?;
            in_use.effects.clone_from(&proposal.model.effects);
            lock(&files).push((proposal.model.clone(), file));
            Ok(in_use)
        });
        made.map_err(|error| {
            *lock(&failed) = Some(error);
            DiagnoseError::Refit
        })
    };
    let found = diagnose::diagnose(&case, &refit, watch);
    drop(work);
    let diagnosis = match (found, lock(&failed).take()) {
        (Ok(diagnosis), _) => diagnosis,
        (Err(DiagnoseError::Interrupted), _) => return Err(IdentifyError::Interrupted),
        (Err(_), Some(error)) => return Err(settings.refused(error)),
        (Err(error), None) => return Err(IdentifyError::Diagnose(error)),
    };
    let by_lsq = refitting.own.is_some();
    let mut files = std::mem::take(&mut *lock(&files));
    files.retain(|(model, _)| model.effects == diagnosis.model.effects);
    let added = diagnosis.changes_model();
    let fitted = files.pop().map(|(_, file)| file).filter(|_| added);
    in_memory.stretches = std::mem::take(&mut case.stretches);
    let logs: Vec<String> = all.iter().map(LogData::name).collect();
    for aside in &diagnosis.set_aside {
        control.note(&format!(
            "{}: {:.2}..{:.2} s set aside as the holdout",
            logs[aside.log], aside.from_s, aside.to_s
        ));
    }
    let mut found = Diagnosed {
        diagnosis,
        in_memory,
        logs,
        contacts: contact,
        given: case.in_use.clone(),
        fitted,
        by_lsq,
        held: Held::default(),
        free_run: None,
        friction_prior,
        candidates: settings.candidates.clone(),
        hold_friction: settings.hold_friction,
        searched: settings.wishes.search,
        filters: case.filters.clone(),
        cutoff_hz: case.cutoff_hz,
    };
    if found.fitted.is_some() {
        let refined = found.model(setup, as_given);
        let tried = hold_out(
            setup,
            (&refined, &found.diagnosis.in_use),
            (&data.logs, &found.in_memory.inputs),
            control,
        );
        found.held = or_note(tried, &mut found.in_memory.notes)?;
    }
    let _work = control.begin("free run", None);
    found.free_run = found.run_freely(setup, (name, as_given))?;
    let spoiled = found.free_run.as_ref().and_then(spoiled);
    found.in_memory.notes.extend(spoiled);
    Ok(DiagnoseEnd::Diagnosed(Box::new(found)))
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Channels that are no torques, as a fault: gains that differ look like friction and loads.
fn without_gains(setup: &RobotSetup) -> Option<DataFault> {
    let problem = setup.check_gains().err()?.explanation();
    Some(DataFault {
        kind: "gains".to_owned(),
        channel: Some("torque".to_owned()),
        effect: problem.what,
        remedy: problem.remedies.join("; "),
    })
}

/// The first fault for which a fit refuses one of the logs.
fn refused(logs: &[LogData]) -> Result<Option<DataFault>, IdentifyError> {
    for log in logs {
        if let Some(fault) = log.recording().inspection.refusal().cloned() {
            return Ok(Some(DataFault {
                kind: fault.kind.word().to_owned(),
                channel: fault.channel,
                effect: format!("{}: {}", log.name(), fault.effect),
                remedy: fault.remedy,
            }));
        }
    }
    Ok(None)
}

/// How many times as firm as its covariance a friction that is held stands against the data.
const HELD_FIRMNESS: f64 = 1e6;

/// What the search is about; `before` is the model with the friction that is known without these logs.
fn case(
    setup: &RobotSetup,
    (name, file, before): (&str, &ModelFile, &ModelFile),
    given: AugmentedModel,
    in_memory: &mut InMemory,
    (roles, settings): (Vec<LogRole>, &DiagnoseSettings),
) -> Result<DiagnosisCase, IdentifyError> {
    let processing = setup.settings();
    let filters = ParallelFilters::design(&processing, &in_memory.stretches)
        .map_err(|error| IdentifyError::motion(name, error))?;
    let hold = settings.hold_friction;
    let open = open(setup, file, &given, hold);
    let rate = filters.row_rate_hz();
    let alone = moved_alone(&given, &in_memory.stretches, &roles);
    let prior = ParameterPrior {
        information: information(before, &given, &open, hold, &alone),
        centre: refined(before, name)?,
        rows_per_independent: (rate / (2.0 * processing.cutoff_hz)).max(1.0),
        // what is held is known so many times better than these data can say; its own spread stays that of its covariance
        firmness: if hold { HELD_FIRMNESS } else { 1.0 },
    };
    let kept = settings.keep.then(|| {
        let size = given.model.parameters();
        let moments = DMatrix::from_row_slice(size, size, &file.model_covariance(&given.model));
        let inertial = given.model.theta.len();
        moments.view((0, 0), (inertial, inertial)).into_owned()
    });
    Ok(DiagnosisCase {
        in_use: refined(&settings.model.file, name)?,
        given,
        prior,
        open,
        stretches: std::mem::take(&mut in_memory.stretches),
        roles,
        filters,
        cutoff_hz: processing.cutoff_hz,
        rest_speed: in_memory.rest_speed.clone(),
        drives: drives(setup),
        units: (0..setup.robot.joints())
            .map(|j| setup.file.torque_unit(j).to_owned())
            .collect(),
        averaged: in_memory.averaged,
        kept,
        own: own_laws(&settings.candidates, &setup.robot)?,
        wishes: settings.wishes.clone(),
        numbers: NUMBERS,
        formula: FORMULA_NUMBERS,
        prediction: PREDICTION_NUMBERS,
    })
}

/// The drives that the robot file declares, joint by joint.
fn drives(setup: &RobotSetup) -> Vec<JointDrive> {
    let names = setup.robot.joint_names().iter();
    let declared = names.map(|name| setup.file.drive.get(name).cloned());
    declared.map(Option::unwrap_or_default).collect()
}

impl DataFault {
    /// A set-up that the torques contradict, as a fault of the data.
    pub fn of_setup(finding: &Finding) -> Self {
        let kind = match finding.kind {
            FindingKind::Sign | FindingKind::Order => effect::wrong_sign_or_order::ENTRY.name,
            other => other.word(),
        };
        let decided = finding.decided().map(|by| format!("; decided by: {by}"));
        Self {
            kind: kind.to_owned(),
            channel: finding.joint.clone(),
            effect: finding.meaning.clone(),
            remedy: format!("write {}{}", finding.remedy, decided.unwrap_or_default()),
        }
    }
}
