//! Which part of a robot's logs is fitted, and which is held out.

use cft_ident_files::config::campaign::CampaignLogs;
use cft_ident_logs::log::{LogSpec, Span};

/// Share of each log that is fitted; the rest of it is held out \[percent\].
const FITTED: f64 = 75.0;
/// Logs from which on the last is held out whole.
const SEVERAL: usize = 3;

/// Sets the last log aside where there are several, else the last part of each.
pub(super) fn parted(logs: &[LogSpec]) -> CampaignLogs {
    let mut out = CampaignLogs::default();
    if let (Some((last, others)), true) = (logs.split_last(), logs.len() >= SEVERAL) {
        out.identification = others.iter().map(LogSpec::to_string).collect();
        out.validation = vec![last.to_string()];
        return out;
    }
    for log in logs {
        let parts = |span: fn(f64, f64) -> Span, from: f64, to: f64| {
            let middle = from + 0.01 * FITTED * (to - from);
            Some([span(from, middle), span(middle, to)])
        };
        let percent = |from, to| Span::Percent { from, to };
        let parted = match log.span {
            Span::Whole => parts(percent, 0.0, 100.0),
            Span::Percent { from, to } => parts(percent, from, to),
            Span::Seconds { to, .. } if to.is_infinite() => None,
            Span::Seconds { from, to } => parts(|from, to| Span::Seconds { from, to }, from, to),
        };
        let part = |span: Span| log.of_span(span).to_string();
        match parted {
            Some([fitted, rest]) => {
                out.identification.push(part(fitted));
                out.validation.push(part(rest));
            }
            None => out.identification.push(log.to_string()),
        }
    }
    out
}
