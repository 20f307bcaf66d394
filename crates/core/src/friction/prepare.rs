//! From measured motion to the one-joint problem: the nuisance that a log can determine.
//!
//! Row `i` of the robot's regressor, evaluated along the measured and smoothed motion of all
//! joints, holds everything that acts on joint `i` beside friction: its own inertia and gravity,
//! the velocity terms that the report drops at (29), and the reaction of joints that do not stand
//! quite still. Its coefficients are unknown. Columns are scaled to the torque, and only the
//! directions that this motion excites are kept.

use std::ops::Range;

use nalgebra::DMatrix;

use super::problem::{FrictionProblem, JointRecord};
use crate::math::rank;
use crate::math::rfactor::RFactor;
use crate::robot::Robot;

/// Motion of all joints over one uninterrupted stretch, at full rate. Arrays are row-major,
/// samples x joints.
#[derive(Debug, Clone, Default)]
pub struct SmoothedMotion {
    pub t: Vec<f64>,
    /// Position as measured.
    pub measured: Vec<f64>,
    /// Position, velocity and acceleration by a wide zero-phase filter.
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub a: Vec<f64>,
    /// Torque as logged.
    pub tau: Vec<f64>,
}

/// Directions of a singular value below this share of the largest are not carried: they add that share to the torque.
const DIRECTION_TOLERANCE: f64 = 2e-3;

/// Samples of the longest record; a longer stretch is cut, for the filter runs over records in parallel.
const LONGEST_RECORD: usize = 40_000;

/// The problem of one joint with the map from its nuisance states back to the robot's parameters.
#[derive(Debug, Clone)]
pub struct PreparedProblem {
    pub problem: FrictionProblem,
    /// Robot parameters (and the offset, last) = `back` times the nuisance states.
    pub back: DMatrix<f64>,
    /// Smoothed velocity of the moving joint, samples of all records one after the other.
    pub velocity: Vec<f64>,
    /// Smoothed acceleration, likewise.
    pub acceleration: Vec<f64>,
}

/// How the position noise and the torque's timing enter.
pub struct SensorModel<'a> {
    /// Variance of the measured position of the moving joint at a pose of all joints.
    pub variance: &'a dyn Fn(&[f64]) -> f64,
    /// True where the torque logged at `t_k` acts until `t_k+1`; else it is a sample at `t_k`.
    pub zero_order_hold: bool,
}

/// Root mean square; zero for nothing.
pub(super) fn rms(x: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = x.fold((0.0, 0usize), |(sum, n), x| (sum + x * x, n + 1));
    if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
}

/// Builds the problem of `joint` from its logs' motions. `None` where the joint has no torque or
/// does not move at all.
pub fn prepare(
    robot: &Robot,
    joint: usize,
    motions: &[SmoothedMotion],
    sensors: &SensorModel,
) -> Option<PreparedProblem> {
    let n = robot.joints();
    let of_joint = |channel: fn(&SmoothedMotion) -> &Vec<f64>| {
        let all = motions.iter().map(channel);
        all.flat_map(move |x| x.iter().skip(joint).step_by(n).copied())
    };
    let torque_scale = rms(of_joint(|m| &m.tau));
    let velocity_scale = rms(of_joint(|m| &m.v));
    // as measured: smoothing leaves rounding errors in what stands still
    let mut measured = of_joint(|m| &m.measured);
    let first = measured.next();
    let moves = measured.any(|q| Some(q) != first);
    if !(moves && torque_scale > 0.0 && velocity_scale > 0.0) {
        return None;
    }
    let back = excited_directions(robot, joint, motions, torque_scale)?;
    let built = build(robot, joint, motions, sensors, &back)?;
    let acceleration_scale = rms(built.acceleration.iter().copied()).max(f64::MIN_POSITIVE);
    let step = median_step(&built.records);
    Some(PreparedProblem {
        problem: FrictionProblem {
            records: built.records,
            nuisance: back.ncols(),
            torque_scale,
            velocity_scale,
            slope_range: slope_range(&built.velocity, acceleration_scale, step),
            least_inertia: 1e-3 * torque_scale / acceleration_scale,
        },
        back,
        velocity: built.velocity,
        acceleration: built.acceleration,
    })
}

