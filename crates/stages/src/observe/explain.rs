//! What explains external torques: a body on the last link, or a change of a joint's friction.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Serialize;

use super::ExternalTorques;
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::friction::sign;

/// Share of the external torque's power that an explanation takes away, at least.
const LEAST_SHARE: f64 = 0.5;
/// Rows that a number takes, at least.
const MIN_ROWS_PER_NUMBER: f64 = 10.0;

/// A number of an explanation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ExplainedNumber {
    pub name: String,
    pub value: f64,
    pub std: f64,
    pub unit: String,
}

/// A change of the robot that explains external torques.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Explanation")]
pub struct TorqueExplanation {
    /// "payload" or "friction".
    pub kind: &'static str,
    /// The joint whose friction changed; none for a payload.
    pub joint: Option<String>,
    /// Share of the external torques' power that it takes away, deviations as units.
    pub share: f64,
    pub changes: Vec<ExplainedNumber>,
}

/// Sums over the samples of alarms: a payload's columns and each joint's friction.
pub struct TorqueExplainer {
    robot: Robot,
    payload: NormalSums,
    friction: Vec<NormalSums>,
    /// Squares of each joint's external torques over their deviations.
    power: Vec<f64>,
    rows: f64,
    every_s: f64,
    next: f64,
}

/// Normal equations: products of the columns with one another and with the right side.
#[derive(Clone)]
struct NormalSums {
    normal: DMatrix<f64>,
    right: DVector<f64>,
}

impl NormalSums {
    fn new(size: usize) -> Self {
        Self {
            normal: DMatrix::zeros(size, size),
            right: DVector::zeros(size),
        }
    }

    fn add(&mut self, columns: &[f64], y: f64) {
        for (i, x) in columns.iter().enumerate() {
            self.right[i] += x * y;
            for (k, z) in columns.iter().enumerate() {
                self.normal[(i, k)] += x * z;
            }
        }
    }

    /// Numbers, covariance for rows of deviation 1, power that they take away; 0 in directions that no row determines.
    fn solve(&self) -> (DVector<f64>, DMatrix<f64>, f64) {
        let u = self.right.len();
        let scale = DVector::from_fn(u, |i, _| {
            let d = self.normal[(i, i)];
            if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 }
        });
        let scaled = DMatrix::from_fn(u, u, |i, k| self.normal[(i, k)] * scale[i] * scale[k]);
        let inverse = scaled.pseudo_inverse(1e-8);
        let inverse = inverse.unwrap_or_else(|_| DMatrix::zeros(u, u));
        let inverse = DMatrix::from_fn(u, u, |i, k| inverse[(i, k)] * scale[i] * scale[k]);
        let x = &inverse * &self.right;
        let power = x.dot(&self.right);
        (x, inverse, power)
    }
}

impl TorqueExplainer {
    /// Nothing yet; rows are taken two a period of the cut-off, as nearer ones say the same.
    pub fn new(robot: Robot, cutoff_hz: f64) -> Self {
        let n = robot.joints();
        Self {
            robot,
            payload: NormalSums::new(4),
            friction: vec![NormalSums::new(2); n],
            power: vec![0.0; n],
            rows: 0.0,
            every_s: 0.5 / cutoff_hz,
            next: f64::NEG_INFINITY,
        }
    }

    /// Takes a sample of an alarm.
    pub fn take(&mut self, o: &ExternalTorques, std: &[f64]) {
        if o.t < self.next {
            return;
        }
        self.next = o.t + self.every_s;
        self.rows += 1.0;
        for (j, std) in std.iter().enumerate() {
            let y = o.external[j] / std;
            self.power[j] += y * y;
            let body = self.robot.level_tool_row(j, o.q, o.v, o.a);
            self.payload.add(&[0, 1, 2, 3].map(|i| body[i] / std), y);
            self.friction[j].add(&[sign(o.v[j]) / std, o.v[j] / std], y);
        }
    }

    /// The explanation that takes away most, where one takes away enough.
    pub fn explanation(&self) -> Option<TorqueExplanation> {
        let all: f64 = self.power.iter().sum();
        if all <= 0.0 || self.rows < MIN_ROWS_PER_NUMBER {
            return None;
        }
        let n = self.friction.len() as f64;
        let names = self.robot.joint_names();
        let mut best: Option<(f64, TorqueExplanation)> = None;
        let mut propose = |sums: &NormalSums, kind, joint: Option<usize>| {
            let (x, covariance, power) = sums.solve();
            let left = (all - power).max(0.0);
            // what is left counts as noise where it is more than that
            let rows = n * self.rows;
            let noise = (left / rows).max(1.0);
            let criterion = rows * (left / rows).max(1e-12).ln() + x.len() as f64 * rows.ln();
            let share = power / all;
            if share < LEAST_SHARE || best.as_ref().is_some_and(|(b, _)| *b <= criterion) {
                return;
            }
            let mut changes = Vec::new();
            // a value, and its slope by the numbers of the explanation
            let mut add = |name: &str, value: f64, slope: &[f64], unit: &str| {
                let g = DVector::from_column_slice(slope);
                let variance = noise * (g.transpose() * &covariance * &g)[0];
                changes.push(ExplainedNumber {
                    name: name.to_owned(),
                    value,
                    std: variance.max(0.0).sqrt(),
                    unit: unit.to_owned(),
                });
            };
            if let Some(j) = joint {
                let unit = self.robot.joint_unit(j);
                let position = self.robot.joint_kind(j).position_unit();
                add("coulomb", x[0], &[1.0, 0.0], unit);
                add(
                    "viscous",
                    x[1],
                    &[0.0, 1.0],
                    &format!("{unit} s/{position}"),
                );
            } else {
                add("mass", x[0], &[1.0, 0.0, 0.0, 0.0], "kg");
                let axes = ["x", "y", "z"].into_iter().enumerate();
                for (i, axis) in axes.filter(|_| self.robot.knows_links() && x[0] != 0.0) {
                    let mut slope = [-x[i + 1] / (x[0] * x[0]), 0.0, 0.0, 0.0];
                    slope[i + 1] = 1.0 / x[0];
                    add(&format!("centre_{axis}"), x[i + 1] / x[0], &slope, "m");
                }
            }
            let joint = joint.map(|j| names[j].clone());
            let found = TorqueExplanation {
                kind,
                joint,
                share,
                changes,
            };
            best = Some((criterion, found));
        };
        propose(&self.payload, "payload", None);
        for (j, sums) in self.friction.iter().enumerate() {
            propose(sums, "friction", Some(j));
        }
        best.map(|(_, found)| found)
    }
}
