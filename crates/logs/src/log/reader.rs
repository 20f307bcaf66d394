//! Reads one log block by block, in SI units, inside its span, with its time checked.

use std::sync::Arc;

use super::arrays::{ArrayRows, LogArrays};
use super::even::EvenClock;
use super::layout::{Channel, Layout};
use super::mend::{
    BridgeInserter, HeldRowFilter, MendingSettings, PositionUnwrap, RowRemover, signed,
};
use super::pass::LogPass;
use super::row_store::RowStore;
use super::rows::{RowStrictness, counted};
use super::source::{self, Provenance};
use super::stale::StaleDetector;
use super::time::Instant;
use super::{Block, LogError, LogSpec, Span};
use cft_ident_core::number::significant;

/// A log that is being read, and refused where anything is wrong with it.
#[derive(Debug)]
pub struct Reader {
    pass: LogPass,
    /// Times of the first and the last row of the file so far [s].
    seen: Option<(f64, f64)>,
    finished: bool,
    activity: Vec<JointActivity>,
    stale: StaleDetector,
    /// Positions that are followed through their turns, by their places.
    turning: Vec<(usize, PositionUnwrap)>,
    /// Torques that are read as signed numbers of a range, by their places: range and zero [SI].
    signed: Vec<(usize, [f64; 2])>,
    held: HeldRowFilter,
    bridging: BridgeInserter,
    failed: RowRemover,
    even: Option<EvenClock>,
    /// Messages that repeat the one before them in everything.
    duplicates: u64,
    /// Rows at the end of the last block that may turn out to be stale.
    pending: Block,
}

