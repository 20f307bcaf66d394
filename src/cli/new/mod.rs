//! `cft-ident new`: a robot file for a robot that the tool has never seen.

mod held;
mod text;
mod weights;

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::{CliError, Context, Outcome, file_name, inspect};
use cft_ident_core::robot::JointKind;
use cft_ident_files::config::{DeclaredCapsules, RobotFile};
use cft_ident_logs::inspect::{LogFault, Severity};
use cft_ident_logs::log::{LogSpec, Provenance, Reader, escape};
use cft_ident_logs::mapping::{
    ClockSource, JointColumns, LogHints, Mapping, SeenColumns, UrdfJoint, look,
};
use cft_ident_plant::excite::space::always_touching;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::table::{CellAlignment, Table, hanging};
use cft_ident_stages::identify::RobotSetup;
use held::{arm_alone, chain_of, has_columns, joints_of};
use text::DraftInputs;

const EXAMPLE: &str = "\
Example:
  cft-ident new myarm --urdf myarm.urdf --log run.csv
  cft-ident lsq run.csv -r myarm.toml -o model.toml";

/// Write a commented robot file from what a URDF and a log show.
///
/// NAME.toml names the joints, maps the columns of the log to them by their names and numbers, takes
/// units from names and sizes, and suggests cut-offs from its rate; where there is no URDF it is a
/// single joint, or a table of modified Denavit-Hartenberg rows to be filled in. What was guessed
/// says CHECK IT. The log is inspected with it. An existing file stays.
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
    /// Rate of a log that has no column of times
    #[arg(long, value_name = "HZ", requires = "log", value_parser = rate)]
    pub rate: Option<f64>,
    /// Topic of the robot in a recording of several machines
    #[arg(long, value_name = "NAME", requires = "log")]
    pub topic: Option<String>,
}

pub(super) fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok();
    let rate = rate.filter(|rate: &f64| rate.is_finite() && *rate > 0.0);
    rate.ok_or_else(|| "give a number above 0".to_owned())
}

/// What a drafted robot file describes the robot by.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum DraftShape {
    /// A URDF beside the robot file, by the path that the file will hold.
    Urdf {
        path: String,
        tip: Option<String>,
        held: BTreeMap<String, f64>,
    },
    /// Rows of a table to be filled in.
    Rows,
    /// One joint.
    Single(JointKind),
}

