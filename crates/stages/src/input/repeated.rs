//! One log given twice: rows that count twice make deviations too small, and what was fitted is no holdout.

use super::error::IdentifyError;
use super::log::Log;
use super::log_data::LogData;
use super::robot_setup::RobotSetup;
use crate::note::{LogNote, StageNote};
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{DataRole, Layout, Provenance, escape, sha256, shares_rows};

/// Logs by what they are used for.
pub(crate) type Role<'a> = (&'static str, &'a [LogData]);

/// Refuses two logs with the same rows, within a role and between roles.
pub(crate) fn each_row_once(setup: &RobotSetup, roles: &[Role]) -> Result<(), IdentifyError> {
    let sources = |(role, logs): &Role| (*role, logs.iter().map(LogData::source).collect());
    let all: Vec<(&str, Vec<Log>)> = roles.iter().map(sources).collect();
    each_log_once(&all, Some(&setup.file.layout()))
}

/// The same of logs that are not read yet; `layout` names the time column where a robot is known.
///
/// # Errors
/// [`IdentifyError::SameRows`].
pub fn each_log_once(
    roles: &[(&'static str, Vec<Log>)],
    layout: Option<&Layout>,
) -> Result<(), IdentifyError> {
    let all = roles.iter();
    let all = all.flat_map(|(role, logs)| logs.iter().map(|log| (*role, log)));
    let all: Vec<(&str, &Log)> = all.collect();
    let logs: Vec<&Log> = all.iter().map(|(_, log)| *log).collect();
    match pairs(&logs, layout).next() {
        None => Ok(()),
        Some((i, k)) => Err(IdentifyError::SameRows {
            first: all[i].1.shown(),
            first_role: all[i].0,
            second: all[k].1.shown(),
            second_role: all[k].0,
        }),
    }
}

/// Which inputs hold rows that a model was made from.
///
/// By checksum and role alone: a file that lost the number of rows of its last input must not turn a log that the
/// model was fitted to into an unseen one.
pub fn used_for(file: &ModelFile, inputs: &[Provenance]) -> Vec<bool> {
    let held_out = |made: &Provenance| made.role == Some(DataRole::HeldOut);
    let made_from = || (file.provenance.inputs.iter()).filter(|input| !held_out(input));
    let used = |input: &Provenance| made_from().any(|made| made.shares_rows(input));
    inputs.iter().map(used).collect()
}

/// Refuses a log that is given as unseen and holds rows that the model was made from.
pub(crate) fn unseen_by(
    model: (&str, &ModelFile),
    logs: &[Provenance],
) -> Result<(), IdentifyError> {
    let used = used_for(model.1, logs);
    match logs.iter().zip(used).find(|(_, used)| *used) {
        None => Ok(()),
        Some((log, _)) => Err(IdentifyError::RowsOfModel {
            log: escape(&log.name),
            model: model.0.to_owned(),
        }),
    }
}

/// Logs of the list that share no row with one of the others.
pub(crate) fn without_rows_of(
    setup: &RobotSetup,
    logs: &[LogData],
    others: &[LogData],
) -> Vec<LogData> {
    let layout = setup.file.layout();
    let fresh = |log: &&LogData| {
        !others
            .iter()
            .any(|other| same_rows(&log.source(), &other.source(), Some(&layout)))
    };
    logs.iter().filter(fresh).cloned().collect()
}

/// A note for each two logs with the same rows, for commands that only look; `layout` names the time column
/// where a robot is known.
pub fn repeated_rows(logs: &[Log], layout: Option<&Layout>) -> Vec<StageNote> {
    let all: Vec<&Log> = logs.iter().collect();
    pairs(&all, layout)
        .map(|(i, k)| {
            let (first, second) = (all[i].shown(), all[k].shown());
            StageNote::Log(LogNote::Repeated { first, second })
        })
        .collect()
}

fn pairs<'a>(
    logs: &'a [&'a Log],
    layout: Option<&'a Layout>,
) -> impl Iterator<Item = (usize, usize)> + 'a {
    let places = (0..logs.len()).flat_map(|k| (0..k).map(move |i| (i, k)));
    places.filter(move |(i, k)| same_rows(logs[*i], logs[*k], layout))
}

fn same_rows(a: &Log, b: &Log, layout: Option<&Layout>) -> bool {
    match (a, b) {
        (Log::File(a), Log::File(b)) => shares_rows(a, b, layout),
        (Log::Arrays(a), Log::Arrays(b)) => a.sha256() == b.sha256(),
        (Log::Reduced(a), Log::Reduced(b)) => a.shares_rows(b),
        (Log::Reduced(part), log) | (log, Log::Reduced(part)) => log
            .provenance()
            .is_some_and(|p| p.shares_rows(&part.provenance)),
        _ => false,
    }
}

impl Log {
    /// Name and span, for messages.
    fn shown(&self) -> String {
        match self {
            Self::File(spec) => match spec.part() {
                Some(span) => format!("{}@{span}", escape(&spec.name())),
                None => escape(&spec.name()),
            },
            Self::Arrays(arrays) => escape(arrays.name()),
            Self::Reduced(part) => match &part.provenance.span {
                Some(span) => format!("{}@{span}", escape(part.name())),
                None => escape(part.name()),
            },
        }
    }

    /// What distinguishes its rows from others, where it can be read.
    fn provenance(&self) -> Option<Provenance> {
        let (span, sha256) = match self {
            Self::File(spec) => (spec.part(), sha256(&spec.path).ok()?),
            Self::Arrays(arrays) => (None, arrays.sha256().to_owned()),
            Self::Reduced(part) => return Some(part.provenance.clone()),
        };
        Some(Provenance {
            name: self.name(),
            span,
            sha256,
            samples: 0,
            duration_s: 0.0,
            role: None,
        })
    }
}
