//! Which part of a robot's logs is fitted, and which is held out.

use super::CliError;
use cft_ident_files::config::campaign::CampaignLogs;
use cft_ident_logs::log::{LogSpec, Span};

/// Share of each log that is held out: its last part, or another where the filter cannot use that \[percent\].
const HELD_OUT: f64 = 25.0;
/// Logs from which on one is held out whole, the last that the filter can use.
const SEVERAL: usize = 3;

/// Sets a log aside where there are several, else a part of each; `is_usable` says whether a filter finds a stretch
/// that is long enough in a part.
pub(super) fn parted(
    logs: &[LogSpec],
    is_usable: &dyn Fn(&LogSpec) -> Result<bool, CliError>,
) -> Result<CampaignLogs, CliError> {
    let mut out = CampaignLogs::default();
    let mut fitted: Vec<LogSpec> = Vec::new();
    if logs.len() >= SEVERAL {
        fitted.extend(logs.iter().cloned());
        for place in (0..logs.len()).rev() {
            if is_usable(&logs[place])? {
                out.validation.push(fitted.remove(place).to_string());
                break;
            }
        }
    } else {
        for log in logs {
            match held_out(log, is_usable)? {
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

/// The parts of a log that are fitted and the one that is held out; none where the filter can use no such parts.
fn held_out(
    log: &LogSpec,
    is_usable: &dyn Fn(&LogSpec) -> Result<bool, CliError>,
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
        let mut all = true;
        for spec in rest.iter().chain([&held]) {
            all = all && is_usable(spec)?;
        }
        if all {
            return Ok(Some((rest, held)));
        }
    }
    Ok(None)
}
