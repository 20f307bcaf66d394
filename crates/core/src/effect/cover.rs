//! What a set of logs covers: by this an effect is refused that the data cannot show.

use super::EffectPlace;
use crate::motion::{Stretch, alike};
use crate::robot::{JointKind, Robot};

/// What one joint did.
#[derive(Debug, Clone, Default)]
pub struct JointCover {
    /// Least and greatest position [m or rad].
    pub position: [f64; 2],
    /// Greatest speed in each direction, backward and forward [m/s or rad/s].
    pub speed: [f64; 2],
    /// Root mean square of the speed.
    pub speed_rms: f64,
    /// Root mean square of the acceleration.
    pub acceleration_rms: f64,
    /// Changes of direction with a travel of at least a thousandth of the range between them.
    pub reversals: usize,
    /// Orders with a peak in the angle-domain spectrum of the residual that keeps its sign.
    pub ripple_orders: Vec<f64>,
    /// The same of the residual times the sign of the speed.
    pub friction_orders: Vec<f64>,
    /// The same of the residual times the sign of the torque.
    pub torque_orders: Vec<f64>,
    /// Greatest torque that is logged [N or Nm].
    pub torque: f64,
    /// The joint is stationary in every log.
    pub stationary: bool,
    /// Gravity acts on it, as far as the robot's model knows.
    pub weight: bool,
}

/// What the logs cover.
#[derive(Debug, Clone, Default)]
pub struct LogCoverage {
    pub joints: Vec<JointCover>,
    pub kinds: Vec<JointKind>,
    /// Longest log \[s\].
    pub duration_s: f64,
    /// Sampling step of the slowest log \[s\].
    pub dt: f64,
    /// Cut-off of the parallel filter \[Hz\].
    pub cutoff_hz: f64,
}

impl LogCoverage {
    /// Looks over stretches.
    pub fn of(robot: &Robot, stretches: &[Stretch], cutoff_hz: f64) -> Self {
        let n = robot.joints();
        let mut cover = LogCoverage {
            joints: vec![JointCover::default(); n],
            kinds: (0..n).map(|j| robot.joint_kind(j)).collect(),
            duration_s: 0.0,
            dt: slowest(stretches),
            cutoff_hz,
        };
        let stationary = stationary_joints(robot, stretches);
        for (j, joint) in cover.joints.iter_mut().enumerate() {
            let mut position = [f64::INFINITY, f64::NEG_INFINITY];
            let (mut square, mut acceleration, mut count) = (0.0, 0.0, 0usize);
            joint.stationary = stationary.iter().all(|s| s[j]);
            let moving = stretches.iter().zip(&stationary);
            let moving = moving.filter(|(_, s)| joint.stationary || !s[j]);
            let moving: Vec<&Stretch> = moving.map(|(s, _)| s).collect();
            for s in &moving {
                for (q, v) in s.q[j].iter().zip(&s.v[j]) {
                    position = [position[0].min(*q), position[1].max(*q)];
                    joint.speed = [joint.speed[0].min(*v), joint.speed[1].max(*v)];
                    square += v * v;
                    count += 1;
                }
                acceleration += s.a[j].iter().map(|a| a * a).sum::<f64>();
                let torques = s.tau[j].iter().map(|tau| tau.abs());
                joint.torque = torques.fold(joint.torque, f64::max);
            }
            joint.speed_rms = (square / count.max(1) as f64).sqrt();
            joint.acceleration_rms = (acceleration / count.max(1) as f64).sqrt();
            let least = TURN * (position[1] - position[0]);
            joint.reversals = moving.iter().map(|s| reversals(&s.q[j], least).len()).sum();
            joint.position = position;
        }
        for (joint, weight) in cover.joints.iter_mut().zip(weights(robot, stretches)) {
            joint.weight = weight;
        }
        let ends = stretches.iter().map(|s| s.began + s.dt * s.len() as f64);
        cover.duration_s = ends.fold(0.0, f64::max);
        cover
    }

    /// What the joint of a place did; the first joint's for all of them.
    pub fn at(&self, place: EffectPlace) -> &JointCover {
        &self.joints[place.joint().unwrap_or(0).min(self.joints.len() - 1)]
    }

    /// What the joint of a place did where it reversed so often; else what the data lack.
    pub(super) fn reversing(
        &self,
        place: EffectPlace,
        times: usize,
        lack: &str,
    ) -> Result<&JointCover, String> {
        let joint = self.at(place);
        let reverses = joint.reversals >= times;
        reverses.then_some(joint).ok_or_else(|| lack.to_owned())
    }

    /// The same of a joint that moved both ways with speeds worth the name.
    pub(super) fn both_ways(&self, place: EffectPlace) -> Result<&JointCover, String> {
        let lack = "the joint moves in one direction only: move it both ways";
        let joint = self.reversing(place, 1, lack)?;
        let [back, forth] = joint.speed;
        let moves = forth > 0.0 && back < 0.0;
        moves.then_some(joint).ok_or_else(|| lack.to_owned())
    }

