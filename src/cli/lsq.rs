//! `cft-ident lsq`: the inertial parameters by linear least squares.

use std::path::{Path, PathBuf};

use super::estimate::{Account, Estimated, Estimator, Passes, estimate};
use super::feasible::{Physical, physical};
pub use super::fitted::{json, processing, quality, text};
use super::friction::new_model;
use super::machine::Machine;
use super::pages::{self, Look};
use super::refined::{held_for_pictures, refined};
use super::{CliError, Context, Outcome, arguments, files};
use crate::config::ModelFile;
use crate::config::identified::{friction_meaning, friction_unit, inertia_unit};
use crate::config::model_file::Parameter;
use crate::config::robot_file::FrictionLawKind;
use crate::inertia::columns::{KnownFriction, Own, RegressorColumns};
use crate::inertia::essential::{Essential, essential};
use crate::inertia::instruments::ReferenceSource;
use crate::inertia::robust::Status;
use crate::inertia::solve::{Fit, factor, residual_of, weights_of};
use crate::inertia::verdict::verdict;
use crate::log::{LogSpec, Provenance};
use crate::motion::Summary;
use crate::number;
use crate::report::json::Document;
use crate::robot::friction::DoubleTanh;
use crate::verdict::Verdict;

const EXAMPLE: &str = "\
Example:
  cft-ident lsq identification.csv -r robot.toml -m friction.toml -o m.toml
  cft-ident lsq emps_id.csv -r configs/emps.toml -o emps.toml --json -";

/// Fit the inertial parameters by linear least squares, friction taken from a model file.
///
/// Where the robot file says that friction is fitted together with the inertias, -m is left out.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident lsq [OPTIONS] -r ROBOT.toml -o MODEL.toml LOG...")]
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
    /// How parameters are estimated from the rows
    #[arg(long, value_enum, default_value_t = Estimator::Wls)]
    pub estimator: Estimator,
    /// Only parameters of links that can exist; the model file then holds the links too
    #[arg(long)]
    pub feasible: bool,
    /// Model file to write
    #[arg(short, long, value_name = "MODEL.toml")]
    pub output: PathBuf,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::html_file)]
    pub report: Option<PathBuf>,
}

/// One unknown of the fit with what the data say about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown {
    /// Short name, that of the model file.
    pub name: String,
    /// The combination of standard parameters that it stands for, where that is its name.
    pub grouping: Option<String>,
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
    pub columns: RegressorColumns,
    pub fit: Fit,
    /// What the estimator did.
    pub account: Account,
    /// Links that can exist, where they were asked for.
    pub physical: Option<Physical>,
    /// Which unknowns the data are really about.
    pub essential: Essential,
    /// Relative residual per joint with those alone.
    pub essential_error: Vec<f64>,
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
    estimator: Estimator,
    feasible: bool,
    context: &Context,
) -> Result<Identified, CliError> {
    let law = friction.is_none() && machine.file.friction_law() == FrictionLawKind::DoubleTanh;
    if law && !matches!(estimator, Estimator::Wls | Estimator::Oe) {
        return Err(CliError::usage(format!(
            "{} is linear, and the double-tanh law of friction is not",
            estimator.name()
        ))
        .hint("take `--estimator oe`, which refines the law with the inertias")
        .hint("or give the friction with -m, or set `law = \"viscous-coulomb\"`"));
    }
    let mut passes = Passes::new(machine, logs, context);
    let linear = columns(machine, friction)?;
    let mut estimated = estimate(&mut passes, linear, estimator, law)?;
    let (essential, essential_error) = essentials(&estimated)?;
    let mut warnings = Vec::new();
    let physical = match feasible {
        true => Some(physical(machine, &mut estimated)?),
        false => None,
    };
    warnings.extend(physical.iter().flat_map(Physical::warnings));
    let Estimated {
        columns,
        fit,
        account,
        ..
    } = estimated;
    if friction.is_none() {
        warnings.push(if law {
            "friction is fitted together with the inertias, for there are no one-joint logs of it: linear columns first, then the law of (18) by refinement".to_owned()
        } else {
            "friction is fitted together with the inertias (viscous and Coulomb terms), for there are no one-joint logs of it".to_owned()
        });
    }
    if estimator == Estimator::Oe && !account.law_refined {
        warnings
            .push("no parameter of this model is nonlinear: oe gives what wls gives".to_owned());
    }
    if let Some(simulated) = &account.simulated {
        if simulated.reference == ReferenceSource::Smoothed {
            warnings.push("iv: no log channel is named as the reference, so the measured position, smoothed to half the cut-off, stands for it; a part of its noise stays in the instruments. Name the channel: `reference = \"COLUMN\"` in [log.joint.NAME]".to_owned());
        }
        if simulated.indefinite > 0.0 {
            warnings.push(format!(
                "iv: at {} of the simulated steps the motion could not be computed or went astray, and joints were moved by themselves or put back; instruments are poorer for it",
                number::percent(simulated.indefinite)
            ));
        }
    }
    if account.status == Status::IterationLimit {
        warnings.push(format!(
            "{} did not settle in {} passes over the logs; its last result stands",
            estimator.name(),
            account.iterations
        ));
    }
    warnings.extend(std::mem::take(&mut passes.warnings));
    let summary = passes.summary.take();
    let summary = summary.ok_or_else(|| CliError::usage("no log is given"))?;
    let inputs = std::mem::take(&mut passes.inputs);
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
        account,
        physical,
        essential,
        essential_error,
        unknowns,
        summary,
        inputs,
        warnings,
    })
}

