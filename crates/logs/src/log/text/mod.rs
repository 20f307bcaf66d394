//! A text log as rows of channels in SI units.

mod cells;
mod csv;
mod head;
mod header;
mod json_lines;
mod line;
mod listed;
mod number;
mod records;
mod runs;
mod table;

use std::path::Path;
use std::sync::OnceLock;

use self::csv::TextFile;
pub(super) use self::json_lines::JsonRows;
use self::runs::TableRuns;
use super::columns::{Header, ScaledColumn, ScaledColumns, choose};
use super::content::FileContent;
use super::layout::Layout;
use super::rows::{LogRows, RowStrictness};
use super::time::{FAR_S, Instant, RowTime};
use super::two_clocks::rest_of;
use super::{Block, LogError, escape};
use cft_ident_core::number::is_usable;

/// A time of day that leaps back by more than this has passed midnight [s].
const HALF_A_DAY_S: f64 = 43_200.0;
/// Rows at the beginning of a log that show whether its channels have rows of their own.
const LOOKED_AT: usize = 10_000;

/// A unit of time, `times` 10^`power` s.
#[derive(Debug, Clone, Copy)]
struct ExactUnit {
    times: i128,
    power: i32,
}

#[derive(Debug, Clone, Copy)]
struct TimeColumn {
    index: usize,
    /// Seconds per unit.
    seconds: f64,
    /// Column of what is beyond whole seconds, and the power of ten of a second that it counts.
    rest: Option<(usize, i32)>,
    /// Dates, and numbers far from zero, are read exactly, in units of so many times 10^power s; known from the
    /// first time.
    exact: Option<Option<ExactUnit>>,
}

pub(super) struct TextRows {
    file: TextFile,
    columns: ScaledColumns,
    time: Option<TimeColumn>,
    /// Rate of a log without times [Hz], and rows so far.
    even: Option<(f64, u64)>,
    strictness: RowStrictness,
    /// The last time of day, and the days that have passed.
    of_day: (Option<Instant>, u32),
    runs: TableRuns,
    /// What the log was opened by, to look at its beginning again.
    asked: Layout,
    /// Whether positions and torques have rows of their own, once it was looked at.
    turns: OnceLock<bool>,
}

impl TextRows {
    /// Finds the columns; the layout that the log turns out to have, and what keeps a strict reader from it.
    pub(super) fn open(
        path: &Path,
        content: FileContent,
        layout: &Layout,
        strictness: RowStrictness,
    ) -> Result<(Self, Layout, Option<LogError>), LogError> {
        let file = TextFile::open(path, content, layout, strictness)?;
        let header = Header {
            at: format!("{}:{}", file.file(), file.header_line),
            names: &file.header,
        };
        let asked = layout.clone();
        let layout = choose(header.names, layout);
        let (columns, refused) = match (header.columns(&layout), strictness) {
            (Ok(columns), _) => (columns, None),
            (Err(error), RowStrictness::Refuse) => return Err(error),
            (Err(error), RowStrictness::Record) => (ScaledColumns::default(), Some(error)),
        };
        let mut rows = Self {
            runs: TableRuns::new(&file.header),
            file,
            time: None,
            even: layout.section.rate_hz.map(|rate| (rate, 0)),
            strictness,
            columns,
            of_day: (None, 0),
            asked,
            turns: OnceLock::new(),
        };
        if let Some(time) = rows.columns.time {
            rows.set_time(time.index, time.factor);
        }
        Ok((rows, layout, refused))
    }

    #[inline]
    fn stamp(&mut self) -> Option<RowTime> {
        if let Some((rate, row)) = &mut self.even {
            let t = *row as f64 / *rate;
            *row += 1;
            return Some(RowTime::Seconds(t));
        }
        let (file, time) = (&self.file, self.time.as_mut()?);
        if let Some((rest, power)) = time.rest {
            let whole = file.instant(time.index, 0)?;
            return Some(RowTime::Exact(whole.and(file.instant(rest, power)?)));
        }
        let seconds = || {
            let seconds = file.number(time.index)? * time.seconds;
            is_usable(seconds).then_some(seconds)
        };
        let exact = match time.exact {
            Some(exact) => exact,
            None => {
                let exact = match file.is_date(time.index) {
                    true => Some(ExactUnit { times: 1, power: 0 }),
                    false => ExactUnit::of(time.seconds)
                        .filter(|_| seconds().is_some_and(|t| t.abs() >= FAR_S)),
                };
                // A first row without a time says nothing.
                if exact.is_none() {
                    seconds()?;
                }
                *time.exact.insert(exact)
            }
        };
        match exact {
            Some(unit) => {
                let instant = file.instant(time.index, unit.power)?.times(unit.times);
                if !file.is_time_of_day(time.index) {
                    return Some(RowTime::Exact(instant));
                }
                let (last, days) = &mut self.of_day;
                // time of day begins anew at midnight
                *days += u32::from(
                    last.is_some_and(|last| instant.seconds() < last.seconds() - HALF_A_DAY_S),
                );
                *last = Some(instant);
                Some(RowTime::Exact(
                    instant.plus(f64::from(*days) * 2.0 * HALF_A_DAY_S),
                ))
            }
            None => seconds().map(RowTime::Seconds),
        }
    }
}

impl LogRows for TextRows {
    fn set_time(&mut self, index: usize, seconds: f64) {
        self.time = Some(TimeColumn {
            index,
            seconds,
            rest: rest_of(&self.file.header, index),
            exact: None,
        });
    }

