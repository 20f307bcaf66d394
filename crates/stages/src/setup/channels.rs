//! From logged channels to joints under a correction.

use nalgebra::{DMatrix, DVector};

use super::correction::Correction;
use super::sample::Row;
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::friction::sign;

/// What the channels of a log are of.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    Joints,
    /// Motors behind coupled gears, p = R q and tau = R' c: R and its inverse.
    Gears(DMatrix<f64>, DMatrix<f64>),
    /// Motors behind the robot's linkage.
    Motors,
}

/// The channels of a log as they are declared: SI value = gain x logged number + offset.
#[derive(Debug, Clone, PartialEq)]
pub struct Channels {
    pub drive: Drive,
    pub position_gain: Vec<f64>,
    pub position_offset: Vec<f64>,
    pub torque_gain: Vec<f64>,
}

/// One row on the joint side, under a correction.
#[derive(Debug, Clone, Default)]
pub(super) struct Carried {
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub a: Vec<f64>,
    pub sign: Vec<f64>,
    /// What each channel gives to each joint, n x n row-major by joint: summed with the weights of [`Channels::mix`].
    pub tau: Vec<f64>,
    /// Positions, speeds and accelerations of motors.
    motors: [Vec<f64>; 3],
    /// Torques of motors and of joints.
    torques: [Vec<f64>; 2],
}

impl Carried {
    pub fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            q: zeros(),
            v: zeros(),
            a: zeros(),
            sign: zeros(),
            tau: vec![0.0; n * n],
            motors: [zeros(), zeros(), zeros()],
            torques: [zeros(), zeros()],
        }
    }
}

impl Channels {
    /// Channels that are the joints' own in SI units.
    pub fn of_joints(joints: usize) -> Self {
        Self {
            drive: Drive::Joints,
            position_gain: vec![1.0; joints],
            position_offset: vec![0.0; joints],
            torque_gain: vec![1.0; joints],
        }
    }

    /// Weights by which the channels' torques sum up to those of each joint.
    pub(super) fn mix(&self, by: &Correction) -> Vec<DVector<f64>> {
        let n = by.torque_factor.len();
        let of = |j: usize| {
            let mut a = DVector::zeros(n);
            match self.drive {
                Drive::Joints => {
                    let k = by.torque_from[j];
                    a[k] = by.torque_factor[j] * self.torque_gain[j] / self.torque_gain[k];
                }
                _ => a.copy_from_slice(&by.torque_factor),
            }
            a
        };
        (0..n).map(of).collect()
    }

    /// A row under a correction; false where it is a pose that the robot does not have.
    pub(super) fn carry(
        &self,
        robot: &Robot,
        row: Row,
        by: &Correction,
        out: &mut Carried,
    ) -> bool {
        let n = row.q.len();
        match &self.drive {
            Drive::Joints => {
                for j in 0..n {
                    let k = by.position_from[j];
                    let f = self.position_factor(by, j);
                    let (q, v, a, sign) = match by.begins[j] {
                        Some(begins) => {
                            (f * row.sum[k] + begins, row.q[k], row.v[k], sign(row.q[k]))
                        }
                        None => {
                            let q = f * (row.q[k] - self.position_offset[k]);
                            (q + self.position_offset[j], row.v[k], row.a[k], row.sign[k])
                        }
                    };
                    out.q[j] = q + by.zero[j];
                    out.v[j] = f * v;
                    out.a[j] = f * a;
                    out.sign[j] = f.signum() * sign;
                    out.tau[j * n..(j + 1) * n].copy_from_slice(row.tau);
                }
                true
            }
            Drive::Gears(r, inverse) => {
                self.through_gears([r, inverse], row, by, out);
                true
            }
            Drive::Motors => self.through_linkage(robot, row, by, out).is_some(),
        }
    }

    fn position_factor(&self, by: &Correction, j: usize) -> f64 {
        let k = by.position_from[j];
        by.position_factor[j] * self.position_gain[j] / self.position_gain[k]
    }

    fn through_gears(
        &self,
        [r, inverse]: [&DMatrix<f64>; 2],
        row: Row,
        by: &Correction,
        out: &mut Carried,
    ) {
        let n = row.q.len();
        let [position, velocity, acceleration] = &mut out.motors;
        for j in 0..n {
            let times = |x: &dyn Fn(usize) -> f64| (0..n).map(|i| r[(j, i)] * x(i)).sum::<f64>();
            position[j] = times(&|i| row.q[i] - self.position_offset[i]);
            velocity[j] = times(&|i| row.v[i]);
            acceleration[j] = times(&|i| row.a[i]);
        }
        for j in 0..n {
            let times = |x: &[f64]| -> f64 {
                let motor = |i: usize| self.position_factor(by, i) * x[by.position_from[i]];
                (0..n).map(|i| inverse[(j, i)] * motor(i)).sum()
            };
            out.q[j] = times(position) + self.position_offset[j] + by.zero[j];
            out.v[j] = times(velocity);
            out.a[j] = times(acceleration);
            out.sign[j] = sign(out.v[j]);
        }
        for k in 0..n {
            let from = by.torque_from[k];
            let gain = self.torque_gain[k] / self.torque_gain[from];
            let motor: f64 = (0..n).map(|i| inverse[(i, from)] * row.tau[i]).sum();
            for j in 0..n {
                out.tau[j * n + k] = r[(k, j)] * gain * motor;
            }
        }
    }

