//! How a joint moves: speeds and accelerations reached, reversals, and how well its motion parts
//! inertia, viscous friction, Coulomb friction and offset.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;

use super::histogram::Histogram;
use crate::inspect::fault::FaultEpisodes;
use cft_ident_core::math::rank;

/// Time over which a speed is formed [s]: long against the steps of an encoder, short against the motion of a robot.
const SPACING_S: f64 = 0.02;
/// Rows at most that it spans.
const MAX_SPAN_ROWS: usize = 4096;
/// A joint moves where its speed is above this share of the largest.
const MOVING_SPEED_SHARE: f64 = 0.02;

/// Speeds in a row that one wrong position alone cannot make.
const IN_A_ROW: u32 = 4;

/// Highest accelerations that are remembered with their times.
const HIGHEST: usize = 64;

/// What one joint did.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointMotion {
    /// The joint.
    pub joint: String,
    /// Name of the channel that its position is in.
    pub channel: String,
    /// Unit of the channel, where it is known.
    pub unit: Option<String>,
    /// Whether the log moves it.
    pub moves: bool,
    /// Largest less smallest position [unit of the channel].
    pub travel: f64,
    /// Largest speed [unit/s].
    pub speed_max: f64,
    /// Root mean square of the speed [unit/s].
    pub speed_rms: f64,
    /// Largest acceleration, over 40 ms [unit/s2].
    pub acceleration_max: f64,
    /// Root mean square of the acceleration [unit/s2].
    pub acceleration_rms: f64,
    /// How often its direction turns.
    pub reversals: u64,
    /// Share of the time in which it moves faster than 2 % of its largest speed.
    pub moving_share: f64,
    /// Condition number of the columns a, v, sgn v, 1, each scaled to norm 1: how well the motion
    /// of this joint alone parts inertia, viscous and Coulomb friction and offset. Absent where it
    /// does not move.
    pub condition: Option<f64>,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Excitation {
    /// Rows between the three positions that a speed and an acceleration are formed from.
    spacing: usize,
    times: Vec<f64>,
    values: Vec<f64>,
    /// Rows in the ring since the stretch began.
    count: usize,
    speeds: Histogram,
    accelerations: Histogram,
    /// Sums of the products of a, v, sgn v and 1, row-major.
    gram: [[f64; 4]; 4],
    points: u64,
    direction: f64,
    reversals: u64,
    /// Largest speed by the robot file, how many speeds in a row are beyond it, and when they were.
    limit: Option<f64>,
    fast: u32,
    pub(crate) too_fast: FaultEpisodes,
    /// First and last time [s] of the rows of the highest accelerations, and their sizes.
    highest: Vec<[f64; 3]>,
}

impl Excitation {
    /// For rows `dt` apart [s] of a joint that may be so fast.
    pub(crate) fn new(dt: f64, limit: Option<f64>) -> Self {
        let spacing = match dt > 0.0 {
            true => ((SPACING_S / dt).round() as usize).clamp(1, MAX_SPAN_ROWS),
            false => 1,
        };
        Self {
            spacing,
            times: vec![0.0; 2 * spacing + 1],
            values: vec![0.0; 2 * spacing + 1],
            limit,
            ..Self::default()
        }
    }

    #[inline]
    pub(crate) fn take(&mut self, t: f64, value: f64) {
        let length = self.times.len();
        let at = self.count % length;
        self.times[at] = t;
        self.values[at] = value;
        self.count += 1;
        if self.count >= length && self.count.is_multiple_of(self.spacing) {
            self.point();
        }
    }

    pub(crate) fn part(&mut self) {
        self.count = 0;
        self.fast = 0;
        self.direction = 0.0;
    }

    fn point(&mut self) {
        let length = self.times.len();
        let row = |back: usize| {
            let at = (self.count - 1 - back) % length;
            (self.times[at], self.values[at])
        };
        let ((t0, q0), (t1, q1), (t2, q2)) = (row(2 * self.spacing), row(self.spacing), row(0));
        let v = (q2 - q0) / (t2 - t0);
        let a = 2.0 * ((q2 - q1) / (t2 - t1) - (q1 - q0) / (t1 - t0)) / (t2 - t0);
        self.points += 1;
        self.speeds.add(v);
        self.accelerations.add(a);
        self.remember([t0, t2, a.abs()]);
        if let Some(limit) = self.limit {
            self.fast = if v.abs() > limit { self.fast + 1 } else { 0 };
            if self.fast >= IN_A_ROW {
                self.too_fast.add(t1, t2, self.spacing as u64, t2 - t0);
            }
        }
        let direction = if v == 0.0 { 0.0 } else { v.signum() };
        let row = [a, v, direction, 1.0];
        for (sums, x) in self.gram.iter_mut().zip(row) {
            for (sum, y) in sums.iter_mut().zip(row) {
                *sum += x * y;
            }
        }
        if direction != 0.0 && v.abs() > MOVING_SPEED_SHARE * self.speeds.quantile(1.0) {
            self.reversals += u64::from(direction == -self.direction);
            self.direction = direction;
        }
    }

