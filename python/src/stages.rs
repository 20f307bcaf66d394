//! The stages: each gives its document, the model that it made, and its page.

use std::ffi::OsString;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use cft_ident::cli;
use cft_ident::config::campaign::EstimatorKind;
use cft_ident::identify::{
    self, AcceptedSetup, Control, Dataset, DiagnoseEnd, DiagnoseSettings, FrictionSettings,
    IdentifyError, LsqSettings, ReducedLogs, RobotSetup, RobotSources, SetupRefusal, TrackSource,
    ValidateSettings, accepted_setup, check_setup_where_possible,
};
use cft_ident::number;
use cft_ident::report::json::{JsonDocument, NO_WARNINGS};
use cft_ident::report::{Report, stages};
use cft_ident::setup::{ChannelKind, Finding, FindingKind, Setting};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::data::{GivenLogs, Log, Model, Part, Robot};
use crate::errors::{InputError, UsageError, of_command, of_input, of_stage};
use crate::work;

/// Document as JSON, page as HTML, text for a terminal.
type Shown = (String, String, String);
/// Name of a robot of a fleet, its parts and its models.
type FleetRobot<'py> = (String, Vec<PyRef<'py, Part>>, Vec<PyRef<'py, Model>>);

fn shown(document: &JsonDocument, report: &Report) -> Shown {
    (document.text(), report.html(), report.text())
}

/// What a fit goes on with; refuses a set-up that the torques plainly contradict, as the commands do.
fn accepted(data: Dataset, control: &Control) -> PyResult<AcceptedSetup> {
    accepted_setup(data, control).map_err(|refusal| match refusal {
        SetupRefusal::Interrupted => of_stage(IdentifyError::Interrupted),
        SetupRefusal::Contradicted(found) => {
            let setup = &found.data.setup;
            let mut logs = found.data.logs.iter().map(|log| &log.source);
            let arrays = logs.all(|log| matches!(log, identify::Log::Arrays(_)));
            let said = found.report.refusals().next().map(|first| {
                let remedy = arrays.then(|| array_remedy(first, setup.robot.joint_names()));
                match remedy.flatten() {
                    Some(remedy) => format!("{}; {remedy}", first.meaning),
                    None => first.in_words(),
                }
            });
            InputError::new_err(format!(
                "{}: the torques contradict the set-up: {}; or go on without by as_declared=True",
                setup.name,
                said.unwrap_or_default()
            ))
        }
    })
}

/// What to do with arrays, where a robot file would get a line.
fn array_remedy(finding: &Finding, joints: &[String]) -> Option<String> {
    let array = match finding.channel? {
        ChannelKind::Position => "q",
        ChannelKind::Torque => "tau",
        ChannelKind::Both => return None,
    };
    let place =
        |joint: &Option<String>| joints.iter().position(|name| Some(name) == joint.as_ref());
    let columns = match place(&finding.joint) {
        Some(j) => format!("{array}[:, {j}]"),
        None => array.to_owned(),
    };
    Some(match (finding.kind, &finding.found) {
        (FindingKind::Sign | FindingKind::Scale, Setting::Number(x)) => {
            match (x.to_degrees() - 1.0).abs() < 1e-9 {
                true => format!("give radians: numpy.radians({columns})"),
                false => format!("give {columns} times {}", number::significant(*x, 6)),
            }
        }
        (FindingKind::Zero, Setting::Number(x)) => {
            format!("give {columns} plus {}", number::significant(*x, 6))
        }
        (FindingKind::Order, _) => {
            let other = place(&finding.with)?;
            format!("exchange {columns} with {array}[:, {other}]")
        }
        _ => return None,
    })
}

