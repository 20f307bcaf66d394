//! A log as it stands in its files: every column, with its errors. What a strict reader refuses, or
//! passes over, can be looked at here.

use std::path::PathBuf;

use super::columns::{time_of, unit_of};
use super::content::FileContent;
use super::layout::{Channel, Layout};
use super::messages::{self, StateGroup, TopicFacts, format_of, state_groups};
use super::pass::LogPass;
use super::rows::{RowStrictness, counted};
use super::section::TimeUnit;
use super::source::Provenance;
use super::table;
use super::time::Instant;
use super::two_clocks::rest_of;
use super::{LogError, LogSection, LogSpec};
use cft_ident_core::number::is_usable;

/// The machines whose joint states a recording holds, by their topics; none of a text log.
pub fn topics(spec: &LogSpec) -> Result<Vec<StateGroup>, LogError> {
    of_recording(spec, state_groups)
}

/// The topics of a recording, with the numbers in their messages; none of a text log.
pub fn listing(spec: &LogSpec) -> Result<Vec<TopicFacts>, LogError> {
    of_recording(spec, messages::listing)
}

/// Looks at a recording, of which an empty part is of no format; nothing of any other log.
fn of_recording<T>(
    spec: &LogSpec,
    look: impl Fn(&[PathBuf]) -> Result<Vec<T>, LogError>,
) -> Result<Vec<T>, LogError> {
    let files = spec.files()?;
    for file in &files {
        let content = FileContent::open(file)?;
        if format_of(content.head()).is_some() && !content.table {
            return look(&files);
        }
        if content.table {
            break;
        }
    }
    Ok(Vec::new())
}

/// Consecutive rows of all columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RawBlock {
    /// Time of each row [s], counted from the log's origin; NaN where it has none.
    pub t: Vec<f64>,
    /// One list of numbers per column, the time's own too; NaN where a field is no number.
    pub columns: Vec<Vec<f64>>,
}

impl RawBlock {
    /// Rows that a block has, fewer where it is very wide.
    pub const ROWS: usize = 4096;
    /// Numbers that a block holds at most, where that is more than a few rows.
    const NUMBERS: usize = 1 << 21;

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.t.len()
    }

    /// Takes numbers that cannot be worked with for no measurement: what is looked at is not what is copied.
    pub(crate) fn drop_unusable(&mut self) {
        for number in self.columns.iter_mut().flatten() {
            if !is_usable(*number) {
                *number = f64::NAN;
            }
        }
    }

    fn clear(&mut self, width: usize) {
        self.t.clear();
        self.columns.resize_with(width, Vec::new);
        self.columns.iter_mut().for_each(Vec::clear);
    }
}

/// A log that is read as it stands: what is wrong with it is recorded, and reading goes on.
#[derive(Debug)]
pub struct RawReader {
    pass: LogPass,
    /// Fields that are neither empty nor a number, per column.
    words: Vec<u64>,
    /// Time and numbers of the last row of the block before, and messages that repeat the one before them in everything.
    last: (f64, Vec<f64>),
    duplicates: u64,
}

impl RawReader {
    /// Opens a log; `layout` gives the columns of a robot, where there is one.
    ///
    /// # Errors
    /// A file that cannot be read, or is no log; without a robot, a recording of several machines.
    pub fn open(spec: &LogSpec, layout: Option<&Layout>) -> Result<Self, LogError> {
        let Some(layout) = layout else {
            return Self::open_plain(spec, &LogSection::default());
        };
        let pass = LogPass::open(spec, layout, RowStrictness::Record, &|| false)?;
        let words = vec![0; pass.rows.names().len()];
        Ok(Self {
            pass,
            words,
            last: (f64::NAN, Vec::new()),
            duplicates: 0,
        })
    }

    /// Opens a log of no robot that is known, by what `section` says of topic, delimiter and rate.
    pub fn open_plain(spec: &LogSpec, section: &LogSection) -> Result<Self, LogError> {
        // A log without a header has columns #1, #2, ...
        let layout = Layout {
            time: Channel::si("#1", "s"),
            section: section.clone(),
            ..Layout::joint_columns(&[] as &[&str])
        };
        Self::open(spec, Some(&layout))
    }

    /// The kind of robot that a dataset of LeRobot says it is of.
    pub(crate) fn robot_type(&self) -> Option<String> {
        table::robot_type(self.pass.files.first()?)
    }

