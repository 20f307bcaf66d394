//! A log as it stands in its file: every column, with its errors. What a strict reader refuses, or
//! passes over, can be looked at here.

use std::path::PathBuf;

use super::columns::{Header, unit_of};
use super::layout::{Channel, Layout};
use super::reader::seconds;
use super::sheet::{Sheet, TimeColumn};
use super::source::{self, Provenance};
use super::time::Instant;
use super::{LogError, LogSpec, Span};

/// Consecutive rows of all columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TableBlock {
    /// Time of each row [s], counted from the table's origin; NaN where it has none.
    pub t: Vec<f64>,
    /// One list of numbers per column, the time's own too; NaN where a field is no number.
    pub columns: Vec<Vec<f64>>,
}

impl TableBlock {
    /// Rows that a table puts into one block, fewer where it is very wide.
    pub const ROWS: usize = 4096;
    /// Numbers that a block holds at most, where that is more than a few rows.
    const NUMBERS: usize = 1 << 21;

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.t.len()
    }

    fn clear(&mut self, width: usize) {
        self.t.clear();
        self.columns.resize_with(width, Vec::new);
        self.columns.iter_mut().for_each(Vec::clear);
    }
}

/// A log that is read as it stands.
#[derive(Debug)]
pub struct Table {
    spec: LogSpec,
    files: Vec<PathBuf>,
    rows: Sheet,
    layout: Layout,
    /// The layout is that of a robot.
    robot: bool,
    /// What keeps a recording from being read as the robot's.
    refused: Option<String>,
    time: Option<TimeColumn>,
    /// The instant from which times are counted, once one was read.
    origin: Option<Instant>,
    span: Option<(f64, f64)>,
    seen: Option<(f64, f64)>,
    samples: u64,
    malformed: u64,
    /// Fields that are neither empty nor a number, per column.
    words: Vec<u64>,
}

impl Table {
    /// Opens a log; `layout` tells the columns of a robot, where there is one.
    ///
    /// # Errors
    /// A file that cannot be read, or is no log.
    pub fn open(spec: &LogSpec, layout: Option<&Layout>) -> Result<Self, LogError> {
        let files = spec.files()?;
        let robot = layout.is_some();
        let layout = match layout {
            Some(layout) => layout.clone(),
            // A log without a header has columns #1, #2, ...
            None => Layout {
                time: Channel::si("#1", "s"),
                ..Layout::joint_columns(&[] as &[&str])
            },
        };
        let (rows, refused) = Sheet::open(&files, &layout, robot)?;
        let words = vec![0; rows.columns().len()];
        Ok(Self {
            spec: spec.clone(),
            files,
            rows,
            layout,
            robot,
            refused: refused.map(|error| error.to_string()),
            time: None,
            origin: None,
            span: None,
            seen: None,
            samples: 0,
            malformed: 0,
            words,
        })
    }

    /// Names of the columns.
    pub fn names(&self) -> &[String] {
        self.rows.columns()
    }

    /// The unit that a column's name states.
    pub fn unit(&self, column: usize) -> Option<&str> {
        self.names().get(column).and_then(|name| unit_of(name))
    }

    /// Which column a channel of a robot file is.
    pub fn find(&self, channel: &Channel) -> Option<usize> {
        self.with_header(|header| header.first(channel))
    }

    /// The layout of those offered that this log has, and what keeps a strict reader from it.
    pub fn layout(&self) -> (Layout, Option<String>) {
        if let Some(layout) = self.rows.layout() {
            return (layout.clone(), None);
        }
        self.with_header(|header| {
            let layout = header.choose(&self.layout);
            let error = match &self.refused {
                Some(refused) => Some(refused.clone()),
                None => header.columns(&layout).err().map(|error| error.to_string()),
            };
            (layout, error)
        })
    }

    /// Whether rows carry their own times, as those of recordings do.
    pub fn is_recording(&self) -> bool {
        !matches!(self.rows, Sheet::Text(_))
    }

    /// Says which column is the time, and how many seconds its unit has.
    pub fn set_time(&mut self, column: usize, seconds: f64) {
        self.time = Some(TimeColumn {
            index: column,
            seconds,
            exact: None,
        });
    }

    /// The instant from which times are counted, once a row is read: zero, unless they lie so far
    /// from it that f64 seconds would lose digits.
    pub fn origin(&self) -> Instant {
        self.origin.unwrap_or_default()
    }

    /// Fills the block with the next rows; false, and no row, at the end.
    ///
    /// # Errors
    /// A file that can no longer be read, or a line without an end.
    pub fn read(&mut self, block: &mut TableBlock) -> Result<bool, LogError> {
        block.clear(self.names().len());
        let wide = TableBlock::NUMBERS / self.names().len().max(1);
        let most = wide.clamp(16, TableBlock::ROWS);
        while block.rows() < most {
            match self.rows.next() {
                Ok(true) => {}
                Ok(false) => break,
                Err(LogError::Fields { .. }) => {
                    self.malformed += 1;
                    continue;
                }
                Err(error) => return Err(error),
            }
            let stamp = self.rows.stamp(&mut self.time);
            let t = stamp.map(|stamp| seconds(stamp, &mut self.origin));
            if !self.is_in_span(t)? {
                continue;
            }
            self.samples += 1;
            block.t.push(t.unwrap_or(f64::NAN));
            for (index, column) in block.columns.iter_mut().enumerate() {
                column.push(match self.rows.number(index) {
                    Some(value) => value,
                    None => {
                        self.words[index] += 1;
                        f64::NAN
                    }
                });
            }
        }
        Ok(block.rows() > 0)
    }

