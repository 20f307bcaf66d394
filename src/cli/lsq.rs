//! `cft-ident lsq`: the inertial parameters by linear least squares.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::friction::new_model;
use super::machine::{Machine, narrowed, run_error, summary_warnings};
use super::pages::{self, Look};
use super::refined::{held_for_pictures, refined};
use super::{CliError, Context, Outcome, arguments, files};
use crate::config::ModelFile;
use crate::config::identified::{friction_meaning, friction_unit, inertia_unit};
use crate::config::model_file::Parameter;
use crate::config::robot_file::FrictionLawKind;
use crate::inertia::accumulate::Sums;
use crate::inertia::columns::{Columns, KnownFriction, Own};
use crate::inertia::encoder::{GRIDS, accumulate_shifted, add_scatter};
use crate::inertia::solve::{Fit, FitError, fit};
use crate::inertia::verdict::verdict;
use crate::inertia::{accumulate, add_processing, solve};
use crate::log::{Block, LogSpec, Provenance};
use crate::motion::{Settings, Summary};
use crate::report::json::Document;
use crate::report::{number, summary};
use crate::robot::friction::DoubleTanh;
use crate::verdict::{IDENTIFIED, Verdict};

const EXAMPLE: &str = "\
Example:
  cft-ident lsq id.csv -r configs/cft.toml -m friction.toml -o model.toml
  cft-ident lsq emps_id.csv -r configs/emps.toml -o emps.toml --json -";

/// Fit the inertial parameters by linear least squares, friction taken from a model file.
///
/// Where the robot file says that friction is fitted together with the inertias, -m is left out.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Robot file, or a built-in one such as configs/cft.toml
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: String,
    /// Model file that holds the friction, as `friction` writes it
    #[arg(short, long, value_name = "FRICTION.toml")]
    pub model: Option<PathBuf>,
    /// How the rows are weighted
    #[arg(long, value_enum, default_value_t = Estimator::Wls)]
    pub estimator: Estimator,
    /// Model file to write
    #[arg(short, long, value_name = "MODEL.toml")]
    pub output: PathBuf,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::html_file)]
    pub report: Option<PathBuf>,
}

/// The weighting of the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Estimator {
    /// Rows weighted by each joint's noise, in two steps
    Wls,
    /// All rows alike
    Ols,
}

impl From<Estimator> for solve::Estimator {
    fn from(estimator: Estimator) -> Self {
        match estimator {
            Estimator::Wls => solve::Estimator::Wls,
            Estimator::Ols => solve::Estimator::Ols,
        }
    }
}

/// One unknown of the fit with what the data say about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown {
    pub name: String,
    pub theta: Option<u32>,
    pub joint: Option<String>,
    pub unit: String,
    pub meaning: String,
    pub value: f64,
    pub std: f64,
    pub verdict: Verdict,
    pub negligible: bool,
}

/// Result of the stage.
pub struct Identified {
    pub columns: Columns,
    pub fit: Fit,
    pub unknowns: Vec<Unknown>,
    pub summary: Summary,
    pub inputs: Vec<Provenance>,
    pub warnings: Vec<String>,
}

