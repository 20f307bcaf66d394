//! Positions of one topic and torques of another, each on its own clock, brought onto that of the positions.
//!
//! Positions are differentiated later and stay as they were measured; the torque at their times is
//! interpolated between its neighbours, or taken by a zero-order hold where the robot file says so. A row whose
//! neighbours lie too far apart is left out: nothing is made up across a dropout.

use std::collections::VecDeque;
use std::path::PathBuf;

use super::delay::DelayEstimator;
use crate::log::layout::Layout;
use crate::log::rows::counted;
use crate::log::time::{Instant, RowTime};

/// Rows that wait for their torque at most.
const MAX_WAITING_ROWS: usize = 1 << 14;
/// Torques that are kept for positions that come late.
const MAX_KEPT_TORQUES: usize = 1 << 12;
/// Steps of the torques' clock from which its pace is known.
const PACE_STEPS: usize = 31;
/// A step longer than this many usual ones is a dropout.
const DROPOUT_STEPS: f64 = 2.5;

/// What one message, or one row, holds: as logged, not scaled.
#[derive(Default)]
pub(super) struct Sample {
    pub(super) stamp: RowTime,
    pub(super) q: Vec<f64>,
    pub(super) tau: Vec<f64>,
    pub(super) dq: Vec<f64>,
    pub(super) number: u64,
    pub(super) path: PathBuf,
    /// The file for a message to the user.
    pub(super) file: String,
}

/// Pairs positions and torques that come in messages of their own.
#[derive(Default)]
pub(super) struct TorquePairing {
    zero_order_hold: bool,
    delay_s: f64,
    waiting: VecDeque<Sample>,
    torques: VecDeque<(Instant, Vec<f64>)>,
    ready: VecDeque<Sample>,
    /// Samples whose memory is used again.
    spare: Vec<Sample>,
    /// The last steps of the torques' clock, and how many there were.
    steps: [f64; PACE_STEPS],
    stepped: usize,
    /// Rows without a torque on both sides, and inside dropouts of the torques.
    outside: u64,
    dropouts: u64,
    /// Torques whose time does not increase.
    disordered: u64,
    delay: DelayEstimator,
}

impl TorquePairing {
    pub(super) fn new(layout: &Layout) -> Self {
        Self {
            zero_order_hold: layout.zero_order_hold,
            delay_s: layout.section.torque_delay_s.unwrap_or(0.0),
            ..Self::default()
        }
    }

    /// Hands out the next row with its torque, where there is one.
    pub(super) fn take(&mut self, row: &mut Sample) -> bool {
        let Some(next) = self.ready.pop_front() else {
            return false;
        };
        self.spare.push(std::mem::replace(row, next));
        true
    }

    pub(super) fn add_positions(&mut self, row: &mut Sample) {
        let spare = self.spare.pop().unwrap_or_default();
        self.waiting.push_back(std::mem::replace(row, spare));
        if self.waiting.len() > MAX_WAITING_ROWS
            && let Some(row) = self.waiting.pop_front()
        {
            self.outside += 1;
            self.spare.push(row);
        }
        self.pair();
    }

    pub(super) fn add_torques(&mut self, sample: &mut Sample) {
        let t = sample.stamp.instant().plus(-self.delay_s);
        if let Some((before, _)) = self.torques.back() {
            if t <= *before {
                self.disordered += 1;
                return;
            }
            self.steps[self.stepped % PACE_STEPS] = t.since(*before);
            self.stepped += 1;
        }
        let mut numbers = match self.torques.len() > MAX_KEPT_TORQUES {
            true => self.torques.pop_front().map(|(_, old)| old),
            false => None,
        }
        .unwrap_or_default();
        numbers.clone_from(&sample.tau);
        self.torques.push_back((t, numbers));
        self.pair();
    }

    /// Pairs every waiting row that has torques at or after its time.
    fn pair(&mut self) {
        while let (Some(row), Some((last, _))) = (self.waiting.front(), self.torques.back()) {
            let t = row.stamp.instant();
            if t > *last {
                return;
            }
            let Some(mut row) = self.waiting.pop_front() else {
                return;
            };
            // The first torque at or after the row.
            let after = self.torques.partition_point(|(time, _)| *time < t);
            if self.torque_at(t, after, &mut row.tau) {
                let seconds = t.since(Instant::default());
                self.delay.add(seconds, &row.q, &row.tau);
                self.ready.push_back(row);
            } else {
                self.spare.push(row);
            }
        }
    }

    /// Torque at `t`, between torque `after` and the one before it; whether there is one.
    fn torque_at(&mut self, t: Instant, after: usize, to: &mut Vec<f64>) -> bool {
        let Some((after_t, after_tau)) = self.torques.get(after) else {
            return false;
        };
        if *after_t == t {
            to.clone_from(after_tau);
            return true;
        }
        let before = after
            .checked_sub(1)
            .and_then(|index| self.torques.get(index));
        let Some((before_t, before_tau)) = before else {
            self.outside += 1;
            return false;
        };
        let step = after_t.since(*before_t);
        if self.is_dropout(step) {
            self.dropouts += 1;
            return false;
        }
        to.clear();
        let share = t.since(*before_t) / step;
        let pairs = before_tau.iter().zip(after_tau);
        to.extend(pairs.map(|(before, after)| match self.zero_order_hold {
            true => *before,
            false => before + share * (after - before),
        }));
        true
    }

    fn is_dropout(&self, step: f64) -> bool {
        let known = self.stepped.min(PACE_STEPS);
        if known < 5 {
            return false;
        }
        let mut steps = self.steps;
        let (_, usual, _) = steps[..known].select_nth_unstable_by(known / 2, f64::total_cmp);
        step > DROPOUT_STEPS * *usual
    }

    /// What the user should know, topics named.
    pub(super) fn warnings(&self, positions: &str, torques: &str) -> Vec<String> {
        let how = match self.zero_order_hold {
            true => "held from message to message",
            false => "interpolated linearly",
        };
        let mut out = vec![format!(
            "positions are those of {positions}, torques those of {torques}, {how} at the times of the positions"
        )];
        let outside = self.outside + self.waiting.len() as u64;
        for (count, text) in [
            (
                outside,
                format!(
                    "{positions} lie before the first or after the last torque and are left out"
                ),
            ),
            (
                self.dropouts,
                format!("{positions} lie in dropouts of {torques} and are left out"),
            ),
            (
                self.disordered,
                format!("{torques} are left out: their time does not increase"),
            ),
        ] {
            out.extend(counted(count, &format!("messages of {text}")));
        }
        out.push(self.delay.describe(positions, torques, self.delay_s));
        out
    }
}
