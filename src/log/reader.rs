//! Reads one log block by block, in SI units, inside its span, with its time checked.

use super::columns::{Column, Columns, Header};
use super::csv::Rows;
use super::layout::Layout;
use super::source::{self, Provenance};
use super::{Block, LogError, LogSpec, Span};

/// A log that is being read.
#[derive(Debug)]
pub struct Reader {
    spec: LogSpec,
    rows: Rows,
    layout: Layout,
    columns: Columns,
    /// Times of the span [s], half open; set at the first row.
    span: Option<(f64, f64)>,
    /// Times of the first and the last row of the file so far [s].
    seen: Option<(f64, f64)>,
    /// Times of the first and the last row handed out [s].
    used: Option<(f64, f64)>,
    samples: u64,
    finished: bool,
    activity: Vec<Activity>,
}

/// What a joint did so far.
#[derive(Debug, Clone, Copy, Default)]
struct Activity {
    first_position: Option<f64>,
    moved: bool,
    driven: bool,
}

impl Reader {
    /// Opens a log and finds its columns.
    ///
    /// # Errors
    /// A file that cannot be read, is no text log, has no header, or lacks a column.
    pub fn open(spec: &LogSpec, layout: &Layout) -> Result<Self, LogError> {
        let rows = Rows::open(&spec.path, layout.delimiter)?;
        let header = Header {
            file: rows.file(),
            line: rows.header_line(),
            names: rows.header(),
        };
        let layout = match &layout.otherwise {
            Some(other) if !header.has_any(layout) && header.has_any(other) => (**other).clone(),
            _ => layout.clone(),
        };
        let columns = header.columns(&layout)?;
        Ok(Self {
            spec: spec.clone(),
            activity: vec![Activity::default(); columns.torques.len().min(columns.positions.len())],
            rows,
            layout,
            columns,
            span: None,
            seen: None,
            used: None,
            samples: 0,
            finished: false,
        })
    }

    /// The layout that the log turned out to have.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Whether the blocks hold logged velocities.
    pub fn has_velocities(&self) -> bool {
        !self.columns.velocities.is_empty()
    }

    /// Rows handed out so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Time from the first to the last row handed out so far [s].
    pub fn duration_s(&self) -> f64 {
        self.used.map_or(0.0, |(first, last)| last - first)
    }

    /// Fills the block with the next rows; false, and an empty block, at the end.
    ///
    /// # Errors
    /// A row that cannot be used, a time that does not increase, fewer than two rows in all, a
    /// torque channel that is dead; each with its line and what to do.
    pub fn read(&mut self, block: &mut Block) -> Result<bool, LogError> {
        block.clear();
        while !self.finished && block.len() < Block::ROWS {
            if !self.rows.next()? {
                self.finish()?;
                break;
            }
            let t = self.time()?;
            let (from, to) = match self.span {
                Some(span) => span,
                None => self.place_span(t)?,
            };
            if t < from {
                continue;
            }
            if t >= to {
                self.finish()?;
                break;
            }
            self.take(t, block)?;
        }
        Ok(!block.is_empty())
    }

    /// Name, span, checksum, rows and duration of what was read; call it after the last block.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn provenance(&self) -> Result<Provenance, LogError> {
        Ok(Provenance {
            name: self.spec.name(),
            span: self.spec.span.label(),
            sha256: source::sha256(&self.spec.path)?,
            samples: self.samples,
            duration_s: self.duration_s(),
        })
    }

    /// Time of the current row [s], later than the row before.
    fn time(&mut self) -> Result<f64, LogError> {
        let t = time_of(&self.rows, self.columns.time)?;
        let Some((first, before)) = self.seen else {
            self.seen = Some((t, t));
            return Ok(t);
        };
        if t <= before {
            return Err(self.out_of_order(before, t));
        }
        self.seen = Some((first, t));
        Ok(t)
    }

    #[cold]
    fn out_of_order(&self, before: f64, t: f64) -> LogError {
        let (file, line) = (self.rows.file(), self.rows.line());
        if t < before {
            LogError::TimeBackwards {
                file,
                line,
                before,
                t,
            }
        } else if self.rows.repeats() {
            LogError::DuplicateRow { file, line, t }
        } else {
            let column = super::escape(&self.layout.time.column);
            LogError::TimeStandsStill {
                file,
                line,
                t,
                column,
            }
        }
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

    /// Time of the file's last row [s]: one pass in which only times are parsed.
    fn last_time(&self) -> Result<f64, LogError> {
        let mut rows = Rows::open(&self.spec.path, self.layout.delimiter)?;
        let mut last = f64::NEG_INFINITY;
        while rows.next()? {
            last = time_of(&rows, self.columns.time)?;
        }
        Ok(last)
    }

    /// Appends the current row to the block.
    fn take(&mut self, t: f64, block: &mut Block) -> Result<(), LogError> {
        if block.is_empty() {
            block.line0 = self.rows.line_hint();
        }
        block.t.push(t);
        let (at_q, at_tau) = (block.q.len(), block.tau.len());
        append(&self.rows, &self.columns.positions, &mut block.q)?;
        append(&self.rows, &self.columns.torques, &mut block.tau)?;
        append(&self.rows, &self.columns.velocities, &mut block.dq)?;
        let (q, tau) = (&mut block.q[at_q..], &mut block.tau[at_tau..]);
        for ((activity, q), tau) in self.activity.iter_mut().zip(&*q).zip(&*tau) {
            activity.driven |= *tau != 0.0;
            activity.moved |= *activity.first_position.get_or_insert(*q) != *q;
        }
        if let Some(conversion) = &self.layout.conversion
            && !conversion.apply(q, tau)
        {
            return Err(self.no_pose());
        }
        self.used = Some((self.used.map_or(t, |(first, _)| first), t));
        self.samples += 1;
        Ok(())
    }

    #[cold]
    fn no_pose(&self) -> LogError {
        let mut positions = Vec::new();
        // The numbers were read before, so that a second failure cannot be.
        let _ = append(&self.rows, &self.columns.positions, &mut positions);
        LogError::NoPose {
            file: self.rows.file(),
            line: self.rows.line(),
            positions: format!("{positions:?}"),
        }
    }

    /// Judges what can be judged only at the end.
    fn finish(&mut self) -> Result<(), LogError> {
        self.finished = true;
        if self.samples < 2 {
            let file = self.rows.file();
            return Err(match (self.spec.span, self.seen) {
                (Span::Percent { .. } | Span::Seconds { .. }, Some((first, last))) => {
                    LogError::EmptySpan {
                        spec: super::escape_whole(&self.spec.to_string()),
                        rows: self.samples,
                        duration_s: last - first,
                    }
                }
                _ => LogError::TooFewRows {
                    file,
                    rows: self.samples,
                },
            });
        }
        let dead = self.activity.iter().position(|a| a.moved && !a.driven);
        match dead {
            None => Ok(()),
            Some(joint) => Err(LogError::ZeroTorque {
                file: self.rows.file(),
                column: super::escape(&self.layout.torques[joint].column),
                joint: super::escape(&self.layout.joints[joint]),
                rows: self.samples,
            }),
        }
    }
}

fn time_of(rows: &Rows, column: Column) -> Result<f64, LogError> {
    rows.scaled(column.index, column.factor, column.offset)
}

/// Appends the numbers of some columns of the current row.
#[inline]
fn append(rows: &Rows, columns: &[Column], to: &mut Vec<f64>) -> Result<(), LogError> {
    for column in columns {
        to.push(rows.scaled(column.index, column.factor, column.offset)?);
    }
    Ok(())
}
