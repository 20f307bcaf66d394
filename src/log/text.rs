//! A text log as rows of channels in SI units.

use std::path::Path;

use super::columns::{Column, Columns, Header};
use super::content::Content;
use super::csv::Rows;
use super::layout::Layout;
use super::row::Stamped;
use super::time::FAR_S;
use super::{Block, LogError};

/// How times of this log are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Clock {
    /// Not known before the first row.
    Unknown,
    /// As f64 seconds, which are exact enough near zero.
    Seconds,
    /// Exactly: dates, and numbers in units of 10^power s that lie far from zero.
    Exact(i32),
}

/// A text log, and which of its columns are read.
#[derive(Debug)]
pub(super) struct TextRows {
    rows: Rows,
    columns: Columns,
    clock: Clock,
}

impl TextRows {
    /// Reads the header and finds the columns; the layout that the log turns out to have.
    pub(super) fn open(
        path: &Path,
        content: Content,
        layout: &Layout,
    ) -> Result<(Self, Layout), LogError> {
        let rows = Rows::new(path, content, layout)?;
        let header = Header {
            file: rows.file(),
            line: rows.header_line(),
            names: rows.header(),
        };
        let layout = header.choose(layout);
        let columns = header.columns(&layout)?;
        let clock = Clock::Unknown;
        Ok((
            Self {
                rows,
                columns,
                clock,
            },
            layout,
        ))
    }

    /// Goes on to the next row; its time, or `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Stamped>, LogError> {
        if !self.rows.next()? {
            return Ok(None);
        }
        let time = self.columns.time;
        if self.clock == Clock::Unknown {
            self.clock = self.clock_of(time)?;
        }
        Ok(Some(match self.clock {
            Clock::Exact(power) => Stamped::Exact(self.rows.instant(time.index, power)?),
            Clock::Seconds | Clock::Unknown => Stamped::Seconds(scaled(&self.rows, time)?),
        }))
    }

    /// Chooses by the first row.
    fn clock_of(&self, time: Column) -> Result<Clock, LogError> {
        let power = power_of_ten(time.factor);
        if self.rows.is_date(time.index) {
            return Ok(Clock::Exact(power.unwrap_or(0)));
        }
        let far = scaled(&self.rows, time)?.abs() >= FAR_S;
        Ok(match power {
            Some(power) if far => Clock::Exact(power),
            _ => Clock::Seconds,
        })
    }

    /// Appends positions, torques and velocities of the current row to the block.
    #[inline]
    pub(super) fn append(&self, block: &mut Block) -> Result<(), LogError> {
        append(&self.rows, &self.columns.positions, &mut block.q)?;
        append(&self.rows, &self.columns.torques, &mut block.tau)?;
        append(&self.rows, &self.columns.velocities, &mut block.dq)
    }

    pub(super) fn has_velocities(&self) -> bool {
        !self.columns.velocities.is_empty()
    }

    /// Whether the current row equals the one before it, byte for byte.
    pub(super) fn repeats(&self) -> bool {
        self.rows.repeats()
    }

    /// File and line of the current row, for a message.
    pub(super) fn place(&self) -> String {
        self.rows.place()
    }

    /// Line of the current row, near enough where comments and blank lines stand between.
    pub(super) fn number(&self) -> u64 {
        self.rows.line_hint()
    }
}

/// Exponent of a power of ten, for those that units of time have.
pub(super) fn power_of_ten(factor: f64) -> Option<i32> {
    [(1.0, 0), (1e-3, -3), (1e-6, -6), (1e-9, -9)]
        .into_iter()
        .find(|(unit, _)| *unit == factor)
        .map(|(_, power)| power)
}

#[inline]
fn scaled(rows: &Rows, column: Column) -> Result<f64, LogError> {
    rows.scaled(column.index, column.factor, column.offset)
}

/// Appends the numbers of some columns of the current row.
#[inline]
fn append(rows: &Rows, columns: &[Column], to: &mut Vec<f64>) -> Result<(), LogError> {
    for column in columns {
        to.push(scaled(rows, *column)?);
    }
    Ok(())
}