/// Fits the inertial parameters; friction from `friction`, or fitted with them where there is none.
pub fn identify(
    machine: &Machine,
    logs: &[LogSpec],
    friction: Option<(&str, &ModelFile)>,
    estimator: solve::Estimator,
    context: &Context,
) -> Result<Identified, CliError> {
    let columns = columns(machine, friction)?;
    let mut warnings = Vec::new();
    if friction.is_none() {
        warnings.push(
            "friction is fitted together with the inertias (viscous and Coulomb terms), for there are no one-joint logs of it".to_owned(),
        );
    }
    let bar = context.progress(
        "least squares",
        Some(2 * logs.len() as u64 + u64::from(GRIDS)),
    );
    let settings = machine.settings();
    let mut inputs = Vec::new();
    let mut reduce = |settings: &Settings, first: bool| {
        let mut total: Option<(Sums, Summary)> = None;
        for spec in logs {
            let mut log = machine.open(spec, context)?;
            let (sums, summary) = accumulate(&machine.robot, &columns, settings, &mut |block| {
                log.read(block)
            })
            .map_err(|e| run_error(spec, e))?;
            if first {
                warnings.extend(log.warnings());
                warnings.extend(summary_warnings(spec, &summary));
                inputs.push(log.provenance()?);
            }
            total = Some(match total {
                None => (sums, summary),
                Some((mut all, summary)) => {
                    all.merge(sums);
                    (all, summary)
                }
            });
            bar.advance(1);
        }
        total.ok_or_else(|| CliError::usage("no log is given"))
    };
    let solved = |sums: &Sums| {
        fit(sums, estimator).map_err(|e| match e {
            FitError::Math(_) => CliError::input(e),
            FitError::TooFewRows { .. } | FitError::NothingExcited => CliError::undetermined(e),
        })
    };
    let (sums, summary) = reduce(&settings, true)?;
    let mut fit = solved(&sums)?;
    // once more with a narrower position filter: what that moves is part of the uncertainty
    let (again, _) = reduce(&narrowed(&settings, 1.0 / summary.dt), false)?;
    add_processing(&mut fit, &solved(&again)?);
    if machine.robot.knows_encoders() {
        let mut shifted = Vec::new();
        for grid in 0..GRIDS {
            let mut all: Option<Sums> = None;
            for spec in logs {
                let mut log = machine.open(spec, context)?;
                let mut read = |block: &mut Block| log.read(block);
                let sums = accumulate_shifted(&machine.robot, &columns, &settings, grid, &mut read)
                    .map_err(|e| run_error(spec, e))?;
                match (&mut all, sums) {
                    (Some(all), Some(sums)) => all.merge(sums),
                    (none, sums) => *none = sums,
                }
            }
            if let Some(sums) = all {
                shifted.push(solved(&sums)?);
            }
            bar.advance(1);
        }
        add_scatter(&mut fit, &shifted);
    }
    let unknowns = unknowns(machine, &columns, &fit);
    for c in &fit.confounded {
        let words: Vec<String> = c
            .terms
            .iter()
            .take(6)
            .map(|(i, x)| format!("{x:+.3} {}", unknowns[*i].name))
            .collect();
        warnings.push(format!(
            "these data cannot tell apart what {} share: their combination {} (columns scaled to norm 1) changes nothing",
            c.terms.iter().take(6).map(|(i, _)| unknowns[*i].name.as_str()).collect::<Vec<_>>().join(", "),
            words.join(" ")
        ));
    }
    if unknowns
        .iter()
        .all(|u| u.verdict == Verdict::NotIdentifiable)
    {
        return Err(CliError::undetermined(
            "these data determine none of the parameters; excite every joint with more speed and acceleration",
        ));
    }
    Ok(Identified {
        columns,
        fit,
        unknowns,
        summary,
        inputs,
        warnings,
    })
}

/// Which columns this robot's rows have.
fn columns(machine: &Machine, friction: Option<(&str, &ModelFile)>) -> Result<Columns, CliError> {
    let robot = &machine.robot;
    let n = robot.joints();
    let section = &machine.file.friction;
    let mut own = vec![Vec::new(); n];
    let mut known = vec![None; n];
    for (j, joint) in robot.joint_names().iter().enumerate() {
        match friction {
            Some((file, model)) => {
                let law = model.double_tanh(file, joint)?;
                let keys: Vec<String> = DoubleTanh::NAMES
                    .iter()
                    .map(|n| format!("{n}:{joint}"))
                    .collect();
                let flat = model.covariance_of(&keys);
                let covariance = std::array::from_fn(|a| std::array::from_fn(|b| flat[a * 5 + b]));
                known[j] = Some(KnownFriction { law, covariance });
            }
            None => own[j].extend([Own::Viscous, Own::Coulomb]),
        }
        if section.offset {
            own[j].push(Own::Offset);
        }
    }
    Ok(Columns {
        joints: n,
        shared: robot.parameters().len(),
        own,
        known,
    })
}

fn unknowns(machine: &Machine, columns: &Columns, fit: &Fit) -> Vec<Unknown> {
    let robot = &machine.robot;
    let rate = |i: usize, value: f64| {
        let std = fit.covariance[(i, i)].max(0.0).sqrt();
        let share = (0..columns.joints)
            .filter(|j| fit.torque_rms[*j] > 0.0)
            .map(|j| 2.0 * std * fit.column_rms[(j, i)] / fit.torque_rms[j])
            .fold(0.0, f64::max);
        let (verdict, negligible) = verdict(value, std, fit.determined[i], share);
        (std, verdict, negligible)
    };
    let mut out = Vec::with_capacity(columns.unknowns());
    for (i, info) in robot.parameters().iter().enumerate() {
        let value = fit.theta[i];
        let (std, verdict, negligible) = rate(i, value);
        out.push(Unknown {
            name: info.name.to_string(),
            theta: info.theta,
            joint: None,
            unit: inertia_unit(robot, &info.unit, machine.file.torque_unit(0)),
            meaning: info.meaning.to_string(),
            value,
            std,
            verdict,
            negligible,
        });
    }
    for (j, joint) in robot.joint_names().iter().enumerate() {
        for own in &columns.own[j] {
            let i = out.len();
            let value = fit.theta[i];
            let (std, verdict, negligible) = rate(i, value);
            out.push(Unknown {
                name: own.name().to_owned(),
                theta: None,
                joint: Some(joint.clone()),
                unit: friction_unit(robot, j, own.name(), machine.file.torque_unit(j)),
                meaning: friction_meaning(own.name()).to_owned(),
                value,
                std,
                verdict,
                negligible,
            });
        }
    }
    out
}

