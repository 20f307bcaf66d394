//! `cft-ident friction`: the friction of single joints from one-joint logs.

use std::path::{Path, PathBuf};

use super::{
    CliError, Context, Outcome, arguments, files, logs_of, names_of, outputs, paths_of, pictures,
    setup, typed,
};
use cft_ident_logs::log::LogSpec;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::stages;
use cft_ident_stages::identify::{Dataset, FrictionSettings, RobotSetup};

const EXAMPLE: &str = "\
Example:
  cft-ident friction q1.csv q2.csv q4.csv q5.csv -r configs/cft.toml -o f.toml
  cft-ident friction q4.csv -r configs/cft.toml --joint q4 -m f.toml -o g.toml";

/// Estimate the friction of single joints by a continuous-discrete extended Kalman filter.
///
/// Each log is a one-joint experiment: the joint moves over its range at several speeds and with
/// reversals, the others stay nearly still. Several logs of one joint are used together.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident friction [OPTIONS] -r ROBOT.toml -o MODEL.toml LOG...")]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Robot file, or a built-in one such as configs/cft.toml
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: String,
    /// The joint that the logs move [default: found from the data]
    #[arg(long, value_name = "NAME")]
    pub joint: Option<String>,
    /// Model whose other joints are kept
    #[arg(short, long, value_name = "OLD.toml")]
    pub model: Option<PathBuf>,
    /// Model file to write
    #[arg(short, long, value_name = "MODEL.toml")]
    pub output: PathBuf,
    /// Draw the friction curves; may be given more than once
    #[arg(hide_short_help = true, long, value_name = "FILE.svg", value_parser = arguments::ends_in(["svg"]))]
    pub plot: Vec<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub setup: setup::SetupArgs,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let outputs = outputs::listed(Some(&args.output), &args.plot, args.report.as_deref());
    let outputs = outputs.chain(args.setup.fix_setup.as_deref());
    context.check_outputs(paths_of(&args.logs), outputs)?;
    let robot = files::robot(Path::new(&args.robot))?;
    let machine = RobotSetup::new(&args.robot, robot.value);
    let mut given = vec![robot.provenance];
    let old = args.model.as_deref();
    let old = old.map(|path| files::model_of(path, &machine.file, context));
    let old = old.transpose()?.map(|model| {
        given.push(model.provenance);
        model.value.file
    });
    let settings = FrictionSettings {
        joint: args.joint.clone(),
    };
    let data = Dataset::read(&machine, &logs_of(&args.logs), &context.control)?;
    let robot = Path::new(&args.robot);
    let checked = setup::checked(data, (robot, &[]), &args.setup, context)?;
    let machine = &checked.setup.data.setup;
    let control = &context.control;
    let (found, model) = checked.setup.friction(&settings, old.as_ref(), control)?;
    let document = JsonDocument::new("friction", &found.inputs, &found.notes, &found)?;
    let of = stages::friction::Friction {
        setup: machine,
        found: &found,
        file: &model,
        path: &typed::quoted(&args.output.to_string_lossy()),
        logs: &names_of(&args.logs),
    };
    let mut report = stages::friction::friction(&of);
    if let Some(path) = &args.report {
        let quality = pictures::inspected(&args.logs, machine, context)?;
        let mut page = report.page();
        stages::friction::pictures(&mut page, &of, &given, &quality, &context.command);
        context.check()?;
        context.write_text(path, &report.html())?;
    }
    context.check()?;
    for path in &args.plot {
        let figure = stages::friction::figure(machine, &found);
        context.write_text(path, &figure.svg())?;
    }
    checked.finish(report, document, (&args.output, &model), context)
}
