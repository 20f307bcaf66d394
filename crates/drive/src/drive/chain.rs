//! The motion that a law makes of commands: all joints of an arm or of legs.
//!
//! (M(q) + Ja) a + C v + g = tau_m + c - D v - dry friction. As on one axis a step drifts half, kicks and drifts half;
//! impulses of dry friction settle joint after joint. M is that of the measured positions, computed once a log: what
//! drives are off by moves it by parts in a hundred of the links' share; gravity and C v follow the predicted motion, from
//! one sample to the next along a straight line: held they would be late, which looks like damping.

use std::collections::HashMap;

use cft_ident_core::robot::Robot;

use super::law::MachineLaw;
use super::roll_out::{PastStates, RollOutFrame, RolledDrive, first_speeds, steps};
use super::set_point::{CommandLines, SetPointFollower};
use super::track::DriveLog;

/// Sweeps in which the impulses of friction settle.
const SWEEPS: usize = 30;

/// Further than this from where it was measured a joint is lost [rad].
const LOST: f64 = 1e3;

/// A part of a log: two spans of one file have its name.
type LogPart = (String, u64, usize);

fn part_of(log: &DriveLog) -> LogPart {
    let begin = log.t.first().copied().unwrap_or(0.0);
    (log.name.clone(), begin.to_bits(), log.t.len())
}

/// A robot whose links are known, and its inertia along some logs.
#[derive(Debug)]
pub struct RobotChains {
    robot: Robot,
    theta: Vec<f64>,
    /// Joints that move each other's links, group by group.
    groups: Vec<Vec<usize>>,
    /// M of every sample, log by log.
    inertia: HashMap<LogPart, Vec<f64>>,
}

impl RobotChains {
    /// Of a robot with base parameters, along logs.
    pub fn new(robot: &Robot, theta: &[f64], logs: &[&DriveLog]) -> Self {
        let n = robot.joints();
        let mut inertia = HashMap::new();
        let mut coupled = vec![false; n * n];
        for log in logs {
            let mut all = vec![0.0; n * n * log.t.len()];
            for (k, mass) in all.chunks_mut(n * n).enumerate() {
                let q: Vec<f64> = log.joints.iter().map(|j| j.position[k]).collect();
                mass_at(robot, theta, &q, mass);
                for (coupled, m) in coupled.iter_mut().zip(&*mass) {
                    *coupled |= m.abs() > 1e-12;
                }
            }
            inertia.insert(part_of(log), all);
        }
        RobotChains {
            robot: robot.clone(),
            theta: theta.to_vec(),
            groups: groups(&coupled, n),
            inertia,
        }
    }

    /// Joints that move with a joint.
    pub fn moved_with(&self, joint: usize) -> Vec<usize> {
        let group = self.groups.iter().find(|group| group.contains(&joint));
        group.cloned().unwrap_or_default()
    }

    /// Inertia that each joint sees of the links, in the middle of all samples [kg m^2].
    pub fn usual_inertia(&self) -> Vec<f64> {
        let n = self.robot.joints();
        let of = |j: usize| {
            let all = self.inertia.values().flat_map(|log| log.chunks(n * n));
            super::track::median(all.map(|m| m[j * n + j]).collect())
        };
        (0..n).map(of).collect()
    }

    /// Torque of gravity at the measured positions of a log, joint after joint.
    pub fn gravity(&self, log: &DriveLog, k: usize) -> Vec<f64> {
        let n = self.robot.joints();
        let q: Vec<f64> = log.joints.iter().map(|j| j.position[k]).collect();
        let (rest, mut tau) = (vec![0.0; n], vec![0.0; n]);
        self.robot.torque(&self.theta, &q, &rest, &rest, &mut tau);
        tau
    }

    /// Positions of all joints along a log, as the encoders would read them.
    pub fn roll(&self, log: &DriveLog, frame: RollOutFrame, law: &MachineLaw) -> Vec<Vec<f64>> {
        let roll = |speeds: &[f64], count: usize| self.roll_from(log, (frame, law), speeds, count);
        self.roll_from(
            log,
            (frame, law),
            &first_speeds(&log.t, &log.joints, roll),
            log.t.len(),
        )
    }

