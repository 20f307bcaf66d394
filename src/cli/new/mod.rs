//! `cft-ident new`: a robot file for a robot that the tool has never seen.

mod columns;
mod text;

use std::path::{Component, Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::outputs::write_text;
use super::{CliError, Context, Outcome};
use crate::config::{RobotFile, UrdfChain};
use crate::log::{LogSpec, Provenance, Reader, escape};
use crate::report::json::Document;
use crate::report::table::{Align, Table};
use crate::robot::JointKind;
use columns::Mapping;
use text::Draft;

const EXAMPLE: &str = "\
Example:
  cft-ident new myarm --urdf myarm.urdf --log run.csv
  cft-ident lsq run.csv -r myarm.toml -o model.toml";

/// Write a commented robot file from what a URDF and a log show.
///
/// NAME.toml names the joints, maps the columns of the log to them by their names, and suggests
/// cut-offs from its rate; where there is no URDF it is a single joint, or a table of modified
/// Denavit-Hartenberg rows to be filled in. What was guessed says so. An existing file stays.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Name of the robot; the file is NAME.toml
    #[arg(value_name = "NAME")]
    pub name: PathBuf,
    /// URDF of the robot
    #[arg(long, value_name = "FILE.urdf")]
    pub urdf: Option<PathBuf>,
    /// Link of the URDF where the chain ends, if it branches
    #[arg(long, value_name = "LINK", requires = "urdf")]
    pub tip: Option<String>,
    /// A log of the robot
    #[arg(long, value_name = "LOG")]
    pub log: Option<LogSpec>,
}

/// What the robot is, as far as it can be seen.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    /// A URDF beside the robot file, by the path that the file will hold.
    Urdf { path: String, tip: Option<String> },
    /// Rows of a table to be filled in.
    Rows,
    /// One joint.
    Single(JointKind),
}

/// A robot file that was written.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Drafted {
    /// Its name.
    file: String,
    /// What the robot is.
    #[schemars(extend("enum" = ["single-joint", "serial"]))]
    model: &'static str,
    joints: Vec<columns::Joint>,
    /// Rate of the log \[Hz\].
    rate_hz: Option<f64>,
    /// Cut-off of the parallel filter that was suggested \[Hz\].
    cutoff_hz: Option<f64>,
}

/// Runs the command.
///
/// # Errors
/// A file that is there already; a URDF or log that cannot be used.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let target = match args.name.extension() {
        Some(end) if end == "toml" => args.name.clone(),
        _ => {
            let mut name = args.name.clone().into_os_string();
            name.push(".toml");
            PathBuf::from(name)
        }
    };
    if target.exists() {
        return Err(
            CliError::output(format!("{} is there already", target.display()))
                .hint("choose another name, or delete the file"),
        );
    }
    let inputs: Vec<&Path> = [
        args.urdf.as_deref(),
        args.log.as_ref().map(|l| l.path.as_path()),
    ]
    .into_iter()
    .flatten()
    .collect();
    context.check_outputs(&inputs, &[&target])?;
    let chain = match &args.urdf {
        Some(path) => Some(UrdfChain::load(path, args.tip.as_deref())?),
        None => None,
    };
    let seen = match &args.log {
        Some(spec) => Some(columns::look(spec, context)?),
        None => None,
    };
    let named: Option<Vec<(String, JointKind)>> = chain.as_ref().map(joints_of);
    let mapping = Mapping::of(named.as_deref(), seen.as_ref());
    let shape = match (&args.urdf, mapping.joints.len()) {
        (Some(path), _) => Shape::Urdf {
            path: beside(path, &target),
            tip: args.tip.clone(),
        },
        (None, 0 | 1) => Shape::Single(mapping.kind()),
        (None, _) => Shape::Rows,
    };
    let draft = Draft {
        name: target
            .file_stem()
            .map(|stem| escape(&stem.to_string_lossy()))
            .unwrap_or_default(),
        shape,
        mapping: &mapping,
        seen: seen.as_ref(),
    };
    let text = draft.text();
    // what is written must be readable, and the log by it
    let folder = target.parent();
    // rows that are to be filled in are read as if they were
    let filled = text.replace("= nan ", "= 1.0 ");
    let file = RobotFile::parse_in(&target.display().to_string(), &filled, folder)?;
    let mut warnings = [file.notes.clone(), mapping.warnings.clone()].concat();
    if let Some(spec) = &args.log
        && let Err(error) = Reader::open(spec, &file.layout())
    {
        warnings.push(format!(
            "the log cannot be read with this file yet: {error}; correct [log] in {}",
            target.display()
        ));
    }
    write_text(&target, &text)?;
    let mut provenance = Vec::new();
    if let Some(path) = &args.urdf {
        provenance.push(Provenance::of_file(path)?);
    }
    if let Some(seen) = &seen {
        provenance.push(seen.provenance.clone());
    }
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("position", Align::Left),
        ("velocity", Align::Left),
        ("torque", Align::Left),
    ])
    .caption(&format!("written: {}", target.display()));
    let or_dash = |column: &Option<String>| column.clone().unwrap_or_else(|| "-".to_owned());
    for joint in &mapping.joints {
        table.row([
            joint.name.as_str(),
            &or_dash(&joint.position),
            &or_dash(&joint.velocity),
            &or_dash(&joint.torque),
        ]);
    }
    let next = match &args.log {
        _ if draft.shape == Shape::Rows => format!(
            "next: fill in the modified Denavit-Hartenberg rows ([[robot.link]]) of {}\n",
            target.display()
        ),
        Some(spec) => format!(
            "next: cft-ident lsq {spec} -r {} -o model.toml\n",
            target.display()
        ),
        None => format!("next: cft-ident inspect LOG -r {}\n", target.display()),
    };
    let result = Drafted {
        file: target
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        model: draft.model(),
        joints: mapping.joints.clone(),
        rate_hz: seen.as_ref().and_then(|s| s.rate_hz),
        cutoff_hz: draft.cutoff_hz(),
    };
    Ok(Outcome {
        text: format!("{table}{next}"),
        document: Document::new("new", &provenance, &warnings, &result)?,
        missed: Vec::new(),
    })
}

/// The independent joints of a URDF and their kinds.
fn joints_of(chain: &UrdfChain) -> Vec<(String, JointKind)> {
    let of = |link: &crate::config::serial_section::LinkSection| {
        let kind = link.kind.unwrap_or(JointKind::Revolute);
        link.joint.clone().map(|joint| (joint, kind))
    };
    chain.links.iter().filter_map(of).collect()
}

/// The path of a file as another one may name it: from the folder of that one.
fn beside(file: &Path, from: &Path) -> String {
    let folder = match from.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let (Ok(file_full), Ok(folder_full)) = (file.canonicalize(), folder.canonicalize()) else {
        return file.display().to_string();
    };
    let (to, at): (Vec<Component>, Vec<Component>) = (
        file_full.components().collect(),
        folder_full.components().collect(),
    );
    let shared = to.iter().zip(&at).take_while(|(a, b)| a == b).count();
    let mut path = PathBuf::new();
    for _ in shared..at.len() {
        path.push("..");
    }
    path.extend(&to[shared..]);
    path.display().to_string()
}
