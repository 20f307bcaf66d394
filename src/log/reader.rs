//! Reads one log block by block, in SI units, inside its span, with its time checked.

use std::path::PathBuf;

use super::layout::Layout;
use super::row::{LogRows, Stamped};
use super::source::{self, Provenance};
use super::stale::{Stale, Verdict};
use super::time::Instant;
use super::{Block, LogError, LogSpec, Span};

/// A log that is being read.
#[derive(Debug)]
pub struct Reader {
    spec: LogSpec,
    files: Vec<PathBuf>,
    rows: LogRows,
    layout: Layout,
    /// The instant from which times are counted; known from the first row.
    origin: Option<Instant>,
    /// Times of the span [s], half open; set at the first row.
    span: Option<(f64, f64)>,
    /// Times of the first and the last row of the file so far [s].
    seen: Option<(f64, f64)>,
    /// Times of the first and the last row handed out [s].
    used: Option<(f64, f64)>,
    samples: u64,
    finished: bool,
    activity: Vec<Activity>,
    stale: Stale,
    /// Messages that repeat the one before them in everything.
    duplicates: u64,
    /// Rows at the end of the last block that may turn out to be stale.
    pending: Block,
}

/// What a joint did so far.
#[derive(Debug, Clone, Copy, Default)]
struct Activity {
    first_position: Option<f64>,
    moved: bool,
    driven: bool,
}

impl Reader {
    /// Opens a log of any format and finds its channels.
    ///
    /// # Errors
    /// A file that cannot be read, is no log, or lacks a channel of the layout.
    pub fn open(spec: &LogSpec, layout: &Layout) -> Result<Self, LogError> {
        let files = spec.files()?;
        let (rows, layout) = LogRows::open(&files, layout)?;
        let joints = layout.positions.len();
        Ok(Self {
            spec: spec.clone(),
            files,
            activity: vec![Activity::default(); layout.torques.len().min(joints)],
            rows,
            stale: Stale::new(joints),
            layout,
            origin: None,
            span: None,
            seen: None,
            used: None,
            samples: 0,
            finished: false,
            duplicates: 0,
            pending: Block::default(),
        })
    }

    /// The layout that the log turned out to have.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Whether the blocks hold logged velocities.
    pub fn has_velocities(&self) -> bool {
        self.rows.has_velocities()
    }

    /// Rows handed out so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Time from the first to the last row handed out so far [s].
    pub fn duration_s(&self) -> f64 {
        self.used.map_or(0.0, |(first, last)| last - first)
    }

    /// The instant from which the times of the blocks are counted, once the first row is read.
    ///
    /// Zero unless the log's own times are so far from it (epoch and ISO stamps) that f64 seconds
    /// would lose digits; then the log's first stamp.
    pub fn origin(&self) -> Instant {
        self.origin.unwrap_or_default()
    }

    /// Fills the block with the next rows; false, and an empty block, at the end.
    ///
    /// # Errors
    /// A row that cannot be used, a time that does not increase, fewer than two rows in all, a
    /// torque channel that is dead; each with its place and what to do.
    pub fn read(&mut self, block: &mut Block) -> Result<bool, LogError> {
        block.clear();
        std::mem::swap(block, &mut self.pending);
        while !self.finished && block.len() < Block::ROWS {
            let Some(stamp) = self.rows.next()? else {
                self.finish(block)?;
                break;
            };
            let Some(t) = self.time(stamp)? else {
                continue;
            };
            let (from, to) = match self.span {
                Some(span) => span,
                None => self.place_span(t)?,
            };
            if t < from {
                continue;
            }
            if t >= to {
                self.finish(block)?;
                break;
            }
            self.take(t, block)?;
        }
        if !self.finished {
            // What follows decides about the rows at the end.
            self.pending.split_from(block, self.stale.undecided());
        }
        self.count(block);
        Ok(!block.is_empty())
    }

    /// What was left out, dropped or chosen so far, one sentence each; call it after the last block.
    pub fn warnings(&self) -> Vec<String> {
        let name = super::escape(&self.spec.name());
        let mut found = self.rows.warnings();
        if self.duplicates > 0 {
            found.push(format!(
                "{} messages are the message before once more, time included, and are left out",
                self.duplicates
            ));
        }
        if self.stale.dropped() > 0 {
            found.push(format!(
                "{} rows repeat the positions of the row before; {} of them, in the middle of a motion, are stale samples and are left out",
                self.stale.repeated(),
                self.stale.dropped()
            ));
        }
        found.iter().map(|text| format!("{name}: {text}")).collect()
    }