fn machine_of(robot: &Robot, as_declared: bool) -> RobotSetup {
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
) -> PyResult<(Shown, Model)> {
    let (machine, logs) = (machine_of(&robot, as_declared), GivenLogs::new(&logs));
    let old = model.map(|m| m.given.file.clone());
    work::run(py, move |control, _| {
        let setup = accepted(logs.read(&machine, control)?, control)?;
        let machine = &setup.data.setup;
        let settings = FrictionSettings { joint };
        let fitted = setup.friction(&settings, old.as_ref(), control);
        let (found, model) = fitted.map_err(of_stage)?;
        let document = JsonDocument::new("friction", &found.inputs, &found.notes, &found);
        let report = stages::friction::friction(&stages::friction::Friction {
            setup: machine,
            found: &found,
            file: &model,
            path: "friction.toml",
            logs: &logs.names(),
        });
        let shown = shown(&document.map_err(of_input)?, &report);
        Ok((shown, Model::of("friction.toml", model)?))
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
) -> PyResult<(Shown, Model)> {
    let (machine, logs) = (machine_of(&robot, as_declared), GivenLogs::new(&logs));
    let kind = self::estimator(estimator)?;
    let friction = model.map(|m| m.given.clone());
    if friction.is_none() && machine.file.needs_friction_first() {
        return Err(UsageError::new_err(
            "lsq needs the friction of every joint; give a model of it, or set `fitted_with_inertias = true` in [friction] of the robot file",
        ));
    }
    work::run(py, move |control, _| {
        if let Some(given) = &friction {
            given
                .file
                .belongs_to(&given.name, &machine.file)
                .map_err(of_input)?;
        }
        let setup = accepted(logs.read(&machine, control)?, control)?;
        let machine = &setup.data.setup;
        let settings = LsqSettings {
            estimator: kind,
            consistent: !unconstrained,
            friction: friction.as_ref(),
            hold_friction,
            ..LsqSettings::default()
        };
        let (found, model) = setup.lsq(&settings, control).map_err(of_stage)?;
        let document = JsonDocument::new("lsq", &found.inputs, &found.notes, &found);
        let report = stages::lsq::lsq(&stages::lsq::LsqReport {
            setup: machine,
            found: &found,
            file: &model,
            path: "model.toml",
            logs: &logs.names(),
            typed: "LOG",
        });
        let shown = shown(&document.map_err(of_input)?, &report);
        Ok((shown, Model::of("model.toml", model)?))
    })
}

/// Errors of a model on logs.
#[pyfunction]
pub fn validate(
    py: Python<'_>,
    model: PyRef<'_, Model>,
    logs: Vec<PyRef<'_, Log>>,
) -> PyResult<Shown> {
    let (given, provenance) = (model.given.clone(), model.provenance());
    let logs = GivenLogs::new(&logs);
    work::run(py, move |control, _| {
        let augmented = given.numbers().map_err(of_stage)?;
        let data = logs.read(&given.setup(), control)?;
        let settings = ValidateSettings {
            free_run: true,
            ..ValidateSettings::of(&given)
        };
        let found = identify::validate(&data, &settings, control, &mut |_, _| {});
        let found = found.map_err(of_stage)?;
        let document = JsonDocument::new("validate", &found.inputs, &found.notes, &found);
        let report = stages::validate::validate(&stages::validate::ValidateReport {
            setup: &data.setup,
            file: &given.file,
            model: &augmented,
            logs: &logs.names(),
            found: &found,
            limit: None,
            given: &provenance,
            next: "cft_ident.diagnose(model, [fitted], holdout=[log])",
            uses: "model.to_c(\"model.h\")",
        });
        Ok(shown(&document.map_err(of_input)?, &report))
    })
}

/// Rows of logs: times, positions, velocities, torques as logged and as reconstructed, half widths of the band, movement.
type RowArrays<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<bool>>,
);

/// Measured and reconstructed torque of every row of logs.
#[pyfunction]
pub fn rows<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    logs: Vec<PyRef<'py, Log>>,
) -> PyResult<RowArrays<'py>> {
    let (given, logs) = (model.given.clone(), GivenLogs::new(&logs));
    let n = given.file.robot.joint_names().len();
    let (t, [q, v, measured, reconstructed, half_width], moving) =
        work::run(py, move |control, _| {
            let data = logs.read(&given.setup(), control)?;
            let (mut t, mut moving, mut columns) =
                (Vec::new(), Vec::new(), [const { Vec::new() }; 5]);
            let settings = ValidateSettings::of(&given);
            let found = identify::validate(&data, &settings, control, &mut |row, _| {
                t.push(row.t);
                moving.extend(row.moving.iter().map(|x| *x > 0.0));
                let each = [
                    row.q,
                    row.v,
                    row.measured,
                    row.reconstructed,
                    row.half_width,
                ];
                for (column, row) in columns.iter_mut().zip(each) {
                    column.extend_from_slice(row);
                }
            });
            found.map_err(of_stage)?;
            Ok((t, columns, moving))
        })?;
    let shape = [t.len(), n];
    let matrix = |values: Vec<f64>| PyArray1::from_vec(py, values).reshape(shape);
    Ok((
        PyArray1::from_vec(py, t),
        matrix(q)?,
        matrix(v)?,
        matrix(measured)?,
        matrix(reconstructed)?,
        matrix(half_width)?,
        PyArray1::from_vec(py, moving).reshape(shape)?,
    ))
}

