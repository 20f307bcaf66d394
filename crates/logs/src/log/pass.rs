//! The one way through a log, strict or not: its rows inside its span, each with its time.

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use super::content::FileContent;
use super::even::{DeclaredEven, EvenClock};
use super::layout::Layout;
use super::open::open;
use super::row_store::{RowStore, StoredRows};
use super::rows::{LogRows, RowStrictness, counted};
use super::section::TimeUnit;
use super::source::{self, Provenance};
use super::stream::HashedReader;
use super::text::{JsonRows, TextRows};
use super::time::Instant;
use super::time_unit::{UNIT_ROWS, first_numbers, is_stated, unstated};
use super::torn::WholeRows;
use super::{LogError, LogSpec, Span};

/// Usual steps from a time of 0 to the next one where the clock began at 0.
const MAX_STEPS_FROM_ZERO: f64 = 10.0;

pub(super) struct LogPass {
    pub(super) spec: LogSpec,
    pub(super) files: Vec<PathBuf>,
    strictness: RowStrictness,
    pub(super) rows: Box<dyn LogRows>,
    /// The layout that the log turned out to have.
    pub(super) layout: Layout,
    /// What keeps a strict reader from it.
    pub(super) refused: Option<LogError>,
    /// Column of the time and seconds per unit of it, where it was said.
    time: Option<(usize, f64)>,
    /// The unit that the times were recognised to have, and their column, where nothing states it.
    recognised: Option<(TimeUnit, String)>,
    /// The instant from which times are counted; known from the first row.
    origin: Option<Instant>,
    /// Times of the span [s], half open; set at the first row that has a time.
    span: Option<(f64, f64)>,
    /// Times of the first and the last row handed out [s].
    used: Option<(f64, f64)>,
    pub(super) samples: u64,
    /// The even clock of a recording whose rate is given.
    even: Option<EvenClock>,
    /// Whether a row was read, and those at the beginning that have no time yet and are left out.
    begun: bool,
    unstamped: u64,
    watch: Option<HashedReader>,
    /// What is kept of its rows, where it is read strictly.
    store: Option<Arc<RowStore>>,
}

impl fmt::Debug for LogPass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_fmt(format_args!("LogPass({})", self.spec))
    }
}

impl LogPass {
    pub(super) fn open(
        spec: &LogSpec,
        layout: &Layout,
        strictness: RowStrictness,
        stop: &dyn Fn() -> bool,
    ) -> Result<Self, LogError> {
        let files = spec.files()?;
        if strictness == RowStrictness::Refuse && !layout.joints.is_empty() {
            let store = Arc::new(RowStore::read(&files, layout, stop)?);
            return Self::along(spec, &store, layout);
        }
        Self::of_files(spec, files, layout, strictness)
    }

    /// Goes along rows that were parsed, with the conversions of a layout.
    pub(super) fn along(
        spec: &LogSpec,
        store: &Arc<RowStore>,
        layout: &Layout,
    ) -> Result<Self, LogError> {
        let found = store.found().clone().converted_as(layout);
        let rows = Box::new(StoredRows::new(Arc::clone(store)));
        Self {
            files: store.files().to_vec(),
            time: store.time,
            recognised: store.recognised.clone(),
            store: Some(Arc::clone(store)),
            ..Self::of_rows(spec.clone(), rows, found)
        }
        .evenly()
    }

    fn of_files(
        spec: &LogSpec,
        files: Vec<PathBuf>,
        layout: &Layout,
        strictness: RowStrictness,
    ) -> Result<Self, LogError> {
        let opened = open(&files, layout, strictness)?;
        let mut pass = Self {
            files,
            strictness,
            refused: opened.refused,
            ..Self::of_rows(spec.clone(), opened.rows, opened.layout)
        };
        // Who names the column later knows its unit then.
        if let Some(column) = unstated(&*pass.rows, &pass.layout) {
            pass.recognise(column)?;
        }
        pass.evenly()
    }

    /// The same on the even clock of a recording whose rate is given.
    fn evenly(self) -> Result<Self, LogError> {
        let mut pass = self;
        if let Some(rate) = pass.layout.section.rate_hz
            && pass.rows.is_recording()
        {
            let (mut rows, mut origin) = (pass.again()?, None);
            let mut declared = DeclaredEven::default();
            while let Some(stamp) = rows.next()? {
                let t = stamp.seconds(&mut origin);
                if t.is_finite() {
                    declared.take(t, rate);
                }
            }
            pass.even = declared.clock(rate).map(EvenClock::new);
        }
        Ok(pass)
    }

    /// Takes the unit of a column of times from its numbers, where its name states none.
    pub(super) fn recognise(&mut self, column: usize) -> Result<(), LogError> {
        if is_stated(&*self.rows, column) {
            return Ok(());
        }
        let times = first_numbers(&self.files, &self.layout, column)?;
        let Some(times) = times else {
            return Ok(());
        };
        let unit = TimeUnit::of_numbers(&times);
        self.set_time(column, unit.in_seconds().1);
        if unit != TimeUnit::Second {
            let name = super::escape(&self.rows.names()[column]);
            self.recognised = Some((unit, name));
        }
        Ok(())
    }

