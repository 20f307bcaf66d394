//! Logs without the parts in which a load is carried: what is looked for in the rest is of the arm.

use super::payload::carried_in;
use super::payload_result::CarriedSpan;
use crate::input::control::Control;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::log::Log;
use crate::input::log_data::LogData;
use crate::note::{FitNote, StageNote};
use cft_ident_logs::log::{Block, escape};

/// Part of the time of all logs that is to remain. Half: a quarter of a log is no diagnosis; twice: a load that is picked
/// up in the first half is taken for an effect.
const LEAST: f64 = 0.25;

/// Logs as a diagnosis takes them.
pub(crate) struct UnloadedLogs {
    pub data: Dataset,
    /// What was left out, one note each.
    pub notes: Vec<StageNote>,
}

/// The logs without the parts in which the last link carries what the model does not have; all of them where it carries
/// it throughout, or for the most part.
pub(crate) fn without_load(
    data: &Dataset,
    given: &GivenModel,
    control: &Control,
) -> Result<UnloadedLogs, IdentifyError> {
    let as_they_are = || UnloadedLogs {
        data: data.clone(),
        notes: Vec::new(),
    };
    let logs = [&*data.logs, &data.held_out].concat();
    let are_files = logs.iter().all(|log| matches!(log.source, Log::File(_)));
    if data.setup.robot.tool_stays_level() || !are_files {
        return Ok(as_they_are());
    }
    let carried = carried_in(&data.setup, &logs, given, control)?;
    let ends = carried
        .iter()
        .map(|span| rows_of(&logs[span.place], span, control));
    let ends = ends.collect::<Result<Vec<_>, _>>()?;
    let seconds = |log: &LogData| log.recording().duration_s();
    let whole: f64 = logs.iter().map(seconds).sum();
    let left = whole - ends.iter().map(|[from, to]| to - from).sum::<f64>();
    // a log that is loaded from its first row to its last says what it says
    let comes_or_goes = |span: &CarriedSpan| span.from_s.is_some() || span.to_s.is_some();
    if carried.is_empty() || !carried.iter().all(comes_or_goes) || left < LEAST * whole {
        return Ok(as_they_are());
    }
    // filters mix both sides of an end
    let room = data.setup.settings().cutoff_hz.recip();
    let with_room = |[from, to]: [f64; 2]| {
        let hundredths = |t: f64| (100.0 * t).round() / 100.0;
        [(from - room).max(0.0), to + room].map(hundredths)
    };
    let mut parts = Vec::with_capacity(logs.len());
    for (place, log) in logs.iter().enumerate() {
        let own = carried.iter().zip(&ends);
        let own: Vec<[f64; 2]> = own
            .filter(|(span, _)| span.place == place)
            .map(|(_, ends)| with_room(*ends))
            .collect();
        parts.push(match own.is_empty() {
            true => log.clone(),
            false => log.without(&data.setup, &own, control)?,
        });
    }
    let held_out = parts.split_off(data.logs.len());
    let note = |span: &CarriedSpan| {
        StageNote::Fit(FitNote::LoadLeftOut {
            log: escape(&span.log),
            from_s: span.from_s,
            to_s: span.to_s,
        })
    };
    Ok(UnloadedLogs {
        notes: carried.iter().map(note).collect(),
        data: Dataset {
            logs: parts,
            held_out,
            ..data.clone()
        },
    })
}

/// The rows in which a load is carried \[s after the log's first row\].
fn rows_of(
    log: &LogData,
    span: &CarriedSpan,
    control: &Control,
) -> Result<[f64; 2], IdentifyError> {
    let Log::File(spec) = &log.source else {
        return Ok([0.0; 2]);
    };
    let mut blocks = log.blocks(control)?;
    blocks.read(&mut Block::default())?;
    // a part of a log begins later
    let begin = blocks.reader().started_s() - spec.started_s;
    let [first, last] = log.recording().time_span;
    let from = span.from_s.map_or(begin, |t| t - spec.started_s);
    let to = span
        .to_s
        .map_or(begin + last - first, |t| t - spec.started_s);
    Ok([from, to])
}