    /// Travel of a place's joint in revolutions or metres.
    pub(super) fn travel(&self, place: EffectPlace) -> f64 {
        let joint = place.joint().unwrap_or(0);
        let range = self.joints[joint].range();
        match self.kinds[joint] {
            JointKind::Revolute => range / std::f64::consts::TAU,
            JointKind::Prismatic => range,
        }
    }
}

impl JointCover {
    /// Travel [m or rad].
    pub fn range(&self) -> f64 {
        (self.position[1] - self.position[0]).max(0.0)
    }

    /// Greatest speed of both directions.
    pub fn fastest(&self) -> f64 {
        self.speed[1].max(-self.speed[0])
    }
}

/// Poses at which a stretch is asked where gravity acts.
const POSES: usize = 5;

/// Whether a body's weight acts on each joint: its row of the regressor at rest is not zero.
fn weights(robot: &Robot, stretches: &[Stretch]) -> Vec<bool> {
    let (n, p) = (robot.joints(), robot.parameters().len());
    let (rest, mut y) = (vec![0.0; n], vec![0.0; n * p]);
    let mut found = vec![false; n];
    for s in stretches.iter().filter(|s| !s.is_empty()) {
        for i in 0..POSES {
            let k = i * (s.len() - 1) / (POSES - 1);
            let q: Vec<f64> = s.q.iter().map(|q| q[k]).collect();
            robot.regressor(&q, &rest, &rest, &mut y);
            for (found, row) in found.iter_mut().zip(y.chunks(p.max(1))) {
                *found |= row.iter().any(|x| x.abs() > WEIGHTLESS);
            }
        }
    }
    found
}

/// Least element of a regressor's row at rest that is no rounding [m/s^2 and its like].
const WEIGHTLESS: f64 = 1e-6;

/// Sampling step of the slowest log; the first log's where all have one rate \[s\].
fn slowest(stretches: &[Stretch]) -> f64 {
    let first = stretches.first().map_or(1.0, |s| s.dt);
    let steps = stretches.iter().map(|s| s.dt);
    steps.fold(first, |found, dt| match dt > found && !alike(dt, found) {
        true => dt,
        false => found,
    })
}

/// Travel below which a joint counts as stationary, over its travel in all logs or its range: a controller gives way.
const STATIONARY_SHARE: f64 = 0.01;

/// Whether each joint is stationary along each stretch, `[stretch][joint]`: one-joint logs are recognised
/// by it. A torque at rest is anything up to static friction, and no law of v says which.
pub fn stationary_joints(robot: &Robot, stretches: &[Stretch]) -> Vec<Vec<bool>> {
    let travel = |q: &Vec<f64>| {
        let most = q.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = q.iter().copied().fold(f64::INFINITY, f64::min);
        (most - least).max(0.0)
    };
    let of = |s: &Stretch| s.q.iter().map(travel).collect();
    let travels: Vec<Vec<f64>> = stretches.iter().map(of).collect();
    let widest = |j: usize| {
        let seen = travels.iter().map(|t| t[j]).fold(0.0, f64::max);
        seen.max(robot.transmission().full_travel(j).unwrap_or(0.0))
    };
    let widest: Vec<f64> = (0..robot.joints()).map(widest).collect();
    let small = |t: &Vec<f64>| {
        let each = t.iter().zip(&widest);
        each.map(|(t, w)| *t < STATIONARY_SHARE * w).collect()
    };
    travels.iter().map(small).collect()
}

/// Part of its travel that a joint goes back before it has turned.
pub const TURN: f64 = 1e-3;

/// Samples of turning points with at least `least` between them.
pub fn reversals(q: &[f64], least: f64) -> Vec<usize> {
    let Some(&first) = q.first() else {
        return Vec::new();
    };
    let (mut extreme, mut at, mut direction, mut all) = (first, 0, 0i8, Vec::new());
    for (k, &x) in q.iter().enumerate() {
        match direction {
            0 if (x - first).abs() > least => {
                direction = if x > first { 1 } else { -1 };
                (extreme, at) = (x, k);
            }
            0 => {}
            1 if x > extreme => (extreme, at) = (x, k),
            -1 if x < extreme => (extreme, at) = (x, k),
            _ if (x - extreme).abs() > least => {
                direction = -direction;
                all.push(at);
                (extreme, at) = (x, k);
            }
            _ => {}
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_points_are_counted_and_jitter_is_not() {
        let q: Vec<f64> = (0..2000)
            .map(|k| (f64::from(k) * 0.01).sin() + 1e-5 * f64::from(k % 2))
            .collect();
        // sin turns at pi/2, 3 pi/2, .. below 20: six times
        let found = reversals(&q, 1e-3);
        assert_eq!(found.len(), 6);
        assert!(found[0].abs_diff(157) <= 1);
        assert!(reversals(&[0.0; 50], 1e-3).is_empty());
    }
}