/// Gives every `every`-th row of a joint's regressor along the motions, a column of ones after it.
fn regressor_rows(
    robot: &Robot,
    joint: usize,
    motions: &[SmoothedMotion],
    every: usize,
    take: &mut dyn FnMut(&[f64]),
) {
    let (n, p) = (robot.joints(), robot.parameters().len());
    let mut y = vec![0.0; n * p];
    let mut row = vec![1.0; p + 1];
    for motion in motions {
        for k in (0..motion.t.len()).step_by(every) {
            let at = k * n..(k + 1) * n;
            let (q, v, a) = (&motion.q[at.clone()], &motion.v[at.clone()], &motion.a[at]);
            robot.regressor(q, v, a, &mut y);
            row[..p].copy_from_slice(&y[joint * p..(joint + 1) * p]);
            take(&row);
        }
    }
}

/// Combinations of the robot's parameters (and the offset, last) that the motion excites, one a column.
fn excited_directions(
    robot: &Robot,
    joint: usize,
    motions: &[SmoothedMotion],
    torque_scale: f64,
) -> Option<DMatrix<f64>> {
    let columns = robot.parameters().len() + 1;
    let mut square = vec![0.0; columns];
    let mut count = 0usize;
    regressor_rows(robot, joint, motions, 1, &mut |row| {
        for (s, x) in square.iter_mut().zip(row) {
            *s += x * x;
        }
        count += 1;
    });
    let scale = |s: &f64| match (s / count as f64).sqrt() {
        size if size > 1e-12 * torque_scale => torque_scale / size,
        _ => 0.0,
    };
    let scale: Vec<f64> = square.iter().map(scale).collect();
    let mut factor = RFactor::new(columns);
    let mut scaled = vec![0.0; columns];
    regressor_rows(robot, joint, motions, 4, &mut |row| {
        for ((x, y), s) in scaled.iter_mut().zip(row).zip(&scale) {
            *x = y * s / torque_scale;
        }
        factor.fold(&scaled);
    });
    let svd = rank::svd(&factor.r()).ok()?;
    let shown = |j: &usize| svd.s[*j] > DIRECTION_TOLERANCE * svd.s[0];
    let kept: Vec<usize> = (0..columns).filter(shown).collect();
    Some(DMatrix::from_fn(columns, kept.len(), |i, j| {
        scale[i] * svd.v[(i, kept[j])]
    }))
}

/// The same problem, unknowns and scales as they are, its known inputs from motions that were smoothed otherwise.
pub(super) fn prepare_again(
    robot: &Robot,
    joint: usize,
    motions: &[SmoothedMotion],
    sensors: &SensorModel,
    like: &PreparedProblem,
) -> Option<FrictionProblem> {
    let built = build(robot, joint, motions, sensors, &like.back)?;
    Some(FrictionProblem {
        records: built.records,
        ..like.problem.clone()
    })
}

/// Records of all motions, with velocity and acceleration of the moving joint.
#[derive(Default)]
struct BuiltRecords {
    records: Vec<JointRecord>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
}

fn build(
    robot: &Robot,
    joint: usize,
    motions: &[SmoothedMotion],
    sensors: &SensorModel,
    back: &DMatrix<f64>,
) -> Option<BuiltRecords> {
    let n = robot.joints();
    let mut built = BuiltRecords::default();
    for motion in motions.iter().filter(|m| m.t.len() >= 3) {
        let record = |piece| record(robot, joint, motion, piece, sensors, back);
        built.records.extend(pieces(motion.t.len()).map(record));
        let own = |all: &mut Vec<f64>, x: &[f64]| all.extend(x.iter().skip(joint).step_by(n));
        own(&mut built.velocity, &motion.v);
        own(&mut built.acceleration, &motion.a);
    }
    (!built.records.is_empty()).then_some(built)
}

/// Samples of a stretch cut into records of about equal length.
fn pieces(samples: usize) -> impl Iterator<Item = Range<usize>> {
    let count = samples.div_ceil(LONGEST_RECORD);
    (0..count).map(move |i| i * samples / count..(i + 1) * samples / count)
}