/// A robot file that was written.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Drafted")]
pub struct WrittenRobotFile {
    /// Its name.
    file: String,
    /// What the robot is.
    #[schemars(extend("enum" = ["single-joint", "serial"]))]
    model: &'static str,
    joints: Vec<JointColumns>,
    /// Rate of the log \[Hz\].
    rate_hz: Option<f64>,
    /// Cut-off of the parallel filter that was suggested \[Hz\].
    cutoff_hz: Option<f64>,
    /// Topic of the recording that was chosen.
    topic: Option<String>,
    /// What is a guess and marked CHECK IT in the file.
    checks: Vec<String>,
    /// What an inspection of the log with this file found; null without a log.
    faults: Option<Vec<LogFault>>,
}

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
        let text = format!("{} is there already", target.display());
        return Err(CliError::output(text).hint("choose another name, or delete the file"));
    }
    if args.name != target && args.name.is_file() {
        let name = args.name.display();
        let text = format!("{name} is a file, where the name of a new robot is asked for");
        return Err(CliError::usage(text).hint(format!(
            "name the robot, and its files by options: cft-ident new NAME --urdf ROBOT.urdf --log {name}"
        )));
    }
    let log = args.log.as_ref().map(|l| &*l.path);
    let inputs = args.urdf.as_deref().into_iter().chain(log);
    context.check_outputs(inputs, [&*target])?;
    let found = describe(args, &target, context)?;
    let (mapping, seen, mut warnings) = (found.mapping, found.seen, found.warnings);
    let place = target.display();
    let (mut unread, mut faults) = (false, None);
    if let Some(spec) = &args.log {
        if let Err(error) = Reader::open(spec, &found.file.layout()) {
            unread = true;
            let text = "the log cannot be read with this file yet";
            warnings.push(format!("{text}: {error}; correct [log] in {place}"));
        } else {
            let setup = RobotSetup::new(&target.to_string_lossy(), found.file);
            faults = Some(inspect::findings(spec, &setup, context)?.faults);
        }
    }
    context.write_text(&target, &found.text)?;
    let urdf = args.urdf.as_deref().map(Provenance::of_file).transpose()?;
    let log = seen.as_ref().map(|seen| seen.provenance.clone());
    let provenance: Vec<Provenance> = urdf.into_iter().chain(log).collect();
    let columns =
        ["joint", "position", "velocity", "torque"].map(|name| (name, CellAlignment::Left));
    let mut table = Table::new(&columns).caption(&format!("written: {place}"));
    for joint in &mapping.joints {
        let found = [&joint.position, &joint.velocity, &joint.torque];
        let [q, v, tau] = found.map(|column| column.as_deref().unwrap_or("-"));
        table.row([&joint.joint, q, v, tau]);
    }
    let mut all = faults.iter().flatten();
    let wrong = all.any(|f| f.severity == Severity::Error);
    let next = match &args.log {
        _ if found.shape == DraftShape::Rows => format!(
            "next: fill in the modified Denavit-Hartenberg rows ([[robot.link]]) of {place}\n"
        ),
        None => format!("next: cft-ident inspect LOG -r {place}\n"),
        Some(_) if unread => match &found.arm {
            Some(command) => format!("next: {command}\n"),
            None => format!("next: correct [log] in {place}\n"),
        },
        Some(spec) if wrong => {
            format!("next: mend the errors that are found: cft-ident inspect {spec} -r {place}\n")
        }
        Some(spec) => {
            let first = match mapping.is_sure(seen.as_ref()) {
                true => "",
                false => "look at the lines with CHECK IT in the file, then: ",
            };
            format!("next: {first}cft-ident lsq {spec} -r {place} -o model.toml\n")
        }
    };
    let all: Vec<&String> = mapping.checks.iter().chain(&mapping.torque_check).collect();
    let checks = checks_in_lines(&all);
    let inspected = inspected(faults.as_deref());
    let result = WrittenRobotFile {
        file: file_name(&target),
        model: found.model,
        joints: mapping.joints.clone(),
        rate_hz: seen.as_ref().and_then(|s| s.rate_hz),
        cutoff_hz: found.cutoff_hz,
        topic: seen.as_ref().and_then(|s| s.topic.clone()),
        checks: all.iter().map(|check| (*check).clone()).collect(),
        faults,
    };
    let brief = match all.len() {
        0 => format!("written: {place}"),
        n => format!("written: {place}, {n} to look at (CHECK IT)"),
    };
    Ok(Outcome::new(
        context.text(format!("{table}{checks}{inspected}{next}"), &brief),
        JsonDocument::new("new", &provenance, &warnings, &result)?,
    ))
}

/// The name of a single joint: that of its robot file, as far as a column may hold it.
fn joint_name(target: &Path) -> String {
    let name = target.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    name.chars().map(plain).collect()
}

/// A robot file as it was drafted.
pub(super) struct RobotDraft {
    pub text: String,
    pub file: RobotFile,
    pub mapping: Mapping,
    pub seen: Option<SeenColumns>,
    shape: DraftShape,
    model: &'static str,
    cutoff_hz: Option<f64>,
    /// The command that describes the arm alone, whose joints the log has.
    arm: Option<String>,
    pub warnings: Vec<String>,
}

impl RobotDraft {
    /// What is a guess, each with the line to change.
    pub fn guesses(&self) -> Vec<String> {
        let mapping = &self.mapping;
        let of_joints = mapping.checks.iter();
        let of_joints = of_joints.map(|check| format!("{check} ([log.joint] of robot.toml)"));
        let torque = mapping.torque_check.iter();
        let torque = torque.map(|check| format!("{check} (torque_is in [log] of robot.toml)"));
        let clock = self.seen.iter().filter_map(|seen| match &seen.clock {
            ClockSource::Column {
                name,
                guessed: true,
                ..
            } => Some(format!(
                "`{}` is the time, for it runs evenly (time in [log] of robot.toml)",
                escape(name)
            )),
            ClockSource::Rate {
                hz,
                coarse: Some(name),
            } => Some(format!(
                "rows lie evenly at {hz} Hz, for the clock of `{}` is too coarse for them (rate_hz in [log] of robot.toml)",
                escape(name)
            )),
            _ => None,
        });
        of_joints.chain(torque).chain(clock).collect()
    }
}

