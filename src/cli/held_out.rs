//! Which part of a robot's logs is fitted, and which is held out.

use super::CliError;
use cft_ident_files::config::campaign::CampaignLogs;
use cft_ident_logs::log::{LogSpec, Span};
use cft_ident_stages::identify::FilteredMotion;

/// The motion that the filter makes of logs, held beside that of others; none where one of them has no stretch that is
/// long enough.
type MotionOfLogs<'a> =
    dyn Fn(&[LogSpec], Option<&FilteredMotion>) -> Result<Option<FilteredMotion>, CliError> + 'a;

/// Share of each log that is held out: its last part, or another where that cannot be \[percent\].
const HELD_OUT: f64 = 25.0;
/// Logs from which on one is held out whole, the last that the filter can use.
const SEVERAL: usize = 3;

/// Sets a log aside where there are several that the filter can use, else a part of each.
pub(super) fn parted(logs: &[LogSpec], motion_of: &MotionOfLogs) -> Result<CampaignLogs, CliError> {
    let mut out = CampaignLogs::default();
    let mut fitted: Vec<LogSpec> = Vec::new();
    if logs.len() >= SEVERAL {
        fitted.extend(logs.iter().cloned());
        for place in (0..logs.len()).rev() {
            if motion_of(&logs[place..=place], None)?.is_some() {
                out.validation.push(fitted.remove(place).to_string());
                break;
            }
        }
    } else {
        for log in logs {
            match held_out(log, motion_of)? {
                Some((rest, part)) => {
                    fitted.extend(rest);
                    out.validation.push(part.to_string());
                }
                None => fitted.push(log.clone()),
            }
        }
    }
    out.identification = fitted.iter().map(LogSpec::to_string).collect();
    Ok(out)
}

/// The parts of a log that are fitted and the one that is held out: parts that the filter can use, of which the second
/// moves, for the most part, where the first do and as fast. Of tests of several kinds in one file none is held out so.
fn held_out(
    log: &LogSpec,
    motion_of: &MotionOfLogs,
) -> Result<Option<(Vec<LogSpec>, LogSpec)>, CliError> {
    let (span, from, to): (fn(f64, f64) -> Span, f64, f64) = match log.span {
        Span::Seconds { to, .. } if to.is_infinite() => return Ok(None),
        Span::Seconds { from, to } => (|from, to| Span::Seconds { from, to }, from, to),
        Span::Percent { from, to } => (|from, to| Span::Percent { from, to }, from, to),
        Span::Whole => (|from, to| Span::Percent { from, to }, 0.0, 100.0),
    };
    let at = |percent: f64| from + 0.01 * percent * (to - from);
    let part = |a: f64, b: f64| (b > a).then(|| log.of_span(span(at(a), at(b))));
    // the last part, the first, then those between
    for begin in [100.0 - HELD_OUT, 0.0, 50.0, HELD_OUT] {
        let end = begin + HELD_OUT;
        let rest: Vec<LogSpec> = [part(0.0, begin), part(end, 100.0)]
            .into_iter()
            .flatten()
            .collect();
        let Some(held) = part(begin, end).filter(|_| !rest.is_empty()) else {
            continue;
        };
        let Some(fitted) = motion_of(&rest, None)? else {
            continue;
        };
        let seen = motion_of(std::slice::from_ref(&held), Some(&fitted))?;
        if seen.is_some_and(|seen| seen.is_within()) {
            return Ok(Some((rest, held)));
        }
    }
    Ok(None)
}
