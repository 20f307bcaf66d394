//! What is known before a design: logs that exist, and motions that will be run beside it.

use nalgebra::DMatrix;

use cft_ident_core::inertia::accumulate::BlockFactors;

use super::information::InformationFactors;
use super::machine::ForeseenRobot;

/// F'F of every joint's rows, as many as a log holds.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenInformation {
    /// p x p per joint.
    joints: Vec<DMatrix<f64>>,
    /// What a model knows, p x p, in rows of unit noise.
    known: DMatrix<f64>,
}

impl GivenInformation {
    /// Nothing.
    pub fn nothing(machine: &ForeseenRobot) -> Self {
        let p = machine.unknowns();
        Self {
            joints: vec![DMatrix::zeros(p, p); machine.coordinates()],
            known: DMatrix::zeros(p, p),
        }
    }

    /// Adds what a model knows: the inverse of its covariance.
    pub fn add_known(&mut self, information: &DMatrix<f64>) {
        self.known += information;
    }

    /// Adds a log's sums, whose filtered and decimated rows stand for `samples` of the log.
    pub fn add_log(&mut self, sums: &BlockFactors, samples: f64) {
        let columns = &sums.columns;
        let weight = samples / (sums.rows as f64).max(1.0);
        for (j, g) in self.joints.iter_mut().enumerate() {
            let r = sums.joint(j);
            let own = columns.shared + columns.own[j].len();
            for a in 0..own {
                for b in 0..own {
                    let dot = r.column(a).dot(&r.column(b));
                    g[(columns.unknown(j, a), columns.unknown(j, b))] += weight * dot;
                }
            }
        }
    }

    /// Adds a motion of which `rows` rows per joint are logged.
    pub fn add_motion(&mut self, information: &InformationFactors, rows: f64) {
        let weight = rows / information.rows as f64;
        for (g, r) in self.joints.iter_mut().zip(&information.joints) {
            *g += r.tr_mul(r) * weight;
        }
    }

    /// Sum over the joints, each joint's rows times its weight, and what a model knows.
    pub fn weighted(&self, weights: &[f64]) -> DMatrix<f64> {
        let mut sum = self.known.clone();
        for (g, weight) in self.joints.iter().zip(weights) {
            sum += g * (weight * weight);
        }
        sum
    }
}
