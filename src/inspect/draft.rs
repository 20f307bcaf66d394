//! Faults as they are told: of a whole channel, or of stretches of it.

use super::fault::{Episodes, FaultKind, LogFault, Severity};
use super::judge::Track;

/// Faults under construction, and what is to be cut out.
pub(super) struct FaultList {
    pub(super) faults: Vec<LogFault>,
    pub(super) cuts: Vec<[f64; 2]>,
    first: f64,
    last: f64,
}

impl FaultList {
    /// No faults yet, of a log from `first` to `last` [s].
    pub(super) fn new(first: f64, last: f64) -> Self {
        Self {
            faults: Vec::new(),
            cuts: Vec::new(),
            first,
            last,
        }
    }

    /// Adds a fault of a channel all through the log.
    pub(super) fn whole(
        &mut self,
        severity: Severity,
        kind: FaultKind,
        track: &Track,
        effect: String,
        remedy: &str,
    ) {
        self.of_log(severity, kind, track.rows, effect, remedy);
        if let Some(fault) = self.faults.last_mut() {
            fault.channel = Some(track.channel.name.clone());
        }
    }

    /// Adds a fault of all channels all through the log.
    pub(super) fn of_log(
        &mut self,
        severity: Severity,
        kind: FaultKind,
        rows: u64,
        effect: String,
        remedy: &str,
    ) {
        let duration_s = self.last - self.first;
        self.faults.push(LogFault {
            rows,
            ..LogFault::whole(severity, kind, duration_s, effect, remedy)
        });
    }

    /// Adds a fault for each stretch, or one for all of them where they are many; `effect` is
    /// given the rows and the number of stretches.
    pub(super) fn stretches(
        &mut self,
        kind: FaultKind,
        severity: Severity,
        channel: Option<&str>,
        episodes: &Episodes,
        effect: &dyn Fn(u64, usize) -> String,
        remedy: &str,
    ) {
        for (episode, count) in episodes.told() {
            let effect = effect(episode.rows, count);
            self.faults.push(LogFault {
                channel: channel.map(str::to_owned),
                from_s: episode.from - self.first,
                rows: episode.rows,
                ..LogFault::whole(severity, kind, episode.to - self.first, effect, remedy)
            });
        }
    }

    /// Leaves the rows of some stretches out, which were told as this fault of this channel.
    pub(super) fn cut(&mut self, kind: FaultKind, channel: &str, episodes: &Episodes) {
        for fault in &mut self.faults {
            fault.cut |= fault.kind == kind && fault.channel.as_deref() == Some(channel);
        }
        self.cuts.extend(episodes.iter().map(|e| [e.from, e.to]));
    }
}

/// `1 row`, `7 rows`, `7 rows in 3 stretches`.
pub(super) fn rows_text(rows: u64, stretches: usize) -> String {
    match (rows, stretches) {
        (1, _) => "1 row".to_owned(),
        (rows, 0 | 1) => format!("{rows} rows"),
        (rows, many) => format!("{rows} rows in {many} stretches"),
    }
}

/// A time for a person: `1.000 ms`.
pub(super) fn seconds(s: f64) -> String {
    match s.abs() {
        x if x >= 1.0 => format!("{s:.3} s"),
        x if x >= 1e-3 => format!("{:.3} ms", s * 1e3),
        _ => format!("{:.3} us", s * 1e6),
    }
}
