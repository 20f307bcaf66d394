//! What the torque residual still holds, and the effects behind it.

use schemars::JsonSchema;
use serde::Serialize;

use super::consistent::project_by;
use super::contact::contacts;
use super::control::{Control, Progress};
use super::error::IdentifyError;
use super::hold_out::{Held, hold_out, or_warning};
use super::in_memory::{InMemory, read_each};
use super::known_friction::before_these;
use super::log::Log;
use super::logged_robot::LoggedRobot;
use super::model::{in_file, new_model, own_laws, refined};
use super::open_loop::{is_in_si, spoiled, whole};
use super::position_cutoff::known;
use super::prior::{information, moved_alone, open};
use super::repeated::each_row_once;
use super::temperatures;
use crate::open_loop::{FreeRun, Span, free_run};
use crate::setup::{Finding, FindingKind};
use cft_ident_core::diagnose::{
    self, Case, DiagnoseError, Diagnosis, FoundEffect, Heard, LogRole, ParameterPrior, Unknown,
    Watch, Wishes,
};
use cft_ident_core::effect::{self, AugmentedModel, EffectNumber};
use cft_ident_core::judge::NUMBERS;
use cft_ident_core::motion::{ParallelFilters, Stretch};
use cft_ident_core::robot::drive::JointDrive;
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::robot::model::JointFriction;
use cft_ident_core::verdict::{Verdict, verdict_of};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::candidates::CandidateSection;
use cft_ident_files::config::model_file::{Estimate, FrictionPrior, Parameter};
use cft_ident_logs::log::DataRole;

/// Logs by what they are for.
#[derive(Debug, Clone, Copy, Default)]
pub struct DiagnoseLogs<'a> {
    /// Fitted.
    pub train: &'a [Log],
    /// Judge what is added, and are never fitted.
    pub veto: &'a [Log],
    /// Evaluated once, after everything is decided; without any, blocks are set aside.
    pub holdout: &'a [Log],
}

