//! What the error of a model means where it is used: the smallest force that shows, the lag that it leaves.

use schemars::JsonSchema;
use serde::Serialize;

use super::robot_setup::RobotSetup;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::model::Model;
use cft_ident_core::robot::tree::pose::{driven, frames};
use cft_ident_core::robot::tree::space::{Vector, add, cross, turn};
use cft_ident_files::config::held_out::HeldOut;
use cft_ident_files::config::{ModelFile, RobotFile};

/// Bandwidth of the position loop that a lag is reported for \[Hz\]: that of a usual industrial arm.
pub const BANDWIDTH_HZ: f64 = 5.0;
/// False alarms an hour for which a smallest force is said where no other rate is asked for.
pub const FALSE_ALARMS_PER_HOUR: f64 = 1.0;
/// Lever below which a torque is reported as it is \[m\].
const MIN_LEVER_M: f64 = 0.05;

/// What the error of one joint means in use.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointInUse {
    pub joint: String,
    /// "N" or "Nm".
    pub unit: String,
    /// Greatest torque along the logs of the fit \[unit\].
    pub torque_seen: f64,
    /// Half the width of its 95 % band, the greatest over speeds and torques seen \[unit\].
    pub half_width_95: f64,
    /// Lever of the point below about the joint in the middle of the positions seen \[m\]; null for a joint that
    /// slides, and where it is too short to speak of.
    pub lever_m: Option<f64>,
    /// Smallest force at that point of which `watch` gives an alarm, at one false alarm an hour \[N\]; null where there
    /// is no lever, or no threshold was learnt.
    pub hidden_force_n: Option<f64>,
    /// What a feed-forward by this model leaves to a position loop of 5 Hz \[m or rad\]; null where the inertia is
    /// not known.
    pub lag: Option<f64>,
    /// "m" or "rad".
    pub position_unit: String,
    /// Least and greatest position along the logs of the fit \[m or rad\].
    pub positions_seen: [f64; 2],
    /// Greatest speed \[m/s or rad/s\].
    pub speed_seen: f64,
}

/// What a joint must feel before an alarm is given.
pub(crate) struct AlarmTorque {
    /// Least and greatest torque over the ranges of speed, the parameters' own deviation aside \[N or Nm\].
    pub ends: [f64; 2],
    /// Force that the least stands for \[N\]; none where the joint has no lever.
    pub force_n: Option<f64>,
}

impl AlarmTorque {
    /// `threshold` is that of the external torque over its 99 % deviation, `lever` that of the joint \[m\].
    pub fn of(held: &HeldOut, threshold: f64, kind: JointKind, lever: Option<f64>) -> Self {
        let sizes = held.external_std.iter();
        let sizes = sizes.map(|std| threshold * std * held.external_99);
        let least = sizes.clone().fold(f64::INFINITY, f64::min);
        Self {
            ends: [least, sizes.fold(0.0, f64::max)],
            force_n: match kind {
                JointKind::Prismatic => Some(least),
                JointKind::Revolute => lever.map(|lever| least / lever),
            },
        }
    }
}

/// The point that forces are reported at and its name: the first frame of the file, or the end of the last link.
fn tool(file: &RobotFile, setup: &RobotSetup, q: &[f64]) -> (Vector, String) {
    let tree = setup.robot.tree();
    let frames = frames(tree, q);
    let links = tree.links();
    let named = file.robot.frame.first().and_then(|frame| {
        let link = links.iter().position(|link| link.name == frame.link)?;
        let (rotation, origin) = frames[link];
        Some((
            add(&origin, &turn(&rotation, &frame.xyz)),
            frame.name.clone(),
        ))
    });
    named.unwrap_or_else(|| {
        let last = frames.last().map_or([0.0; 3], |(_, origin)| *origin);
        let name = links.last().map_or("base", |link| link.name.as_str());
        (last, format!("origin of {name}"))
    })
}

/// Levers of the tool about each joint at a pose \[m\], none for a joint that slides or whose lever is short; and
/// what the point is called.
pub fn levers(setup: &RobotSetup, q: &[f64]) -> (Vec<Option<f64>>, String) {
    let robot = &setup.robot;
    let tree = robot.tree();
    let (point, name) = tool(&setup.file, setup, q);
    let frames = frames(tree, q);
    let links = driven(tree).into_iter().enumerate();
    let lever = |(j, link): (usize, usize)| {
        if robot.joint_kind(j) == JointKind::Prismatic {
            return None;
        }
        let (rotation, origin) = frames.get(link)?;
        let axis = turn(rotation, &tree.links()[link].axis);
        let away: Vector = std::array::from_fn(|i| point[i] - origin[i]);
        let lever = cross(&axis, &away)
            .iter()
            .map(|x| x * x)
            .sum::<f64>()
            .sqrt();
        (lever >= MIN_LEVER_M).then_some(lever)
    };
    (links.map(lever).collect(), name)
}

/// The middle of the positions that a model was fitted in.
pub(crate) fn middle(file: &ModelFile) -> Vec<f64> {
    let seen = file.held_out.iter().map(|held| held.positions_seen);
    seen.map(|[low, high]| 0.5 * (low + high)).collect()
}

/// What the errors of a model mean in use, and the point that forces are reported at; nothing where the file does not hold
/// what it left of data set aside.
pub fn in_use(
    setup: &RobotSetup,
    file: &ModelFile,
    model: &Model,
) -> Option<(Vec<JointInUse>, String)> {
    let n = setup.robot.joints();
    if file.held_out.len() != n {
        return None;
    }
    let q = middle(file);
    let (levers, point) = levers(setup, &q);
    let still = vec![0.0; n];
    let (mut weight, mut tau) = (vec![0.0; n], vec![0.0; n]);
    model
        .robot
        .torque(&model.theta, &q, &still, &still, &mut weight);
    let mut inertia = |j: usize| {
        let mut a = still.clone();
        a[j] = 1.0;
        model.robot.torque(&model.theta, &q, &still, &a, &mut tau);
        tau[j] - weight[j]
    };
    let stiffness = (std::f64::consts::TAU * BANDWIDTH_HZ).powi(2);
    let learnt = file.excesses.as_ref();
    let threshold = learnt.map(|learnt| learnt.threshold(FALSE_ALARMS_PER_HOUR));
    let joints = file.held_out.iter().enumerate().map(|(j, held)| {
        let widths = held.half_width_95.iter().flatten();
        let half = widths.fold(0.0, |most: f64, x| most.max(*x));
        let kind = setup.robot.joint_kind(j);
        let inertia = inertia(j);
        JointInUse {
            joint: held.joint.clone(),
            unit: setup.file.torque_unit(j).to_owned(),
            torque_seen: held.torque_seen,
            half_width_95: half,
            lever_m: levers[j],
            hidden_force_n: threshold
                .and_then(|threshold| AlarmTorque::of(held, threshold, kind, levers[j]).force_n),
            lag: (inertia > 0.0).then(|| half / (inertia * stiffness)),
            position_unit: kind.position_unit().to_owned(),
            positions_seen: held.positions_seen,
            speed_seen: held.speed_seen,
        }
    });
    Some((joints.collect(), point))
}