    /// Name of the log, for messages.
    pub fn log_name(&self) -> String {
        super::escape(&self.pass.spec.name())
    }

    /// Names of the columns.
    pub fn names(&self) -> &[String] {
        self.pass.rows.names()
    }

    /// What a column is called by the names in the messages of a recording, where its own name is a path.
    pub(crate) fn label(&self, column: usize) -> Option<&str> {
        self.pass.rows.label(column)
    }

    /// The unit that a column's name states.
    pub fn unit(&self, column: usize) -> Option<&str> {
        self.names().get(column).and_then(|name| unit_of(name))
    }

    /// Seconds in the unit of time that a column's name states: `time [ms]`, `time_ms`.
    pub(crate) fn stated_seconds(&self, column: usize) -> Option<f64> {
        let unit = self.unit(column).and_then(TimeUnit::stated);
        let unit = unit.or_else(|| TimeUnit::of_suffix(self.names().get(column)?))?;
        Some(unit.in_seconds().1)
    }

    /// The same log from its beginning.
    pub(crate) fn again(&self) -> Result<Self, LogError> {
        Self::open(&self.pass.spec, Some(self.layout()))
    }

    /// Which column a channel of a robot file is.
    pub fn find(&self, channel: &Channel) -> Option<usize> {
        time_of(self.names(), channel)
    }

    /// The column of whole seconds of a clock that has another column for what is beyond them.
    pub fn split_clock(&self) -> Option<usize> {
        let names = self.names();
        (0..names.len()).find(|column| rest_of(names, *column).is_some())
    }

    /// The layout of those offered that this log has.
    pub fn layout(&self) -> &Layout {
        &self.pass.layout
    }

    /// What keeps a strict reader from the log's channels.
    pub fn refused(&self) -> Option<&LogError> {
        self.pass.refused.as_ref()
    }

    /// Whether rows carry their own times, as those of recordings do.
    pub fn is_recording(&self) -> bool {
        self.pass.rows.is_recording()
    }

    /// Whether rows have times of their own: those of a recording, or of a log whose rate is given.
    pub fn is_timed(&self) -> bool {
        self.is_recording() || self.layout().section.rate_hz.is_some()
    }

    /// Says which column is the time, and how many seconds its unit has.
    pub fn set_time(&mut self, column: usize, seconds: f64) {
        self.pass.set_time(column, seconds);
    }

    /// The instant from which times are counted, once a row is read: zero, unless they lie so far
    /// from it that f64 seconds would lose digits.
    pub fn origin(&self) -> Instant {
        self.pass.origin()
    }

