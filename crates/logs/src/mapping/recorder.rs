//! What recorders are known to write, where the sizes of numbers would say something else.

use super::column::LogColumn;
use super::units::Unit;
use super::urdf_joint::UrdfJoint;
use crate::inspect::words::{has, words};
use crate::log::escape;

/// Robots that LeRobot calibrates itself: a joint is in degrees or in -100..100 of its calibrated range, a gripper in
/// 0..100.
const CALIBRATED: &str = "so koch lekiwi omx";
/// The largest number of a share of a range.
const WHOLE: f64 = 100.0;

/// LeRobot, with a robot whose range it calibrates.
pub(super) struct CalibratedRobot {
    robot_type: String,
}

impl CalibratedRobot {
    /// By the kind of robot that a dataset is of.
    pub(super) fn of(robot_type: &str) -> Option<Self> {
        has(&words(robot_type), CALIBRATED).then(|| Self {
            robot_type: robot_type.to_owned(),
        })
    }

    /// The units of positions.
    pub(super) fn positions(&self, columns: &[&LogColumn], joints: &[&UrdfJoint]) -> Vec<Unit> {
        let is_gripper = |joint: &UrdfJoint| has(&words(&joint.name), "gripper jaw");
        let arm = || {
            columns
                .iter()
                .zip(joints)
                .filter(|(_, joint)| !is_gripper(joint))
        };
        // no share of a range is beyond it
        let degrees = arm().any(|(column, _)| column.largest() > 1.01 * WHOLE);
        let first = arm().next().map(|(_, joint)| &joint.name);
        let each = columns.iter().zip(joints).map(|(column, joint)| {
            if is_gripper(joint) && column.largest() <= 1.01 * WHOLE {
                return gripper(joint);
            }
            let check = format!(
                "deg is taken, which LeRobot records of {} since 0.4.4; before, a position is -100..100 of its calibrated range: then position_scale = half that range [rad] / 100 in place of position_unit, of range_min and range_max (4096 a turn) in the calibration file of the robot",
                escape(&self.robot_type)
            );
            Unit {
                check: Some(check).filter(|_| !degrees && first == Some(&joint.name)),
                ..Unit::of("deg")
            }
        });
        each.collect()
    }
}

/// A gripper, 0..100 of its calibrated range.
fn gripper(joint: &UrdfJoint) -> Unit {
    let name = escape(&joint.name);
    let share = format!("{name} is 0..100 of its calibrated range, and no angle");
    match joint.position {
        Some([low, high]) => Unit {
            scale: Some((high - low) / WHOLE),
            offset: Some(low).filter(|low| *low != 0.0),
            check: Some(format!(
                "{share}: position_scale is the range of the URDF / 100, where that of the calibration file is not known"
            )),
            ..Unit::default()
        },
        None => Unit {
            check: Some(format!("{share}: give position_scale, its range / 100")),
            ..Unit::of("counts")
        },
    }
}
