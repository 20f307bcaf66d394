//! Gravity's parameters, friction at rest and ratios of gains by least squares over held poses.

use nalgebra::DVector;
use schemars::JsonSchema;
use serde::Serialize;

use super::HELD;
use super::check::HoldCheck;
use super::error::HeldError;
use super::holds::HeldLog;
use super::problem::{HeldProblem, blocks, of_joint, rms};
use cft_ident_core::judge::{jackknife, width_95};
use cft_ident_core::number;
use cft_ident_core::verdict::{TorqueOff, Verdict, verdict_of};
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::escape;

/// A number of gravity with its 95 % interval.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct GravityNumber {
    pub name: String,
    /// Null where these poses do not determine it, or where it is one with the number before it.
    pub value: Option<f64>,
    pub std: Option<f64>,
    pub interval_95: Option<[f64; 2]>,
    pub unit: String,
    pub verdict: Verdict,
    pub meaning: String,
}

/// What is known of a joint at rest.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointAtRest {
    pub joint: String,
    /// Unit of its torque.
    pub unit: String,
    /// Friction at rest: half the difference of both sides. Null where poses were reached from one side alone.
    pub stiction: GravityNumber,
    /// Null where none is fitted.
    pub offset: Option<GravityNumber>,
    /// Gain of its channel over that of the first joint; null where torques are torques, or joints share nothing.
    pub gain: Option<GravityNumber>,
    /// Poses that were reached from below and from above.
    pub from_below: usize,
    pub from_above: usize,
    /// Root mean square of the torque, and of what is left: fitted, and of blocks left out.
    pub torque: f64,
    pub left: f64,
    pub left_held_out: f64,
}

/// A pose in which something else acts on the arm.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TouchedPose {
    /// Its number among the held poses of all logs, from 1.
    pub pose: usize,
    /// When it began \[s\].
    pub t: f64,
    pub off: Vec<TorqueOff>,
}

/// Gravity of an arm.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct GravityFit {
    pub poses: usize,
    pub rows_are_poses: bool,
    pub parameters: Vec<GravityNumber>,
    pub joints: Vec<JointAtRest>,
    /// Poses with the torque that is expected there.
    pub checks: Vec<HoldCheck>,
    pub blocks: usize,
    /// Poses that are set aside: their torques are far from what all others say.
    pub touched: Vec<TouchedPose>,
    /// The parameters with these; none where there are none, and where gravity does not explain the torques then.
    pub with_touched: Vec<GravityNumber>,
    /// Values of all parameters of the robot, 0 where gravity does not ask for them, and which were determined.
    #[serde(skip)]
    pub theta: Vec<f64>,
    #[serde(skip)]
    pub kept: Vec<usize>,
    /// Covariance of the parameters.
    #[serde(skip)]
    pub covariance: Vec<Vec<f64>>,
}

/// Fits gravity to held poses, without those that tell another story than all others.
///
/// # Errors
/// Gravity that moves no joint, poses that do not determine it, and torques that it does not explain.
pub fn fit_gravity(log: &HeldLog, file: &RobotFile, name: &str) -> Result<GravityFit, HeldError> {
    let mut problem = HeldProblem::of(log, file, name)?;
    problem.weigh_joints(&torques(&problem, file));
    let Some(kept) = problem.kept_poses() else {
        return fit_to_all(log, file, name);
    };
    let poses = log.poses.iter().zip(&kept);
    let others = HeldLog {
        poses: poses
            .filter(|(_, kept)| **kept)
            .map(|(pose, _)| pose.clone())
            .collect(),
        ..log.clone()
    };
    let x = problem.solved(&|pose| kept[pose], &problem.fitted());
    let names = file.joint_names();
    let touched = |k: usize| TouchedPose {
        pose: log.poses[k].number,
        t: log.poses[k].t,
        off: (problem.residual(&(k..k + 1), &x).into_iter())
            .map(|(j, off)| TorqueOff {
                joint: names[j].clone(),
                off,
                unit: file.torque_unit(j).to_owned(),
            })
            .collect(),
    };
    let with_touched = fit_to_all(log, file, name).ok();
    Ok(GravityFit {
        touched: (0..kept.len()).filter(|k| !kept[*k]).map(touched).collect(),
        with_touched: with_touched.map_or(Vec::new(), |of| of.parameters),
        ..fit_to_all(&others, file, name)?
    })
}

/// Root mean square torque of each joint.
fn torques(problem: &HeldProblem, file: &RobotFile) -> Vec<f64> {
    let of = |j: usize| {
        let own = problem.equations.iter().filter(|e| e.joint == j);
        rms(own.map(|e| e.tau))
    };
    (0..file.joint_names().len()).map(of).collect()
}

