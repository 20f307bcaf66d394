//! Files of drives -> [`DriveLog`]s: rigs of BAM, `.pt` of PACE, folders of SAGE, and tables.

pub mod bam;
pub mod pace;
pub mod pickle;
pub mod sage;

use std::path::Path;

use cft_ident_core::explain::Explain;
use cft_ident_logs::log::{self, LogSpec, Provenance, RawBlock, RawReader, Span, escape};

use super::check;
use super::error::DriveError;
use super::track::{CommandIs, DriveLoad, DriveLog, JointTrack};
use bam::RigGiven;

/// What a person says about logs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadRequest {
    pub rig: RigGiven,
    /// Names of the joints, in the order of files that have none.
    pub joints: Vec<String>,
    /// Columns of the commands of a table: `q_des_*`.
    pub command: Option<String>,
    /// Columns of the positions of a table: `q_*`.
    pub position: Option<String>,
    /// Whether the links of a robot are known.
    pub robot: bool,
    /// Whether a volts drive is meant, whose gain may be unknown.
    pub volts: bool,
}

/// Reads a log: the part of it that is used, checked.
pub fn read(spec: &LogSpec, told: &ReadRequest) -> Result<(DriveLog, Provenance), DriveError> {
    let path = spec.path.as_path();
    let name = spec.name();
    let file = escape(&name);
    let said = |what: String, remedy: &str| DriveError::File {
        file: file.clone(),
        what,
        remedy: remedy.to_owned(),
    };
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    let (mut log, sha256) = if path.is_dir() {
        let texts = sage::FILES.map(|name| text(&path.join(name)));
        let [control, state] = texts;
        let (control, state) = (control?, state?);
        let sha256 = log::sha256_of_bytes(format!("{control}{state}").as_bytes());
        let found = sage::read(&control, &state).map_err(|what| {
            said(
                what,
                "a folder of SAGE holds control.csv and state_motor.csv with timestamp and positions",
            )
        })?;
        let joints = tracks(&file, found.position, found.command, told)?;
        (plain(&name, found.t, CommandIs::Held, joints, told), sha256)
    } else if ending == "pt" {
        let bytes = bytes(path)?;
        let found = pace::read(&bytes).map_err(|what| {
            said(
                what,
                "save a dictionary of tensors time, dof_pos and des_dof_pos with torch.save",
            )
        })?;
        let joints = tracks(&file, found.position, found.command, told)?;
        let log = plain(&name, found.t, CommandIs::Held, joints, told);
        (log, log::sha256_of_bytes(&bytes))
    } else if ending == "json" {
        let bytes = bytes(path)?;
        if !bam::is_bam(&bytes) {
            return Err(said(
                "is no log of a rig".to_owned(),
                "a rig's log is an object with mass, length, kp and entries, as BAM writes it",
            ));
        }
        (
            bam::read(&file, &bytes, &told.rig)?,
            log::sha256_of_bytes(&bytes),
        )
    } else {
        table(spec, told)?
    };
    increasing(&file, &log)?;
    cut(&mut log, spec.span);
    if log.t.len() < LEAST_ROWS {
        return Err(said(
            format!("{} rows are left", log.t.len()),
            "choose a longer part: a drive needs a second of motion at least",
        ));
    }
    check::check(&mut log)?;
    let provenance = Provenance {
        name,
        span: spec.span.label(),
        sha256,
        samples: log.t.len() as u64,
        duration_s: log.duration(),
        role: None,
    };
    Ok((log, provenance))
}

/// Fewest rows of a log.
const LEAST_ROWS: usize = 20;

fn bytes(path: &Path) -> Result<Vec<u8>, DriveError> {
    log::bytes(path).map_err(unread)
}

fn unread(error: log::LogError) -> DriveError {
    let explained = error.explanation();
    DriveError::Request {
        what: explained.what,
        remedy: explained.remedies.join("; "),
    }
}

fn text(path: &Path) -> Result<String, DriveError> {
    let bytes = bytes(path)?;
    String::from_utf8(bytes).map_err(|_| DriveError::File {
        file: log::shown(path),
        what: "is no text".to_owned(),
        remedy: "a folder of SAGE holds control.csv and state_motor.csv".to_owned(),
    })
}

