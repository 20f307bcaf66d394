//! How fast the joints of a log move, by which a rest is distinguished from a slow motion.

use crate::log::{Block, RowConversion};

/// Time over which a speed is formed [s]: long against the steps of an encoder, short against a motion.
const SPACING_S: f64 = 0.02;
/// Share of a time that is as good as all of it.
const FULL_TIME_SHARE: f64 = 0.999;
/// Speed up to which a joint rests, over its rms speed.
const RESTING_SPEED_SHARE: f64 = 0.01;
/// Speed that is rounding and no motion [m/s or rad/s]: a joint of one position rests.
const ROUNDING_SPEED: f64 = 1e-9;

/// Steps from which on rows may be poses [s]: no machine is logged in motion so slowly.
const POSE_S: f64 = 0.2;
/// Speed below which a joint stands [m/s or rad/s].
const STANDING_SPEED: f64 = 0.01;
/// Part of the time at rest from which on a log holds poses, and how many of them.
const HELD_SHARE: f64 = 0.8;
const HOLDS: u64 = 6;
/// Correlation from which on a velocity column follows the position.
const MIN_VELOCITY_CORRELATION: f64 = 0.9;

/// Sums of a joint's velocity column v and the derivative d of its position.
#[derive(Debug, Clone, Copy, Default)]
struct SpeedProducts {
    vv: f64,
    dd: f64,
    vd: f64,
}

/// Sums of the differences of positions from row to row, and of those of the differences.
#[derive(Debug, Clone, Default)]
struct Rows {
    last: [Vec<f64>; 2],
    times: [f64; 2],
    count: u64,
    seconds: f64,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Rows {
    fn take(&mut self, t: f64, q: &[f64]) {
        self.first.resize(q.len(), 0.0);
        self.second.resize(q.len(), 0.0);
        if self.count > 0 {
            self.seconds += t - self.times[1];
        }
        for (j, q) in q.iter().enumerate() {
            let [a, b] = [&self.last[0], &self.last[1]].map(|row| row.get(j).copied());
            if let Some(b) = b {
                self.first[j] += (q - b).powi(2);
                self.second[j] += a.map_or(0.0, |a| (q - 2.0 * b + a).powi(2));
            }
        }
        self.last.swap(0, 1);
        self.last[1].clear();
        self.last[1].extend_from_slice(q);
        self.times = [self.times[1], t];
        self.count += 1;
    }
}

/// Root mean square of every joint's speed, from positions as logged.
pub(crate) struct SpeedMeter {
    rows: Rows,
    /// Velocities between two positions whose speed is formed, summed, and how many they are.
    between: Vec<f64>,
    rows_between: u64,
    pairs: Vec<SpeedProducts>,
    last: Option<f64>,
    before: Vec<f64>,
    now: Vec<f64>,
    squares: Vec<f64>,
    fastest: Vec<f64>,
    seconds: f64,
    bounds: Option<[f64; 2]>,
    /// Time at which every joint stands, and how often that begins.
    still_s: f64,
    holds: u64,
    stands: bool,
}

impl SpeedMeter {
    pub(crate) fn new() -> Self {
        SpeedMeter {
            rows: Rows::default(),
            between: Vec::new(),
            rows_between: 0,
            pairs: Vec::new(),
            last: None,
            before: Vec::new(),
            now: Vec::new(),
            squares: Vec::new(),
            fastest: Vec::new(),
            seconds: 0.0,
            bounds: None,
            still_s: 0.0,
            holds: 0,
            stands: false,
        }
    }

