//! What a sensor, its mounting and its cable do beside the weight of the tool.

use cft_ident_core::robot::tree::space::{Vector, cross, product, times};

use super::GRAVITY;
use super::equations::{AXES, LinearisedAt, RowEquations};
use super::wrench_log::{PoseRow, turned_back};

/// An effect that a wrench may show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WrenchEffect {
    /// The bias follows a polynomial of time, or of the order of rows.
    BiasDrift {
        /// Its degree.
        degree: usize,
    },
    /// The bias is another one from a row on: the sensor was tared, or struck.
    Taring {
        /// The first row of the new bias.
        row: usize,
    },
    /// Gravity is not along the base's -z.
    LeaningBase,
    /// The sensor stands turned against the frame whose orientation is logged.
    TurnedSensor,
    /// Channels of the force have gains of their own and show parts of each other.
    Gains,
    /// A force that follows the place of the sensor, as of a cable or a hose.
    Cable,
}

/// Legendre polynomials of degree 1 to `out.len()` at s.
fn legendre(s: f64, out: &mut [f64]) {
    let (mut before, mut now) = (1.0, s);
    for (n, x) in out.iter_mut().enumerate() {
        *x = now;
        let n = (n + 1) as f64;
        (before, now) = (now, ((2.0 * n + 1.0) * s * now - n * before) / (n + 1.0));
    }
}

/// Highest degree of a drift that is tried.
pub(super) const DEGREES: usize = 5;

impl WrenchEffect {
    /// Name in documents.
    pub fn name(&self) -> &'static str {
        match self {
            Self::BiasDrift { .. } => "bias-drift",
            Self::Taring { .. } => "taring",
            Self::LeaningBase => "leaning-base",
            Self::TurnedSensor => "turned-sensor",
            Self::Gains => "gains",
            Self::Cable => "cable-force",
        }
    }

    /// How many numbers it has.
    pub fn numbers(&self) -> usize {
        match self {
            Self::BiasDrift { degree } => 6 * degree,
            Self::Taring { .. } => 6,
            Self::LeaningBase => 2,
            Self::TurnedSensor | Self::Cable => 3,
            Self::Gains => 5,
        }
    }

    /// Those of its numbers that are forces, or turn the force: what it is judged by.
    pub(super) fn judged(&self) -> Vec<usize> {
        let forces = |k: &usize| k % 6 < 3;
        match self {
            Self::BiasDrift { .. } | Self::Taring { .. } => {
                (0..self.numbers()).filter(forces).collect()
            }
            _ => (0..self.numbers()).collect(),
        }
    }

    /// Whether it is a function of time: it says nothing of a time that was not measured.
    pub fn is_of_time(&self) -> bool {
        matches!(self, Self::BiasDrift { .. } | Self::Taring { .. })
    }

    /// Names and units of its numbers.
    pub(super) fn keys(&self) -> Vec<(String, &'static str)> {
        let six = ["fx", "fy", "fz", "tx", "ty", "tz"];
        let unit = |k: usize| if k % 6 < 3 { "N" } else { "Nm" };
        match self {
            Self::BiasDrift { degree } => (0..6 * degree)
                .map(|k| (format!("{}_{}", six[k % 6], k / 6 + 1), unit(k)))
                .collect(),
            Self::Taring { .. } => (0..6).map(|k| (six[k].to_owned(), unit(k))).collect(),
            Self::LeaningBase => ["x", "y"].map(|k| (k.to_owned(), "rad")).to_vec(),
            Self::TurnedSensor => ["x", "y", "z"].map(|k| (k.to_owned(), "rad")).to_vec(),
            Self::Gains => ["xx", "yy", "xy", "xz", "yz"]
                .map(|k| (k.to_owned(), "1"))
                .to_vec(),
            Self::Cable => ["x", "y", "z"].map(|k| (k.to_owned(), "N/m")).to_vec(),
        }
    }

    /// Writes its columns from `column` on; s is -1 at the first row and 1 at the last.
    pub(super) fn columns(
        &self,
        row: &PoseRow,
        s: f64,
        at: &LinearisedAt,
        u: &Vector,
        column: usize,
        out: &mut RowEquations,
    ) {
        let (m, h) = (at.mass, &at.first_moment);
        let mut constant = |column: usize, x: f64| {
            for k in 0..6 {
                out.set(k, column + k, x);
            }
        };
        match self {
            Self::BiasDrift { degree } => {
                let mut powers = [0.0; DEGREES];
                legendre(s, &mut powers[..*degree]);
                for (d, x) in powers[..*degree].iter().enumerate() {
                    constant(column + 6 * d, *x);
                }
            }
            Self::Taring { row: first } => {
                constant(column, f64::from(u8::from(row.number >= *first)));
            }
            Self::LeaningBase => {
                let axes = product(&row.rotation, &at.turn);
                for (k, axis) in AXES.iter().take(2).enumerate() {
                    let du = turned_back(&axes, &times(GRAVITY, axis));
                    out.wrench(column + k, &times(m, &du), &cross(h, &du));
                }
            }
            Self::TurnedSensor => {
                for (k, axis) in AXES.iter().enumerate() {
                    let du = cross(u, axis);
                    out.wrench(column + k, &times(m, &du), &cross(h, &du));
                }
            }
            Self::Gains => {
                let f = times(m, u);
                let forces = [
                    [f[0], 0.0, -f[2]],
                    [0.0, f[1], -f[2]],
                    [f[1], f[0], 0.0],
                    [f[2], 0.0, f[0]],
                    [0.0, f[2], f[1]],
                ];
                for (k, force) in forces.iter().enumerate() {
                    out.wrench(column + k, force, &[0.0; 3]);
                }
            }
            Self::Cable => {
                let axes = product(&row.rotation, &at.turn);
                let away = row.away.unwrap_or_default();
                for (k, axis) in AXES.iter().enumerate() {
                    let force = turned_back(&axes, &times(away[k], axis));
                    out.wrench(column + k, &force, &[0.0; 3]);
                }
            }
        }
    }
}