impl Unknown {
    fn relative_std(&self) -> f64 {
        self.std / self.value.abs()
    }

    /// The parameter as a model file holds it: the value is kept even where the data do not
    /// determine it, for the torque is computed with all of them together.
    fn parameter(&self) -> Parameter {
        Parameter {
            name: self.name.clone(),
            theta: self.theta,
            joint: self.joint.clone(),
            value: self.value,
            std: self.std.is_finite().then_some(self.std),
            unit: self.unit.clone(),
            meaning: self.meaning.clone(),
            verdict: Some(self.verdict),
        }
    }
}

/// The model: friction as it was known, and what was fitted, with their joint covariance.
pub fn into_model(
    machine: &Machine,
    found: &Identified,
    friction: Option<&ModelFile>,
) -> ModelFile {
    let mut model = new_model(machine, "lsq", &found.inputs);
    model.parameters = found.unknowns.iter().map(Unknown::parameter).collect();
    let robot = &machine.robot;
    let u = found.unknowns.len();
    let mut keys: Vec<String> = model.parameters.iter().map(Parameter::key).collect();
    let mut joint_of = Vec::new();
    if let Some(friction) = friction {
        for (j, joint) in robot.joint_names().iter().enumerate() {
            for (k, name) in DoubleTanh::NAMES.iter().enumerate() {
                if let Some(p) = friction.find(name, Some(joint)) {
                    keys.push(p.key());
                    joint_of.push((j, k));
                    model.parameters.push(p.clone());
                }
            }
        }
        model.effects = friction.effects.clone();
    }
    let fit = &found.fit;
    let known = |j: usize, a: usize, b: usize| {
        found.columns.known[j]
            .as_ref()
            .map_or(0.0, |k| k.covariance[a][b])
    };
    // cov(theta, theta_f) = S Sigma_f, with S = d theta / d theta_f
    let cross = |i: usize, (j, k): (usize, usize)| -> f64 {
        fit.friction_sensitivity[j]
            .as_ref()
            .map_or(0.0, |s| (0..5).map(|m| s[(i, m)] * known(j, m, k)).sum())
    };
    model.replace_covariance(&keys, &|a, b| match (a < u, b < u) {
        (true, true) => fit.covariance[(a, b)],
        (true, false) => cross(a, joint_of[b - u]),
        (false, true) => cross(b, joint_of[a - u]),
        (false, false) => {
            let ((ja, ka), (jb, kb)) = (joint_of[a - u], joint_of[b - u]);
            if ja == jb { known(ja, ka, kb) } else { 0.0 }
        }
    });
    for (joint, std) in robot.joint_names().iter().zip(&fit.residual_std) {
        model.residual_std.insert(joint.clone(), *std);
    }
    model
}

/// The JSON fields of the command.
pub fn json(machine: &Machine, found: &Identified) -> Value {
    let fit = &found.fit;
    let parameters: Vec<Value> = found
        .unknowns
        .iter()
        .map(|u| {
            let known = u.verdict != Verdict::NotIdentifiable;
            json!({
                "name": u.name,
                "theta": u.theta,
                "joint": u.joint,
                "value": known.then_some(u.value),
                "std": known.then_some(u.std),
                "relative_std": known.then(|| u.relative_std()),
                "unit": u.unit,
                "verdict": u.verdict,
                "negligible": u.negligible,
            })
        })
        .collect();
    let joints: Vec<Value> = (0..machine.robot.joints())
        .map(|j| {
            json!({
                "joint": machine.robot.joint_names()[j],
                "unit": machine.file.torque_unit(j),
                "rmse": fit.residual_std[j],
                "relative_error": fit.relative_error[j],
            })
        })
        .collect();
    json!({
        "parameters": parameters,
        "condition": fit.condition,
        "rank": fit.rank,
        "samples": fit.rows * machine.robot.joints() as u64,
        "effective_samples": fit.effective_rows * machine.robot.joints() as f64,
        "joints": joints,
        "processing": processing(&found.summary),
    })
}