    /// What was chosen on the way, one sentence each.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut shown = self.rows.warnings();
        shown.extend(counted(
            self.unstamped,
            "rows at the beginning are stamped 0, before the clock was set, and are left out",
        ));
        if let (Some(rate), true) = (self.layout.section.rate_hz, self.even.is_some()) {
            shown.push(format!(
                "messages are put on an even clock of {rate} Hz, as `rate_hz` says"
            ));
        }
        if let Some((unit, column)) = &self.recognised {
            let unit = unit.in_seconds().0;
            shown.push(format!(
                "times of `{column}` are taken as {unit}, by the size of the numbers and of their steps; `time_unit = \"{unit}\"` in [log] of the robot file says so, \"s\" that they are seconds"
            ));
        }
        shown
    }

    /// Goes through rows that are there already.
    pub(super) fn of_rows(spec: LogSpec, rows: Box<dyn LogRows>, layout: Layout) -> Self {
        Self {
            spec,
            files: Vec::new(),
            strictness: RowStrictness::Refuse,
            rows,
            layout,
            refused: None,
            time: None,
            recognised: None,
            origin: None,
            span: None,
            used: None,
            samples: 0,
            even: None,
            begun: false,
            unstamped: 0,
            watch: None,
            store: None,
        }
    }

    /// Goes through the lines of a stream called `name`: CSV with its header, or JSON lines.
    pub(super) fn of_stream(
        name: &str,
        stream: Box<dyn std::io::Read + Send>,
        layout: &Layout,
    ) -> Result<Self, LogError> {
        let path = std::path::Path::new(name);
        let content = FileContent::of_stream(path, stream)?;
        let watch = content.watch.clone();
        let is_json = content.head().trim_ascii_start().starts_with(b"{");
        let (rows, layout): (Box<dyn LogRows>, Layout) = if is_json {
            let (rows, layout) = JsonRows::open(path, content, layout)?;
            (Box::new(WholeRows::new(rows)), layout)
        } else {
            let (rows, layout, _) = TextRows::open(path, content, layout, RowStrictness::Refuse)?;
            (Box::new(WholeRows::new(rows)), layout)
        };
        Ok(Self {
            watch,
            ..Self::of_rows(LogSpec::whole(name), rows, layout)
        })
    }

    pub(super) fn set_time(&mut self, column: usize, seconds: f64) {
        self.time = Some((column, seconds));
        self.rows.set_time(column, seconds);
    }

    /// Seconds per unit of the times.
    pub(super) fn seconds(&self) -> Option<f64> {
        self.time.map(|(_, seconds)| seconds)
    }

    /// The same where they were recognised by their numbers.
    pub(super) fn recognised_s(&self) -> Option<f64> {
        (self.recognised.as_ref()).map(|(unit, _)| unit.in_seconds().1)
    }

    /// The instant from which times are counted, once a row is read.
    pub(super) fn origin(&self) -> Instant {
        self.origin.unwrap_or_default()
    }

    /// Times at which runs begin that one table holds, but for the first \[s\]; call it after the last row.
    pub(super) fn seams(&self) -> Vec<f64> {
        let mut origin = self.origin;
        let all = self.rows.seams();
        all.into_iter()
            .map(|stamp| stamp.seconds(&mut origin))
            .collect()
    }

    /// Goes on to the next row; its time [s], NaN where it has none, or `None` at the end.
    #[inline]
    pub(super) fn next(&mut self) -> Result<Option<f64>, LogError> {
        let mut stamp = self.rows.next()?;
        if !std::mem::replace(&mut self.begun, true) && stamp.is_some_and(|stamp| stamp.is_zero()) {
            self.unstamped = self.unstamped()?;
            for _ in 0..self.unstamped {
                stamp = self.rows.next()?;
            }
        }
        // of messages that are there twice one has a place on an even clock
        while self.even.is_some() && stamp.is_some() && self.rows.repeats() {
            stamp = self.rows.next()?;
        }
        let t = stamp.map(|stamp| stamp.seconds(&mut self.origin));
        Ok(match &mut self.even {
            None => t,
            Some(even) => t.map(|t| even.take(t)),
        })
    }

    /// Rows at the beginning of a file that are all stamped 0, far from where its clock goes on.
    #[cold]
    fn unstamped(&self) -> Result<u64, LogError> {
        if self.files.is_empty() || self.rows.is_recording() {
            return Ok(0);
        }
        let (mut rows, mut origin) = (self.again()?, None);
        let (mut zeros, mut after) = (0, None);
        for _ in 0..UNIT_ROWS {
            let Some(stamp) = rows.next()? else { break };
            match (stamp.is_zero(), after) {
                (true, None) => zeros += 1,
                (true, Some(_)) => break,
                (false, None) => after = Some(stamp.seconds(&mut origin)),
                (false, Some(first)) => {
                    let step = stamp.seconds(&mut origin) - first;
                    if step > 0.0 {
                        let leap = stamp.instant().seconds() - step;
                        let far = zeros > 1 && leap > MAX_STEPS_FROM_ZERO * step;
                        return Ok(if far { zeros } else { 0 });
                    }
                }
            }
        }
        Ok(0)
    }

    /// The rows from the beginning, once more.
    fn again(&self) -> Result<Box<dyn LogRows>, LogError> {
        match &self.store {
            Some(store) => Ok(Box::new(StoredRows::new(Arc::clone(store)))),
            None => self.anew(),
        }
    }

    /// The same from the files.
    fn anew(&self) -> Result<Box<dyn LogRows>, LogError> {
        let mut rows = open(&self.files, &self.layout, self.strictness)?.rows;
        if let Some((column, seconds)) = self.time {
            rows.set_time(column, seconds);
        }
        Ok(rows)
    }

    /// Times of the span [s], half open, once the first row's is known.
    #[inline]
    pub(super) fn span(&mut self, first: f64) -> Result<(f64, f64), LogError> {
        if let Some(span) = self.span {
            return Ok(span);
        }
        let span = match self.spec.span {
            Span::Whole => (f64::NEG_INFINITY, f64::INFINITY),
            Span::Seconds { from, to } => {
                let zero = self.rows.begins().unwrap_or(first);
                (zero + from, zero + to)
            }
            Span::Percent { from, to } => {
                let last = self.last_time()?.unwrap_or(first);
                let at = |percent: f64| first + (last - first) * percent / 100.0;
                let end = if to >= 100.0 { f64::INFINITY } else { at(to) };
                (at(from), end)
            }
        };
        self.span = Some(span);
        Ok(span)
    }

    /// Time of the log's last row [s]: one more pass, in which only times are looked at.
    fn last_time(&self) -> Result<Option<f64>, LogError> {
        let mut rows = self.again()?;
        let (mut origin, mut last) = (self.origin, None);
        while let Some(stamp) = rows.next()? {
            let t = stamp.seconds(&mut origin);
            last = if t.is_nan() { last } else { Some(t) };
        }
        Ok(last)
    }

    /// The least step of a clock that is too coarse for its rows, and the rate of the rows; `None` of any other clock.
    pub(super) fn coarse_clock(&self) -> Option<(f64, f64)> {
        let mut rows = self.anew().ok()?;
        let (mut origin, mut first, mut last) = (self.origin, None, f64::NAN);
        let (mut count, mut still, mut least) = (0_u64, 0_u64, f64::INFINITY);
        while let Some(stamp) = rows.next().ok()? {
            let t = stamp.seconds(&mut origin);
            let step = t - last;
            if step < 0.0 || t.is_nan() {
                return None;
            }
            still += u64::from(step == 0.0);
            least = if step > 0.0 { least.min(step) } else { least };
            (count, last) = (count + 1, t);
            first.get_or_insert(t);
        }
        let duration = last - first?;
        let rate = count.saturating_sub(1) as f64 / duration;
        // a clock that stands still now and then is another fault
        let coarse = 4 * still > count && duration > 10.0 * least;
        coarse.then(|| (least, round_within(rate, rate * 2.0 * least / duration)))
    }

    /// Counts rows that are handed out, by the times of the first and the last of them.
    pub(super) fn count(&mut self, rows: usize, first: f64, last: f64) {
        self.used = Some((self.used.map_or(first, |(first, _)| first), last));
        self.samples += rows as u64;
    }

    /// Time of the first row handed out [s].
    pub(super) fn began(&self) -> Option<f64> {
        self.used.map(|(first, _)| first)
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.used.map_or(0.0, |(first, last)| last - first)
    }

    pub(super) fn provenance(&self) -> Result<Provenance, LogError> {
        Ok(Provenance {
            name: self.spec.name(),
            span: self.spec.part(),
            sha256: match (self.rows.sha256(), &self.watch) {
                (Some(known), _) => known.to_owned(),
                (None, Some(watch)) => watch.sha256_so_far(),
                (None, None) => source::sha256_of(&self.files)?,
            },
            samples: self.samples,
            duration_s: self.duration_s(),
            role: None,
        })
    }
}

/// The shortest number that is as near to `x` as `within`.
pub(crate) fn round_within(x: f64, within: f64) -> f64 {
    let shorter = (1..=6).map(|digits| {
        let place = 10_f64.powi(digits - 1 - x.abs().log10().floor() as i32);
        (x * place).round() / place
    });
    let mut near = shorter.filter(|short| (short - x).abs() <= within);
    near.next().unwrap_or(x)
}