    /// Rows with more or fewer fields than the header, so far; they are passed over.
    pub fn malformed(&self) -> u64 {
        self.malformed
    }

    /// What was left out, one sentence each; call it after the last block.
    pub fn warnings(&self) -> Vec<String> {
        self.rows.warnings()
    }

    /// Where files break off; call it after the last block.
    pub fn breaks(&self) -> Vec<String> {
        self.rows.breaks()
    }

    /// Fields of a column that hold words, so far.
    pub fn words(&self, column: usize) -> u64 {
        self.words.get(column).copied().unwrap_or(0)
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
            duration_s: self.seen.map_or(0.0, |(first, last)| last - first),
        })
    }

    fn with_header<T>(&self, ask: impl FnOnce(Header<'_>) -> T) -> T {
        let (file, line) = self.rows.header_place(&self.files);
        let names = self.rows.columns();
        ask(Header { file, line, names })
    }

    /// Whether a row of this time belongs to the span; one without a time does.
    fn is_in_span(&mut self, t: Option<f64>) -> Result<bool, LogError> {
        let Some(t) = t else {
            return Ok(true);
        };
        let (from, to) = match self.span {
            Some(span) => span,
            None => self.place_span(t)?,
        };
        let inside = t >= from && t < to;
        if inside {
            self.seen = Some((self.seen.map_or(t, |(first, _)| first), t));
        }
        Ok(inside)
    }

    fn place_span(&mut self, first: f64) -> Result<(f64, f64), LogError> {
        let span = match self.spec.span {
            Span::Whole => (f64::NEG_INFINITY, f64::INFINITY),
            Span::Seconds { from, to } => (first + from, first + to),
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

    fn last_time(&self) -> Result<Option<f64>, LogError> {
        let (mut rows, _) = Sheet::open(&self.files, &self.layout, self.robot)?;
        let (mut time, mut origin) = (self.time, self.origin);
        let mut last = None;
        loop {
            match rows.next() {
                Ok(true) => {
                    let t = rows.stamp(&mut time);
                    last = t.map(|stamp| seconds(stamp, &mut origin)).or(last);
                }
                Ok(false) => return Ok(last),
                Err(LogError::Fields { .. }) => {}
                Err(error) => return Err(error),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str, span: &str) -> (Table, TableBlock) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, text).unwrap();
        let spec = format!("{}{span}", path.display()).parse().unwrap();
        let mut table = Table::open(&spec, None).unwrap();
        table.set_time(0, 1.0);
        let (mut block, mut all) = (TableBlock::default(), TableBlock::default());
        while table.read(&mut block).unwrap() {
            all.columns.resize_with(block.columns.len(), Vec::new);
            all.t.extend(&block.t);
            for (all, column) in all.columns.iter_mut().zip(&block.columns) {
                all.extend(column);
            }
        }
        (table, all)
    }

    #[test]
    fn what_a_strict_reader_refuses_is_read_as_it_stands() {
        let text = "t,q [deg],word\n0,1,a\n1,nan,b\n0.5,,c\n2\n3,x,d\n3,4,5\n";
        let (table, block) = table(text, "");
        assert_eq!(table.names(), ["t", "q [deg]", "word"]);
        assert_eq!(table.unit(1), Some("deg"));
        assert_eq!(block.columns[0], [0.0, 1.0, 0.5, 3.0, 3.0]);
        let finite: Vec<bool> = block.columns[1].iter().map(|x| x.is_finite()).collect();
        assert_eq!(finite, [true, false, false, false, true]);
        assert_eq!(
            (table.malformed(), table.words(1), table.words(2)),
            (1, 1, 4)
        );
    }

    #[test]
    fn spans_are_those_of_the_strict_reader() {
        let rows: String = (0..10).map(|k| format!("{k},{k}\n")).collect();
        let text = format!("t,q\n{rows}");
        assert_eq!(
            table(&text, "@0..50%").1.columns[1],
            [0.0, 1.0, 2.0, 3.0, 4.0]
        );
        assert_eq!(table(&text, "@7..s").1.columns[1], [7.0, 8.0, 9.0]);
    }

    #[test]
    fn epoch_and_iso_times_are_counted_from_the_first() {
        let epoch = "stamp,q\n1714566896.123456789,1\n1714566896.123456790,2\nx,3\n";
        let (table, block) = table(epoch, "");
        assert_eq!(block.t[..2], [0.0, 1e-9]);
        assert!(block.t[2].is_nan());
        assert_eq!(table.origin().nanoseconds(), 1_714_566_896_123_456_789);
        let iso = "t,q\n2024-05-01T12:34:56.5Z,1\n2024-05-01T12:34:57Z,2\n";
        assert_eq!(super::tests::table(iso, "").1.t, [0.0, 0.5]);
    }
}
