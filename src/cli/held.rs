//! `cft-ident lsq --static`: gravity from poses that are held.

use std::collections::BTreeMap;
use std::path::Path;

use super::{CliError, Context, Exit, Outcome, file_name, files, paths_of, typed, written};
use cft_ident_core::explain::Explain;
use cft_ident_files::config::model_file::{Covariance, Parameter, Verdict};
use cft_ident_files::config::robot_file::FrictionLawKind;
use cft_ident_files::config::{ModelFile, RobotFile};
use cft_ident_logs::log::{LogSpec, Provenance};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::stages;
use cft_ident_stages::identify::{RobotSetup, new_model};
use cft_ident_tool::held::{GravityFit, GravityNumber, HeldError, fit_gravity, read_held};

/// An error by its exit status.
fn failed(error: HeldError) -> CliError {
    let exit = match error {
        HeldError::TooFew { .. } | HeldError::NothingDetermined | HeldError::NoGravity { .. } => {
            Exit::Undetermined
        }
        _ => Exit::BadInput,
    };
    CliError::new(exit, error.explanation())
}

/// What is asked of held poses.
pub(super) struct HeldRun<'a> {
    pub logs: &'a [LogSpec],
    pub robot: &'a str,
    pub output: &'a Path,
    pub report: Option<&'a Path>,
}

pub(super) fn run(args: &HeldRun, context: &Context) -> Result<Outcome, CliError> {
    let outputs = [Some(args.output), args.report];
    context.check_outputs(paths_of(args.logs), outputs.into_iter().flatten())?;
    let robot = files::robot(Path::new(args.robot))?;
    let (log, mut inputs) = read_held(args.logs, &robot.value).map_err(failed)?;
    let name = file_name(Path::new(args.robot));
    let found = fit_gravity(&log, &robot.value, &name).map_err(failed)?;
    context.check()?;
    let setup = RobotSetup::new(args.robot, robot.value);
    let model = model(&found, &setup, &inputs);
    let path = typed::quoted(&args.output.to_string_lossy());
    let logs = typed::logs(args.logs.iter().map(LogSpec::to_string));
    let mut report = stages::held::held(&found, &path, &logs);
    inputs.push(robot.provenance);
    stages::tool::origin(&mut report.page(), &inputs, &context.command);
    if let Some(page) = args.report {
        context.write_text(page, &report.html())?;
    }
    files::write_model(args.output, &model, context)?;
    written(&mut report, args.output);
    let mut warnings = Vec::new();
    for (joint, unsigned) in found.joints.iter().zip(&log.unsigned) {
        let turns = joint.torque > 0.0 && setup.file.log.sign.is_none();
        if *unsigned && turns && joint.from_below > 0 && joint.from_above > 0 {
            warnings.push(format!(
                "the torque of {} is never below zero: where its channel has no sign, `sign = \"hang\"` in [log] takes it from the side on which the joint hangs off its command",
                joint.joint
            ));
        }
    }
    let document = JsonDocument::new("lsq-static", &inputs, &warnings, &found)?;
    Ok(Outcome::new(report.text_for(context.screen), document))
}

/// The model file: gravity's parameters, those that poses do not ask for as 0, friction at rest as Coulomb friction.
fn model(found: &GravityFit, setup: &RobotSetup, inputs: &[Provenance]) -> ModelFile {
    let mut model = new_model(setup, "lsq --static", inputs);
    let file: &mut RobotFile = &mut model.robot;
    file.friction.law = Some(FrictionLawKind::ViscousCoulomb);
    let robot = setup.robot.clone();
    for (at, info) in robot.parameters().iter().enumerate() {
        let place = found.kept.iter().position(|kept| *kept == at);
        let known = place.map(|k| &found.parameters[k]);
        model.parameters.push(Parameter {
            name: info.name.to_string(),
            theta: info.theta,
            joint: None,
            value: found.theta[at],
            std: known.and_then(|number| number.std),
            consistent: None,
            unit: known.map_or(info.unit.to_string(), |number| number.unit.clone()),
            meaning: info.meaning.to_string(),
            verdict: known
                .map(|number| number.verdict)
                .or(Some(Verdict::NotIdentifiable)),
        });
    }
    let mut residual = BTreeMap::new();
    for joint in &found.joints {
        let of_joint = |name: &str, number: Option<&GravityNumber>, meaning: &str| Parameter {
            name: name.to_owned(),
            theta: None,
            joint: Some(joint.joint.clone()),
            value: number.and_then(|n| n.value).unwrap_or(0.0),
            std: number.and_then(|n| n.std),
            consistent: None,
            unit: match name {
                "viscous" => format!("{} s/rad", joint.unit),
                _ => joint.unit.clone(),
            },
            meaning: meaning.to_owned(),
            verdict: number.map(|n| n.verdict).or(Some(Verdict::NotIdentifiable)),
        };
        model
            .parameters
            .push(of_joint("viscous", None, "not asked for by held poses"));
        let stiction = Some(&joint.stiction);
        model
            .parameters
            .push(of_joint("coulomb", stiction, "friction at rest"));
        if let Some(offset) = &joint.offset {
            model
                .parameters
                .push(of_joint("offset", Some(offset), "constant torque"));
        }
        residual.insert(joint.joint.clone(), joint.left_held_out);
    }
    model.residual_std = residual;
    let stds = found.parameters.iter();
    let names: Vec<String> = stds.map(|number| number.name.clone()).collect();
    model.covariance = Some(Covariance {
        matrix: found.covariance.clone(),
        names,
    });
    model
}
