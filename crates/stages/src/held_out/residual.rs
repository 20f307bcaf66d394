//! What a fit leaves of each joint's torque.

use schemars::JsonSchema;
use serde::Serialize;

use super::validate::ErrorsOfLogs;
use crate::input::robot_setup::RobotSetup;
use cft_ident_core::validate::JointError;

/// A joint's residual relative to its torque, a fraction.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RelativeError {
    pub joint: String,
    pub relative_error: f64,
}

impl RelativeError {
    /// The errors of a robot's joints.
    pub(crate) fn each(setup: &RobotSetup, errors: &[f64]) -> Vec<Self> {
        let joints = setup.robot.joint_names().iter().zip(errors);
        let of = |(joint, relative_error): (&String, &f64)| RelativeError {
            joint: joint.clone(),
            relative_error: *relative_error,
        };
        joints.map(of).collect()
    }
}

/// A joint's residual.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointResidual {
    pub joint: String,
    /// Unit of its torque.
    pub unit: &'static str,
    /// Root mean square \[unit\].
    pub rmse: f64,
    /// The same over that of the torque, a fraction.
    pub relative_error: f64,
    /// The same of the rows in which the joint moves.
    pub relative_error_moving: Option<f64>,
    /// Root mean square of the rows in which the joint moves \[unit\].
    pub rmse_moving: Option<f64>,
    /// The same of the rows in which it rests; null where it never does.
    pub relative_error_rest: Option<f64>,
}

/// What a fit leaves of one of its logs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ErrorOfLog {
    pub log: String,
    /// Residual relative to the torque, of the joints that move in it and the rows in which they do.
    pub joints: Vec<RelativeError>,
}

impl ErrorOfLog {
    /// Of the errors on one log.
    pub(crate) fn of(found: ErrorsOfLogs) -> Self {
        let moving = found.errors.joints.into_iter().filter_map(|joint| {
            Some(RelativeError {
                relative_error: joint.relative_error_moving?,
                joint: joint.joint,
            })
        });
        ErrorOfLog {
            log: found.logs.join(", "),
            joints: moving.collect(),
        }
    }
}

impl JointResidual {
    /// Of the errors of a validation.
    pub(crate) fn of(error: JointError) -> Self {
        JointResidual {
            joint: error.joint,
            unit: error.unit,
            rmse: error.rmse,
            relative_error: error.relative_error,
            relative_error_moving: error.relative_error_moving,
            rmse_moving: error.rmse_moving,
            relative_error_rest: error.relative_error_rest,
        }
    }

    /// The error that is spoken of: of the rows in which the joint moves, where it does.
    pub fn headline(&self) -> f64 {
        self.relative_error_moving.unwrap_or(self.relative_error)
    }

    /// Whether it moves at all.
    pub fn moves(&self) -> bool {
        self.relative_error_moving.is_some() || self.relative_error_rest.is_none()
    }
}