/// Effects that a model lacks, and the refined model where there is one.
#[pyfunction]
pub fn diagnose(
    py: Python<'_>,
    model: PyRef<'_, Model>,
    logs: Vec<PyRef<'_, Log>>,
    holdout: Vec<PyRef<'_, Log>>,
    keep: bool,
) -> PyResult<(Shown, Option<Model>)> {
    let (of, given) = (model.given.clone(), model.provenance());
    let (train, holdout) = (GivenLogs::new(&logs), GivenLogs::new(&holdout));
    work::run(py, move |control, _| {
        let (machine, file) = (of.setup(), &of.file);
        let data = holdout.held_out_of(train.read(&machine, control)?, control)?;
        let setup = check_setup_where_possible(&data, control)
            .map_err(of_stage)?
            .report;
        let settings = DiagnoseSettings {
            keep,
            ..DiagnoseSettings::of(&of)
        };
        let end = identify::diagnose(&data, &settings, control).map_err(of_stage)?;
        match end {
            DiagnoseEnd::DataFault(fault) => {
                let document = JsonDocument::new(
                    "diagnose",
                    &[],
                    &NO_WARNINGS,
                    &fault.result().with_setup(setup),
                );
                let report = stages::diagnose::data_fault(&fault, &given);
                Ok((shown(&document.map_err(of_input)?, &report), None))
            }
            DiagnoseEnd::Diagnosed(found) => {
                let (inputs, notes) = (&found.in_memory.inputs, &found.in_memory.notes);
                let result = found.result(&machine).with_setup(setup);
                let document = JsonDocument::new("diagnose", inputs, notes, &result);
                let refined = found.model(&machine, file);
                let report = stages::diagnose::diagnose(&stages::diagnose::DiagnoseReport {
                    setup: &machine,
                    file,
                    given: &given,
                    found: &found,
                    refined: &refined,
                    path: "refined.toml",
                    logs: "LOG",
                });
                let model = Model::of("refined.toml", refined)?;
                Ok((shown(&document.map_err(of_input)?, &report), Some(model)))
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
    let (machine, logs) = (machine_of(&robot, as_declared), GivenLogs::new(&logs));
    let friction = model.map(|m| m.given.clone());
    work::run(py, move |control, _| {
        let data = accepted(logs.read(&machine, control)?, control)?.data;
        let found = identify::reduce(&data, friction.as_ref(), control).map_err(of_stage)?;
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
pub fn track(py: Python<'_>, robots: Vec<FleetRobot<'_>>) -> PyResult<Shown> {
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
            name: model.given.name.clone(),
            file: Box::new(model.given.file.clone()),
            provenance: model.provenance(),
        }));
        all.push(RobotSources { name, sources });
    }
    work::run(py, move |control, _| {
        let found = identify::track(&all, control).map_err(of_stage)?;
        let document = JsonDocument::new("track", &found.inputs, &found.notes, &found);
        let report = stages::track::track(&found);
        Ok(shown(&document.map_err(of_input)?, &report))
    })
}
