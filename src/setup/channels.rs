//! From logged channels to joints under a correction.

use nalgebra::{DMatrix, DVector};

use super::correction::Correction;
use super::sample::Row;
use crate::robot::Robot;

/// What the channels of a log are of.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// Joints.
    Joints,
    /// Motors behind coupled gears, p = R q and tau = R' c.
    Gears(DMatrix<f64>),
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
    /// What each channel gives to each joint, n x n row-major by joint: summed with the weights of
    /// [`Channels::mix`].
    pub tau: Vec<f64>,
    /// Work space.
    x: [Vec<f64>; 3],
    u: Vec<f64>,
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
            x: [zeros(), zeros(), zeros()],
            u: zeros(),
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

    /// Whether two corrections give the same rows but for the weights of [`Self::mix`].
    pub(super) fn same_rows(&self, a: &Correction, b: &Correction) -> bool {
        a.moves_as(b) && (self.drive == Drive::Joints || a.torque_from == b.torque_from)
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
                    out.q[j] = f * (row.q[k] - self.position_offset[k])
                        + self.position_offset[j]
                        + by.zero[j];
                    out.v[j] = f * row.v[k];
                    out.a[j] = f * row.a[k];
                    out.sign[j] = f.signum() * row.sign[k];
                    out.tau[j * n..(j + 1) * n].copy_from_slice(row.tau);
                }
                true
            }
            Drive::Gears(r) => self.through_gears(r, row, by, out),
            Drive::Motors => self.through_linkage(robot, row, by, out).is_some(),
        }
    }

    fn position_factor(&self, by: &Correction, j: usize) -> f64 {
        let k = by.position_from[j];
        by.position_factor[j] * self.position_gain[j] / self.position_gain[k]
    }

    fn through_gears(
        &self,
        r: &DMatrix<f64>,
        row: Row,
        by: &Correction,
        out: &mut Carried,
    ) -> bool {
        let n = row.q.len();
        let Some(inverse) = r.clone().try_inverse() else {
            return false;
        };
        let times = |m: &DMatrix<f64>, x: &[f64]| m * DVector::from_column_slice(x);
        let off = DVector::from_column_slice(&self.position_offset);
        let p = r * (DVector::from_column_slice(row.q) - &off);
        let turned = |x: &DVector<f64>| {
            DVector::from_fn(n, |j, _| {
                self.position_factor(by, j) * x[by.position_from[j]]
            })
        };
        let q = &inverse * turned(&p) + off + DVector::from_column_slice(&by.zero);
        let v = &inverse * turned(&times(r, row.v));
        let a = &inverse * turned(&times(r, row.a));
        let c = inverse.transpose() * DVector::from_column_slice(row.tau);
        out.q.copy_from_slice(q.as_slice());
        out.v.copy_from_slice(v.as_slice());
        out.a.copy_from_slice(a.as_slice());
        for j in 0..n {
            out.sign[j] = crate::robot::friction::sign(out.v[j]);
            for k in 0..n {
                let from = by.torque_from[k];
                let gain = self.torque_gain[k] / self.torque_gain[from];
                out.tau[j * n + k] = r[(k, j)] * gain * c[from];
            }
        }
        true
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
        let Carried { q, v, a, x, u, .. } = out;
        drive.positions(row.q, &mut x[0]);
        drive.velocities(row.q, row.v, &mut x[1]);
        drive.accelerations(row.q, row.v, row.a, &mut x[2]);
        drive.volts(row.q, row.tau, u).ok()?;
        let before = x.clone();
        for j in 0..n {
            let (k, f) = (by.position_from[j], self.position_factor(by, j));
            x[0][j] =
                f * (before[0][k] - self.position_offset[k]) + self.position_offset[j] + by.zero[j];
            x[1][j] = f * before[1][k];
            x[2][j] = f * before[2][k];
        }
        drive.joints(&x[0], q).ok()?;
        drive.joint_velocities(q, &x[1], v).ok()?;
        drive.joint_accelerations(q, v, &x[2], a).ok()?;
        let volts = u.clone();
        let mut tau = vec![0.0; n];
        for k in 0..n {
            let from = by.torque_from[k];
            u.fill(0.0);
            u[k] = volts[from] * self.torque_gain[k] / self.torque_gain[from];
            drive.torques(q, u, &mut tau);
            for j in 0..n {
                out.tau[j * n + k] = tau[j];
            }
        }
        for (sign, v) in out.sign.iter_mut().zip(&out.v) {
            *sign = crate::robot::friction::sign(*v);
        }
        let finite = |x: &[f64]| x.iter().all(|x| x.is_finite());
        (finite(&out.q) && finite(&out.v) && finite(&out.a) && finite(&out.tau)).then_some(())
    }
}
