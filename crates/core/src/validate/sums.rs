//! Sums of errors of one joint, row after row and log after log.

use crate::math::relative_error;

/// Sums of one joint.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ErrorSums {
    pub error: f64,
    pub torque: f64,
    pub mean: f64,
    pub scatter: f64,
    pub largest: f64,
    pub rows: u64,
    pub raw_error: f64,
    pub raw_torque: f64,
    /// Raw samples, those inside the band, and the sum of its half widths.
    pub raw_rows: u64,
    pub inside: u64,
    pub widths: f64,
    /// Squared error and torque of the rows in which the joint moves, as a fit weighs them.
    pub moving: [f64; 2],
    /// Squared error and torque of the rows in which the joint rests, and their number.
    pub rest: [f64; 2],
    pub resting: u64,
}

impl ErrorSums {
    /// A row, `weighted` as a fit has it: measured and reconstructed.
    pub fn add(&mut self, [measured, reconstructed]: [f64; 2], weighted: [f64; 2], rests: bool) {
        let e = measured - reconstructed;
        if rests {
            self.rest[0] += e * e;
            self.rest[1] += measured * measured;
            self.resting += 1;
        } else {
            self.moving[0] += (weighted[0] - weighted[1]).powi(2);
            self.moving[1] += weighted[0].powi(2);
        }
        self.error += e * e;
        self.torque += measured * measured;
        self.largest = self.largest.max(e.abs());
        self.rows += 1;
        // Welford 1962: the scatter about the running mean
        let d = measured - self.mean;
        self.mean += d / self.rows as f64;
        self.scatter += d * (measured - self.mean);
    }

    /// Adds the rows of another log.
    pub fn merge(&mut self, other: &Self) {
        // Chan, Golub and LeVeque 1983: the scatter about the mean of both
        let rows = (self.rows + other.rows).max(1) as f64;
        let apart = other.mean - self.mean;
        self.scatter += other.scatter + apart * apart * self.rows as f64 * other.rows as f64 / rows;
        self.mean += apart * other.rows as f64 / rows;
        self.error += other.error;
        self.torque += other.torque;
        self.largest = self.largest.max(other.largest);
        self.rows += other.rows;
        self.raw_error += other.raw_error;
        self.raw_torque += other.raw_torque;
        self.raw_rows += other.raw_rows;
        self.inside += other.inside;
        self.widths += other.widths;
        self.moving[0] += other.moving[0];
        self.moving[1] += other.moving[1];
        self.rest[0] += other.rest[0];
        self.rest[1] += other.rest[1];
        self.resting += other.resting;
    }

    pub fn add_raw(&mut self, measured: f64, reconstructed: f64, half_width: f64) {
        let e = measured - reconstructed;
        self.raw_rows += 1;
        self.inside += u64::from(e.abs() <= half_width);
        self.widths += half_width;
        self.raw_error += e * e;
        self.raw_torque += measured * measured;
    }
}

/// The relative error from the squares of error and torque, where there are rows.
pub(super) fn ratio([error, torque]: [f64; 2], rows: u64) -> Option<f64> {
    (rows > 0).then(|| relative_error(error, torque))
}
