//! A bounded number of smoothed rows, spread over the logs.

use super::LIMITS;
use cft_ident_core::judge::LogRows;

/// Numbers of a joint in a row.
const OF_JOINT: usize = 6;

/// Rows of smoothed motion and torque; of motors behind a linkage as logged, whatever pose they belong to.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    pub joints: usize,
    /// Of each row, its log.
    log: Vec<usize>,
    rows: Vec<f64>,
}

/// One row, joint side as declared.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    /// Positions [m or rad], velocities and accelerations.
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub a: &'a [f64],
    /// Signs of the velocities, filtered as all others.
    pub sign: &'a [f64],
    /// Torques [N or N m].
    pub tau: &'a [f64],
    /// Integrals of the positions over time since the log began.
    pub sum: &'a [f64],
}

impl Sample {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.log.len()
    }

    /// Row k.
    pub fn row(&self, k: usize) -> Row<'_> {
        let n = self.joints;
        let list = |i: usize| &self.rows[(k * OF_JOINT + i) * n..(k * OF_JOINT + i + 1) * n];
        Row {
            q: list(0),
            v: list(1),
            a: list(2),
            sign: list(3),
            tau: list(4),
            sum: list(5),
        }
    }

    /// Sum over all rows of a product of two numbers of a joint.
    pub fn product(&self, of: impl Fn(Row<'_>) -> f64) -> f64 {
        (0..self.len()).map(|k| of(self.row(k))).sum()
    }

    /// Root mean square of a number of each joint.
    pub fn rms(&self, of: impl Fn(Row<'_>) -> &[f64]) -> Vec<f64> {
        let rows = self.len().max(1) as f64;
        let of_joint = |j: usize| (self.product(|row| of(row)[j].powi(2)) / rows).sqrt();
        (0..self.joints).map(of_joint).collect()
    }

    /// How far a joint travels \[m or rad\].
    pub(super) fn travel(&self, joint: usize) -> f64 {
        let q = (0..self.len()).map(|k| self.row(k).q[joint]);
        let ends = |(l, h): (f64, f64), q: f64| (l.min(q), h.max(q));
        let (low, high) = q.fold((f64::INFINITY, f64::NEG_INFINITY), ends);
        high - low
    }

    /// The rows of each log, a row being the unit of time.
    pub(super) fn logs(&self) -> Vec<LogRows> {
        let speeds = self.rms(|row| row.v);
        let mut out: Vec<LogRows> = Vec::new();
        for (first, log) in self.log.iter().enumerate() {
            if out.last().is_none_or(|last| last.log != *log) {
                let rows = self.log[first..].iter().take_while(|l| *l == log).count();
                let own = first..first + rows;
                let fast = |j: usize| {
                    let moves = |k: usize| self.row(k).v[j].abs() > LIMITS.still * speeds[j];
                    own.clone().any(moves)
                };
                out.push(LogRows {
                    log: *log,
                    pieces: vec![(out.len(), own.clone())],
                    step_s: 1.0,
                    moves: (0..self.joints).map(fast).collect(),
                    counts: vec![true; rows],
                });
            }
        }
        out
    }

    /// Leaves out the rows in which nothing moves: static friction takes any torque there.
    fn without_rests(&mut self) {
        let speeds = self.rms(|row| row.v);
        let moves = |k: &usize| {
            let mut pairs = self.row(*k).v.iter().zip(&speeds);
            pairs.any(|(v, rms)| v.abs() > LIMITS.still * rms)
        };
        let kept: Vec<usize> = (0..self.len()).filter(moves).collect();
        if kept.len() >= self.len() / 4 {
            self.keep(&kept);
        }
    }

    fn keep(&mut self, kept: &[usize]) {
        let width = OF_JOINT * self.joints;
        for (to, from) in kept.iter().enumerate() {
            self.rows
                .copy_within(from * width..(from + 1) * width, to * width);
            self.log[to] = self.log[*from];
        }
        self.rows.truncate(kept.len() * width);
        self.log.truncate(kept.len());
    }
}

/// Takes rows as they come and keeps at most [`LIMITS`]`.rows`: twice as rarely each time that there are too many.
#[derive(Debug, Clone)]
pub struct Thinner {
    sample: Sample,
    every: u64,
    seen: u64,
    /// Log, time, positions and their integrals of the row before.
    last: Option<(usize, f64, Vec<f64>, Vec<f64>)>,
}

impl Thinner {
    /// For a robot of so many joints.
    pub fn new(joints: usize) -> Self {
        Self {
            sample: Sample {
                joints,
                ..Sample::default()
            },
            every: 1,
            seen: 0,
            last: None,
        }
    }

    /// Adds a row at time t \[s\]: positions, velocities, accelerations, signs of the velocities, torques.
    pub fn add(&mut self, log: usize, t: f64, channels: &[f64]) {
        let n = self.sample.joints;
        if channels.len() != (OF_JOINT - 1) * n || channels.iter().any(|x| !x.is_finite()) {
            return;
        }
        let q = &channels[..n];
        let sum = match self.last.take() {
            Some((of, last, before, sum)) if of == log => {
                let step = t - last;
                let pairs = sum.iter().zip(q.iter().zip(&before));
                pairs.map(|(s, (q, b))| s + 0.5 * step * (q + b)).collect()
            }
            _ => vec![0.0; n],
        };
        if self.seen.is_multiple_of(self.every) {
            self.sample.rows.extend_from_slice(channels);
            self.sample.rows.extend_from_slice(&sum);
            self.sample.log.push(log);
        }
        self.seen += 1;
        self.last = Some((log, t, q.to_vec(), sum));
        if self.sample.len() > LIMITS.rows {
            self.every *= 2;
            let kept: Vec<usize> = (0..self.sample.len()).step_by(2).collect();
            self.sample.keep(&kept);
        }
    }

    /// The rows that were kept.
    pub fn finish(mut self) -> Sample {
        self.sample.without_rests();
        self.sample
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_log_is_thinned_evenly_and_rows_in_which_nothing_moves_are_left_out() {
        let mut thinner = Thinner::new(1);
        for k in 0..30_000 {
            let x = f64::from(k);
            let v = if k < 100 { 0.0 } else { 1.0 };
            thinner.add(k as usize / 10_000, 0.5 * x, &[x, v, x, x, x]);
        }
        let sample = thinner.finish();
        assert!((LIMITS.rows / 2..=LIMITS.rows).contains(&sample.len()));
        let step = |k: usize| sample.row(k + 1).q[0] - sample.row(k).q[0];
        assert!((0..sample.len() - 1).all(|k| step(k) == step(0)));
        assert!(sample.row(0).q[0] >= 100.0 && sample.logs().len() == 3);
        let first = sample.row(0);
        assert_eq!(first.sum[0], 0.25 * first.q[0] * first.q[0]);
    }
}
