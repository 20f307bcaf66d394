//! The stages: each gives its document, the model that it made, and its page.

use std::ffi::OsString;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use cft_ident::cli;
use cft_ident::config::campaign::EstimatorKind;
use cft_ident::identify::{
    self, Control, DiagnoseEnd, DiagnoseLogs, DiagnoseSettings, FrictionSettings, LoggedRobot,
    LsqSettings, ReducedLogs, RobotSources, TrackSource, check_setup, refined,
};
use cft_ident::report::json::Document;
use cft_ident::report::{Report, stages};
use pyo3::prelude::*;

use crate::data::{Log, Model, Part, Robot};
use crate::errors::{InputError, UsageError, of_command, of_input, of_stage};
use crate::work;

/// Document as JSON, page as HTML, text for a terminal.
type Told = (String, String, String);

fn told(document: &Document, report: &Report) -> Told {
    (document.text(), report.html(), report.text())
}

fn all(logs: &[PyRef<'_, Log>]) -> Vec<identify::Log> {
    logs.iter().flat_map(|log| log.logs.clone()).collect()
}

/// What the check of the set-up found, and what it tells.
#[derive(Default)]
struct Checked {
    findings: Vec<cft_ident::setup::Finding>,
    warnings: Vec<String>,
}

/// Refuses a set-up that the torques plainly contradict, as the commands do.
fn checked(machine: &LoggedRobot, logs: &[identify::Log], control: &Control) -> PyResult<Checked> {
    // logs that cannot be checked are told by the fit itself
    let report = check_setup(machine, logs, control)
        .unwrap_or_default()
        .report;
    control.check().map_err(of_stage)?;
    if let Some(finding) = report.refusals().next() {
        return Err(InputError::new_err(format!(
            "{}: the torques contradict the robot file: {}; or go on without by as_declared=True",
            machine.name,
            finding.in_words()
        )));
    }
    let likely = report.findings.iter().filter(|f| !f.sure);
    let likely = likely.map(|f| format!("the set-up may be wrong: {}", f.in_words()));
    let power = report.friction_power.iter().map(|power| power.sentence());
    Ok(Checked {
        warnings: likely.chain(power).collect(),
        findings: report.findings,
    })
}

fn machine_of(robot: &Robot, as_declared: bool) -> LoggedRobot {
    match as_declared {
        true => robot.machine.clone().as_declared(),
        false => robot.machine.clone(),
    }
}

/// Runs a command line without printing: its document and its text.
#[pyfunction]
pub fn run(py: Python<'_>, arguments: Vec<String>) -> PyResult<(String, String)> {
    let words = std::iter::once("cft-ident".to_owned()).chain(arguments);
    let words: Vec<OsString> = words.map(OsString::from).collect();
    work::run(py, move |_, stop| {
        let outcome = cli::perform(&words, stop).map_err(|e| of_command(&e))?;
        Ok((outcome.document.text(), outcome.text))
    })
}

/// The program: prints, and gives its exit status.
#[pyfunction]
pub fn main(py: Python<'_>, arguments: Vec<String>) -> u8 {
    let words: Vec<OsString> = arguments.into_iter().map(OsString::from).collect();
    py.detach(|| cli::run(words, Arc::new(AtomicBool::new(false))).code())
}

/// Friction of single joints.
#[pyfunction]
#[pyo3(signature = (robot, logs, joint, model, as_declared))]
pub fn friction(
    py: Python<'_>,
    robot: PyRef<'_, Robot>,
    logs: Vec<PyRef<'_, Log>>,
    joint: Option<String>,
    model: Option<PyRef<'_, Model>>,
    as_declared: bool,
) -> PyResult<(Told, Model)> {
    let (machine, logs) = (machine_of(&robot, as_declared), all(&logs));
    let old = model.map(|m| m.file.clone());
    work::run(py, move |control, _| {
        let setup = match as_declared {
            true => Checked::default(),
            false => checked(&machine, &logs, control)?,
        };
        let settings = FrictionSettings { joint };
        let mut found =
            identify::friction(&machine, &logs, &settings, control).map_err(of_stage)?;
        found.setup = setup.findings;
        found.warnings.splice(0..0, setup.warnings);
        let model = found.model(&machine, old.as_ref());
        let document = Document::new("friction", &found.inputs, &found.warnings, &found);
        let names: Vec<String> = logs.iter().map(identify::Log::name).collect();
        let report = stages::friction::friction(&stages::friction::Friction {
            machine: &machine,
            found: &found,
            file: &model,
            path: "friction.toml",
            logs: &names,
        });
        let told = told(&document.map_err(of_input)?, &report);
        Ok((told, Model::of("friction.toml", model)?))
    })
}

fn estimator(name: &str) -> PyResult<EstimatorKind> {
    let known = [
        EstimatorKind::Wls,
        EstimatorKind::Ols,
        EstimatorKind::Irls,
        EstimatorKind::Iv,
        EstimatorKind::Oe,
    ];
    let found = known.into_iter().find(|kind| kind.name() == name);
    found.ok_or_else(|| {
        let names = known.map(EstimatorKind::name).join(", ");
        UsageError::new_err(format!(
            "there is no estimator `{name}`; choose one of {names}"
        ))
    })
}

/// Inertial parameters by least squares.
#[pyfunction]
#[pyo3(signature = (robot, logs, model, estimator, unconstrained, hold_friction, as_declared))]
#[allow(clippy::too_many_arguments)] // those of the command
pub fn lsq(
    py: Python<'_>,
    robot: PyRef<'_, Robot>,
    logs: Vec<PyRef<'_, Log>>,
    model: Option<PyRef<'_, Model>>,
    estimator: &str,
    unconstrained: bool,
    hold_friction: bool,
    as_declared: bool,
) -> PyResult<(Told, Model)> {
    let (machine, logs) = (machine_of(&robot, as_declared), all(&logs));
    let kind = self::estimator(estimator)?;
    let friction = model.map(|m| (m.name.clone(), m.file.clone()));
    if friction.is_none() && machine.file.needs_friction_first() {
        return Err(UsageError::new_err(
            "lsq needs the friction of every joint; give a model of it, or set `fitted_with_inertias = true` in [friction] of the robot file",
        ));
    }
    work::run(py, move |control, _| {
        let friction = friction.as_ref().map(|(name, file)| (name.as_str(), file));
        if let Some((name, file)) = friction {
            file.belongs_to(name, &machine.file).map_err(of_input)?;
        }
        let setup = match as_declared {
            true => Checked::default(),
            false => checked(&machine, &logs, control)?,
        };
        let settings = LsqSettings {
            estimator: kind,
            consistent: !unconstrained,
            friction,
            hold_friction,
            gains: None,
        };
        let mut found = identify::lsq(&machine, &logs, &settings, control).map_err(of_stage)?;
        found.setup.splice(0..0, setup.findings);
        found.warnings.splice(0..0, setup.warnings);
        let model = found.model(&machine, friction.map(|f| f.1));
        let document = Document::new("lsq", &found.inputs, &found.warnings, &found);
        let names: Vec<String> = logs.iter().map(identify::Log::name).collect();
        let report = stages::lsq::lsq(&stages::lsq::Lsq {
            machine: &machine,
            found: &found,
            file: &model,
            path: "model.toml",
            logs: &names,
            typed: "LOG",
        });
        let told = told(&document.map_err(of_input)?, &report);
        Ok((told, Model::of("model.toml", model)?))
    })
}

/// Errors of a model on logs.
#[pyfunction]
pub fn validate(
    py: Python<'_>,
    model: PyRef<'_, Model>,
    logs: Vec<PyRef<'_, Log>>,
) -> PyResult<Told> {
    let (name, file, provenance) = (model.name.clone(), model.file.clone(), model.provenance());
    let logs = all(&logs);
    work::run(py, move |control, _| {
        let augmented = refined(&file, &name).map_err(of_stage)?;
        let machine = LoggedRobot::new(&name, file.robot.clone());
        let found = identify::validate(
            &machine,
            (&augmented, Some(&file)),
            &logs,
            control,
            &mut |_, _| {},
        );
        let mut found = found.map_err(of_stage)?;
        let inputs = (&logs[..], &found.inputs[..]);
        found.free_run =
            identify::free_run(&machine, &augmented, inputs, control).map_err(of_stage)?;
        let document = Document::new("validate", &found.inputs, &found.warnings, &found);
        let names: Vec<String> = logs.iter().map(identify::Log::name).collect();
        let report = stages::validate::validate(&stages::validate::Validate {
            machine: &machine,
            file: &file,
            model: &augmented,
            logs: &names,
            found: &found,
            limit: None,
            given: &provenance,
        });
        Ok(told(&document.map_err(of_input)?, &report))
    })
}

/// Effects that a model lacks, and the refined model where there is one.
#[pyfunction]
pub fn diagnose(
    py: Python<'_>,
    model: PyRef<'_, Model>,
    logs: Vec<PyRef<'_, Log>>,
    veto: Vec<PyRef<'_, Log>>,
    holdout: Vec<PyRef<'_, Log>>,
    keep: bool,
) -> PyResult<(Told, Option<Model>)> {
    let (name, file, given) = (model.name.clone(), model.file.clone(), model.provenance());
    let (train, veto, holdout) = (all(&logs), all(&veto), all(&holdout));
    work::run(py, move |control, _| {
        let machine = LoggedRobot::new(&name, file.robot.clone());
        let logs = DiagnoseLogs {
            train: &train,
            veto: &veto,
            holdout: &holdout,
        };
        let settings = DiagnoseSettings {
            keep,
            ..DiagnoseSettings::default()
        };
        let of = (name.as_str(), &file);
        let end = identify::diagnose(&machine, of, &logs, &settings, control).map_err(of_stage)?;
        match end {
            DiagnoseEnd::DataFault(fault) => {
                let document = Document::new("diagnose", &[], &[], &fault.result());
                let report = stages::diagnose::data_fault(&fault, &given);
                Ok((told(&document.map_err(of_input)?, &report), None))
            }
            DiagnoseEnd::Diagnosed(found) => {
                let (inputs, warnings) = (&found.in_memory.inputs, &found.in_memory.warnings);
                let result = found.result(&machine);
                let document = Document::new("diagnose", inputs, warnings, &result);
                let refined = found.model(&machine, &file);
                let report = stages::diagnose::diagnose(&stages::diagnose::Diagnose {
                    machine: &machine,
                    file: &file,
                    given: &given,
                    found: &found,
                    refined: &refined,
                    path: "refined.toml",
                    logs: "LOG",
                });
                let model = Model::of("refined.toml", refined)?;
                Ok((told(&document.map_err(of_input)?, &report), Some(model)))
            }
        }
    })
}

/// What a linear fit needs of logs.
#[pyfunction]
#[pyo3(signature = (robot, logs, model, as_declared))]
pub fn reduce(
    py: Python<'_>,
    robot: PyRef<'_, Robot>,
    logs: Vec<PyRef<'_, Log>>,
    model: Option<PyRef<'_, Model>>,
    as_declared: bool,
) -> PyResult<Part> {
    let (machine, logs) = (machine_of(&robot, as_declared), all(&logs));
    let friction = model.map(|m| (m.name.clone(), m.file.clone()));
    work::run(py, move |control, _| {
        let friction = friction.as_ref().map(|(name, file)| (name.as_str(), file));
        if !as_declared {
            checked(&machine, &logs, control)?;
        }
        let found = identify::reduce(&machine, &logs, friction, control).map_err(of_stage)?;
        Ok(Part {
            logs: Arc::new(found),
        })
    })
}

/// Several sets of reduced logs as one.
#[pyfunction]
pub fn merge(parts: Vec<PyRef<'_, Part>>) -> PyResult<Part> {
    let sets = parts.iter().map(|part| ReducedLogs::clone(&part.logs));
    let logs = ReducedLogs::merge(sets).map_err(of_stage)?;
    Ok(Part {
        logs: Arc::new(logs),
    })
}

/// Parameters of robots over their logs: of each robot its name, and reduced logs or models in order of time.
#[pyfunction]
pub fn track(
    py: Python<'_>,
    robots: Vec<(String, Vec<PyRef<'_, Part>>, Vec<PyRef<'_, Model>>)>,
) -> PyResult<Told> {
    let mut all = Vec::new();
    for (name, parts, models) in robots {
        let mut sources = Vec::new();
        for (file, part) in parts.iter().enumerate() {
            sources.extend(part.logs.logs().iter().map(|log| TrackSource::Part {
                log: log.clone(),
                file,
            }));
        }
        sources.extend(models.iter().map(|model| TrackSource::Model {
            name: model.name.clone(),
            file: Box::new(model.file.clone()),
            provenance: model.provenance(),
        }));
        all.push(RobotSources { name, sources });
    }
    work::run(py, move |control, _| {
        let found = identify::track(&all, control).map_err(of_stage)?;
        let document = Document::new("track", &found.inputs, &found.warnings, &found);
        let report = stages::track::track(&found);
        Ok(told(&document.map_err(of_input)?, &report))
    })
}