/// Tracks of columns joint after joint, with what is told of names and gains.
fn tracks(
    file: &str,
    position: Vec<Vec<f64>>,
    command: Vec<Vec<f64>>,
    told: &ReadRequest,
) -> Result<Vec<JointTrack>, DriveError> {
    let wide = position.len();
    if !told.joints.is_empty() && told.joints.len() != wide {
        return Err(DriveError::File {
            file: file.to_owned(),
            what: format!("holds {wide} joints, and {} are named", told.joints.len()),
            remedy: "name each joint once, in the order of the file: --joints a,b,..".to_owned(),
        });
    }
    let name = |j: usize| match told.joints.get(j) {
        Some(name) => name.clone(),
        None => format!("joint_{}", j + 1),
    };
    let (kp, kd) = gains(file, told)?;
    let pairs = position.into_iter().zip(command).enumerate();
    let track = |(j, (position, command))| JointTrack {
        joint: name(j),
        command,
        position,
        kp,
        kd,
        ..JointTrack::default()
    };
    Ok(pairs.map(track).collect())
}

/// The gains: those that are told; where torques are ratios an unknown kp is one unit.
fn gains(file: &str, told: &ReadRequest) -> Result<(f64, f64), DriveError> {
    match (told.rig.kp, told.robot && !told.volts) {
        (Some(kp), _) => Ok((kp, told.rig.kd.unwrap_or(0.0))),
        (None, false) => Ok((1.0, 0.0)),
        (None, true) => Err(DriveError::File {
            file: file.to_owned(),
            what: "no gain of the drives is given".to_owned(),
            remedy: "give the gains that the controller had: --kp 20 --kd 1.5; or, of hobby servos whose gain is a count of their firmware, --volts".to_owned(),
        }),
    }
}

fn plain(
    name: &str,
    t: Vec<f64>,
    command_is: CommandIs,
    joints: Vec<JointTrack>,
    told: &ReadRequest,
) -> DriveLog {
    let mut facts = Vec::new();
    for (fact, value) in [("kp", told.rig.kp), ("kd", told.rig.kd)] {
        facts.extend(value.map(|value| (fact.to_owned(), value)));
    }
    DriveLog {
        number: 0,
        name: name.to_owned(),
        motion: name.to_owned(),
        facts,
        t,
        command_is,
        joints,
        load: match told.robot {
            true => DriveLoad::Robot,
            false => DriveLoad::Unknown,
        },
        findings: Vec::new(),
    }
}

fn increasing(file: &str, log: &DriveLog) -> Result<(), DriveError> {
    match (1..log.t.len()).find(|k| log.t[*k] <= log.t[k - 1] || log.t[*k].is_nan()) {
        None => Ok(()),
        Some(k) => Err(DriveError::File {
            file: file.to_owned(),
            what: format!("row {k}: the time does not increase"),
            remedy: "sort the rows by time and leave copies out".to_owned(),
        }),
    }
}

/// Keeps a span.
fn cut(log: &mut DriveLog, span: Span) {
    let (from, to) = match span {
        Span::Whole => return,
        Span::Percent { from, to } => (from / 100.0 * log.duration(), to / 100.0 * log.duration()),
        Span::Seconds { from, to } => (from, to),
    };
    let begin = log.t.first().copied().unwrap_or(0.0);
    let ends = to >= log.duration();
    let inside = |t: &f64| t - begin >= from && (t - begin < to || ends);
    let keep: Vec<bool> = log.t.iter().map(inside).collect();
    fn only<T: Copy>(x: &mut Vec<T>, keep: &[bool]) {
        if x.is_empty() {
            return;
        }
        let kept = x.iter().zip(keep).filter(|(_, keep)| **keep);
        *x = kept.map(|(x, _)| *x).collect();
    }
    for track in &mut log.joints {
        only(&mut track.command, &keep);
        only(&mut track.position, &keep);
        only(&mut track.supply, &keep);
        only(&mut track.on, &keep);
    }
    only(&mut log.t, &keep);
}