    fn through_linkage(
        &self,
        robot: &Robot,
        row: Row,
        by: &Correction,
        out: &mut Carried,
    ) -> Option<()> {
        let n = row.q.len();
        let drive = robot.transmission();
        let offset = &self.position_offset;
        let [moved, speed, change] = &mut out.motors;
        for j in 0..n {
            let (k, f) = (by.position_from[j], self.position_factor(by, j));
            moved[j] = f * (row.q[k] - offset[k]) + offset[j] + by.zero[j];
            speed[j] = f * row.v[k];
            change[j] = f * row.a[k];
        }
        let (q, v, a) = (&mut out.q, &mut out.v, &mut out.a);
        drive.joints(moved, q).ok()?;
        drive.joint_velocities(q, speed, v).ok()?;
        drive.joint_accelerations(q, v, change, a).ok()?;
        let [u, force] = &mut out.torques;
        for k in 0..n {
            let from = by.torque_from[k];
            u.fill(0.0);
            u[k] = row.tau[from] * self.torque_gain[k] / self.torque_gain[from];
            drive.torques(q, u, force);
            for (j, force) in force.iter().enumerate() {
                out.tau[j * n + k] = *force;
            }
        }
        for (to, v) in out.sign.iter_mut().zip(&out.v) {
            *to = sign(*v);
        }
        let all = [&out.q, &out.v, &out.a, &out.tau];
        let finite = all.into_iter().flatten().all(|x| x.is_finite());
        finite.then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::{Change, ChannelKind};
    use cft_ident_core::robot::cft::{LaboratorySetup, ParameterStructure};

    const ROW: [[f64; 4]; 4] = [
        [0.35, 0.2, 0.9, 0.8],
        [0.1, -0.4, 0.3, 0.6],
        [1.0, 2.0, -3.0, 0.5],
        [20.0, 3.0, -4.0, 5.0],
    ];

    #[test]
    fn rows_are_as_declared_without_a_correction_and_motors_turn_joints_together() {
        let robot = Robot::cft(LaboratorySetup::default(), ParameterStructure::Printed12);
        let mut r = DMatrix::from_diagonal(&DVector::from_vec(vec![2.0, 3.0, 1.0, 1.0]));
        r[(3, 2)] = 0.5;
        let gears = Drive::Gears(r.clone(), r.try_inverse().unwrap());
        for (drive, least) in [(Drive::Joints, 1), (gears, 2), (Drive::Motors, 1)] {
            let channels = Channels {
                drive,
                ..Channels::of_joints(4)
            };
            let mut logged = ROW;
            if channels.drive == Drive::Motors {
                let drive = robot.transmission();
                let [q, v, a, tau] = &ROW;
                drive.positions(q, &mut logged[0]);
                drive.velocities(q, v, &mut logged[1]);
                drive.accelerations(q, v, a, &mut logged[2]);
                drive.volts(q, tau, &mut logged[3]).unwrap();
            }
            let [q, v, a, tau] = logged.each_ref().map(|x| &x[..]);
            let (sign, sum) = (&[0.0; 4], &[0.0; 4]);
            let row = Row {
                q,
                v,
                a,
                sign,
                tau,
                sum,
            };
            let none = Correction::none(4);
            let mut carried = Carried::new(4);
            assert!(channels.carry(&robot, row, &none, &mut carried));
            let torques = |by: &Correction| -> Vec<f64> {
                let of = |(tau, mix): (&[f64], &DVector<f64>)| {
                    tau.iter().zip(mix).map(|(t, m)| t * m).sum()
                };
                let rows = carried.tau.chunks_exact(4);
                rows.zip(&channels.mix(by)).map(of).collect()
            };
            let found = torques(&none);
            let lists = [&carried.q, &carried.v, &carried.a, &found];
            for (list, row) in lists.into_iter().zip(&ROW) {
                let near = |(x, y): (&f64, &f64)| (x - y).abs() < 1e-9;
                assert!(list.iter().zip(row).all(near), "{:?}", channels.drive);
            }
            // behind these gears the last motor turns two joints
            let other = torques(&none.with(&Change::Scale(ChannelKind::Torque, vec![3], -1.0)));
            let changed = (0..4).filter(|j| (other[*j] - found[*j]).abs() > 1e-9);
            assert!(changed.count() >= least, "{:?}", channels.drive);
        }
    }
}
