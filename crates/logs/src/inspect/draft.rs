//! Faults as they are reported: of a whole channel, or of stretches of it.

use super::fault::{Episodes, FaultKind, LogFault, Severity};
use super::judge::Track;
use crate::log::RowFault;
use cft_ident_core::number::clock;

/// Faults under construction, and what is to be cut out.
pub(super) struct FaultList {
    pub(super) faults: Vec<LogFault>,
    /// Rows to leave out: from, to [s], and why.
    pub(super) cuts: Vec<([f64; 2], FaultKind)>,
    /// Numbers to put in the place of spikes: time [s], place of the channel, number.
    pub(super) bridges: Vec<(f64, usize, f64)>,
    /// Times of rows that were not read [s].
    pub(super) failed: Vec<f64>,
    /// Positions that begin anew, by their places, and their ranges.
    pub(super) wraps: Vec<(usize, f64)>,
    /// Torques that are exactly 0 in motion, by their places: from, to [s].
    pub(super) off: Vec<(usize, [f64; 2])>,
    /// Stretches in which everything is frozen [s].
    pub(super) stalls: Vec<[f64; 2]>,
    /// Rows for which each sample was held.
    pub(super) held: Option<usize>,
    /// Kinds that are reported but not acted upon.
    pub(super) keep: Vec<RowFault>,
    first: f64,
    last: f64,
}

impl FaultList {
    /// No faults yet, of a log from `first` to `last` [s].
    pub(super) fn new(first: f64, last: f64, keep: &[RowFault]) -> Self {
        Self {
            faults: Vec::new(),
            cuts: Vec::new(),
            bridges: Vec::new(),
            failed: Vec::new(),
            wraps: Vec::new(),
            off: Vec::new(),
            stalls: Vec::new(),
            held: None,
            keep: keep.to_vec(),
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
        for (episode, count) in episodes.merged() {
            let effect = effect(episode.rows, count);
            self.faults.push(LogFault {
                channel: channel.map(str::to_owned),
                from_s: episode.from - self.first,
                rows: episode.rows,
                ..LogFault::whole(severity, kind, episode.to - self.first, effect, remedy)
            });
        }
    }

    /// Leaves the rows of some stretches out, which were reported as this fault of this channel, unless
    /// the robot file keeps them.
    pub(super) fn cut(&mut self, kind: FaultKind, channel: Option<&str>, episodes: &Episodes) {
        if self.acts(kind, channel) {
            let spans = episodes.iter().map(|e| ([e.from, e.to], kind));
            self.cuts.extend(spans);
        }
    }

    /// Marks what was reported as this fault of this channel as acted upon; false, and told so, where
    /// the robot file keeps it.
    pub(super) fn acts(&mut self, kind: FaultKind, channel: Option<&str>) -> bool {
        let kept = kind.kept(&self.keep);
        for fault in &mut self.faults {
            if fault.kind != kind || fault.channel.as_deref() != channel {
                continue;
            }
            if kept {
                fault.severity = Severity::Info;
                fault.remedy = format!(
                    "kept, as `keep` in [log] of the robot file says: {}",
                    fault.remedy
                );
            } else {
                fault.cut = true;
            }
        }
        !kept
    }

    /// Whether a time lies in a stretch in which everything is frozen, or within `reach` of it [s].
    pub(super) fn stalled(&self, t: f64, reach: f64) -> bool {
        let near = |[from, to]: &[f64; 2]| from - reach <= t && t <= to + reach;
        self.stalls.iter().any(near)
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
        x if x >= 1.0 => format!("{} s", clock(s)),
        x if x >= 1e-3 => format!("{:.3} ms", s * 1e3),
        _ => format!("{:.3} us", s * 1e6),
    }
}
