//! `cft-ident export`: a model for other programs, as C header, Rust module, URDF or file of a simulator.

mod drives;
mod exported;
mod formats;
mod sources;
mod tool;

pub use self::exported::ExportedModel;
use self::exported::{FormatOmission, WrittenFile};
use self::formats::formats;
use self::sources::{SourceFile, folder_from, not_of_others, source, with_table};
mod words;

use cft_ident_core::explain::Explain;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use self::words::{about_effects, beyond_table, effects, never_driving, not_in_here};
use super::files::ReadFile;
use super::{
    CliError, Context, Outcome, arguments, controller, file_name, files, logs_of, paths_of,
};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::effect::as_code::no_torque;
use cft_ident_export::export::arm::{Arm, ArmSettings, BaseFrame, FormatSupport};
use cft_ident_export::export::checked::{self, FileToCheck};
use cft_ident_export::export::dissipative::below_zero;
use cft_ident_export::export::left_out::{self, LeftOut, OmissionPlace};
use cft_ident_export::export::source_text::{SourceText, WrittenSource};
use cft_ident_export::export::{self, ExportError, Note, Program, mjcf_source, urdf, urdf_source};
use cft_ident_files::config::{ModelFile, WholeUrdf};
use cft_ident_logs::log::{LogSpec, escape};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::table::{CellAlignment, Table};
use cft_ident_stages::identify::{self, BANDWIDTH_HZ, GivenModel, InMemory, LogData};
use cft_ident_tool::held::gravity_in_python;
use cft_ident_tool::tool::{RobotController, ToolFile};

const EXAMPLE: &str = "\
Example:
  cft-ident export -m model.toml --c feedforward.h
  cft-ident export -m model.toml --rust feedforward.rs
  cft-ident export -m tool.toml --controller ur
  cft-ident export -m myarm-model.toml --urdf myarm-identified.urdf
  cft-ident export -m myarm-model.toml --mjcf myarm.xml unseen.csv";