/// Drafts the robot file `target` from what a URDF and a log show; nothing is written.
pub(super) fn describe(
    args: &Args,
    target: &Path,
    context: &Context,
) -> Result<RobotDraft, CliError> {
    let urdf = args.urdf.as_deref();
    let load = |held: &BTreeMap<String, f64>| {
        let chain = urdf.map(|path| chain_of(path, args.tip.as_deref(), held));
        chain.transpose()
    };
    let mut held = BTreeMap::new();
    let mut chain = load(&held)?;
    let mut known: Option<Vec<UrdfJoint>> = chain.as_ref().map(joints_of);
    let asked = LogHints {
        rate_hz: args.rate,
        topic: args.topic.clone(),
    };
    let bar = context.progress("looking at the log", None);
    let joints = known.as_ref().map(Vec::len);
    let stop = || context.interrupted();
    let log = args.log.as_ref();
    let seen = log.map(|spec| look(spec, &asked, joints, &stop));
    let seen = seen.transpose()?;
    drop(bar);
    let mut mapping = Mapping::of(known.as_deref(), seen.as_ref());
    if let (Some(all), Some(_)) = (&chain, &seen) {
        held = held::before_arm(all, &mapping);
    }
    if let Some(check) = held::check(&held) {
        chain = load(&held)?;
        known = chain.as_ref().map(joints_of);
        mapping = Mapping::of(known.as_deref(), seen.as_ref());
        mapping.checks.push(check);
    }
    let both = chain.as_ref().zip(urdf);
    let capsules = both.map(|(chain, path)| chain.capsules(path));
    if let ([alone], None) = (&mut mapping.joints[..], &known) {
        // a column says what it is of, and not always of which joint
        alone.joint = joint_name(target);
    }
    let shape = match (&args.urdf, mapping.joints.len()) {
        (Some(path), _) => DraftShape::Urdf {
            path: beside(path, target),
            tip: args.tip.clone(),
            held: held.clone(),
        },
        (None, 0 | 1) => DraftShape::Single(mapping.kind()),
        (None, _) => DraftShape::Rows,
    };
    let mut draft = DraftInputs {
        name: escape(&target.file_stem().unwrap_or_default().to_string_lossy()),
        shape,
        mapping: &mapping,
        seen: seen.as_ref(),
        chain: chain.as_ref(),
        capsules: capsules.unwrap_or_default(),
        touching: Vec::new(),
    };
    // what is written must be readable, and the log by it
    let folder = target.parent();
    let read = |draft: &DraftInputs| {
        // rows that are to be filled in are read as if they were
        let filled = draft.text().replace("= nan ", "= 1.0 ");
        RobotFile::parse_in(&target.display().to_string(), &filled, folder)
    };
    let mut file = read(&draft)?;
    draft.touching = always_touching(&file);
    if !draft.touching.is_empty() {
        file = read(&draft)?;
    }
    let text = draft.text();
    let mut warnings = [file.notes.0.clone(), mapping.warnings.clone()].concat();
    if let Some(text) = unheld(&draft.capsules) {
        // capsules are for motions to come
        context.aside(&text);
        warnings.push(text);
    }
    if let Some(seen) = &seen
        && args.topic.is_none()
        && let Some(topic) = &seen.topic
    {
        warnings.push(format!(
            "topic {} is read, for it holds positions and torques and is no leader's and no command's; the others are {}",
            escape(topic),
            cft_ident_logs::log::list(seen.other_topics.iter().map(String::as_str))
        ));
    }
    if let (Some(spec), Some(_)) = (&args.log, &args.urdf)
        && mapping.torque_is == "joint"
        && mapping.joints.iter().all(JointColumns::is_torque)
        && let Some(text) = weights::warning(&file, spec, context)?
    {
        warnings.push(text);
    }
    let arm = chain.as_ref();
    let arm = arm.and_then(|chain| arm_alone(chain, &mapping, &held, args));
    if let Some(text) = without_columns(&mapping, arm.as_deref()).filter(|_| chain.is_some()) {
        warnings.push(text);
    }
    let (shape, model, cutoff_hz) = (draft.shape.clone(), draft.model(), draft.cutoff_hz());
    Ok(RobotDraft {
        text,
        file,
        shape,
        model,
        cutoff_hz,
        arm,
        warnings,
        mapping,
        seen,
    })
}

