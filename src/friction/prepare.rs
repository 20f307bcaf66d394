//! From measured motion to the one-joint problem: the nuisance that a log can determine.
//!
//! Row `i` of the robot's regressor, evaluated along the measured and smoothed motion of all
//! joints, holds everything that acts on joint `i` beside friction: its own inertia and gravity,
//! the velocity terms that the report drops at (29), and the reaction of joints that do not stand
//! quite still. Its coefficients are unknown. Columns are scaled to the torque, and only the
//! directions that this motion excites are kept.

use nalgebra::DMatrix;

use super::problem::{FrictionProblem, Record};
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

/// Directions whose singular value is below this share of the largest are not carried: what they
/// could add to the torque is below this share of it.
const DIRECTION_TOLERANCE: f64 = 2e-3;

/// The problem of one joint with the map from its nuisance states back to the robot's parameters.
#[derive(Debug, Clone)]
pub struct Prepared {
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
    let (mut s, mut n) = (0.0, 0usize);
    for x in x {
        s += x * x;
        n += 1;
    }
    if n == 0 { 0.0 } else { (s / n as f64).sqrt() }
}

/// Builds the problem of `joint` from its logs' motions. `None` where the joint has no torque or
/// does not move at all.
pub fn prepare(
    robot: &Robot,
    joint: usize,
    motions: &[SmoothedMotion],
    sensors: &SensorModel,
) -> Option<Prepared> {
    let n = robot.joints();
    let p = robot.parameters().len();
    let columns = p + 1;
    let torque_scale = rms(motions
        .iter()
        .flat_map(|m| m.tau.iter().skip(joint).step_by(n).copied()));
    let velocity_scale = rms(motions
        .iter()
        .flat_map(|m| m.v.iter().skip(joint).step_by(n).copied()));
    // as measured: smoothing leaves rounding errors in what stands still
    let mut measured = motions
        .iter()
        .flat_map(|m| m.measured.iter().skip(joint).step_by(n));
    let first = measured.next();
    let moves = measured.any(|q| Some(q) != first);
    if !(moves && torque_scale > 0.0 && velocity_scale > 0.0) {
        return None;
    }

    let mut y = vec![0.0; n * p];
    let mut square = vec![0.0; columns];
    let mut count = 0usize;
    for motion in motions {
        for k in 0..motion.t.len() {
            let at = k * n..(k + 1) * n;
            robot.regressor(
                &motion.q[at.clone()],
                &motion.v[at.clone()],
                &motion.a[at],
                &mut y,
            );
            for (s, x) in square.iter_mut().zip(&y[joint * p..(joint + 1) * p]) {
                *s += x * x;
            }
            count += 1;
        }
    }
    square[p] = count as f64;
    let scale: Vec<f64> = square
        .iter()
        .map(|s| {
            let size = (s / count as f64).sqrt();
            if size > 1e-12 * torque_scale {
                torque_scale / size
            } else {
                0.0
            }
        })
        .collect();

    // singular directions of the scaled columns
    let mut factor = RFactor::new(columns);
    let mut row = vec![0.0; columns];
    for motion in motions {
        for k in (0..motion.t.len()).step_by(4) {
            let at = k * n..(k + 1) * n;
            robot.regressor(
                &motion.q[at.clone()],
                &motion.v[at.clone()],
                &motion.a[at],
                &mut y,
            );
            for (j, x) in y[joint * p..(joint + 1) * p].iter().enumerate() {
                row[j] = x * scale[j] / torque_scale;
            }
            row[p] = scale[p] / torque_scale;
            factor.fold(&row);
        }
    }
    let svd = rank::svd(&factor.r()).ok()?;
    let kept: Vec<usize> = (0..columns)
        .filter(|&j| svd.s[j] > DIRECTION_TOLERANCE * svd.s[0])
        .collect();
    let e = kept.len();
    let back = DMatrix::from_fn(columns, e, |i, j| scale[i] * svd.v[(i, kept[j])]);

    let built = build(robot, joint, motions, sensors, &back)?;
    let acceleration_scale = rms(built.acceleration.iter().copied()).max(f64::MIN_POSITIVE);
    let step = median_step(&built.records);
    Some(Prepared {
        problem: FrictionProblem {
            records: built.records,
            nuisance: e,
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

/// The same problem, its known inputs from motions that were smoothed otherwise: unknowns and
/// scales stay, so that estimates can be compared.
pub fn prepare_again(
    robot: &Robot,
    joint: usize,
    motions: &[SmoothedMotion],
    sensors: &SensorModel,
    like: &Prepared,
) -> Option<FrictionProblem> {
    let built = build(robot, joint, motions, sensors, &like.back)?;
    Some(FrictionProblem {
        records: built.records,
        ..like.problem.clone()
    })
}

/// Records of all motions, with velocity and acceleration of the moving joint.
struct BuiltRecords {
    records: Vec<Record>,
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
    let p = robot.parameters().len();
    let columns = p + 1;
    let e = back.ncols();
    let mut y = vec![0.0; n * p];
    let mut moved = vec![0.0; n * p];
    let mut records = Vec::with_capacity(motions.len());
    let mut velocity = Vec::new();
    let mut acceleration = Vec::new();
    let mut a = vec![0.0; n];
    let (mut raw_m, mut raw_h) = (vec![0.0; columns], vec![0.0; columns]);
    for motion in motions {
        let samples = motion.t.len();
        if samples < 3 {
            continue;
        }
        let mut record = Record {
            t: motion.t.clone(),
            v0: motion.v[joint],
            ..Record::default()
        };
        let (mut m, mut h) = (vec![0.0; samples * e], vec![0.0; samples * e]);
        for k in 0..samples {
            let at = k * n..(k + 1) * n;
            let (q, v) = (&motion.q[at.clone()], &motion.v[at.clone()]);
            a.copy_from_slice(&motion.a[at.clone()]);
            a[joint] = 0.0;
            robot.regressor(q, v, &a, &mut y);
            a[joint] = 1.0;
            robot.regressor(q, v, &a, &mut moved);
            for j in 0..p {
                raw_h[j] = y[joint * p + j];
                raw_m[j] = moved[joint * p + j] - raw_h[j];
            }
            raw_h[p] = 1.0;
            for (j, (mm, hh)) in m[k * e..(k + 1) * e]
                .iter_mut()
                .zip(&mut h[k * e..(k + 1) * e])
                .enumerate()
            {
                let column = back.column(j);
                *mm = raw_m.iter().zip(column.iter()).map(|(a, b)| a * b).sum();
                *hh = raw_h.iter().zip(column.iter()).map(|(a, b)| a * b).sum();
            }
            record.y.push(motion.measured[k * n + joint]);
            record.r.push((sensors.variance)(&motion.measured[at]));
            velocity.push(motion.v[k * n + joint]);
            acceleration.push(motion.a[k * n + joint]);
        }
        // intervals: mean of their ends; the torque as it is timed
        for k in 0..samples - 1 {
            let row = |x: &'_ [f64], k: usize| -> Vec<f64> { x[k * n..(k + 1) * n].to_vec() };
            record.tau.push(if sensors.zero_order_hold {
                // the motor's force is constant; as a joint torque it is that of the middle pose
                let (here, next) = (row(&motion.q, k), row(&motion.q, k + 1));
                let middle: Vec<f64> = here.iter().zip(&next).map(|(a, b)| 0.5 * (a + b)).collect();
                robot
                    .transmission()
                    .carry_torque(&here, &middle, &row(&motion.tau, k), &mut a);
                a[joint]
            } else {
                0.5 * (motion.tau[k * n + joint] + motion.tau[(k + 1) * n + joint])
            });
            for j in 0..e {
                record.m.push(0.5 * (m[k * e + j] + m[(k + 1) * e + j]));
                record.h.push(0.5 * (h[k * e + j] + h[(k + 1) * e + j]));
            }
        }
        records.push(record);
    }
    if records.is_empty() {
        return None;
    }
    Some(BuiltRecords {
        records,
        velocity,
        acceleration,
    })
}

fn median_step(records: &[Record]) -> f64 {
    let mut steps: Vec<f64> = records
        .iter()
        .flat_map(|r| r.t.windows(2).map(|w| w[1] - w[0]))
        .collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1e-3)
}

/// Slopes that a log can show: from a transition ten times as wide as the fastest speed down to
/// one that the joint crosses within a tenth of a sample.
fn slope_range(velocity: &[f64], acceleration: f64, step: f64) -> (f64, f64) {
    let fastest = velocity.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    (
        0.1 / fastest,
        (10.0 / (acceleration * step)).max(10.0 / fastest),
    )
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
