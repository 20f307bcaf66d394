//! A tool on a wrist sensor for controllers and for C.

use super::Args;
use crate::cli::{CliError, Context, Outcome, arguments, file_name, tool::failed};
use cft_ident_export::export::header::identifier;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_report::report::json::{JsonDocument, NO_WARNINGS};
use cft_ident_tool::tool::{ToolFile, c_function};

use super::{ExportedModel, WrittenFile, stem};

/// Writes what was asked for of a tool's file.
pub(super) fn run(args: &Args, text: &str, context: &Context) -> Result<Outcome, CliError> {
    let shown = escape(&args.model.to_string_lossy());
    let others = [
        ("--python", args.python.is_some()),
        ("--urdf", args.urdf.is_some()),
        ("--mjcf", args.mjcf.is_some()),
        ("--sdf", args.sdf.is_some()),
        ("--usd", args.usd.is_some()),
        ("--rust", args.rust.is_some()),
        ("--ros2-control", args.ros2_control.is_some()),
        ("--observer", args.observer.is_some()),
        ("--without-effects", args.without_effects),
        ("LOG", !args.logs.is_empty()),
    ];
    if let Some((option, _)) = others.into_iter().find(|(_, given)| *given) {
        let text = format!("{option} takes a model of a robot, and {shown} is a tool's file");
        return Err(CliError::usage(text).hint("a tool's file goes with --controller and --c"));
    }
    let file = ToolFile::parse(&shown, text).map_err(failed)?;
    let name = file_name(&args.model);
    let provenance = Provenance::of_text(&name, text);
    let undetermined = || {
        let text = format!("{shown}: the poses did not determine mass and centre of the tool");
        CliError::input(text)
            .hint("log the next pose that `cft-ident tool` names, and analyse again")
    };
    let (mut out, mut files) = (String::new(), Vec::new());
    if let Some(controller) = args.controller {
        out = controller.lines(&file).ok_or_else(undetermined)?;
    }
    if let Some(path) = &args.c {
        context.check_outputs([&*args.model], [path.as_path()])?;
        let lines = [
            format!(
                "Written by cft-ident {} from {}.",
                env!("CARGO_PKG_VERSION"),
                escape(&name)
            ),
            "Bias and weight of what hangs on the sensor, SI units.".to_owned(),
        ];
        let header = c_function(&file, &identifier(&stem(path)), &lines);
        context.write_text(path, &header.ok_or_else(undetermined)?)?;
        out += &format!("written: {}\n", path.display());
        files.push(WrittenFile {
            file: file_name(path),
            what: "C99 header".to_owned(),
        });
    }
    if out.is_empty() {
        return Err(CliError::usage(format!(
            "{shown} is a tool's file, for --controller and --c"
        ))
        .hint("cft-ident export -m TOOL.toml --controller ur"));
    }
    let lines = args
        .controller
        .map(|_| out.lines().map(str::to_owned).collect());
    let result = ExportedModel {
        joints: Vec::new(),
        files,
        left_out: Vec::new(),
        beyond: Vec::new(),
        lines,
    };
    let document = JsonDocument::new("export", &[provenance], &NO_WARNINGS, &result)?;
    Ok(Outcome::new(out, document))
}

/// A controller by its name.
pub(super) fn controller(text: &str) -> Result<cft_ident_tool::tool::RobotController, String> {
    use cft_ident_tool::tool::RobotController;
    let mut all = RobotController::ALL.into_iter();
    let known = || RobotController::ALL.map(RobotController::name).join(", ");
    all.find(|c| c.name() == text)
        .ok_or_else(|| format!("is none of {}", known()))
}

/// What a path of Python may be called.
pub(super) fn python() -> impl Fn(&str) -> Result<std::path::PathBuf, String> + Clone {
    arguments::ends_in(["py"])
}
