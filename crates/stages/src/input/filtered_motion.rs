//! The motion in which a filter can use logs, to part them by.

use super::control::Control;
use super::error::IdentifyError;
use super::log_data::LogData;
use super::robot_setup::RobotSetup;
use cft_ident_core::motion::{FilteredRow, MotionError, RunError, run};

/// Rows that a filter makes of logs: how far they go, and how many of them go no farther than those of others.
#[derive(Debug, Clone, PartialEq)]
pub struct FilteredMotion {
    /// Least and greatest position of each joint \[m or rad\], then those of its velocity \[m/s or rad/s\].
    ranges: Vec<[f64; 2]>,
    rows: u64,
    within: u64,
}

impl FilteredMotion {
    /// Runs logs through the filter of a robot file beside the rows of others; `None` where it finds no stretch that
    /// is long enough in one of them.
    ///
    /// # Errors
    /// Logs that fits refuse.
    pub fn of_logs(
        setup: &RobotSetup,
        logs: &[LogData],
        beside: Option<&Self>,
        control: &Control,
    ) -> Result<Option<Self>, IdentifyError> {
        let (n, settings) = (setup.robot.joints(), setup.settings());
        let mut seen = Self {
            ranges: vec![[f64::INFINITY, f64::NEG_INFINITY]; 2 * n],
            rows: 0,
            within: 0,
        };
        for log in logs {
            let mut blocks = log.blocks(control)?;
            let filtered = run(
                &mut |block| blocks.read(block),
                n,
                &settings,
                None,
                1,
                &|_, out| out.fill(0.0),
                &mut |row| seen.take_row(row, beside),
            );
            match filtered {
                Err(RunError::Motion(MotionError::NoSegment { .. })) => return Ok(None),
                Err(error) => return Err(log.to_stage_error(&blocks, error)),
                Ok(_) => {}
            }
        }
        Ok(Some(seen))
    }

    fn take_row(&mut self, row: &FilteredRow, beside: Option<&Self>) {
        let numbers = || row.q.iter().chain(row.v).copied();
        for (range, x) in self.ranges.iter_mut().zip(numbers()) {
            *range = [range[0].min(x), range[1].max(x)];
        }
        let inside = |other: &Self| {
            let mut pairs = other.ranges.iter().zip(numbers());
            pairs.all(|([low, high], x)| (*low..=*high).contains(&x))
        };
        self.rows += 1;
        self.within += u64::from(beside.is_some_and(inside));
    }

    /// Whether most of its rows lie within the ranges of the rows that it was held beside.
    pub fn is_within(&self) -> bool {
        2 * self.within > self.rows
    }
}
