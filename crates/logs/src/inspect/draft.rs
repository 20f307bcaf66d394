//! Faults as they are reported: of a whole channel, or of stretches of it.

use super::fault::{FaultEpisodes, FaultKind, LogFault, Severity};
use super::findings::LogFindings;
use super::judge::ChannelTrack;
use crate::log::RowFault;
use cft_ident_core::number::clock;

/// Faults under construction, and what is to be cut out.
#[derive(Default)]
pub(super) struct FaultList {
    /// What is found so far.
    pub(super) found: LogFindings,
    /// Rows to leave out: from, to [s], and why.
    pub(super) cuts: Vec<([f64; 2], FaultKind)>,
    /// Stretches in which everything is frozen [s].
    pub(super) stalls: Vec<[f64; 2]>,
    /// Kinds that are reported but not acted upon.
    keep: Vec<RowFault>,
    first: f64,
    last: f64,
}

/// How much a fault matters, what is wrong, and the channel where it is one's.
pub(super) type Fault<'a> = (Severity, FaultKind, Option<&'a ChannelTrack>);

impl FaultList {
    /// No faults yet, of a log from `first` to `last` [s].
    pub(super) fn new(first: f64, last: f64, keep: &[RowFault]) -> Self {
        Self {
            keep: keep.to_vec(),
            first,
            last,
            ..Self::default()
        }
    }

    /// Adds a fault of a channel all through the log.
    pub(super) fn whole(
        &mut self,
        severity: Severity,
        kind: FaultKind,
        track: &ChannelTrack,
        effect: String,
        remedy: &str,
    ) {
        self.of_log((severity, kind, Some(track)), track.rows, effect, remedy);
    }

    /// Adds a fault of so many rows all through the log.
    pub(super) fn of_log(&mut self, fault: Fault, rows: u64, effect: String, remedy: &str) {
        let (severity, kind, track) = fault;
        self.found.faults.push(LogFault {
            channel: name(track).map(str::to_owned),
            rows,
            ..LogFault::whole(severity, kind, self.last - self.first, effect, remedy)
        });
    }

    /// Adds a fault for each stretch, or one for all of them where they are many; `effect` follows the number of rows.
    pub(super) fn rows(
        &mut self,
        fault: Fault,
        episodes: &FaultEpisodes,
        effect: &str,
        remedy: &str,
    ) {
        let effect = |rows: u64, times: usize| format!("{} {effect}", rows_text(rows, times));
        self.stretches(fault, episodes, &effect, remedy);
    }

    /// The same where `effect` is made of the rows and the number of stretches; gives what was added.
    pub(super) fn stretches(
        &mut self,
        (severity, kind, track): Fault,
        episodes: &FaultEpisodes,
        effect: &dyn Fn(u64, usize) -> String,
        remedy: &str,
    ) -> &mut [LogFault] {
        let before = self.found.faults.len();
        let first = self.first;
        let each = episodes.merged().into_iter().map(|(episode, count)| {
            let effect = effect(episode.rows, count);
            LogFault {
                channel: name(track).map(str::to_owned),
                from_s: episode.from - first,
                rows: episode.rows,
                ..LogFault::whole(severity, kind, episode.to - first, effect, remedy)
            }
        });
        self.found.faults.extend(each);
        &mut self.found.faults[before..]
    }

    /// Leaves the rows of some stretches out, which were reported as this fault, unless the robot file keeps them.
    pub(super) fn cut(&mut self, fault: Fault, episodes: &FaultEpisodes) {
        if self.acts(fault) {
            let spans = episodes.list.iter().map(|e| ([e.from, e.to], fault.1));
            self.cuts.extend(spans);
        }
    }

    /// Marks what was reported as this fault as acted upon; false, and it is said there, where the robot file keeps it.
    pub(super) fn acts(&mut self, (_, kind, track): Fault) -> bool {
        let kept = kind.kept(&self.keep);
        let channel = name(track);
        let same = |of: &&mut LogFault| of.kind == kind && of.channel.as_deref() == channel;
        for fault in self.found.faults.iter_mut().filter(same) {
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

fn name(track: Option<&ChannelTrack>) -> Option<&str> {
    track.map(|track| track.channel.name.as_str())
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