    /// The first so many positions from speeds at the first sample \[rad/s\].
    fn roll_from(
        &self,
        log: &DriveLog,
        ((kind, longest), law): (RollOutFrame, &MachineLaw),
        speeds: &[f64],
        count: usize,
    ) -> Vec<Vec<f64>> {
        let n = self.robot.joints();
        let mut out = vec![vec![0.0; count]; n];
        let Some(inertia) = self.inertia.get(&part_of(log)) else {
            return out;
        };
        let t = &log.t[..count];
        let late = law.command_delay + law.loop_delay;
        let joints = log.joints.iter().zip(&law.joints);
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        let mut sides = Vec::with_capacity(n);
        for (j, (track, of)) in joints.clone().enumerate() {
            q[j] = track.position[0] + of.bias;
            v[j] = speeds[j];
            out[j][0] = track.position[0];
            sides.push(CommandSide {
                command: CommandLines::new(&log.t, &track.command, log.command_is, t[0] - late),
                follower: SetPointFollower::new(track.command[0], of.slowness),
                past: PastStates::new(law.loop_delay, t[0], q[j], v[j]),
            });
        }
        let still = vec![0.0; n];
        let (mut bias, mut before, mut rate) = (vec![0.0; n], Vec::new(), vec![0.0; n]);
        let mut work = KickWork::new(n);
        for k in 1..t.len() {
            let dt = t[k] - t[k - 1];
            let parts = steps(dt, longest);
            let h = dt / parts as f64;
            let mass = &inertia[(k - 1) * n * n..k * n * n];
            for i in 0..parts {
                let begin = t[k - 1] + i as f64 * h;
                for j in 0..n {
                    q[j] += 0.5 * h * v[j];
                }
                if i == 0 {
                    self.robot.torque(&self.theta, &q, &v, &still, &mut bias);
                    for (j, before) in before.iter().enumerate() {
                        rate[j] = (bias[j] - before) / dt;
                    }
                    before.clone_from(&bias);
                }
                for (j, (track, of)) in joints.clone().enumerate() {
                    let side = &mut sides[j];
                    let end = begin + h - late;
                    let on = track.on.get(k - 1).copied().unwrap_or(true);
                    let supply = match (law.supply, track.supply.get(k - 1)) {
                        (Some(reference), Some(volts)) => volts / reference,
                        _ => 1.0,
                    };
                    let seen = side.past.seen(begin, h, q[j], v[j]);
                    let drive = RolledDrive::new(kind, of, [track.kp, track.kd], supply);
                    let ahead = (&mut side.follower, &mut side.command);
                    let (mut tau, mut slope) = drive.mean_torque(ahead, (end, h), (seen, of.bias));
                    if !on {
                        (tau, slope) = (0.0, 0.0);
                    }
                    let damping = if on { of.damping } else { of.viscous };
                    let links = bias[j] + rate[j] * i as f64 * h;
                    work.force[j] = tau + of.offset - links - damping * v[j];
                    work.added[j] = of.armature + 0.5 * h * (damping + slope * seen.own);
                    work.limit[j] = h * of.dry(v[j], tau);
                }
                for group in &self.groups {
                    work.kick(group, mass, n, h, &mut v);
                }
                for j in 0..n {
                    q[j] += 0.5 * h * v[j];
                    sides[j].past.push(begin + h, q[j], v[j]);
                }
            }
            for (j, (track, of)) in joints.clone().enumerate() {
                if (q[j] - track.position[k]).abs() >= LOST || q[j].is_nan() {
                    (q[j], v[j]) = (track.position[k] + LOST, 0.0);
                }
                out[j][k] = q[j] - of.bias;
            }
        }
        out
    }
}

/// What stands before a controller.
struct CommandSide<'a> {
    command: CommandLines<'a>,
    follower: SetPointFollower,
    past: PastStates,
}

/// Numbers of one kick.
struct KickWork {
    force: Vec<f64>,
    added: Vec<f64>,
    limit: Vec<f64>,
    inverse: Vec<f64>,
    change: Vec<f64>,
    impulse: Vec<f64>,
}