/// Fits gravity to all poses of a log.
fn fit_to_all(log: &HeldLog, file: &RobotFile, name: &str) -> Result<GravityFit, HeldError> {
    let robot = file.robot();
    let (n, p) = (robot.joints(), robot.parameters().len());
    let mut problem = HeldProblem::of(log, file, name)?;
    let torque = torques(&problem, file);
    let largest = torque.iter().copied().fold(0.0, f64::max);
    // each joint by its own noise
    problem.weigh_joints(&torque);
    let x = problem.fitted();
    let whole = 0..problem.poses;
    let parts = blocks(problem.poses);
    let left_out: Vec<DVector<f64>> = parts
        .iter()
        .map(|block| problem.solved(&|pose| !block.contains(&pose), &x))
        .collect();
    let v = jackknife(&x, &left_out);
    let left = problem.residual(&whole, &x);
    let held_out: Vec<(usize, f64)> = parts
        .iter()
        .zip(&left_out)
        .flat_map(|(block, x)| problem.residual(block, x))
        .collect();
    let width = width_95(parts.len());
    let number = |at: usize, name: &str, unit: &str, meaning: &str| {
        let (value, std) = (x[at], v[(at, at)].sqrt());
        GravityNumber {
            name: name.to_owned(),
            value: Some(value),
            std: Some(std),
            interval_95: Some([value - width * std, value + width * std]),
            unit: unit.to_owned(),
            verdict: verdict_of(value, std),
            meaning: meaning.to_owned(),
        }
    };
    let unit_of = |j: usize| file.torque_unit(j).to_owned();
    let common = file.inertial_torque_unit();
    let mut parameters = Vec::new();
    let mut theta = vec![0.0; p];
    for (k, at) in problem.unknowns.kept.iter().enumerate() {
        let info = &robot.parameters()[*at];
        theta[*at] = x[k];
        let unit = cft_ident_files::config::identified::inertia_unit(&robot, &info.unit, common);
        parameters.push(number(k, &info.name, &unit, &info.meaning));
    }
    let names = robot.joint_names();
    let u = &problem.unknowns;
    let open = |name: &str, unit: &str| GravityNumber {
        name: name.to_owned(),
        value: None,
        std: None,
        interval_95: None,
        unit: unit.to_owned(),
        verdict: Verdict::NotIdentifiable,
        meaning: "poses were reached from one side alone".to_owned(),
    };
    let joints: Vec<JointAtRest> = (0..n)
        .map(|j| {
            let unit = unit_of(j);
            let found = |at: Option<usize>, name: &str, unit: &str, meaning: &str| {
                at.map(|at| number(at, name, unit, meaning))
            };
            let gain = found(
                u.gain[j],
                "gain",
                "1",
                "gain of the channel over that of the first joint that gravity moves",
            );
            let (torque, left, left_held_out) =
                (torque[j], of_joint(&left, j), of_joint(&held_out, j));
            JointAtRest {
                joint: names[j].clone(),
                stiction: found(u.stiction[j], "stiction", &unit, "friction at rest")
                    .unwrap_or_else(|| open("stiction", &unit)),
                offset: found(u.offset[j], "offset", &unit, "constant torque"),
                gain,
                from_below: log.count_poses_from_side(j, 1.0),
                from_above: log.count_poses_from_side(j, -1.0),
                torque,
                left,
                left_held_out,
                unit,
            }
        })
        .collect();
    // a joint that is heavy beside the others and of which most is left
    let bad = joints
        .iter()
        .find(|j| j.torque > 0.3 * largest && j.left > HELD.explained * j.torque);
    if let Some(bad) = bad {
        return Err(HeldError::NotGravity {
            joint: escape(&bad.joint),
            left: number::percent(bad.left / bad.torque),
        });
    }
    let expected = |k: usize, j: usize| {
        let e = problem
            .equations
            .iter()
            .find(|e| e.pose == k && e.joint == j)?;
        let (row, model) = problem.row(e, &x);
        let mut held = row.clone();
        let friction = u.stiction[j].map(|at| {
            held[at] = 0.0;
            x[at].abs()
        });
        let own = u.stiction[j].map_or(0.0, |at| e.side * x[at]);
        let std = (held.dot(&(&v * &held))).max(0.0).sqrt();
        let noise = joints[j].left_held_out;
        Some([
            model - own,
            friction.unwrap_or(0.0) + width * std.hypot(noise),
        ])
    };
    let checks = super::check::checks(log, names, &|j| unit_of(j), &expected);
    Ok(GravityFit {
        poses: log.poses.len(),
        rows_are_poses: log.rows_are_poses,
        parameters,
        joints,
        checks,
        blocks: parts.len(),
        theta,
        covariance: (0..u.kept.len())
            .map(|i| (0..u.kept.len()).map(|j| v[(i, j)]).collect())
            .collect(),
        kept: u.kept.clone(),
        touched: Vec::new(),
        with_touched: Vec::new(),
    })
}