/// A table with a column of commands and one of positions for each joint.
fn table(spec: &LogSpec, told: &ReadRequest) -> Result<(DriveLog, FileChecksum), DriveError> {
    let name = spec.name();
    let file = escape(&name);
    let said = |what: String, remedy: String| DriveError::File {
        file: file.clone(),
        what,
        remedy,
    };
    let whole = spec.of_span(Span::Whole);
    let mut reader = RawReader::open(&whole, None).map_err(unread)?;
    let names = reader.names().to_vec();
    let Some(pattern) = &told.command else {
        return Err(said(
            format!(
                "which columns are commands is not said; it has {}",
                names.join(", ")
            ),
            "say it: --command 'q_des_*', and --position where positions are no q_*".to_owned(),
        ));
    };
    let position = told.position.as_deref().unwrap_or("q_*");
    let mut pairs = Vec::new();
    for (c, name) in names.iter().enumerate() {
        let Some(joint) = matched(pattern, name) else {
            continue;
        };
        let wanted = position.replace('*', joint);
        let Some(q) = names.iter().position(|n| *n == wanted) else {
            return Err(said(
                format!(
                    "{name} is the command of {joint}, and no column {wanted} holds its position"
                ),
                "say which do: --position 'NAME_*'".to_owned(),
            ));
        };
        pairs.push((joint.to_owned(), c, q));
    }
    if pairs.is_empty() {
        return Err(said(
            format!("no column is like {pattern}; it has {}", names.join(", ")),
            "say which columns are commands: --command 'NAME_*'".to_owned(),
        ));
    }
    if !told.joints.is_empty() {
        let find = |joint: &String| {
            let found = pairs.iter().find(|(name, ..)| name == joint);
            let known = || {
                pairs
                    .iter()
                    .map(|(n, ..)| n.as_str())
                    .collect::<Vec<_>>()
                    .join(", ")
            };
            found.cloned().ok_or_else(|| {
                said(
                    format!("holds no command of joint {joint}; it has {}", known()),
                    "give the columns the joint names of the robot".to_owned(),
                )
            })
        };
        pairs = told.joints.iter().map(find).collect::<Result<_, _>>()?;
    }
    let time = names
        .iter()
        .position(|n| ["t", "time", "timestamp"].contains(&n.as_str()));
    if !reader.is_timed() {
        let time = time.unwrap_or(0);
        reader.set_time_by_numbers(time).map_err(unread)?;
    }
    let (kp, kd) = gains(&file, told)?;
    let mut t = Vec::new();
    let mut joints: Vec<JointTrack> = pairs
        .iter()
        .map(|(joint, ..)| JointTrack {
            joint: joint.clone(),
            kp,
            kd,
            ..JointTrack::default()
        })
        .collect();
    let mut block = RawBlock::default();
    while reader.read(&mut block).map_err(unread)? {
        for k in 0..block.rows() {
            let row = pairs
                .iter()
                .map(|(_, c, q)| [block.columns[*c][k], block.columns[*q][k]]);
            let row: Vec<[f64; 2]> = row.collect();
            let usable = row.iter().flatten().all(|x| x.is_finite()) && block.t[k].is_finite();
            // a row that repeats its time says nothing new
            if !usable || t.last().is_some_and(|last| block.t[k] <= *last) {
                continue;
            }
            t.push(block.t[k]);
            for (track, [command, position]) in joints.iter_mut().zip(row) {
                track.command.push(command);
                track.position.push(position);
            }
        }
    }
    let sha256 = reader.provenance().map_err(unread)?.sha256;
    Ok((plain(&name, t, CommandIs::Held, joints, told), sha256))
}

/// SHA-256 of a file, hexadecimal.
type FileChecksum = String;

/// What stands for `*`.
fn matched<'a>(pattern: &str, name: &'a str) -> Option<&'a str> {
    let (before, after) = pattern.split_once('*').unwrap_or((pattern, ""));
    let rest = name.strip_prefix(before)?.strip_suffix(after)?;
    match pattern.contains('*') {
        true => (!rest.is_empty()).then_some(rest),
        false => rest.is_empty().then_some(name),
    }
}