/// The essential unknowns, and the relative residual of each joint with those alone.
fn essentials(estimated: &Estimated) -> Result<(Essential, Vec<f64>), CliError> {
    let (fit, basis) = (&estimated.fit, &estimated.basis);
    let weights = weights_of(
        &basis.sums,
        &residual_of(&basis.sums, &(&fit.theta - &basis.shift))?,
    );
    let factor = factor(&basis.sums, &weights)?;
    // targets without the laws that the rows are linear about: a parameter is absent at 0
    let mut whole = factor.clone();
    let u = factor.ncols() - 1;
    let target = factor.column(u) + factor.columns(0, u) * &basis.shift;
    whole.set_column(u, &target);
    let rows = (fit.rows * basis.sums.columns.joints as u64) as f64;
    let found = essential(&whole, rows, fit.effective_rows / fit.rows as f64)?;
    // on the rows of the fit, which a robust one has weighted; the residual of all rows grows alike
    let whole = residual_of(&basis.sums, &(&fit.theta - &basis.shift))?;
    let alone = residual_of(&basis.sums, &(&found.theta - &basis.shift))?;
    let growth = alone
        .iter()
        .zip(&whole)
        .map(|(a, w)| if *w > 0.0 { a / w } else { 1.0 });
    let error = growth.zip(&fit.relative_error).map(|(g, e)| g * e);
    Ok((found, error.collect()))
}

/// Which columns this robot's rows have.
fn columns(
    machine: &Machine,
    friction: Option<(&str, &ModelFile)>,
) -> Result<RegressorColumns, CliError> {
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
    Ok(RegressorColumns {
        joints: n,
        shared: robot.parameters().len(),
        own,
        known,
    })
}

fn unknowns(machine: &Machine, columns: &RegressorColumns, fit: &Fit) -> Vec<Unknown> {
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
        let grouped = i < robot.groupings().len();
        out.push(Unknown {
            name: info.name.to_string(),
            grouping: grouped.then(|| info.meaning.to_string()),
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
                grouping: None,
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
    /// Standard deviation over the size of the value.
    pub fn relative_std(&self) -> f64 {
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
        let known = &found.columns.known;
        let names = robot.joint_names().iter().enumerate();
        // where it was refined it is among what was fitted
        for (j, joint) in names.filter(|(j, _)| known[*j].is_some()) {
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
    if let Some(physical) = &found.physical {
        physical.write_into(machine, &mut model);
    }
    model
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
    if friction.is_none() && machine.file.needs_friction_first() {
        return Err(CliError::usage("lsq needs the friction of every joint")
            .hint("identify it first with `cft-ident friction`, and give its model with -m")
            .hint("or set `fitted_with_inertias = true` in [friction] of the robot file"));
    }
    let known = friction
        .as_ref()
        .map(|(name, model)| (name.as_str(), model));
    let found = identify(
        &machine,
        &args.logs,
        known,
        args.estimator,
        args.feasible,
        context,
    )?;
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