    /// Says which column is the time, whose name states no unit: it is recognised by its numbers.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn set_time_by_numbers(&mut self, column: usize) -> Result<f64, LogError> {
        self.pass.set_time(column, 1.0);
        self.pass.recognise(column)?;
        Ok(self.pass.seconds().unwrap_or(1.0))
    }

    /// Seconds per unit of the times that the robot file names, where they were recognised.
    pub fn recognised_s(&self) -> Option<f64> {
        self.pass.recognised_s()
    }

    /// Fills the block with the next rows; false, and no row, at the end.
    ///
    /// # Errors
    /// A file that can no longer be read, or a line without an end.
    pub fn read(&mut self, block: &mut RawBlock) -> Result<bool, LogError> {
        let width = self.words.len();
        if let Some(t) = block.t.last() {
            let row = block.columns.iter().filter_map(|column| column.last());
            self.last = (*t, row.copied().collect());
        }
        block.clear(width);
        let most = (RawBlock::NUMBERS / width.max(1)).clamp(16, RawBlock::ROWS);
        while block.rows() < most
            && let Some(t) = self.pass.next()?
        {
            // A row without a time belongs to any span.
            if !t.is_nan() {
                let (from, to) = self.pass.span(t)?;
                if t < from || t >= to {
                    continue;
                }
                self.pass.count(0, t, t);
            }
            if self.repeats(t, block) {
                self.duplicates += 1;
                continue;
            }
            self.pass.samples += 1;
            block.t.push(t);
            for (index, column) in block.columns.iter_mut().enumerate() {
                let number = self.pass.rows.logged(index);
                if number.is_none() {
                    // else most of the numbers, or all rows, would be lost in silence
                    self.pass.rows.refuse_comma(index)?;
                    self.words[index] += 1;
                }
                column.push(number.unwrap_or(f64::NAN));
            }
        }
        Ok(block.rows() > 0)
    }

    /// Whether the current message is there twice, time included: nobody can delete it from a recording.
    fn repeats(&self, t: f64, block: &RawBlock) -> bool {
        let before = block.t.last().copied().unwrap_or(self.last.0);
        if t != before || !self.is_recording() {
            return false;
        }
        (0..self.words.len()).all(|column| {
            let own = self.pass.rows.logged(column).unwrap_or(f64::NAN);
            let last = match block.t.is_empty() {
                true => self.last.1.get(column).copied(),
                false => block
                    .columns
                    .get(column)
                    .and_then(|all| all.last().copied()),
            };
            last.is_some_and(|last| last == own || (last.is_nan() && own.is_nan()))
        })
    }

    /// Time from the first to the last row so far [s].
    pub fn duration_s(&self) -> f64 {
        self.pass.duration_s()
    }

    /// Rows with more or fewer fields than the header, so far; they are passed over.
    pub fn malformed(&self) -> u64 {
        self.pass.rows.malformed()
    }

    /// What was left out, one sentence each; call it after the last block.
    pub fn warnings(&self) -> Vec<String> {
        let mut out = self.pass.warnings();
        out.extend(counted(
            self.duplicates,
            "messages repeat the message before, time included, and are left out",
        ));
        out
    }

    pub(crate) fn breaks(&self) -> Vec<String> {
        self.pass.rows.breaks()
    }

    /// Messages that contradict the others of their topic and are left out, with how many they are.
    pub(crate) fn contradictions(&self) -> Vec<(u64, String)> {
        self.pass.rows.contradictions()
    }

    pub(crate) fn uneven(&self) -> Vec<(u64, String)> {
        self.pass.rows.uneven()
    }

    /// Fields of a column that hold words, so far.
    pub fn words(&self, column: usize) -> u64 {
        self.words.get(column).copied().unwrap_or(0)
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
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, span: &str) -> (RawReader, RawBlock) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, text).unwrap();
        let spec = format!("{}{span}", path.display()).parse().unwrap();
        let mut log = RawReader::open(&spec, None).unwrap();
        log.set_time(0, 1.0);
        let (mut block, mut all) = (RawBlock::default(), RawBlock::default());
        while log.read(&mut block).unwrap() {
            all.columns.resize_with(block.columns.len(), Vec::new);
            all.t.extend(&block.t);
            for (all, column) in all.columns.iter_mut().zip(&block.columns) {
                all.extend(column);
            }
        }
        (log, all)
    }

    #[test]
    fn what_a_strict_reader_refuses_is_read_as_it_stands() {
        let text = "t,q [deg],word\n0,1,a\n1,nan,b\n0.5,,c\n2\n3,x,d\n3,4,5\n";
        let (log, block) = read(text, "");
        assert_eq!(log.names(), ["t", "q [deg]", "word"]);
        assert_eq!(log.unit(1), Some("deg"));
        assert_eq!(block.columns[0], [0.0, 1.0, 0.5, 3.0, 3.0]);
        let finite: Vec<bool> = block.columns[1].iter().map(|x| x.is_finite()).collect();
        assert_eq!(finite, [true, false, false, false, true]);
        assert_eq!((log.malformed(), log.words(1), log.words(2)), (1, 1, 4));
    }

    #[test]
    fn spans_are_those_of_the_strict_reader() {
        let rows: String = (0..10).map(|k| format!("{k},{k}\n")).collect();
        let text = format!("t,q\n{rows}");
        let rows = |span| read(&text, span).1.columns[1].clone();
        assert_eq!(rows("@0..50%"), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(rows("@7..s"), [7.0, 8.0, 9.0]);
    }

    #[test]
    fn epoch_and_iso_times_are_counted_from_the_first() {
        let epoch = "stamp,q\n1714566896.123456789,1\n1714566896.123456790,2\nx,3\n";
        let (log, block) = read(epoch, "");
        assert_eq!(block.t[..2], [0.0, 1e-9]);
        assert!(block.t[2].is_nan());
        assert_eq!(log.origin().nanoseconds(), 1_714_566_896_123_456_789);
        let iso = "t,q\n2024-05-01T12:34:56.5Z,1\n2024-05-01T12:34:57Z,2\n";
        assert_eq!(read(iso, "").1.t, [0.0, 0.5]);
    }
}