    /// Takes a block of what was logged; `conversion` makes joint positions of it.
    pub(crate) fn take(&mut self, block: &Block, conversion: Option<&RowConversion>) {
        let n = block.joints();
        if n == 0 {
            return;
        }
        if let (Some(first), Some(last)) = (block.t.first(), block.t.last()) {
            self.bounds = Some([self.bounds.map_or(*first, |[first, _]| first), *last]);
        }
        self.squares.resize(n, 0.0);
        self.fastest.resize(n, 0.0);
        self.pairs.resize(n, SpeedProducts::default());
        self.between.resize(n, 0.0);
        for (k, (t, q)) in block.t.iter().zip(block.q.chunks_exact(n)).enumerate() {
            self.rows.take(*t, q);
            let logged = block.dq.get(k * n..(k + 1) * n);
            if let Some(v) = logged.filter(|v| v.iter().all(|v| v.is_finite())) {
                self.between
                    .iter_mut()
                    .zip(v)
                    .for_each(|(sum, v)| *sum += v);
                self.rows_between += 1;
            }
            let step = self.last.map_or(f64::INFINITY, |last| t - last);
            // times are rounded, and otherwise where the clock's zero lies
            let short = FULL_TIME_SHARE * SPACING_S;
            // a step back is a fault of the clock, and another begin
            if (0.0..short).contains(&step) {
                continue;
            }
            self.now.clear();
            self.now.extend_from_slice(q);
            let known = match conversion {
                Some(conversion) => conversion.apply(&mut self.now, &mut [], &mut []),
                None => true,
            };
            let known = known && self.now.iter().all(|q| q.is_finite());
            if known && step.is_finite() && step > 0.0 {
                let moved = self.now.iter().zip(&self.before);
                let sums = self.squares.iter_mut().zip(&mut self.fastest);
                for ((now, before), (square, fastest)) in moved.zip(sums) {
                    *square += (now - before).powi(2) / step;
                    *fastest = fastest.max((now - before).abs() / step);
                }
                let speeds = self.now.iter().zip(&self.before);
                let stands = speeds
                    .map(|(a, b)| (a - b).abs() / step)
                    .all(|v| v < STANDING_SPEED);
                self.holds += u64::from(stands && !self.stands);
                self.still_s += if stands { step } else { 0.0 };
                self.stands = stands;
                self.seconds += step;
                self.compare(step);
            }
            self.rows_between = 0;
            self.between.fill(0.0);
            self.last = known.then_some(*t);
            std::mem::swap(&mut self.now, &mut self.before);
        }
    }

    /// Compares the velocities of the last step with the derivative of the positions.
    fn compare(&mut self, step: f64) {
        if self.rows_between == 0 {
            return;
        }
        for (j, pair) in self.pairs.iter_mut().enumerate() {
            let v = self.between[j] / self.rows_between as f64;
            let d = (self.now[j] - self.before[j]) / step;
            if v.is_finite() {
                pair.vv += v * v;
                pair.dd += d * d;
                pair.vd += v * d;
            }
        }
    }

    /// Velocity column over the derivative of the position, joint by joint; none where it does not follow that.
    pub(crate) fn velocities(&self) -> Vec<Option<f64>> {
        let factor = |p: &SpeedProducts| {
            let follows =
                p.vd.abs() > MIN_VELOCITY_CORRELATION * (p.vv * p.dd).sqrt() && p.dd > 0.0;
            follows.then(|| p.vd / p.dd)
        };
        self.pairs.iter().map(factor).collect()
    }

    /// Rate of a log whose positions leap from row to row, joint for joint [Hz].
    pub(crate) fn poses_hz(&self) -> Option<f64> {
        let Rows { first, second, .. } = &self.rows;
        let steps = self.rows.count.saturating_sub(1) as f64;
        let leaps = |(first, second): (&f64, &f64)| *first == 0.0 || second > first;
        let poses = steps >= 2.0
            && first.iter().any(|x| *x > 0.0)
            && first.iter().zip(second).all(leaps)
            && self.rows.seconds >= POSE_S * steps;
        poses.then(|| steps / self.rows.seconds)
    }

    /// Part of the time in which every joint stands, of a log that holds pose after pose.
    pub(crate) fn held_share(&self) -> Option<f64> {
        let share = self.still_s / self.seconds.max(f64::MIN_POSITIVE);
        (share > HELD_SHARE && self.holds >= HOLDS).then_some(share)
    }

    /// First and last time [s].
    pub(crate) fn bounds(&self) -> [f64; 2] {
        self.bounds.unwrap_or_default()
    }

    /// Greatest speed of each joint [m/s or rad/s].
    pub(crate) fn fastest(&self) -> Vec<f64> {
        self.fastest.clone()
    }

    /// Speed up to which each joint rests [m/s or rad/s].
    pub(crate) fn resting(&self) -> Vec<f64> {
        let rms = |square: &f64| match self.seconds > 0.0 {
            true => (square / self.seconds).sqrt(),
            false => 0.0,
        };
        let rests = |square| (RESTING_SPEED_SHARE * rms(square)).max(ROUNDING_SPEED);
        self.squares.iter().map(rests).collect()
    }
}
