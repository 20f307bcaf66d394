//! Faults as they are found, and how their texts name rows and times.

use super::fault::{Episodes, Fault, Kind, Severity};

/// Faults under construction, and what is to be cut out.
pub(super) struct Draft {
    pub(super) faults: Vec<Fault>,
    pub(super) cuts: Vec<[f64; 2]>,
    /// First time of the log, and how long it is [s].
    first: f64,
    duration: f64,
}

impl Draft {
    pub(super) fn new(first: f64, duration: f64) -> Self {
        Self {
            faults: Vec::new(),
            cuts: Vec::new(),
            first,
            duration,
        }
    }

    /// Adds a fault of the whole log.
    pub(super) fn whole(
        &mut self,
        kind: Kind,
        severity: Severity,
        channel: Option<&str>,
        rows: u64,
        (effect, remedy): (String, &str),
    ) {
        self.faults.push(Fault {
            kind,
            severity,
            channel: channel.map(str::to_owned),
            from_s: 0.0,
            to_s: self.duration,
            rows,
            effect,
            remedy: remedy.to_owned(),
            cut: false,
        });
    }

    /// Adds a fault for each stretch, or one for all of them where they are many; `effect` is
    /// given the rows and the number of stretches.
    pub(super) fn stretches(
        &mut self,
        kind: Kind,
        severity: Severity,
        channel: Option<&str>,
        episodes: &Episodes,
        (effect, remedy): (&dyn Fn(u64, usize) -> String, &str),
    ) {
        for (episode, count) in episodes.told() {
            self.faults.push(Fault {
                kind,
                severity,
                channel: channel.map(str::to_owned),
                from_s: episode.from - self.first,
                to_s: episode.to - self.first,
                rows: episode.rows,
                effect: effect(episode.rows, count),
                remedy: remedy.to_owned(),
                cut: false,
            });
        }
    }

    /// Leaves the rows of some stretches out, which were told as this fault of this channel.
    pub(super) fn cut(&mut self, kind: Kind, channel: &str, episodes: &Episodes) {
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