    fn remember(&mut self, point: [f64; 3]) {
        if self.highest.len() < HIGHEST {
            self.highest.push(point);
            return;
        }
        let lowest = (self.highest.iter_mut()).min_by(|a, b| a[2].total_cmp(&b[2]));
        if let Some(lowest) = lowest.filter(|lowest| lowest[2] < point[2]) {
            *lowest = point;
        }
    }

    /// The largest acceleration in which no event at these times took part, else the smallest of all; 0 without any.
    pub(crate) fn highest_apart(&self, events: &[f64]) -> f64 {
        let inside = |[from, to, _]: &[f64; 3]| events.iter().any(|t| from <= t && t <= to);
        let apart = self.highest.iter().filter(|point| !inside(point));
        let all = || self.highest.iter().map(|point| point[2]);
        let found = apart.map(|point| point[2]).reduce(f64::max);
        found.or_else(|| all().reduce(f64::min)).unwrap_or(0.0)
    }

    /// How often the direction turned.
    pub(crate) fn reversals(&self) -> u64 {
        self.reversals
    }

    /// Root mean square of the acceleration, or of column 1, the speed.
    pub(crate) fn rms(&self, column: usize) -> f64 {
        (self.gram[column][column] / self.points.max(1) as f64).sqrt()
    }

    /// What is known at the end; `travel` of the channel, `moves` as judged among all joints.
    pub(crate) fn facts(
        &self,
        joint: &str,
        channel: &str,
        travel: f64,
        moves: bool,
    ) -> JointMotion {
        let speed_max = self.speeds.quantile(1.0);
        let slow = MOVING_SPEED_SHARE * speed_max;
        let moving = self.speeds.share_outside(0.0, slow);
        JointMotion {
            joint: joint.to_owned(),
            channel: channel.to_owned(),
            unit: None,
            moves,
            travel,
            speed_max,
            speed_rms: self.rms(1),
            acceleration_max: self.accelerations.quantile(1.0),
            acceleration_rms: self.rms(0),
            reversals: if moves { self.reversals } else { 0 },
            moving_share: if moves { moving } else { 0.0 },
            condition: if moves { self.condition() } else { None },
        }
    }

    /// Condition number of the columns, each scaled to norm 1.
    fn condition(&self) -> Option<f64> {
        let scaled = DMatrix::from_fn(4, 4, |i, j| {
            self.gram[i][j] / (self.gram[i][i] * self.gram[j][j]).sqrt()
        });
        let squares = rank::svd(&scaled).ok()?;
        let condition = rank::condition(&squares.s).sqrt();
        condition.is_finite().then_some(condition)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fed(q: impl Fn(f64) -> f64) -> JointMotion {
        let mut motion = Excitation::new(0.001, None);
        for k in 0..20_000 {
            let t = f64::from(k) * 0.001;
            motion.take(t, q(t));
        }
        motion.facts("q1", "q_q1", 1.0, true)
    }

    #[test]
    fn speed_acceleration_and_reversals_of_a_sine_are_its_own() {
        let w = 4.0f64;
        let found = fed(|t| 0.5 * (w * t).sin());
        let off = |x: f64, y: f64| (x / y - 1.0).abs();
        assert!(off(found.speed_max, 0.5 * w) < 0.03, "{found:?}");
        assert!(off(found.acceleration_max, 0.5 * w * w) < 0.03, "{found:?}");
        assert!(off(found.speed_rms * 2f64.sqrt(), 0.5 * w) < 0.02);
        assert_eq!(found.reversals, 25);
        assert!(found.moving_share > 0.97);
    }

    #[test]
    fn speeds_beyond_the_limit_are_seen_and_a_single_wrong_position_is_none() {
        let rows = |limit: f64, wrong: bool| {
            let mut motion = Excitation::new(0.001, Some(limit));
            for k in 0..20_000 {
                let t = f64::from(k) * 0.001;
                let spike = if wrong && k == 9_000 { 50.0 } else { 0.0 };
                motion.take(t, 0.5 * (4.0 * t).sin() + spike);
            }
            motion.too_fast.rows()
        };
        assert_eq!(rows(2.1, false), 0);
        assert_eq!(rows(2.1, true), 0);
        // above half of its largest, a sine is for two thirds of the time
        assert!((rows(1.0, false) as f64 / 20_000.0 - 2.0 / 3.0).abs() < 0.15);
    }

    #[test]
    fn constant_speed_parts_less_than_speeds_that_vary() {
        let one = fed(|t| 0.1 * (t % 4.0 - 2.0).abs());
        let many = fed(|t| 0.1 * t.sin() + 0.03 * (3.1 * t).sin() + 0.01 * (7.3 * t).cos());
        let [less, more] = [&one, &many].map(|motion| motion.condition.unwrap());
        assert!(less > 3.0 * more, "{one:?} {many:?}");
    }
}