/// How effects are looked for.
#[derive(Debug, Clone, Default)]
pub struct DiagnoseSettings {
    /// The inertial parameters of the given model stay: finds payload, gain and tilt.
    pub keep: bool,
    /// What the user asks for besides.
    pub wishes: Wishes,
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
    /// Names of the logs, in order: fitted, veto, holdout.
    pub logs: Vec<String>,
    /// The model as it was given.
    pub given: AugmentedModel,
    /// What the refined model leaves of data set aside.
    pub held: Held,
    /// The motion that the models make of measured torques on held-out data, or on all where there are none.
    pub free_run: Option<FreeRun>,
    /// What a refined model keeps of the friction before these logs.
    friction_prior: Vec<FrictionPrior>,
    /// Effects of the user's own that were tried.
    candidates: Vec<CandidateSection>,
    /// The friction was held.
    hold_friction: bool,
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

/// Refuses effects of a user's own that cannot be tried beside a model, whose file is called `name`.
///
/// # Errors
/// Formulas that are none on this robot, and a name that the model has for another effect.
pub fn check_candidates(
    candidates: &[CandidateSection],
    machine: &LoggedRobot,
    (name, file): (&str, &ModelFile),
) -> Result<(), IdentifyError> {
    own_laws(candidates, &machine.robot)?;
    let other = |own: &&CandidateSection| {
        let mut known = file.candidates.iter();
        known.any(|known| known.name == own.name && known != *own)
    };
    match candidates.iter().find(other) {
        Some(own) => Err(IdentifyError::CandidateOfModel {
            name: own.name.clone(),
            model: name.to_owned(),
        }),
        None => Ok(()),
    }
}

/// Diagnoses a model, whose file is called `name`, on logs.
///
/// # Errors
/// Logs or a model that cannot be used, and logs too short to look for effects.
pub fn diagnose(
    machine: &LoggedRobot,
    (name, file): (&str, &ModelFile),
    logs: &DiagnoseLogs,
    settings: &DiagnoseSettings,
    control: &Control,
) -> Result<DiagnoseEnd, IdentifyError> {
    // what is looked for stands beside the plain fit
    let (as_given, plain) = (file, file.as_fitted());
    let file = &plain;
    let given = refined(file, name)?;
    check_candidates(&settings.candidates, machine, (name, file))?;
    let judged = |p: &&Parameter| p.std.is_some() && p.verdict.is_some();
    let mut judged = file.parameters.iter().filter(judged).peekable();
    let determined = |p: &Parameter| matches!(p.verdict, Some(Verdict::Identified | Verdict::Weak));
    if judged.peek().is_some() && !judged.any(determined) {
        return Err(IdentifyError::NothingIdentified {
            model: name.to_owned(),
        });
    }
    if let Some(fault) = without_gains(machine).or(refused(machine, logs.train, control)?) {
        return Ok(DiagnoseEnd::DataFault(fault));
    }
    each_row_once(
        machine,
        &[
            ("fit", logs.train),
            ("veto", logs.veto),
            ("holdout", logs.holdout),
        ],
    )?;
    let groups = [
        (logs.train, LogRole::Train),
        (logs.veto, LogRole::Veto),
        (logs.holdout, LogRole::Holdout),
    ];
    let roles = |(logs, role): &(&[Log], LogRole)| vec![*role; logs.len()];
    let roles: Vec<LogRole> = groups.iter().flat_map(roles).collect();
    let all = [logs.train, logs.veto, logs.holdout].concat();
    let laws = known(&given.model);
    let together = machine.with_position_cutoffs(&all, &laws, control)?;
    let each = machine.settings_of_each(&all, &laws, &together, control)?;
    let machine = &together;
    let mut in_memory = read_each(machine, &each, &all, control)?;
    let contact = contacts(machine, logs.train, control)?;
    in_memory.warnings.splice(0..0, contact);
    let mut taken = temperatures::of_model(&given);
    taken.extend(temperatures::of_laws(&own_laws(
        &settings.candidates,
        &machine.robot,
    )?));
    machine.check_taken(&taken, &all, &in_memory.stretches)?;
    let fitted = match settings.keep {
        true => &[],
        false => &in_memory.inputs[..logs.train.len()],
    };
    let (before, friction_prior) = match settings.hold_friction {
        true => (file.clone(), file.friction_prior.clone()),
        false => before_these((name, file), fitted)?,
    };
    let (fitted, vetoed) = (logs.train.len(), logs.train.len() + logs.veto.len());
    for (at, input) in in_memory.inputs.iter_mut().enumerate() {
        input.role = Some(match at {
            at if at < fitted => DataRole::Fitted,
            at if at < vetoed => DataRole::Vetoed,
            _ => DataRole::HeldOut,
        });
    }
    let case = case(
        machine,
        (name, file, &before),
        given,
        &mut in_memory,
        (roles, settings),
    )?;
    let work = control.begin("search for effects", None);
    let tell = |heard: Heard| {
        control.tell(match heard {
            Heard::Begin(part, steps) => Progress::Begin(part, Some(steps)),
            Heard::Step => Progress::Advance(1),
            Heard::End => Progress::End,
        });
    };
    let watch = Watch {
        tell: &tell,
        stop: &|| control.stopped(),
    };
    let found = diagnose::diagnose(&case, watch);
    drop(work);
    let diagnosis = match found {
        Ok(diagnosis) => diagnosis,
        Err(DiagnoseError::Interrupted) => return Err(IdentifyError::Interrupted),
        Err(error) => return Err(IdentifyError::Diagnose(error)),
    };
    in_memory.stretches = case.stretches;
    let train = logs.train;
    let logs: Vec<String> = all.iter().map(Log::name).collect();
    for aside in &diagnosis.set_aside {
        if aside.role == LogRole::Holdout {
            let text = format!(
                "{}: {:.2}..{:.2} s set aside as the holdout",
                logs[aside.log], aside.from_s, aside.to_s
            );
            control.note(&text);
        }
    }
    let mut found = Diagnosed {
        diagnosis,
        in_memory,
        logs,
        given: case.given,
        held: Held::default(),
        free_run: None,
        friction_prior,
        candidates: settings.candidates.clone(),
        hold_friction: settings.hold_friction,
        filters: case.filters,
        cutoff_hz: case.cutoff_hz,
    };
    if found.diagnosis.written().next().is_some() {
        let refined = found.model(machine, file);
        let tried = hold_out(
            machine,
            (&refined, &found.diagnosis.model),
            (train, &found.in_memory.inputs),
            control,
        );
        found.held = or_warning(tried, &mut found.in_memory.warnings)?;
    }
    let _work = control.begin("free run", None);
    found.free_run = found.run_freely(machine, (name, as_given))?;
    let spoiled = found.free_run.as_ref().and_then(spoiled);
    found.in_memory.warnings.extend(spoiled);
    Ok(DiagnoseEnd::Diagnosed(Box::new(found)))
}

/// Channels that are no torques, as a fault: gains that differ look like friction and loads.
fn without_gains(machine: &LoggedRobot) -> Option<DataFault> {
    let error = machine.check_gains().err()?.to_string();
    let (effect, remedy) = error.split_once("; ").unwrap_or((&error, ""));
    Some(DataFault {
        kind: "gains".to_owned(),
        channel: Some("torque".to_owned()),
        effect: effect.to_owned(),
        remedy: remedy.to_owned(),
    })
}

/// The first fault for which a fit refuses one of the logs.
fn refused(
    machine: &LoggedRobot,
    logs: &[Log],
    control: &Control,
) -> Result<Option<DataFault>, IdentifyError> {
    for log in logs {
        if let Some(fault) = machine.fault(log, control)? {
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
const HELD: f64 = 1e6;

/// What the search is about; it takes the stretches of the logs. `before` is the model `file` with the friction
/// that is known without these logs.
fn case(
    machine: &LoggedRobot,
    (name, file, before): (&str, &ModelFile, &ModelFile),
    given: AugmentedModel,
    in_memory: &mut InMemory,
    (roles, settings): (Vec<LogRole>, &DiagnoseSettings),
) -> Result<Case, IdentifyError> {
    let processing = machine.settings();
    let filters = ParallelFilters::design(&processing, &in_memory.stretches)
        .map_err(|error| IdentifyError::motion(name, error))?;
    let hold = settings.hold_friction;
    let open = open(machine, file, &given, hold);
    let rate = filters.row_rate_hz();
    let alone = moved_alone(&given, &in_memory.stretches, &roles);
    // what is held is known so many times better than these data can say; its own spread stays that of its covariance
    let firm = if hold { HELD } else { 1.0 };
    let prior = ParameterPrior {
        information: information(before, &given, &open, hold, &alone),
        centre: refined(before, name)?,
        rows_per_independent: firm * (rate / (2.0 * processing.cutoff_hz)).max(1.0),
    };
    Ok(Case {
        given,
        prior,
        open,
        stretches: std::mem::take(&mut in_memory.stretches),
        roles,
        filters,
        cutoff_hz: processing.cutoff_hz,
        rest_speed: in_memory.rest_speed.clone(),
        drives: drives(machine),
        units: (0..machine.robot.joints())
            .map(|j| machine.file.torque_unit(j).to_owned())
            .collect(),
        averaged: in_memory.averaged,
        keep: settings.keep,
        without: Vec::new(),
        own: own_laws(&settings.candidates, &machine.robot)?,
        wishes: settings.wishes.clone(),
        numbers: NUMBERS,
    })
}

/// The drives that the robot file declares, joint by joint.
fn drives(machine: &LoggedRobot) -> Vec<JointDrive> {
    let names = machine.robot.joint_names().iter();
    let declared = names.map(|name| machine.file.drive.get(name).cloned());
    declared.map(Option::unwrap_or_default).collect()
}

impl Diagnosed {
    /// The free run of the model given and of the one that is written, with the parameters in use.
    fn run_freely(
        &self,
        machine: &LoggedRobot,
        (name, given): (&str, &ModelFile),
    ) -> Result<Option<FreeRun>, IdentifyError> {
        if !is_in_si(machine) {
            return Ok(None);
        }
        let before = refined(given, name)?;
        let after = match self.diagnosis.written().next() {
            None => None,
            Some(_) => Some(refined(&self.model(machine, given), name)?),
        };
        let stretches = &self.in_memory.stretches;
        let spans = self.held_out_spans();
        Ok(free_run(&before, after.as_ref(), stretches, &spans))
    }

    /// Held-out spans of the stretches; all of them where nothing is held out.
    fn held_out_spans(&self) -> Vec<Span> {
        let (inputs, stretches) = (&self.in_memory.inputs, &self.in_memory.stretches);
        let of_log = |s: &Stretch| inputs[s.log].role == Some(DataRole::HeldOut);
        let aside = |s: &Stretch, t: f64| {
            let mut blocks = self.diagnosis.set_aside.iter();
            blocks.any(|a| {
                a.role == LogRole::Holdout && a.log == s.log && (a.from_s..=a.to_s).contains(&t)
            })
        };
        let mut spans = Vec::new();
        for (number, s) in stretches.iter().enumerate() {
            let held = |k: &usize| of_log(s) || aside(s, s.own_time(*k));
            let mut from = (0..s.len()).find(held);
            while let Some(begin) = from {
                let until = (begin..s.len()).find(|k| !held(k)).unwrap_or(s.len());
                spans.push((number, begin, until));
                from = (until..s.len()).find(held);
            }
        }
        match spans.is_empty() {
            true => whole(stretches),
            false => spans,
        }
    }

    /// Estimated parameters of an effect with their standard deviations.
    pub fn told(&self, machine: &LoggedRobot, step: &FoundEffect) -> Vec<EffectNumber> {
        let effect = &step.estimate;
        let unit = machine.file.torque_unit(effect.place.joint().unwrap_or(0));
        effect.numbers(&machine.robot, unit, Some(&step.covariance))
    }

    /// The refined model, where `file` is the one that was given: that file itself where nothing was added.
    pub fn model(&self, machine: &LoggedRobot, file: &ModelFile) -> ModelFile {
        let diagnosis = &self.diagnosis;
        if diagnosis.written().next().is_none() {
            return file.clone();
        }
        let mut model = new_model(machine, "diagnose", &self.in_memory.inputs);
        model.parameters.clone_from(&file.parameters);
        // inertial parameters that are kept are as consistent as they were
        let kept = !diagnosis
            .unknowns
            .iter()
            .any(|u| matches!(u, Unknown::Theta(_)));
        if !kept {
            model.forget_consistent();
        }
        model.friction_prior.clone_from(&self.friction_prior);
        // beside a part of an effect the declared numbers take up the rest, and are no estimates
        let whole = self.is_whole();
        let (mut keys, mut places, mut widened) = (Vec::new(), Vec::new(), Vec::new());
        let mut undetermined = Vec::new();
        for (i, unknown) in diagnosis.unknowns.iter().enumerate() {
            if self.hold_friction && matches!(unknown, Unknown::Friction { .. }) {
                continue;
            }
            let Some((name, joint, value)) = fitted(&diagnosis.model, *unknown) else {
                continue;
            };
            let there = |p: &&mut Parameter| p.name == name && p.joint == joint;
            let Some(p) = model.parameters.iter_mut().find(there) else {
                continue;
            };
            let found = diagnosis.covariance[(i, i)].max(0.0).sqrt();
            if !whole {
                let estimate = fitted(&diagnosis.estimates, *unknown).map_or(value, |f| f.2);
                model.estimates.push(Estimate {
                    name,
                    joint,
                    value: estimate,
                    std: Some(found),
                    unit: p.unit.clone(),
                });
                (p.value, p.std) = (value, None);
                undetermined.push(p.key());
                continue;
            }
            match put(p, value, found) {
                Some(factor) => {
                    widened.push(factor);
                    keys.push(p.key());
                    places.push(i);
                }
                None => undetermined.push(p.key()),
            }
        }
        model.forget_covariance(&undetermined);
        model.replace_covariance(&keys, &|a, b| {
            widened[a] * widened[b] * diagnosis.covariance[(places[a], places[b])]
        });
        let joints = machine.robot.joint_names().iter();
        for (joint, std) in joints.zip(&diagnosis.residual_std) {
            model.residual_std.insert(joint.clone(), *std);
        }
        self.put_effects(machine, file, &mut model);
        let of_model = |c: &&CandidateSection| model.effects.iter().any(|e| e.name == c.name);
        let known = file.candidates.iter().chain(&self.candidates);
        for candidate in known.filter(of_model) {
            if !model.candidates.contains(candidate) {
                model.candidates.push(candidate.clone());
            }
        }
        self.held.write_into(&mut model);
        if !kept && file.is_consistent() {
            let key = |unknown: &Unknown| match fitted(&diagnosis.model, *unknown) {
                Some((name, Some(joint), _)) => format!("{name}:{joint}"),
                Some((name, None, _)) => name,
                None => String::new(),
            };
            let unknowns: Vec<String> = diagnosis.unknowns.iter().map(key).collect();
            if project_by(&mut model, &unknowns, &diagnosis.information).is_err() {
                model.forget_consistent();
            }
        }
        model
    }

    /// Whether every effect is written as it was estimated.
    fn is_whole(&self) -> bool {
        let model = &self.diagnosis.model;
        let mut written = self.diagnosis.written();
        written.all(|s| {
            s.written
                .is_some_and(|at| model.effects[at].linear == s.estimate.linear)
        })
    }

    /// Effects that the given model had, and those that were found.
    fn put_effects(&self, machine: &LoggedRobot, file: &ModelFile, model: &mut ModelFile) {
        model.effects.clone_from(&file.effects);
        model.estimates.extend(file.estimates.iter().cloned());
        for step in self.diagnosis.written() {
            let Some(effect) = step
                .written
                .and_then(|at| self.diagnosis.model.effects.get(at))
            else {
                continue;
            };
            let estimated = self.told(machine, step);
            let whole = effect.linear == step.estimate.linear;
            let unit = machine.file.torque_unit(effect.place.joint().unwrap_or(0));
            let numbers = match whole {
                true => estimated.clone(),
                false => effect.numbers(&machine.robot, unit, None),
            };
            let mut section = in_file(effect, machine, &numbers);
            section.accepted_by_user = step.accepted_by_user;
            if !whole {
                section.shrinkage = Some(step.shrinkage);
                let own = estimated.into_iter().filter(|n| n.std.is_some());
                model.estimates.extend(own.map(|n| Estimate {
                    name: format!("{} {}", section.name, n.key),
                    joint: section.joint.clone(),
                    value: n.value,
                    std: n.std,
                    unit: n.unit,
                }));
            }
            model.effects.push(section);
        }
    }
}

/// Name, joint and value of an unknown that model files hold.
fn fitted(model: &AugmentedModel, unknown: Unknown) -> Option<(String, Option<String>, f64)> {
    let fitted = &model.model;
    let robot = &fitted.robot;
    let (name, joint, value) = match unknown {
        Unknown::Theta(k) => (
            robot.parameters()[k].name.to_string(),
            None,
            fitted.theta[k],
        ),
        Unknown::Offset(j) => ("offset".to_owned(), Some(j), fitted.offset[j]),
        Unknown::Friction { joint, k } => match &fitted.friction[joint] {
            JointFriction::None => return None,
            JointFriction::DoubleTanh(law) => (
                DoubleTanh::NAMES[k].to_owned(),
                Some(joint),
                law.parameters()[k],
            ),
            JointFriction::ViscousCoulomb(law) => (
                ViscousCoulomb::NAMES[k].to_owned(),
                Some(joint),
                [law.viscous, law.coulomb][k],
            ),
        },
    };
    Some((name, joint.map(|j| robot.joint_names()[j].clone()), value))
}

/// Gives a parameter the value and the standard deviation that were found, and says by how much the
/// latter is widened; none where other parameters explain the same torque in these logs.
fn put(p: &mut Parameter, value: f64, found: f64) -> Option<f64> {
    if !found.is_finite() {
        p.value = value;
        p.std = None;
        p.verdict = Some(Verdict::NotIdentifiable);
        return None;
    }
    // what smoothing and the encoders' steps did to the given model, they do to this one
    let std = found.max(p.std.unwrap_or(0.0));
    // a parameter without a torque worth mentioning is known well enough as it is
    let negligible = p.is_negligible();
    p.value = value;
    p.std = Some(std);
    if !negligible {
        p.verdict = Some(verdict_of(value, std));
    }
    Some(if found > 0.0 { std / found } else { 1.0 })
}

impl DataFault {
    /// A set-up that the torques contradict, as a fault of the data.
    pub fn of_setup(finding: &Finding) -> Self {
        let kind = match finding.kind {
            FindingKind::Sign | FindingKind::Order => effect::wrong_sign_or_order::ENTRY.name,
            other => other.word(),
        };
        Self {
            kind: kind.to_owned(),
            channel: finding.joint.clone(),
            effect: finding.meaning.clone(),
            remedy: format!("write {}", finding.remedy),
        }
    }
}
