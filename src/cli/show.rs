//! `cft-ident show`: a model file as a person wants to know it.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::{CliError, Context, Outcome, arguments, files, written};
use cft_ident_files::config::model_file::{EffectSection, Parameter};
use cft_ident_report::report::json::{JsonDocument, NO_WARNINGS};
use cft_ident_report::report::sections::provenance;
use cft_ident_report::report::stages;
use cft_ident_stages::identify::{JointInUse, in_use};

const EXAMPLE: &str = "\
Example:
  cft-ident show model.toml
  cft-ident show model.toml --report model.html";

/// Show a model: what its error means in use, its parameters, friction, effects, and for what motion it holds.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Write the same as a page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

/// A model as it is shown.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ShownModel {
    /// Joints in the order of every vector.
    joints: Vec<String>,
    /// Physically consistent parameters stand beside those of the plain fit.
    consistent: bool,
    /// What the data estimate, with deviations; `consistent` is what torques are computed with.
    parameters: Vec<Parameter>,
    effects: Vec<EffectSection>,
    /// What the errors mean in use; empty where the file does not hold what it left of data set aside.
    in_use: Vec<JointInUse>,
    /// The point that forces are reported at.
    point: Option<String>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    context.check_outputs([&*args.model], args.report.as_deref())?;
    let given = files::model(&args.model, context)?;
    let (model, machine) = (given.value.numbers()?, given.value.setup());
    let file = given.value.file;
    let found = in_use(&machine, &file, &model.model);
    let of = stages::show::ShowReport {
        setup: &machine,
        file: &file,
        model: &model,
        in_use: found.as_ref(),
    };
    let mut report = stages::show::show(&of);
    let inputs = vec![given.provenance];
    if let Some(path) = &args.report {
        let made_from = &file.provenance.inputs;
        let (page, command) = (&mut report.page(), &context.command);
        provenance::section(page, &file.robot, &inputs, made_from, None, command);
        context.write_text(path, &report.html())?;
        written(&mut report, path);
    }
    let (in_use, point) = found.unzip();
    let shown = ShownModel {
        joints: machine.robot.joint_names().to_vec(),
        consistent: file.is_consistent(),
        parameters: file.estimated_parameters(),
        effects: file.effects,
        in_use: in_use.unwrap_or_default(),
        point,
    };
    Ok(Outcome::new(
        report.text_for(context.screen),
        JsonDocument::new("show", &inputs, &NO_WARNINGS, &shown)?,
    ))
}