    fn names(&self) -> &[String] {
        &self.file.header
    }

    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        if !self.file.next()? {
            return Ok(None);
        }
        match (self.stamp(), self.strictness, self.time) {
            (Some(stamp), ..) => {
                let (file, even) = (&self.file, self.even.is_some());
                let number = |place: usize| file.number(place);
                let other_word = || file.other_word();
                Ok(Some(self.runs.take(stamp, even, number, other_word)))
            }
            (None, RowStrictness::Refuse, Some(time)) => Err(self.file.no_number(time.index)),
            (None, ..) => Ok(Some(RowTime::NONE)),
        }
    }

    fn append(&self, block: &mut Block) -> Result<(), LogError> {
        let parts = [
            (&self.columns.positions, &mut block.q),
            (&self.columns.torques, &mut block.tau),
        ];
        for (columns, to) in parts {
            for column in columns {
                let value = self.file.number(column.index);
                match value.map(|value| value * column.factor + column.offset) {
                    Some(value) if is_usable(value) => to.push(value),
                    _ => return Err(self.unusable(column.index)),
                }
            }
        }
        // nothing is fitted to velocities: what was not measured is no reason to refuse a row
        let velocities = self.columns.velocities.iter().map(|column| {
            let value = self.file.number(column.index).unwrap_or(f64::NAN);
            value * column.factor + column.offset
        });
        let usable = velocities.map(|x| if is_usable(x) { x } else { f64::NAN });
        block.dq.extend(usable);
        Ok(())
    }

    fn logged(&self, column: usize) -> Option<f64> {
        let blank = || self.file.is_blank_field(column).then_some(f64::NAN);
        self.file.number(column).or_else(blank)
    }

    fn refuse_comma(&self, column: usize) -> Result<(), LogError> {
        match self.file.has_decimal_comma(column) {
            true => Err(self.file.no_number(column)),
            false => Ok(()),
        }
    }

    fn has_velocities(&self) -> bool {
        !self.columns.velocities.is_empty()
    }

    fn repeats(&self) -> bool {
        self.file.repeats()
    }

    fn malformed(&self) -> u64 {
        self.file.malformed
    }

    fn warnings(&self) -> Vec<String> {
        let mut out = self.file.in_words();
        out.extend(self.runs.in_words());
        if let Some((time, (rest, _))) = self.time.and_then(|time| Some((time, time.rest?))) {
            let [seconds, rest] = [time.index, rest].map(|column| escape(&self.names()[column]));
            out.push(format!(
                "times are those of `{seconds}` and `{rest}` together"
            ));
        }
        out
    }

    fn seams(&self) -> Vec<RowTime> {
        self.runs.seams.clone()
    }

    fn place(&self) -> String {
        self.file.place()
    }

    fn number(&self) -> u64 {
        self.file.line_hint()
    }

    fn is_recording(&self) -> bool {
        false
    }
}

impl TextRows {
    /// Whether positions and torques have rows of their own at the beginning of the log, and fewer rows hold both.
    fn takes_turns(&self) -> bool {
        let path = &self.file.path;
        let opened = || {
            TextFile::open(
                path,
                FileContent::open(path)?,
                &self.asked,
                RowStrictness::Record,
            )
        };
        // what arrives on a stream cannot be read again
        let Some(mut file) = (!self.file.is_stream()).then(opened).and_then(Result::ok) else {
            return false;
        };
        let (mut positions, mut torques, mut both) = (0_usize, 0_usize, 0_usize);
        for _ in 0..LOOKED_AT {
            if !file.next().unwrap_or(false) {
                break;
            }
            match self.holds(&file) {
                [true, true] => both += 1,
                [true, false] => positions += 1,
                [false, true] => torques += 1,
                [false, false] => {}
            }
        }
        positions.min(torques) > 0 && both < positions + torques
    }

    /// Whether anything stands in the columns of positions and of torques of the current row of a file.
    ///
    /// Cells are empty, and no numbers that are none, where a table of two topics has a row of the other one.
    fn holds(&self, file: &TextFile) -> [bool; 2] {
        let any = |columns: &[ScaledColumn]| columns.iter().any(|c| !file.is_empty_cell(c.index));
        [any(&self.columns.positions), any(&self.columns.torques)]
    }

    /// Why a field of the current row cannot be used: nothing stands there, or all of its kind have another clock.
    #[cold]
    fn unusable(&self, index: usize) -> LogError {
        let (Some(q), Some(time)) = (self.columns.positions.first(), self.time) else {
            return self.file.no_number(index);
        };
        let [positions, torques] = self.holds(&self.file);
        if self.columns.torques.is_empty()
            || positions == torques
            || !self.turns.get_or_init(|| self.takes_turns())
        {
            return self.file.no_number(index);
        }
        let name = |at: usize| escape(&self.names()[at]).replace(['\'', '"', '`', '$', '\\'], "_");
        LogError::Cells {
            at: self.file.place(),
            column: escape(&self.names()[index]),
            what: "nothing: positions and torques have rows of their own, each by its clock",
            remedy: format!(
                "bring the torques to the times of the positions: `python -c \"import pandas; d = pandas.read_csv('IN', index_col='{}').select_dtypes('number'); k = d['{}'].notna(); d.interpolate(method='index')[k].dropna(axis=1, how='all').dropna().to_csv('OUT.csv')\"`",
                name(time.index),
                name(q.index)
            ),
        }
    }
}

impl ExactUnit {
    fn of(seconds: f64) -> Option<Self> {
        let powers = [(1.0, 0), (1e-3, -3), (1e-6, -6), (1e-9, -9)];
        let known = powers.into_iter().find(|(unit, _)| *unit == seconds);
        let whole = seconds >= 1.0 && seconds.fract() == 0.0;
        match known {
            Some((_, power)) => Some(Self { times: 1, power }),
            None => whole.then_some(Self {
                times: seconds as i128,
                power: 0,
            }),
        }
    }
}
