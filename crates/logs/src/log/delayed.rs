//! Torques that were logged late in the rows of their positions, brought to the time that they belong to.

use std::collections::VecDeque;

use super::rows::{LogRows, counted};
use super::time::{Instant, RowTime};
use super::{Block, LogError};

/// A step longer than this many usual ones is a dropout, over which nothing is interpolated.
const DROPOUT_STEPS: f64 = 2.5;

struct WaitingRow {
    stamp: RowTime,
    t: f64,
    block: Block,
    number: u64,
    repeats: bool,
}

/// Rows whose torques are those of so many seconds later.
pub(super) struct DelayedRows {
    inner: Box<dyn LogRows>,
    delay_s: f64,
    hold: bool,
    /// Rows that were read, those before the current one too as far as their torques are needed.
    rows: VecDeque<WaitingRow>,
    /// Place of the next row among them, and the current row with its torque.
    next: usize,
    current: Option<(Block, u64, bool)>,
    origin: Option<Instant>,
    ended: bool,
    lost: u64,
}

impl DelayedRows {
    pub(super) fn new(inner: Box<dyn LogRows>, delay_s: f64, hold: bool) -> Self {
        Self {
            inner,
            delay_s,
            hold,
            rows: VecDeque::new(),
            next: 0,
            current: None,
            origin: None,
            ended: false,
            lost: 0,
        }
    }

    /// Reads one more row; false at the end.
    fn read(&mut self) -> Result<bool, LogError> {
        let Some(stamp) = self.inner.next()? else {
            self.ended = true;
            return Ok(false);
        };
        let mut block = Block::default();
        self.inner.append(&mut block)?;
        self.rows.push_back(WaitingRow {
            t: stamp.seconds(&mut self.origin),
            stamp,
            block,
            number: self.inner.number(),
            repeats: self.inner.repeats(),
        });
        Ok(true)
    }

    /// The torques at a time, between the rows about it; `None` where there are none near.
    fn torques(&self, t: f64) -> Option<Vec<f64>> {
        let after = self.rows.iter().position(|row| row.t >= t)?;
        let b = &self.rows[after];
        if b.t == t {
            return Some(b.block.tau.clone());
        }
        let a = &self.rows[after.checked_sub(1)?];
        let step = b.t - a.t;
        let near = |pair: (&WaitingRow, &WaitingRow)| pair.1.t - pair.0.t;
        let usual = self.rows.iter().zip(self.rows.iter().skip(1)).map(near);
        let usual = usual.fold(f64::INFINITY, |least, step| {
            if step > 0.0 { least.min(step) } else { least }
        });
        if step > DROPOUT_STEPS * usual {
            return None;
        }
        let share = if self.hold { 0.0 } else { (t - a.t) / step };
        let pairs = a.block.tau.iter().zip(&b.block.tau);
        Some(pairs.map(|(a, b)| a + share * (b - a)).collect())
    }
}

impl LogRows for DelayedRows {
    fn names(&self) -> &[String] {
        self.inner.names()
    }

    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        loop {
            while self.rows.len() <= self.next && self.read()? {}
            let Some(row) = self.rows.get(self.next) else {
                return Ok(None);
            };
            let (stamp, t) = (row.stamp, row.t);
            let wanted = t + self.delay_s;
            while !self.ended && self.rows.back().is_none_or(|last| last.t < wanted) {
                self.read()?;
            }
            let torques = self.torques(wanted);
            let row = &self.rows[self.next];
            let found = torques.map(|tau| {
                let block = Block {
                    tau,
                    ..row.block.clone()
                };
                (block, row.number, row.repeats)
            });
            self.next += 1;
            // rows that no later one takes its torque from
            while self.next > 1 && self.rows.get(1).is_some_and(|row| row.t < wanted.min(t)) {
                self.rows.pop_front();
                self.next -= 1;
            }
            match found {
                Some(found) => {
                    self.current = Some(found);
                    return Ok(Some(stamp));
                }
                None => self.lost += 1,
            }
        }
    }

    fn append(&self, block: &mut Block) -> Result<(), LogError> {
        if let Some((row, ..)) = &self.current {
            block.q.extend_from_slice(&row.q);
            block.tau.extend_from_slice(&row.tau);
            block.dq.extend_from_slice(&row.dq);
        }
        Ok(())
    }

    fn has_velocities(&self) -> bool {
        self.inner.has_velocities()
    }

    fn begins(&self) -> Option<f64> {
        self.inner.begins()
    }

    fn set_time(&mut self, column: usize, seconds: f64) {
        self.inner.set_time(column, seconds);
    }

    fn is_recording(&self) -> bool {
        self.inner.is_recording()
    }

    fn repeats(&self) -> bool {
        self.current
            .as_ref()
            .is_some_and(|(_, _, repeats)| *repeats)
    }

    fn number(&self) -> u64 {
        self.current.as_ref().map_or(0, |(_, number, _)| *number)
    }

    fn place(&self) -> String {
        self.inner.place()
    }

    fn clock_remedy(&self) -> Option<String> {
        self.inner.clock_remedy()
    }

    fn warnings(&self) -> Vec<String> {
        let mut out = self.inner.warnings();
        out.push(format!(
            "torques are those of {} s later, as `torque_delay_s` says",
            self.delay_s
        ));
        out.extend(counted(
            self.lost,
            "rows have no torque at that time and are left out",
        ));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows at 100 Hz whose position is their time, and whose torque came late.
    struct Late(f64, u32);

    impl LogRows for Late {
        fn next(&mut self) -> Result<Option<RowTime>, LogError> {
            self.1 += 1;
            Ok((self.1 < 200).then(|| RowTime::Seconds(f64::from(self.1) * 0.01)))
        }

        fn append(&self, block: &mut Block) -> Result<(), LogError> {
            let t = f64::from(self.1) * 0.01;
            block.q.push(t);
            block.tau.push(3.0 * (t - self.0));
            Ok(())
        }
    }

    #[test]
    fn torques_come_back_to_the_rows_that_they_belong_to() {
        for delay in [0.0131, -0.0257, 0.02] {
            let mut rows = DelayedRows::new(Box::new(Late(delay, 0)), delay, false);
            let (mut count, mut block) = (0, Block::default());
            while rows.next().unwrap().is_some() {
                block.clear();
                rows.append(&mut block).unwrap();
                assert!(
                    (block.tau[0] - 3.0 * block.q[0]).abs() < 1e-12,
                    "{delay}: {block:?}"
                );
                count += 1;
            }
            assert!((195..200).contains(&count), "{delay}: {count}");
        }
    }
}