/// What was done to the logs before the fit.
pub fn processing(summary: &Summary) -> Value {
    json!({
        "cutoff_hz": summary.cutoff_hz,
        "decimation": summary.decimation,
        "position_cutoff_hz": summary.q_cutoff_hz,
    })
}

/// The tables for a person.
pub fn text(machine: &Machine, found: &Identified) -> String {
    let rows: Vec<summary::Parameter> = found
        .unknowns
        .iter()
        .map(|u| {
            let known = u.verdict != Verdict::NotIdentifiable;
            summary::Parameter {
                joint: u.joint.as_deref().unwrap_or(""),
                name: &u.name,
                theta: None,
                value: if known { u.value } else { f64::NAN },
                std: if known { u.std } else { f64::NAN },
                unit: &u.unit,
                verdict: if u.negligible && u.relative_std() > IDENTIFIED {
                    "negligible"
                } else {
                    u.verdict.word()
                },
                truth: None,
            }
        })
        .collect();
    format!(
        "{}\n{}",
        summary::parameters("parameters", &rows),
        quality(machine, found)
    )
}

/// Condition, rank, independent rows and residual of the fit, in two lines.
pub fn quality(machine: &Machine, found: &Identified) -> String {
    let fit = &found.fit;
    let condition = |c: Option<f64>| c.map_or("infinite".to_owned(), |c| number::significant(c, 4));
    let mut out = format!(
        "condition {} raw, {} normalised; rank {} of {}; {} rows a joint, worth {:.0} independent ones\n",
        condition(fit.condition.raw),
        condition(fit.condition.normalised),
        fit.rank,
        found.unknowns.len(),
        fit.rows,
        fit.effective_rows,
    );
    let errors: Vec<String> = (0..machine.robot.joints())
        .map(|j| {
            format!(
                "{} {} ({} {})",
                machine.robot.joint_names()[j],
                number::percent(fit.relative_error[j]),
                number::significant(fit.residual_std[j], 3),
                machine.file.torque_unit(j)
            )
        })
        .collect();
    out += &format!("residual of the fit: {}\n", errors.join(", "));
    out
}

/// Runs the command.
///
/// # Errors
/// Every [`CliError`]; nothing is written then.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs: Vec<&Path> = args.logs.iter().map(|l| l.path.as_path()).collect();
    let mut outputs = vec![args.output.as_path()];
    outputs.extend(args.report.as_deref());
    context.check_outputs(&inputs, &outputs)?;
    let robot = files::robot(Path::new(&args.robot))?;
    let machine = Machine::new(&args.robot, robot.value);
    let mut given = vec![robot.provenance];
    let friction = match &args.model {
        None => None,
        Some(path) => {
            let model = files::model_of(path, &machine.file)?;
            given.push(model.provenance);
            Some((model.name, model.value))
        }
    };
    if friction.is_none()
        && !machine.file.friction.fitted_with_inertias
        && machine.file.friction_law() == FrictionLawKind::DoubleTanh
    {
        return Err(CliError::usage("lsq needs the friction of every joint")
            .hint("identify it first with `cft-ident friction`, and give its model with -m")
            .hint("or set `fitted_with_inertias = true` in [friction] of the robot file"));
    }
    let known = friction
        .as_ref()
        .map(|(name, model)| (name.as_str(), model));
    let found = identify(&machine, &args.logs, known, args.estimator.into(), context)?;
    let model = into_model(&machine, &found, known.map(|k| k.1));
    let document = Document::new(
        "lsq",
        &found.inputs,
        &found.warnings,
        &json(&machine, &found),
    )?;
    let mut text = text(&machine, &found);
    if let Some(path) = &args.report {
        let logs: Vec<&LogSpec> = args.logs.iter().collect();
        let held = held_for_pictures(&machine, &logs, context)?;
        let held = held.as_ref();
        let page = pages::Lsq {
            machine: &machine,
            found: &found,
            file: &model,
            model: &refined(&model, &args.output.to_string_lossy())?,
            logs: &args.logs,
            given,
            look: held
                .map(|held| Look::new(&machine, held, args.logs.iter().map(LogSpec::name)))
                .transpose()?,
        };
        let page = pages::lsq(&page, context)?;
        context.check()?;
        super::outputs::write_text(path, &page)?;
    }
    context.check()?;
    super::outputs::write_text(&args.output, &model.to_toml()?)?;
    text += &format!("written: {}\n", args.output.display());
    Ok(Outcome {
        text,
        document,
        missed: Vec::new(),
    })
}