/// Write a model for other programs: a C header, a Rust module, a URDF, files of simulators.
///
/// Header and module hold tau(q, v, a) for feed-forward with all effects, gravity(q), friction(v), friction
/// compensation and the rigid links alone; they need nothing but the standard library. What remembers the
/// motion (presliding, backlash, warm-up) has a state: init, then step once a sample. Files of links (URDF,
/// MJCF, SDF, USD) hold chain, inertials, damping and friction, where they can the inertia of drives. A model
/// file beside a URDF, FILE.toml, holds the rest and is read as any model file; beside the others
/// FILE.left-out.toml lists what they cannot say, with its size along the logs that are given.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
#[command(
    override_usage = "cft-ident export [OPTIONS] --model <MODEL.toml>\n       \
    <--c <FILE.h> | --rust <FILE.rs> | --urdf <FILE.urdf> |\n        \
    --mjcf <FILE.xml> | --sdf <FILE.sdf> | --usd <FILE.usda> |\n        \
    --ros2-control <FILE.yaml>>... [LOG]..."
)]
#[command(group = clap::ArgGroup::new("into").required(true).multiple(true))]
pub struct Args {
    /// Logs along which the size of what files of links cannot say is taken; LOG@0..70% is a part of one
    #[arg(value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Of a tool's file: the lines that a controller takes, one of ur, franka, xarm, ros2
    #[arg(long, value_name = "CONTROLLER", group = "into", value_parser = tool::controller)]
    pub controller: Option<RobotController>,
    /// Python module to write: gravity(q) of the links alone
    #[arg(hide_short_help = true, long, value_name = "FILE.py", group = "into", value_parser = tool::python())]
    pub python: Option<PathBuf>,
    /// URDF to write, with FILE.toml beside it (serial robots and single joints)
    #[arg(long, value_name = "FILE.urdf", group = "into", value_parser = arguments::ends_in(["urdf"]))]
    pub urdf: Option<PathBuf>,
    /// URDF of the same robot whose meshes, names and frames the one of --urdf keeps: only inertials and
    /// friction are replaced
    #[arg(
        hide_short_help = true,
        long,
        value_name = "FILE.urdf",
        requires = "urdf"
    )]
    pub urdf_source: Option<PathBuf>,
    /// Actuators of MuJoCo to write, of a model file of `drive`
    #[arg(long, value_name = "FILE.xml", group = "into", value_parser = arguments::ends_in(["xml"]))]
    pub mjcf_actuators: Option<PathBuf>,
    /// Parameters of BAM to write, of a model file of `drive`
    #[arg(long, value_name = "FILE.json", group = "into", value_parser = arguments::ends_in(["json"]))]
    pub bam: Option<PathBuf>,
    /// Actuators of Isaac Lab to write, of a model file of `drive`
    #[arg(long, value_name = "FILE.py", group = "into", value_parser = arguments::ends_in(["py"]))]
    pub isaaclab: Option<PathBuf>,
    /// Proportional gain of the actuators of `drive` [N m/rad, or counts of the firmware]
    #[arg(hide_short_help = true, long, value_name = "X", value_parser = arguments::positive)]
    pub kp: Option<f64>,
    /// Their gain of the speed
    #[arg(hide_short_help = true, long, value_name = "X", default_value = "0", value_parser = arguments::finite)]
    pub kd: f64,
    /// Step of their simulator [s]
    #[arg(hide_short_help = true, long, value_name = "S", default_value = "0.002", value_parser = arguments::positive)]
    pub timestep: f64,
    /// Class of BAM that the servo is
    #[arg(
        hide_short_help = true,
        long,
        value_name = "NAME",
        default_value = "sts3215",
        requires = "bam"
    )]
    pub actuator: String,
    /// MJCF file of MuJoCo to write
    #[arg(long, value_name = "FILE.xml", group = "into", value_parser = arguments::ends_in(["xml"]))]
    pub mjcf: Option<PathBuf>,
    /// MJCF of the same robot whose geoms, meshes, names and actuators the one of --mjcf keeps: only inertials,
    /// armatures and friction are replaced
    #[arg(
        hide_short_help = true,
        long,
        value_name = "FILE.xml",
        requires = "mjcf"
    )]
    pub mjcf_source: Option<PathBuf>,
    /// Write damping that bends with speed into the MJCF, as d0 v + d1 v |v| + d2 v^3: MuJoCo since 4.0 reads it, Pinocchio takes
    /// it for none, and Drake refuses the file
    #[arg(hide_short_help = true, long, requires = "mjcf")]
    pub mujoco_damping: bool,
    /// SDF file of Gazebo to write
    #[arg(hide_short_help = true, long, value_name = "FILE.sdf", group = "into", value_parser = arguments::ends_in(["sdf"]))]
    pub sdf: Option<PathBuf>,
    /// USD file of Isaac Sim to write, as text
    #[arg(hide_short_help = true, long, value_name = "FILE.usda", group = "into", value_parser = arguments::ends_in(["usda"]))]
    pub usd: Option<PathBuf>,
    /// C99 header to write
    #[arg(long, value_name = "FILE.h", group = "into", value_parser = arguments::ends_in(["h"]))]
    pub c: Option<PathBuf>,
    /// Rust module to write
    #[arg(long, value_name = "FILE.rs", group = "into", value_parser = arguments::ends_in(["rs"]))]
    pub rust: Option<PathBuf>,
    /// Parameter file of ros2_control's joint_trajectory_controller to write, for joints that take efforts
    #[arg(hide_short_help = true, long, value_name = "FILE.yaml", group = "into", value_parser = arguments::ends_in(["yaml"]))]
    pub ros2_control: Option<PathBuf>,
    /// Bandwidth of its gains [Hz]
    #[arg(hide_short_help = true, long, value_name = "HZ", default_value_t = BANDWIDTH_HZ, requires = "ros2_control", value_parser = arguments::positive)]
    pub bandwidth: f64,
    /// Rate at which rows arrive [Hz]: header and module get the observer of `watch` for it
    #[arg(hide_short_help = true, long, value_name = "HZ", value_parser = arguments::positive)]
    pub observer: Option<f64>,
    /// False alarms an hour that the limits of the observer are for
    #[arg(hide_short_help = true, long, value_name = "PER_HOUR", default_value_t = 1.0, requires = "observer", value_parser = arguments::positive)]
    pub false_alarms: f64,
    /// Leave out the [[effect]] tables of the model; the files say so
    #[arg(hide_short_help = true, long)]
    pub without_effects: bool,
}

fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// The motion along which sizes are taken, where logs are given.
fn along(args: &Args, given: &GivenModel, context: &Context) -> Result<Option<InMemory>, CliError> {
    if args.logs.is_empty() {
        return Ok(None);
    }
    let machine = given.setup();
    let logs = LogData::read_all(&machine, &logs_of(&args.logs), &[], &context.control)?;
    let whole = identify::read_whole(&machine, &logs, &context.control)?;
    machine.check_temperatures(&given.numbers()?, &logs, &whole.stretches)?;
    Ok(Some(whole))
}

/// What the controller calls joints that the model calls otherwise.
fn controller_names(file: &ModelFile) -> BTreeMap<String, String> {
    let joints = file.robot.log.joint.iter();
    let named = joints.filter_map(|(joint, of)| Some((joint.clone(), of.name.clone()?)));
    named.collect()
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    if drives::asked(args) {
        return drives::run(args, context);
    }
    let text = files::text(&args.model)?;
    if ToolFile::is_one(&text) {
        return tool::run(args, &text, context);
    }
    if args.controller.is_some() {
        let text = "--controller takes a file of `cft-ident tool`";
        return Err(CliError::usage(text)
            .hint("`payload` prints the lines of a body found by joint torques"));
    }
    let side = args.urdf.as_ref().map(|path| path.with_extension("toml"));
    let formats = formats(args);
    if !args.logs.is_empty() && formats.is_empty() && args.urdf.is_none() {
        return Err(CliError::usage(
            "logs belong to --urdf, --mjcf, --sdf and --usd, whose files cannot say all of a model",
        ));
    }
    let outputs = [
        &args.urdf,
        &side,
        &args.c,
        &args.rust,
        &args.python,
        &args.ros2_control,
    ];
    let outputs = outputs.into_iter().filter_map(|path| path.as_deref());
    let outputs = outputs.chain(formats.iter().flat_map(|f| [f.path, &f.side]));
    let inputs = paths_of(&args.logs).chain([&*args.model]);
    let sources = args.urdf_source.iter().chain(&args.mjcf_source);
    context.check_outputs(inputs.chain(sources.map(|path| &**path)), outputs)?;
    if let (Some(urdf), Some(side)) = (&args.urdf, &side) {
        not_of_others(urdf, side)?;
    }
    let given = files::model(&args.model, context)?;
    for effect in &given.value.file.effects {
        if let (Some(reason), false) = (no_torque(&effect.name), args.without_effects) {
            let (file, effect) = (&given.name, escape(&effect.name));
            let text = format!("{file}: the effect {effect} cannot be a torque: {reason}");
            return Err(CliError::input(text).hint(match args.observer {
                None => "export the rest with --without-effects",
                // the observer's limits are those of all effects
                Some(_) => "export the rest with --without-effects and without --observer, or fit a model without it",
            }));
        }
    }
    let (refined, left_out) = match args.without_effects {
        true => {
            let model = given.value.file.model(&given.name)?;
            (AugmentedModel::plain(model), effects(&given.value.file))
        }
        false => (given.value.numbers()?, Vec::new()),
    };
    let model = &refined.model;
    let failed = |error: ExportError| CliError::input(error.explanation().of(&given.name));
    let mut program = Program::with_effects(&refined).map_err(failed)?;
    program.rest_by(&given.value.file.robot);
    if let Some(rate_hz) = args.observer {
        if args.c.is_none() && args.rust.is_none() {
            return Err(CliError::usage("--observer belongs to --c and --rust"));
        }
        if args.without_effects && !left_out.is_empty() {
            let text = "the limits of --observer are those of the model with its effects";
            let hint = "leave --without-effects out, or fit a model without effects";
            return Err(CliError::usage(text).hint(hint));
        }
        let recipe = identify::watch_recipe(&given.value, 1.0 / rate_hz, args.false_alarms)?;
        program.observer = Some(recipe);
    }
    let mut lines = vec![
        format!(
            "Dynamic model written by cft-ident {} from {} (SHA-256 {}).",
            env!("CARGO_PKG_VERSION"),
            escape(&file_name(&args.model)),
            given.provenance.sha256
        ),
        "tau = Y(q, v, a) theta + F(v) + offset, SI units and radians.".to_owned(),
    ];
    let base_lines = lines.clone();
    lines.extend(about_effects(&program, &left_out));
    let never_driving = never_driving(&program);
    lines.extend(never_driving.iter().cloned());
    let unit = |j: usize| given.value.file.robot.torque_unit(j).to_owned();
    let torque_units = (0..program.joints.len()).map(unit).collect();
    let along = along(args, &given.value, context)?;
    let stretches = along.as_ref().map_or(&[][..], |along| &along.stretches);
    let logs = args.logs.iter().map(|log| escape(&log.name()));
    let logs: Vec<String> = logs.collect();
    let source = args.urdf_source.as_deref().map(source).transpose()?;
    let settings = ArmSettings {
        along: stretches,
        ..ArmSettings::PLAIN
    };
    let mut described = Vec::new();
    // every text is made before the first is written
    let mut texts: Vec<(&Path, &str, String)> = Vec::new();
    let mut beyond = Vec::new();
    if let (Some(path), Some(side)) = (&args.urdf, &side) {
        let mut kept = given.value.file.clone();
        if args.without_effects {
            kept.effects.clear();
        }
        let arm = ArmSettings {
            any_bodies: source.is_none(),
            base: match source {
                Some(_) => BaseFrame::Silent,
                None => BaseFrame::Turned,
            },
            ..settings
        };
        let arm = Arm::of(&kept, &refined, arm).map_err(failed)?;
        let names = controller_names(&given.value.file);
        let folder = args.urdf_source.as_deref();
        let folder = folder.and_then(|source| folder_from(path, source));
        let into = |head: &[String]| {
            let write = |source: &ReadFile<(String, WholeUrdf)>| {
                let (text, whole) = &source.value;
                let into = SourceText {
                    file: &source.name,
                    text,
                    names: &names,
                    folder: folder.as_deref(),
                };
                urdf_source::written(&arm, &into, whole, head)
            };
            source.as_ref().map(write).transpose()
        };
        // a chain of the source that has the joints of the model, so that a model file can stand beside it
        let draft = into(&[]).map_err(failed)?;
        let chain = match &draft {
            Some(draft) => urdf_source::tip_of(&arm, &draft.text),
            None => Some(None),
        };
        let beside = chain.is_some();
        kept.robot.robot.tip = chain.flatten();
        let elsewhere = match beside {
            true => OmissionPlace::Beside,
            false => OmissionPlace::Nowhere,
        };
        let says = FormatSupport {
            armature_readers: urdf::SAYS.armature_readers.filter(|_| source.is_none()),
            ..urdf::SAYS
        };
        let written = |found: &[LeftOut]| {
            let mut head = base_lines.clone();
            head.extend(not_in_here(&left_out));
            head.extend(left_out::lines(found, &logs, elsewhere));
            let mut made = urdf::urdf(&kept, model, &arm, &file_name(path), &head)?;
            let of_source = into(&head)?;
            if let Some(of_source) = &of_source {
                made.urdf.clone_from(&of_source.text);
            }
            Ok((made, of_source))
        };
        let shown = file_name(path);
        let check = |(made, source): &(urdf::UrdfFiles, Option<WrittenSource>)| {
            let file = FileToCheck {
                file: &shown,
                text: &made.urdf,
                says,
                source: source.as_ref(),
            };
            checked::urdf(&file, &arm, &refined, stretches)
        };
        let found = left_out::left_out(&arm, &refined, says, stretches);
        let ((made, of_source), found) = with_table(found, written, check).map_err(failed)?;
        // what the model file beside it holds is no loss
        let lost = found.into_iter().filter(|part| !beside || part.of_reader);
        beyond.extend(lost.map(|part| FormatOmission::of(path, part)));
        described.extend(of_source.into_iter().flat_map(|source| source.notes));
        texts.push((path, "URDF", made.urdf));
        if beside {
            texts.push((side, "model file of the URDF", made.side));
        } else {
            described.push(format!(
                "{}: no chain of it has the joints of the model ({}), so no model file stands beside {}",
                source.as_ref().map_or("", |source| source.name.as_str()),
                program.joints.join(", "),
                file_name(path)
            ));
        }
    }
    if !formats.is_empty() {
        for format in &formats {
            let of_source = args.mjcf_source.as_deref();
            let of_source = of_source.filter(|_| args.mjcf.as_deref() == Some(format.path));
            let base = match of_source {
                Some(_) => BaseFrame::Kept,
                None => BaseFrame::Turned,
            };
            let settings = ArmSettings {
                base,
                bends: args.mujoco_damping && args.mjcf.as_deref() == Some(format.path),
                ..settings
            };
            let arm = Arm::of(&given.value.file, &refined, settings).map_err(failed)?;
            let says = format.says;
            let found = export::left_out::left_out(&arm, &refined, says, stretches);
            let mut head = base_lines.clone();
            head.extend(not_in_here(&left_out));
            head.extend(below_zero(&given.value.file, model));
            let source = of_source
                .map(|source| SourceFile::mjcf(source, format.path))
                .transpose()?;
            let names = controller_names(&given.value.file);
            let write = |found: &[LeftOut]| {
                let mut head = head.clone();
                head.extend(left_out::lines(found, &logs, OmissionPlace::Nowhere));
                head.extend(arm.of_inertials.iter().cloned());
                match &source {
                    None => Ok(((format.text)(&arm, &head), None)),
                    Some(source) => {
                        let written = mjcf_source::written(&arm, &source.to_write(&names), &head)?;
                        Ok((written.text.clone(), Some(written)))
                    }
                }
            };
            let shown = file_name(format.path);
            let check = |(text, source): &(String, Option<WrittenSource>)| {
                let file = FileToCheck {
                    file: &shown,
                    text,
                    says,
                    source: source.as_ref(),
                };
                match args.mjcf.as_deref() == Some(format.path) {
                    true => checked::mjcf(&file, &arm, &refined, stretches),
                    false => Ok(Vec::new()),
                }
            };
            let ((text, written), found) = with_table(found, write, check).map_err(failed)?;
            let side = export::left_out::side_file(&found, &head, &logs).map_err(failed)?;
            described.extend(written.into_iter().flat_map(|written| written.notes));
            texts.push((format.path, format.what, text));
            texts.push((&format.side, "what it cannot say", side));
            let found = found.into_iter();
            beyond.extend(found.map(|part| FormatOmission::of(format.path, part)));
        }
    }
    let note = Note {
        lines,
        torque_units,
    };
    if let Some(path) = &args.c {
        let prefix = export::header::identifier(&stem(path));
        let text = export::header::header(&program, &prefix, &note);
        texts.push((path, "C99 header", text));
    }
    if let Some(path) = &args.rust {
        texts.push((path, "Rust module", export::module::module(&program, &note)));
    }
    if let Some(path) = &args.python {
        let text = gravity_in_python(&model.robot, &model.theta, &base_lines).ok_or_else(|| {
            CliError::input(format!(
                "{}: --python cannot be written: links of this robot follow others or are not known",
                given.name
            ))
            .hint("take gravity of --c or --rust")
        })?;
        texts.push((path, "Python module", text));
    }
    if let Some(path) = &args.ros2_control {
        let of = (given.name.as_str(), &given.value.file, model);
        let text = controller::ros2_control(of, args.bandwidth, &base_lines)?;
        texts.push((path, "parameters of ros2_control", text));
    }
    for (path, _, text) in &texts {
        context.write_text(path, text)?;
    }
    let mut table = Table::new(&[("file", CellAlignment::Left), ("what", CellAlignment::Left)])
        .caption(&format!("{} for other programs", given.name));
    for (path, what, _) in &texts {
        table.row([path.display().to_string().as_str(), what]);
    }
    let mut warnings = Vec::new();
    if !left_out.is_empty() {
        warnings.push(format!("left out: {}", left_out.join(", ")));
    }
    if args.urdf.is_some() || !formats.is_empty() {
        warnings.extend(below_zero(&given.value.file, model));
    }
    if args.c.is_some() || args.rust.is_some() {
        warnings.extend(never_driving);
    }
    let written = texts.iter().map(|(path, what, _)| WrittenFile {
        file: file_name(path),
        what: (*what).to_owned(),
    });
    let result = ExportedModel {
        joints: program.joints.clone(),
        files: written.collect(),
        left_out,
        beyond,
        lines: None,
    };
    let mut inputs = vec![given.provenance];
    inputs.extend(source.map(|source| source.provenance));
    warnings.extend(described);
    if let Some(along) = along {
        inputs.extend(along.inputs);
        warnings.extend(along.notes.iter().map(ToString::to_string));
    }
    let text = table.to_string() + &beyond_table(&result.beyond);
    let files: Vec<&str> = result.files.iter().map(|of| of.file.as_str()).collect();
    let brief = format!("written: {}", files.join(", "));
    Ok(Outcome::new(
        context.text(text, &brief),
        JsonDocument::new("export", &inputs, &warnings, &result)?,
    ))
}