/// The record of a piece of one motion.
fn record(
    robot: &Robot,
    joint: usize,
    motion: &SmoothedMotion,
    piece: Range<usize>,
    sensors: &SensorModel,
    back: &DMatrix<f64>,
) -> JointRecord {
    let (n, e) = (robot.joints(), back.ncols());
    let first = piece.start;
    let mut record = JointRecord {
        t: motion.t[piece.clone()].to_vec(),
        v0: motion.v[first * n + joint],
        ..JointRecord::default()
    };
    for k in piece.clone() {
        let pose = &motion.measured[k * n..(k + 1) * n];
        record.y.push(pose[joint]);
        record.r.push((sensors.variance)(pose));
    }
    let (m, h) = coefficients(robot, joint, motion, piece.clone(), back);
    let mut torque = vec![0.0; n];
    // intervals: mean of their ends; the torque as it is timed
    for k in piece.start..piece.end - 1 {
        record.tau.push(if sensors.zero_order_hold {
            // the motor's force is constant; as a joint torque it is that of the middle pose
            let (here, next) = motion.q[k * n..(k + 2) * n].split_at(n);
            let middle: Vec<f64> = here.iter().zip(next).map(|(a, b)| 0.5 * (a + b)).collect();
            let logged = &motion.tau[k * n..(k + 1) * n];
            let transmission = robot.transmission();
            transmission.carry_torque(here, &middle, logged, &mut torque);
            torque[joint]
        } else {
            0.5 * (motion.tau[k * n + joint] + motion.tau[(k + 1) * n + joint])
        });
        let row = (k - first) * e;
        for j in row..row + e {
            record.m.push(0.5 * (m[j] + m[j + e]));
            record.h.push(0.5 * (h[j] + h[j + e]));
        }
    }
    record
}

/// Coefficients of the nuisance at every sample, row-major: of the joint's own acceleration, and of all else.
fn coefficients(
    robot: &Robot,
    joint: usize,
    motion: &SmoothedMotion,
    piece: Range<usize>,
    back: &DMatrix<f64>,
) -> (Vec<f64>, Vec<f64>) {
    let (n, p, e) = (robot.joints(), robot.parameters().len(), back.ncols());
    let (samples, first) = (piece.len(), piece.start);
    let (mut y, mut moved) = (vec![0.0; n * p], vec![0.0; n * p]);
    let mut a = vec![0.0; n];
    let (mut raw_m, mut raw_h) = (vec![0.0; p + 1], vec![0.0; p + 1]);
    let (mut m, mut h) = (vec![0.0; samples * e], vec![0.0; samples * e]);
    for k in 0..samples {
        let at = (first + k) * n..(first + k + 1) * n;
        let (q, v) = (&motion.q[at.clone()], &motion.v[at.clone()]);
        a.copy_from_slice(&motion.a[at]);
        a[joint] = 0.0;
        robot.regressor(q, v, &a, &mut y);
        a[joint] = 1.0;
        robot.regressor(q, v, &a, &mut moved);
        for j in 0..p {
            raw_h[j] = y[joint * p + j];
            raw_m[j] = moved[joint * p + j] - raw_h[j];
        }
        raw_h[p] = 1.0;
        let row = k * e..(k + 1) * e;
        for (j, (m, h)) in m[row.clone()].iter_mut().zip(&mut h[row]).enumerate() {
            let column = back.column(j);
            *m = raw_m.iter().zip(column.iter()).map(|(a, b)| a * b).sum();
            *h = raw_h.iter().zip(column.iter()).map(|(a, b)| a * b).sum();
        }
    }
    (m, h)
}

fn median_step(records: &[JointRecord]) -> f64 {
    let records = records.iter();
    let mut steps: Vec<f64> = records
        .flat_map(|r| r.t.windows(2).map(|w| w[1] - w[0]))
        .collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1e-3)
}

/// Slopes that a log can show: transitions from ten times the fastest speed to a tenth of a sample wide.
fn slope_range(velocity: &[f64], acceleration: f64, step: f64) -> (f64, f64) {
    let fastest = velocity.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let steepest = (10.0 / (acceleration * step)).max(10.0 / fastest);
    (0.1 / fastest, steepest)
}

/// Step of a position channel: the smallest change between neighbouring samples; where positions
/// are not quantised it is tiny, and the filter finds the noise by itself.
pub fn resolution(motions: &[SmoothedMotion], joints: usize, joint: usize) -> f64 {
    let mut least = f64::INFINITY;
    for motion in motions {
        let position = motion.measured.iter().skip(joint).step_by(joints);
        for (a, b) in position.clone().zip(position.skip(1)) {
            let step = (a - b).abs();
            // differences of equal counts that were scaled twice leave rounding behind
            if step > 1e-12 * a.abs().max(1e-3) && step < least {
                least = step;
            }
        }
    }
    if least.is_finite() { least } else { 1e-9 }
}