impl KickWork {
    fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        KickWork {
            force: zeros(),
            added: zeros(),
            limit: zeros(),
            inverse: vec![0.0; n * n],
            change: zeros(),
            impulse: zeros(),
        }
    }

    /// Changes the speeds of a group of joints by a step.
    fn kick(&mut self, group: &[usize], mass: &[f64], n: usize, h: f64, v: &mut [f64]) {
        let m = group.len();
        let inverse = &mut self.inverse[..m * m];
        for (a, i) in group.iter().enumerate() {
            for (b, j) in group.iter().enumerate() {
                inverse[a * m + b] = mass[i * n + j];
            }
            inverse[a * m + a] += self.added[*i];
        }
        if !invert(inverse, m) {
            return;
        }
        for a in 0..m {
            let row = (0..m).map(|b| inverse[a * m + b] * self.force[group[b]]);
            self.change[a] = h * row.sum::<f64>();
            self.impulse[a] = 0.0;
        }
        for _ in 0..SWEEPS {
            let mut moved = 0.0f64;
            for a in 0..m {
                let limit = self.limit[group[a]];
                if limit <= 0.0 {
                    continue;
                }
                let next = v[group[a]] + self.change[a];
                let wanted = self.impulse[a] - next / inverse[a * m + a];
                let allowed = wanted.clamp(-limit, limit);
                let step = allowed - self.impulse[a];
                self.impulse[a] = allowed;
                moved = moved.max(step.abs() / limit);
                for b in 0..m {
                    self.change[b] += inverse[b * m + a] * step;
                }
            }
            if moved < 1e-9 {
                break;
            }
        }
        for (a, j) in group.iter().enumerate() {
            v[*j] += self.change[a];
        }
    }
}

/// The inverse of a positive definite m x m matrix in its place, by Gauss-Jordan; false where it is none.
fn invert(a: &mut [f64], m: usize) -> bool {
    for k in 0..m {
        let pivot = a[k * m + k];
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let p = 1.0 / pivot;
        a[k * m + k] = 1.0;
        for c in 0..m {
            a[k * m + c] *= p;
        }
        for r in (0..m).filter(|r| *r != k) {
            let by = a[r * m + k];
            a[r * m + k] = 0.0;
            for c in 0..m {
                a[r * m + c] -= by * a[k * m + c];
            }
        }
    }
    true
}

/// M(q): torques of unit accelerations less those of none.
fn mass_at(robot: &Robot, theta: &[f64], q: &[f64], mass: &mut [f64]) {
    let n = q.len();
    let still = vec![0.0; n];
    let (mut rest, mut tau, mut unit) = (still.clone(), still.clone(), still.clone());
    robot.torque(theta, q, &still, &still, &mut rest);
    for j in 0..n {
        unit[j] = 1.0;
        robot.torque(theta, q, &still, &unit, &mut tau);
        unit[j] = 0.0;
        for i in 0..n {
            mass[i * n + j] = tau[i] - rest[i];
        }
    }
}

/// Joints in groups that share entries of M.
fn groups(coupled: &[bool], n: usize) -> Vec<Vec<usize>> {
    let mut of: Vec<usize> = (0..n).collect();
    for i in 0..n {
        for j in 0..n {
            if coupled[i * n + j] && of[i] != of[j] {
                let (keep, gone) = (of[i].min(of[j]), of[i].max(of[j]));
                for x in &mut of {
                    if *x == gone {
                        *x = keep;
                    }
                }
            }
        }
    }
    let mut out: Vec<Vec<usize>> = Vec::new();
    for first in 0..n {
        let group: Vec<usize> = (0..n).filter(|j| of[*j] == first).collect();
        if !group.is_empty() {
            out.push(group);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_of_a_small_matrix_is_its_inverse() {
        let a = [4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0];
        let mut b = a;
        assert!(invert(&mut b, 3));
        for i in 0..3 {
            for j in 0..3 {
                let x: f64 = (0..3).map(|k| a[i * 3 + k] * b[k * 3 + j]).sum();
                assert!((x - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        assert!(!invert(&mut [-1.0], 1));
    }

    #[test]
    fn joints_that_share_an_entry_are_one_group() {
        let mut coupled = vec![false; 16];
        coupled[2] = true; // 0 and 2
        assert_eq!(groups(&coupled, 4), [vec![0, 2], vec![1], vec![3]]);
    }
}
