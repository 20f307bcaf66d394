//! Rows of a log as they stand in its files, whatever their format, errors and all.

use std::path::PathBuf;

use super::content::{Content, Kind};
use super::csv::Rows;
use super::layout::Layout;
use super::recording::{JointStates, MessageRows};
use super::row::Stamped;
use super::text::power_of_ten;
use super::time::FAR_S;
use super::{LogError, source};

/// The time of a text log.
#[derive(Debug, Clone, Copy)]
pub(super) struct TimeColumn {
    pub(super) index: usize,
    /// Seconds per unit.
    pub(super) seconds: f64,
    /// Read exactly, in units of 10^power s; known from the first row that has a time.
    pub(super) exact: Option<Option<i32>>,
}

/// The rows of a log.
#[derive(Debug)]
pub(super) enum Sheet {
    Text(Box<Rows>),
    /// The channels of a robot, wherever its messages hold them.
    Robot {
        rows: Box<MessageRows>,
        layout: Box<Layout>,
        columns: Vec<String>,
        stamp: Stamped,
    },
    /// What joint states there are.
    States(Box<JointStates>),
}

impl Sheet {
    /// Opens the files of a log; `robot` where its layout is that of a robot. What keeps a
    /// recording from being read as the robot's is told beside it.
    pub(super) fn open(
        files: &[PathBuf],
        layout: &Layout,
        robot: bool,
    ) -> Result<(Self, Option<LogError>), LogError> {
        if let [path] = files {
            let content = Content::open(path)?;
            if content.kind == Kind::Text {
                return Ok((
                    Self::Text(Box::new(Rows::new(path, content, layout)?)),
                    None,
                ));
            }
        }
        let mut refused = None;
        if robot {
            match MessageRows::open(files, layout) {
                Ok((rows, layout)) => return Ok((Self::robot(rows, layout), None)),
                Err(error) => refused = Some(error),
            }
        }
        match JointStates::open(files) {
            Ok(states) => Ok((Self::States(Box::new(states)), refused)),
            Err(error) => Err(refused.unwrap_or(error)),
        }
    }

    fn robot(rows: MessageRows, layout: Layout) -> Self {
        let mut columns = vec!["t".to_owned()];
        let velocities = match rows.has_velocities() {
            true => &layout.velocities[..],
            false => &[],
        };
        let channels = (layout.positions.iter())
            .chain(&layout.torques)
            .chain(velocities);
        columns.extend(channels.map(|channel| channel.column.clone()));
        Self::Robot {
            rows: Box::new(rows),
            layout: Box::new(layout),
            columns,
            stamp: Stamped::Seconds(0.0),
        }
    }

    /// Names of the columns.
    pub(super) fn columns(&self) -> &[String] {
        match self {
            Self::Text(rows) => rows.header(),
            Self::Robot { columns, .. } => columns,
            Self::States(states) => states.columns(),
        }
    }

    /// File and line of the header, for a message.
    pub(super) fn header_place(&self, files: &[PathBuf]) -> (String, u64) {
        match self {
            Self::Text(rows) => (rows.file(), rows.header_line()),
            _ => (source::shown_all(files), 1),
        }
    }

    /// The layout of the robot's channels, where they were looked for in messages.
    pub(super) fn layout(&self) -> Option<&Layout> {
        match self {
            Self::Robot { layout, .. } => Some(layout),
            _ => None,
        }
    }

    /// Goes on to the next row; false at the end.
    pub(super) fn next(&mut self) -> Result<bool, LogError> {
        match self {
            Self::Text(rows) => rows.next(),
            Self::Robot { rows, stamp, .. } => Ok(match rows.next()? {
                Some(next) => {
                    *stamp = next;
                    true
                }
                None => false,
            }),
            Self::States(states) => states.next(),
        }
    }

    /// Time of the current row, where it has one; `time` says which column of a text log it is.
    pub(super) fn stamp(&self, time: &mut Option<TimeColumn>) -> Option<Stamped> {
        match self {
            Self::Text(rows) => text_stamp(rows, time.as_mut()?),
            Self::Robot { stamp, .. } => Some(*stamp),
            Self::States(states) => Some(states.stamp()),
        }
    }

    /// The number in a column of the current row, NaN where there is none; `None` for words.
    pub(super) fn number(&self, column: usize) -> Option<f64> {
        match self {
            Self::Text(rows) => rows.lenient(column),
            Self::Robot { rows, .. } => Some(rows.logged(column.checked_sub(1)?)),
            Self::States(states) => Some(states.number(column)),
        }
    }

    /// What was left out, once the last row is read.
    pub(super) fn warnings(&self) -> Vec<String> {
        match self {
            Self::Text(_) => Vec::new(),
            Self::Robot { rows, .. } => rows.warnings(),
            Self::States(states) => states.warnings(),
        }
    }

    /// Where files break off, once the last row is read.
    pub(super) fn breaks(&self) -> Vec<String> {
        match self {
            Self::Text(_) => Vec::new(),
            Self::Robot { rows, .. } => rows.breaks(),
            Self::States(states) => states.breaks(),
        }
    }
}

fn text_stamp(rows: &Rows, time: &mut TimeColumn) -> Option<Stamped> {
    let plain = rows.lenient(time.index).map(|number| number * time.seconds);
    let exact = match time.exact {
        Some(exact) => exact,
        None => {
            let power = power_of_ten(time.seconds);
            let exact = match plain {
                None if rows.is_date(time.index) => Some(power.unwrap_or(0)),
                Some(t) if t.abs() >= FAR_S => power,
                Some(t) if t.is_finite() => None,
                _ => return None,
            };
            time.exact = Some(exact);
            exact
        }
    };
    Some(match exact {
        Some(power) => Stamped::Exact(rows.instant(time.index, power).ok()?),
        None => Stamped::Seconds(plain.filter(|t| t.is_finite())?),
    })
}
