//! Whether a log can be of the robot of a model: where its joints stand, and how large its torques are.

use super::dataset::Dataset;
use super::error::IdentifyError;
use super::log_data::LogData;
use super::robot_setup::RobotSetup;
use cft_ident_core::number;
use cft_ident_core::robot::JointKind;
use cft_ident_core::validate::{ReconstructedRow, TorqueErrors};
use cft_ident_logs::log::Instant;
use std::f64::consts::TAU;

/// Share of its travel by which a joint of the same robot may stand beyond its limits: stops give way, zeros drift.
const BEYOND_LIMITS_SHARE: f64 = 0.1;
/// Share of the rows beyond from which on it is no spike.
const ROWS_BEYOND_SHARE: f64 = 0.01;

/// Where joints stand along logs, beside where they can.
pub(crate) struct JointRanges {
    /// Limits of each joint that has some, widened.
    limits: Vec<Option<[f64; 2]>>,
    /// Joints that turn: a whole turn more is the same place.
    turning: Vec<bool>,
    seen: Vec<[f64; 2]>,
    beyond: Vec<u64>,
    rows: u64,
}

impl JointRanges {
    pub(crate) fn new(setup: &RobotSetup) -> Self {
        let limits = setup.robot.joint_names().iter().map(|joint| {
            let [low, high] = setup.file.limits.get(joint)?.position?;
            let room = BEYOND_LIMITS_SHARE * (high - low);
            Some([low - room, high + room])
        });
        let limits: Vec<Option<[f64; 2]>> = limits.collect();
        let turns = |j: usize| setup.robot.joint_kind(j) == JointKind::Revolute;
        Self {
            turning: (0..limits.len()).map(turns).collect(),
            seen: vec![[f64::INFINITY, f64::NEG_INFINITY]; limits.len()],
            beyond: vec![0; limits.len()],
            rows: 0,
            limits,
        }
    }

    pub(crate) fn take(&mut self, q: &[f64]) {
        self.rows += 1;
        for (j, q) in q.iter().enumerate() {
            let Some([low, high]) = self.limits[j] else {
                continue;
            };
            let seen = &mut self.seen[j];
            *seen = [seen[0].min(*q), seen[1].max(*q)];
            let turns = match self.turning[j] {
                true => ((q - 0.5 * (low + high)) / TAU).round(),
                false => 0.0,
            };
            let q = q - turns * TAU;
            self.beyond[j] += u64::from(q < low || q > high);
        }
    }

    /// The refusal of positions where a joint of this robot cannot stand.
    pub(crate) fn refused(&self, setup: &RobotSetup) -> Option<IdentifyError> {
        let far = |j: &usize| self.beyond[*j] as f64 > ROWS_BEYOND_SHARE * self.rows as f64;
        let j = (0..self.limits.len()).find(far)?;
        let joint = setup.robot.joint_names().get(j)?;
        let shown = |range: [f64; 2]| range.map(|x| number::significant(x, 4)).join("..");
        Some(IdentifyError::OtherRobotLog {
            joint: joint.clone(),
            positions: shown(self.seen[j]),
            limits: shown(setup.file.limits.get(joint)?.position?),
            unit: setup.robot.joint_kind(j).position_unit(),
        })
    }
}

/// A torque of so many times the largest that was measured is of a model that does not hold.
const IMPOSSIBLE_TORQUE_RATIO: f64 = 10.0;

/// The largest torques of every joint, measured and reconstructed, and when.
pub(crate) struct TorquePeaks {
    measured: Vec<f64>,
    reconstructed: Vec<(f64, f64)>,
}

impl TorquePeaks {
    pub(crate) fn new(joints: usize) -> Self {
        TorquePeaks {
            measured: vec![0.0; joints],
            reconstructed: vec![(0.0, 0.0); joints],
        }
    }

    pub(crate) fn take(&mut self, row: &ReconstructedRow, origin: Instant) {
        for (most, x) in self.measured.iter_mut().zip(row.measured) {
            *most = most.max(x.abs());
        }
        for (most, x) in self.reconstructed.iter_mut().zip(row.reconstructed) {
            if x.abs() > most.0 {
                *most = (x.abs(), origin.seconds() + row.t);
            }
        }
    }

    /// The joint whose torque the model makes impossibly large: by its rms too, for single rows may be noise.
    pub(crate) fn impossible(
        &self,
        errors: &TorqueErrors,
        data: &Dataset,
    ) -> Option<IdentifyError> {
        let pairs = self.measured.iter().zip(&self.reconstructed).enumerate();
        let rms = |j: usize| errors.joints.get(j).map_or(0.0, |e| e.rmse);
        let mut off = pairs.filter(|(j, (m, r))| {
            **m > 0.0 && r.0 > IMPOSSIBLE_TORQUE_RATIO * **m && rms(*j) > **m
        });
        let (j, (measured, (torque, t))) = off.next()?;
        let names: Vec<String> = data.logs.iter().map(LogData::name).collect();
        Some(IdentifyError::Impossible {
            joint: data.setup.robot.joint_names()[j].clone(),
            log: names.join(", "),
            t: *t,
            torque: *torque,
            measured: *measured,
            unit: data.setup.file.torque_unit(j),
        })
    }
}
