//! One log given twice: rows that count twice make deviations too small, and what was fitted is no holdout.

use super::dataset::Dataset;
use super::error::IdentifyError;
use super::log::Log;
use super::log_data::LogData;
use crate::note::{LogNote, StageNote};
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{DataRole, Layout, LogSpec, Provenance, escape, shares_rows};

/// What distinguishes the rows of a log from others.
pub(crate) struct RowIdentity {
    /// Name and span, for messages.
    shown: String,
    /// Of the whole log; none where it cannot be read any more.
    sha256: Option<String>,
    /// First and last time, by the log's own clock \[s\].
    bounds_s: [f64; 2],
}

impl RowIdentity {
    fn of_log(log: &LogData) -> Self {
        let provenance = log.recording().identity().ok();
        RowIdentity {
            shown: shown_log(&log.source),
            sha256: provenance.map(|provenance| provenance.sha256),
            bounds_s: log.bounds(),
        }
    }

    fn shares_rows(&self, other: &Self) -> bool {
        let [a, b] = [self.bounds_s, other.bounds_s];
        let overlap = a[0] <= b[1] && b[0] <= a[1];
        overlap && self.sha256.is_some() && self.sha256 == other.sha256
    }
}

/// What distinguishes the rows of each of these logs.
pub(crate) fn identities(logs: &[LogData]) -> Vec<RowIdentity> {
    logs.iter().map(RowIdentity::of_log).collect()
}

/// The same of the logs of a dataset that are fitted, reduced ones among them.
pub(crate) fn fitted_identities(data: &Dataset) -> Vec<RowIdentity> {
    let reduced = data.reduced.iter().map(|part| {
        let span = part.provenance.span.iter();
        let span: String = span.map(|span| format!("@{span}")).collect();
        RowIdentity {
            shown: escape(part.name()) + &span,
            sha256: Some(part.provenance.sha256.clone()),
            bounds_s: part.bounds_s,
        }
    });
    reduced.chain(identities(&data.logs)).collect()
}

/// Refuses two logs with the same rows, within a role and between roles.
pub(crate) fn each_row_once(
    roles: &[(&'static str, Vec<RowIdentity>)],
) -> Result<(), IdentifyError> {
    let all = roles.iter();
    let all = all.flat_map(|(role, logs)| logs.iter().map(move |log| (*role, log)));
    let all: Vec<(&'static str, &RowIdentity)> = all.collect();
    let pair = pairs(all.len(), |i, k| all[i].1.shares_rows(all[k].1)).next();
    let shown = |(role, log): (&'static str, &RowIdentity)| (role, log.shown.clone());
    pair.map_or(Ok(()), |(i, k)| {
        Err(same_rows(shown(all[i]), shown(all[k])))
    })
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
    let all = all.flat_map(|(role, logs)| logs.iter().map(move |log| (*role, log)));
    let all: Vec<(&'static str, &Log)> = all.collect();
    let same = |i: usize, k: usize| match (all[i].1, all[k].1) {
        (Log::File(a), Log::File(b)) => shares_rows(a, b, layout),
        (Log::Arrays(a), Log::Arrays(b)) => a.sha256() == b.sha256(),
        _ => false,
    };
    let shown = |(role, log): (&'static str, &Log)| (role, shown_log(log));
    let pair = pairs(all.len(), same).next();
    pair.map_or(Ok(()), |(i, k)| {
        Err(same_rows(shown(all[i]), shown(all[k])))
    })
}

/// The refusal of two logs with the same rows, each a role and a name.
fn same_rows(first: (&'static str, String), second: (&'static str, String)) -> IdentifyError {
    IdentifyError::SameRows {
        first: first.1,
        first_role: first.0,
        second: second.1,
        second_role: second.0,
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
pub(crate) fn without_rows_of(logs: &[LogData], others: &[LogData]) -> Vec<LogData> {
    let others = identities(others);
    let fresh = |log: &&LogData| {
        let own = RowIdentity::of_log(log);
        !others.iter().any(|other| own.shares_rows(other))
    };
    logs.iter().filter(fresh).cloned().collect()
}

/// A note for each two logs with the same rows.
pub(crate) fn repeated_rows(logs: &[RowIdentity]) -> Vec<StageNote> {
    let pairs = pairs(logs.len(), |i, k| logs[i].shares_rows(&logs[k]));
    pairs
        .map(|(i, k)| note(&logs[i].shown, &logs[k].shown))
        .collect()
}

/// The same of files that no robot file describes; `layout` names the time column where a robot is known.
pub fn repeated_files(logs: &[LogSpec], layout: Option<&Layout>) -> Vec<StageNote> {
    let pairs = pairs(logs.len(), |i, k| shares_rows(&logs[i], &logs[k], layout));
    pairs
        .map(|(i, k)| note(&shown(&logs[i]), &shown(&logs[k])))
        .collect()
}

fn note(first: &str, second: &str) -> StageNote {
    StageNote::Log(LogNote::Repeated {
        first: first.to_owned(),
        second: second.to_owned(),
    })
}

/// Places of each two of so many that are the same.
fn pairs(
    count: usize,
    same: impl Fn(usize, usize) -> bool,
) -> impl Iterator<Item = (usize, usize)> {
    let places = (0..count).flat_map(|k| (0..k).map(move |i| (i, k)));
    places.filter(move |(i, k)| same(*i, *k))
}

/// Name and span, for messages.
fn shown_log(log: &Log) -> String {
    match log {
        Log::File(spec) => shown(spec),
        log => escape(&log.name()),
    }
}

/// Name and span of a file, for messages.
fn shown(spec: &LogSpec) -> String {
    let span = spec.part().map(|span| format!("@{span}"));
    escape(&spec.name()) + &span.unwrap_or_default()
}