    /// Name, span, checksum, rows and duration of what was read; call it after the last block.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn provenance(&self) -> Result<Provenance, LogError> {
        Ok(Provenance {
            name: self.spec.name(),
            span: self.spec.span.label(),
            sha256: source::sha256_of(&self.files)?,
            samples: self.samples,
            duration_s: self.duration_s(),
        })
    }

    /// Time of the current row [s], later than the row before; `None` for a row that is there twice.
    #[inline]
    fn time(&mut self, stamp: Stamped) -> Result<Option<f64>, LogError> {
        let t = seconds(stamp, &mut self.origin);
        let Some((first, before)) = self.seen else {
            self.seen = Some((t, t));
            return Ok(Some(t));
        };
        if t <= before {
            return self.out_of_order(before, t);
        }
        self.seen = Some((first, t));
        Ok(Some(t))
    }

    #[cold]
    fn out_of_order(&mut self, before: f64, t: f64) -> Result<Option<f64>, LogError> {
        let repeats = t == before && self.rows.repeats();
        // Nobody can delete messages from a recording by hand.
        if repeats && matches!(self.rows, LogRows::Messages(_)) {
            self.duplicates += 1;
            return Ok(None);
        }
        let at = self.rows.place();
        let remedy = |text: String| match &self.rows {
            LogRows::Messages(rows) => rows.clock_remedy(before - self.seen.map_or(0.0, |s| s.0)),
            LogRows::Text(_) => text,
        };
        Err(if t < before {
            let remedy = remedy(
                "sort the rows by time, or split the file where a second recording begins"
                    .to_owned(),
            );
            LogError::TimeBackwards {
                at,
                before,
                t,
                remedy,
            }
        } else if repeats {
            LogError::DuplicateRow { at, t }
        } else {
            let column = super::escape(&self.layout.time.column);
            let remedy = remedy(format!(
                "check the clock of the recorder or the time column `{column}`"
            ));
            LogError::TimeStandsStill { at, t, remedy }
        })
    }

    /// Turns the span into times, once the first row is known.
    fn place_span(&mut self, first: f64) -> Result<(f64, f64), LogError> {
        let span = match self.spec.span {
            Span::Whole => (f64::NEG_INFINITY, f64::INFINITY),
            Span::Seconds { from, to } => (first + from, first + to),
            Span::Percent { from, to } => {
                let last = self.last_time()?;
                let at = |percent: f64| first + (last - first) * percent / 100.0;
                let end = if to >= 100.0 { f64::INFINITY } else { at(to) };
                (at(from), end)
            }
        };
        self.span = Some(span);
        Ok(span)
    }

    /// Time of the log's last row [s]: one pass in which only times are looked at.
    fn last_time(&self) -> Result<f64, LogError> {
        let mut origin = self.origin;
        let (mut rows, _) = LogRows::open(&self.files, &self.layout)?;
        let mut last = f64::NEG_INFINITY;
        while let Some(stamp) = rows.next()? {
            last = seconds(stamp, &mut origin);
        }
        Ok(last)
    }

    /// Appends the current row to the block, and drops rows before it that turn out to be stale.
    fn take(&mut self, t: f64, block: &mut Block) -> Result<(), LogError> {
        if block.is_empty() {
            block.line0 = self.rows.number();
        }
        block.t.push(t);
        let (at_q, at_tau, at_dq) = (block.q.len(), block.tau.len(), block.dq.len());
        self.rows.append(block)?;
        let (q, tau) = (&mut block.q[at_q..], &mut block.tau[at_tau..]);
        for ((activity, q), tau) in self.activity.iter_mut().zip(&*q).zip(&*tau) {
            activity.driven |= *tau != 0.0;
            activity.moved |= *activity.first_position.get_or_insert(*q) != *q;
        }
        if let Some(conversion) = &self.layout.conversion
            && !conversion.apply(q, tau, &mut block.dq[at_dq..])
        {
            return Err(LogError::NoPose {
                at: self.rows.place(),
                positions: format!("{q:?}"),
            });
        }
        let verdict = self
            .stale
            .judge(t, &block.q[at_q..], || block.repeats_beside_positions());
        if let Verdict::Drop(rows) = verdict {
            block.remove_before_last(rows);
        }
        Ok(())
    }

    /// Counts the rows that are handed out.
    fn count(&mut self, block: &Block) {
        if let (Some(first), Some(last)) = (block.t.first(), block.t.last()) {
            self.used = Some((self.used.map_or(*first, |(first, _)| first), *last));
            self.samples += block.len() as u64;
        }
    }

    /// Judges what can be judged only at the end.
    fn finish(&mut self, block: &Block) -> Result<(), LogError> {
        self.finished = true;
        let file = || source::shown_all(&self.files);
        let rows = self.samples + block.len() as u64;
        if rows < 2 {
            return Err(match (self.spec.span, self.seen) {
                (Span::Percent { .. } | Span::Seconds { .. }, Some((first, last))) => {
                    LogError::EmptySpan {
                        spec: super::escape_whole(&self.spec.to_string()),
                        rows,
                        duration_s: last - first,
                    }
                }
                _ => LogError::TooFewRows { file: file(), rows },
            });
        }
        let dead = self.activity.iter().position(|a| a.moved && !a.driven);
        match dead {
            None => Ok(()),
            Some(joint) => Err(LogError::ZeroTorque {
                file: file(),
                column: super::escape(&self.layout.torques[joint].column),
                joint: super::escape(&self.layout.joints[joint]),
                rows,
            }),
        }
    }
}

/// Seconds of a row's time, counted from the first one where that is far from zero.
#[inline]
pub(super) fn seconds(stamp: Stamped, origin: &mut Option<Instant>) -> f64 {
    match stamp {
        Stamped::Seconds(seconds) => seconds,
        Stamped::Exact(instant) => {
            let origin = *origin.get_or_insert(match instant.is_far() {
                true => instant,
                false => Instant::default(),
            });
            instant.since(origin)
        }
    }
}