/// What is to be done about joints that a log of others has no columns of; `arm` is the command that leaves them out, where
/// they are no part between others.
fn without_columns(mapping: &Mapping, arm: Option<&str>) -> Option<String> {
    let (with, without): (Vec<&JointColumns>, Vec<_>) =
        (mapping.joints.iter()).partition(|joint| has_columns(joint));
    let last = with.last().filter(|_| !without.is_empty())?;
    let still = arm.map_or_else(String::new, |command| {
        format!(" where they stood still, the arm is described without them: `{command}`;")
    });
    Some(format!(
        "the log has no columns of {};{still} one that moves as one with a joint that was logged says so in the URDF: `<mimic joint=\"{}\" multiplier=\"1\"/>` in its <joint>",
        cft_ident_logs::log::list(without.iter().map(|joint| joint.joint.as_str())),
        last.joint,
    ))
}

/// Lines of a terminal that say what is to be looked at.
const CHECKS: usize = 5;

fn checks_in_lines(checks: &[&String]) -> String {
    let shown = match checks.len() > CHECKS {
        true => CHECKS - 1,
        false => checks.len(),
    };
    let lines = checks[..shown].iter();
    let mut out: String = lines.map(|check| format!("CHECK IT: {check}\n")).collect();
    if shown < checks.len() {
        let more = checks.len() - shown;
        out += &format!("CHECK IT: {more} more, marked so in the file\n");
    }
    out
}

/// The collision shapes that no capsule holds, in one sentence.
fn unheld(capsules: &DeclaredCapsules) -> Option<String> {
    let (first, more) = capsules.reasons.split_at(capsules.reasons.len().min(2));
    let more = match more.len() {
        0 => String::new(),
        more => format!("; and {more} more of the kind"),
    };
    (!first.is_empty()).then(|| {
        format!(
            "collision shapes that no capsule holds: {}{more}; put the files where they are named, or give [[limits.capsule]] tables",
            first.join("; ")
        )
    })
}

/// What an inspection found that spoils a fit, in lines.
fn inspected(faults: Option<&[LogFault]>) -> String {
    let Some(faults) = faults else {
        return String::new();
    };
    // the first of each kind, errors first
    let mut kinds: Vec<(&LogFault, usize)> = Vec::new();
    for fault in faults.iter().filter(|f| f.severity != Severity::Info) {
        let same = |(first, _): &&mut (&LogFault, usize)| {
            (first.kind, first.severity) == (fault.kind, fault.severity)
        };
        match kinds.iter_mut().find(same) {
            Some((_, count)) => *count += 1,
            None => kinds.push((fault, 1)),
        }
    }
    kinds.sort_by_key(|(fault, _)| fault.severity != Severity::Error);
    if kinds.is_empty() {
        return "inspect: no faults found\n".to_owned();
    }
    let line = |(fault, count): &(&LogFault, usize)| {
        let kind = match fault.severity {
            Severity::Error => "error",
            _ => "warning",
        };
        let channel = fault.channel.as_deref();
        let channel = channel.map_or_else(String::new, |name| format!("{}: ", escape(name)));
        let more = match count {
            1 => String::new(),
            count => format!(" ({} more of the kind)", count - 1),
        };
        let text = format!("{kind}: {channel}{}{more}", fault.effect);
        hanging("inspect: ", &text, 2)
    };
    kinds.iter().map(line).collect()
}

/// The independent joints of a URDF, their kinds and their largest torques.
/// The path of a file as another one may name it: from the folder of that one.
fn beside(file: &Path, from: &Path) -> String {
    let folder = match from.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let (Ok(file_full), Ok(folder_full)) = (file.canonicalize(), folder.canonicalize()) else {
        return file.display().to_string();
    };
    let (to, at) = (file_full.components(), folder_full.components());
    let pairs = to.clone().zip(at.clone());
    let shared = pairs.take_while(|(a, b)| a == b).count();
    let up = at.skip(shared).map(|_| Component::ParentDir);
    let path: PathBuf = up.chain(to.skip(shared)).collect();
    path.display().to_string()
}