/// What a joint has done so far: its first position, whether it moved, and whether it was driven.
#[derive(Debug, Clone, Copy, Default)]
struct JointActivity {
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
        Self::open_until(spec, layout, &|| false)
    }

    /// The same; where `stop` says so while the log is parsed, that ends with [`LogError::Interrupted`].
    ///
    /// # Errors
    /// Those of [`Reader::open`], and interruption.
    pub fn open_until(
        spec: &LogSpec,
        layout: &Layout,
        stop: &dyn Fn() -> bool,
    ) -> Result<Self, LogError> {
        LogPass::open(spec, layout, RowStrictness::Refuse, stop).map(Self::new)
    }

    /// Goes along rows that were parsed.
    pub(crate) fn along(
        spec: &LogSpec,
        store: &Arc<RowStore>,
        layout: &Layout,
    ) -> Result<Self, LogError> {
        LogPass::along(spec, store, layout).map(Self::new)
    }

    /// Reads a log that is in memory; `layout` names its joints and says whether torques are read.
    ///
    /// # Errors
    /// Another number of channels than the layout has.
    pub fn of_arrays(arrays: &Arc<LogArrays>, layout: Layout) -> Result<Self, LogError> {
        let rows = Box::new(ArrayRows::open(arrays, &layout)?);
        let spec = LogSpec::whole(arrays.name());
        Ok(Self::new(LogPass::of_rows(spec, rows, layout)))
    }

    /// Reads what arrives on a stream, CSV with a header line or JSON lines, by [`Self::read_on`]; times
    /// whose unit neither the layout nor a name states are seconds.
    ///
    /// # Errors
    /// A stream whose first lines lack a channel of the layout, or that cannot be read.
    pub fn of_stream(
        name: &str,
        stream: Box<dyn std::io::Read + Send>,
        layout: &Layout,
    ) -> Result<Self, LogError> {
        LogPass::of_stream(name, stream, layout).map(Self::new)
    }

    /// The next row or few, without waiting for more: rows that repeat the one before them come with the
    /// next that does not, at most twenty. False, and an empty block, at the end.
    pub fn read_on(&mut self, block: &mut Block) -> Result<bool, LogError> {
        loop {
            let more = self.read_rows(block, 1)?;
            if more || self.finished {
                return Ok(more);
            }
        }
    }

    fn new(pass: LogPass) -> Self {
        let (joints, torques) = (pass.layout.positions.len(), pass.layout.torques.len());
        let mut reader = Self {
            pass,
            seen: None,
            finished: false,
            activity: vec![JointActivity::default(); torques.min(joints)],
            stale: StaleDetector::new(joints),
            turning: Vec::new(),
            signed: Vec::new(),
            held: HeldRowFilter::default(),
            bridging: BridgeInserter::default(),
            failed: RowRemover::default(),
            even: None,
            duplicates: 0,
            pending: Block::default(),
        };
        reader.mend(&MendingSettings::default());
        reader
    }

    /// Says what to mend, before the first row is read; positions whose range the layout names are
    /// followed through their turns in any case.
    pub fn mend(&mut self, mending: &MendingSettings) {
        let positions = self.pass.layout.positions.iter().enumerate();
        let turning = |(place, channel): (usize, &Channel)| {
            let found = mending.wraps.get(place).copied().flatten();
            Some((place, PositionUnwrap::new(channel.wrap.or(found)?)))
        };
        self.turning = positions.filter_map(turning).collect();
        let torques = self.pass.layout.torques.iter().enumerate();
        let signed = torques.filter_map(|(place, of)| Some((place, [of.wrap?, of.offset])));
        self.signed = signed.collect();
        self.held = HeldRowFilter::new(mending.held);
        self.even = mending.even.map(EvenClock::new);
        self.bridging = BridgeInserter::new(Arc::clone(&mending.bridges));
        self.failed = RowRemover::new(Arc::clone(&mending.failed));
        self.stale.keep = mending.keep_repeats;
    }

    /// Rows for which a sample was held at most, in a log that repeats most of its rows while the robot
    /// moves; call it after the last block.
    pub fn hold(&self) -> Option<usize> {
        self.stale.hold()
    }

    /// Name of the log, without folders.
    pub(crate) fn name(&self) -> String {
        self.pass.spec.name()
    }

    /// Whether rows are messages, with times of their own.
    pub(crate) fn is_recording(&self) -> bool {
        self.pass.rows.is_recording()
    }

    /// The layout that the log turned out to have.
    pub fn layout(&self) -> &Layout {
        &self.pass.layout
    }

    /// Whether the blocks hold logged velocities.
    pub fn has_velocities(&self) -> bool {
        self.pass.rows.has_velocities()
    }

    /// How long the machine had run when the rows that are read begin \[s\]; call it after the first block.
    pub fn started_s(&self) -> f64 {
        let before = |(first, _)| self.pass.began().map_or(0.0, |began| began - first);
        self.pass.spec.started_s + self.seen.map_or(0.0, before)
    }

    /// Rows handed out so far.
    pub fn samples(&self) -> u64 {
        self.pass.samples
    }

    /// Time from the first to the last row handed out so far [s].
    pub fn duration_s(&self) -> f64 {
        self.pass.duration_s()
    }

    /// The instant from which the times of the blocks are counted, once the first row is read.
    ///
    /// Zero unless the log's own times are so far from it (epoch and ISO stamps) that f64 seconds
    /// would lose digits; then the log's first stamp.
    pub fn origin(&self) -> Instant {
        self.pass.origin()
    }

    /// Fills the block with the next rows; false, and an empty block, at the end.
    ///
    /// # Errors
    /// A row that cannot be used, a time that does not increase, fewer than two rows in all, a
    /// torque channel that is dead; each with its place and what to do.
    pub fn read(&mut self, block: &mut Block) -> Result<bool, LogError> {
        self.read_rows(block, Block::ROWS)
    }

    /// Fills the block up to so many rows, and with one more than were kept back in any case.
    fn read_rows(&mut self, block: &mut Block, rows: usize) -> Result<bool, LogError> {
        block.clear();
        std::mem::swap(block, &mut self.pending);
        let most = rows.max(block.len() + 1);
        while !self.finished && block.len() < most {
            let Some(t) = self.pass.next()? else {
                self.finish(block)?;
                break;
            };
            if !self.is_later(t)? {
                continue;
            }
            let (from, to) = self.pass.span(t)?;
            if t < from {
                self.pass_over(block)?;
                continue;
            }
            if t >= to {
                self.finish(block)?;
                break;
            }
            let since = t - self.seen.map_or(t, |(first, _)| first);
            if (self.even.is_some() || !self.failed.has(t)) && !self.pass.spec.leaves_out(since) {
                self.take(t, block)?;
            }
        }
        if !self.finished {
            // What follows decides about the rows at the end.
            self.pending.split_from(block, self.stale.undecided());
        }
        if let (Some(first), Some(last)) = (block.t.first(), block.t.last()) {
            self.pass.count(block.len(), *first, *last);
        }
        Ok(!block.is_empty())
    }

    /// What was left out, dropped or chosen so far, one sentence each; call it after the last block.
    pub fn warnings(&self) -> Vec<String> {
        let name = super::escape(&self.pass.spec.name());
        let mut found = self.pass.warnings();
        found.extend(counted(
            self.duplicates,
            "messages repeat the message before, time included, and are left out",
        ));
        if self.held.dropped > 0 {
            let rows = self.pass.samples + self.held.dropped;
            found.push(format!(
                "sample-and-hold: {} of {rows} rows ({:.0} %) repeat the row before; only fresh rows are used",
                self.held.dropped,
                100.0 * self.held.dropped as f64 / rows as f64
            ));
        }
        if self.stale.dropped > 0 {
            found.push(format!(
                "{} rows repeat the positions of the row before; {} of them, in the middle of a motion, are stale samples and are left out",
                self.stale.repeated, self.stale.dropped
            ));
        }
        found.iter().map(|text| format!("{name}: {text}")).collect()
    }

    /// Rows that were left out so far, by their causes.
    pub fn left_out(&self) -> [(u64, &'static str); 2] {
        [
            (self.held.dropped, "sample-and-hold"),
            (self.stale.dropped, "repeated-rows"),
        ]
    }

    /// Rows left out so far because nothing was read.
    pub fn not_read(&self) -> u64 {
        self.failed.dropped
    }

    /// Times at which runs begin that one table holds, but for the first \[s\]; call it after the last block.
    pub(crate) fn seams(&self) -> Vec<f64> {
        self.pass.seams()
    }

    /// Name, span, checksum, rows and duration of what was read; call it after the last block.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn provenance(&self) -> Result<Provenance, LogError> {
        self.pass.provenance()
    }

    /// Whether the current row is later than the one before it; false for one that is there twice.
    #[inline]
    fn is_later(&mut self, t: f64) -> Result<bool, LogError> {
        match self.seen {
            Some((_, before)) if t <= before => self.out_of_order(before, t),
            seen => {
                self.seen = Some((seen.map_or(t, |(first, _)| first), t));
                Ok(true)
            }
        }
    }

    #[cold]
    fn out_of_order(&mut self, before: f64, t: f64) -> Result<bool, LogError> {
        let rows = &self.pass.rows;
        let into = before - self.seen.map_or(0.0, |seen| seen.0);
        let remedy = rows.clock_remedy().map(|remedy| match into > 0.0 {
            true => format!("{remedy}, or use the part before it: FILE@0..{into}s"),
            false => remedy,
        });
        let repeats = t == before && rows.repeats();
        // Nobody can delete messages from a recording by hand.
        if repeats && remedy.is_some() {
            self.duplicates += 1;
            return Ok(false);
        }
        let at = rows.place();
        Err(if t < before {
            let remedy = remedy.unwrap_or_else(|| {
                "sort the rows by time, or split the file where a second recording begins"
                    .to_owned()
            });
            LogError::TimeBackwards {
                at,
                before,
                t,
                remedy,
            }
        } else if repeats {
            LogError::DuplicateRow { at, t }
        } else {
            let remedy = remedy.unwrap_or_else(|| {
                let column = super::escape(&self.pass.layout.time.column);
                match self.pass.coarse_clock() {
                    Some((step, rate)) => format!(
                        "the clock of `{column}` moves in steps of {} s, too coarse for rows at {rate} Hz: set `rate_hz = {rate}` in [log] of the robot file, in place of `time`",
                        significant(step, 3)
                    ),
                    None => format!(
                        "check the clock of the recorder or the time column `{column}`; where rows lie evenly, `rate_hz = ..` in [log] of the robot file says so, in place of `time`"
                    ),
                }
            });
            LogError::TimeStandsStill { at, t, remedy }
        })
    }

    /// Follows positions through their turns in a row before the span.
    fn pass_over(&mut self, block: &mut Block) -> Result<(), LogError> {
        if self.turning.is_empty() {
            return Ok(());
        }
        let rows = block.len();
        block.t.push(0.0);
        let at_q = block.q.len();
        let before = ends(block);
        self.pass.rows.append(block)?;
        for (place, unwrap) in &mut self.turning {
            unwrap.take(block.q[at_q + *place]);
        }
        cut_off(block, rows, before);
        Ok(())
    }

    /// Appends the current row to the block, and drops rows before it that turn out to be stale.
    fn take(&mut self, t: f64, block: &mut Block) -> Result<(), LogError> {
        if block.is_empty() {
            block.line0 = self.pass.rows.number();
        }
        let (rows, before) = (block.len(), ends(block));
        let [at_q, at_tau, at_dq] = before;
        block.t.push(t);
        self.pass.rows.append(block)?;
        let logged = [&block.q[at_q..], &block.tau[at_tau..], &block.dq[at_dq..]];
        if self.held.repeats(logged) {
            cut_off(block, rows, before);
            return Ok(());
        }
        let mut t = t;
        if let Some(even) = &mut self.even {
            t = even.take(t);
            if self.failed.has(t) {
                cut_off(block, rows, before);
                return Ok(());
            }
            if let Some(last) = block.t.last_mut() {
                *last = t;
            }
        }
        let (q, tau) = (&mut block.q[at_q..], &mut block.tau[at_tau..]);
        for (place, unwrap) in &mut self.turning {
            q[*place] = unwrap.take(q[*place]);
        }
        for (place, [range, zero]) in &self.signed {
            tau[*place] = zero + signed(tau[*place] - zero, *range);
        }
        self.bridging.mend(t, q, tau);
        for ((activity, q), tau) in self.activity.iter_mut().zip(&*q).zip(&*tau) {
            activity.driven |= *tau != 0.0;
            activity.moved |= *activity.first_position.get_or_insert(*q) != *q;
        }
        if let Some(conversion) = &self.pass.layout.conversion
            && !conversion.apply(q, tau, &mut block.dq[at_dq..])
        {
            let at = self.pass.rows.place();
            return Err(match self.pass.layout.section.torque {
                Some(_) => LogError::NoVelocities { at },
                None => LogError::NoPose {
                    at,
                    positions: format!("{q:?}"),
                },
            });
        }
        if self.pass.layout.conversion.is_some() {
            // of what the torques of the joints were made
            block.tau.truncate(at_tau + self.activity.len());
        }
        let same = || block.repeats_beside_positions();
        let stale = self.stale.judge(t, &block.q[at_q..], same);
        if stale > 0 {
            block.remove_before_last(stale);
        }
        Ok(())
    }

    /// Judges what can be judged only at the end.
    fn finish(&mut self, block: &Block) -> Result<(), LogError> {
        self.finished = true;
        let file = || match self.pass.files.as_slice() {
            [] => super::escape(&self.pass.spec.name()),
            files => source::shown_all(files),
        };
        let rows = self.pass.samples + block.len() as u64;
        if rows < 2 {
            return Err(match (self.pass.spec.span, self.seen) {
                (Span::Percent { .. } | Span::Seconds { .. }, Some((first, last))) => {
                    LogError::EmptySpan {
                        spec: super::escape_whole(&self.pass.spec.to_string()),
                        rows,
                        duration_s: last - first,
                    }
                }
                _ => LogError::TooFewRows { file: file(), rows },
            });
        }
        let Some(joint) = self.activity.iter().position(|a| a.moved && !a.driven) else {
            return Ok(());
        };
        Err(LogError::ZeroTorque {
            file: file(),
            column: super::escape(&self.pass.layout.torques[joint].column),
            joint: super::escape(&self.pass.layout.joints[joint]),
            rows,
        })
    }
}

/// Where positions, torques and velocities of a block end.
fn ends(block: &Block) -> [usize; 3] {
    [block.q.len(), block.tau.len(), block.dq.len()]
}

/// Takes off what was appended behind these rows, however wide it was.
fn cut_off(block: &mut Block, rows: usize, [q, tau, dq]: [usize; 3]) {
    block.t.truncate(rows);
    block.q.truncate(q);
    block.tau.truncate(tau);
    block.dq.truncate(dq);
}
