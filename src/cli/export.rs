//! `cft-ident export`: a model for other programs, as C header, Rust module or URDF.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::{CliError, Context, Outcome, arguments, files};
use crate::config::ModelFile;
use crate::export::dissipative::below_zero;
use crate::export::{self, ExportError, Note, Program};
use crate::log::escape;
use crate::report::json::Document;
use crate::report::table::{Align, Table};

const EXAMPLE: &str = "\
Example:
  cft-ident export -m model.toml --c feedforward.h
  cft-ident export -m model.toml --rust feedforward.rs
  cft-ident export -m myarm-model.toml --urdf myarm-identified.urdf";

/// Write a model for other programs: a C header, a Rust module, a URDF.
///
/// Header and module hold tau(q, v, a) for feed-forward, gravity(q), friction(v) and the rigid links
/// alone; they need nothing but the standard library, and keep no state. A URDF holds chain and
/// inertials; a model file beside it, FILE.toml, holds what a URDF cannot (drive inertias,
/// couplings, friction, offsets) and is read as any model file.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
#[command(
    override_usage = "cft-ident export [OPTIONS] --model <MODEL.toml>\n       \
    <--urdf <FILE.urdf> | --c <FILE.h> | --rust <FILE.rs>>..."
)]
#[command(group = clap::ArgGroup::new("into").required(true).multiple(true))]
pub struct Args {
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// URDF to write, with FILE.toml beside it (serial robots and single joints)
    #[arg(long, value_name = "FILE.urdf", group = "into", value_parser = arguments::urdf_file)]
    pub urdf: Option<PathBuf>,
    /// C99 header to write
    #[arg(long, value_name = "FILE.h", group = "into", value_parser = arguments::header_file)]
    pub c: Option<PathBuf>,
    /// Rust module to write
    #[arg(long, value_name = "FILE.rs", group = "into", value_parser = arguments::rust_file)]
    pub rust: Option<PathBuf>,
    /// Leave out the [[effect]] tables of the model; the files say so
    #[arg(long)]
    pub without_effects: bool,
}

/// A model that was written for other programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Exported {
    joints: Vec<String>,
    files: Vec<Written>,
    /// Effects that the files do not hold.
    left_out: Vec<String>,
}

/// A file that was written.
#[derive(Debug, Serialize, JsonSchema)]
struct Written {
    /// Its name.
    file: String,
    /// What it is.
    what: String,
}

/// A file's name without folder and ending.
fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// The effects of a model, as a person names them.
fn effects(file: &ModelFile) -> Vec<String> {
    let of = |e: &crate::config::model_file::Effect| match &e.joint {
        Some(joint) => format!("{} of {}", escape(&e.name), escape(joint)),
        None => escape(&e.name),
    };
    file.effects.iter().map(of).collect()
}

/// Runs the command.
///
/// # Errors
/// Every [`CliError`]; a file that cannot be made keeps none from being written that was.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let side = args.urdf.as_ref().map(|path| path.with_extension("toml"));
    let outputs = [&args.urdf, &side, &args.c, &args.rust];
    let outputs: Vec<&Path> = outputs.iter().filter_map(|path| path.as_deref()).collect();
    context.check_outputs(&[&args.model], &outputs)?;
    let given = files::model(&args.model, context)?;
    let model = given.value.model(&given.name)?;
    let left_out = effects(&given.value);
    if !left_out.is_empty() && !args.without_effects {
        return Err(CliError::input(format!(
            "{}: the model has effects that these files cannot hold: {}",
            given.name,
            left_out.join(", ")
        ))
        .hint("export the rest with --without-effects")
        .hint("`cft-ident torque` computes the torque with all effects"));
    }
    let program = Program::of(&model);
    let mut lines = vec![
        format!(
            "Dynamic model written by cft-ident {} from {} (SHA-256 {}).",
            env!("CARGO_PKG_VERSION"),
            escape(&name(&args.model)),
            given.provenance.sha256
        ),
        "tau = Y(q, v, a) theta + F(v) + offset, SI units and radians.".to_owned(),
    ];
    lines.push(match left_out.is_empty() {
        true => "Nothing of the model is left out.".to_owned(),
        false => format!(
            "NOT in here, though the model has it: {}.",
            left_out.join(", ")
        ),
    });
    let torque_units: Vec<String> = (0..program.joints.len())
        .map(|j| given.value.robot.torque_unit(j).to_owned())
        .collect();
    // every text is made before the first is written
    let mut texts: Vec<(&Path, &str, String)> = Vec::new();
    if let (Some(path), Some(side)) = (&args.urdf, &side) {
        let made = export::urdf::urdf(&given.value, &model, &name(path), &lines);
        let made =
            made.map_err(|error: ExportError| CliError::input(format!("{}: {error}", given.name)))?;
        texts.push((path, "URDF", made.urdf));
        texts.push((side, "model file of the URDF", made.side));
    }
    let note = Note {
        lines: lines.clone(),
        torque_units,
    };
    if let Some(path) = &args.c {
        let prefix = export::header::identifier(&stem(path));
        texts.push((
            path,
            "C99 header",
            export::header::header(&program, &prefix, &note),
        ));
    }
    if let Some(path) = &args.rust {
        texts.push((path, "Rust module", export::module::module(&program, &note)));
    }
    for (path, _, text) in &texts {
        context.write_text(path, text)?;
    }
    let mut table = Table::new(&[("file", Align::Left), ("what", Align::Left)])
        .caption(&format!("{} for other programs", given.name));
    for (path, what, _) in &texts {
        table.row([path.display().to_string().as_str(), what]);
    }
    let mut warnings: Vec<String> = match left_out.is_empty() {
        true => Vec::new(),
        false => vec![format!("left out: {}", left_out.join(", "))],
    };
    if args.urdf.is_some() {
        warnings.extend(below_zero(&given.value, &model));
    }
    let written = texts.iter().map(|(path, what, _)| Written {
        file: name(path),
        what: (*what).to_owned(),
    });
    let result = Exported {
        joints: program.joints.clone(),
        files: written.collect(),
        left_out,
    };
    Ok(Outcome {
        text: table.to_string(),
        document: Document::new("export", &[given.provenance], &warnings, &result)?,
        missed: Vec::new(),
    })
}
