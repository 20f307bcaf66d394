//! From motors to joints: motors at the joints, gear trains that are coupled, or a linkage whose motors
//! move coordinates of their own.
//!
//! Vectors of motors and of joints have one number each per joint. Where the motors are at the joints
//! their coordinates are the joints' own, and one volt stands for one unit of torque.

use super::cft::actuation::{self, ActuationLimits, ENCODER_SCALE, LaboratorySetup};
use super::cft::pantograph::{self, TURN_OFFSET};
use super::cft::{COORDINATES, geometry};
use super::error::RobotError;
use super::joint::JointKind;
use super::tree::JointCoupling;

/// How the motors of a robot move its joints.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Transmission {
    couplings: Vec<JointCoupling>,
    /// The pantograph of the CFT robot, eq. (45)-(57), with its amplifiers.
    pantograph: Option<LaboratorySetup>,
}

impl Transmission {
    /// A motor at each joint, some of them turned by other joints too.
    pub(super) fn geared(couplings: Vec<JointCoupling>) -> Self {
        Self {
            couplings,
            pantograph: None,
        }
    }

    /// The motors of x_c1..x_c4, through the pantograph and Table 6.
    pub(super) fn pantograph(setup: LaboratorySetup) -> Self {
        Self {
            couplings: Vec::new(),
            pantograph: Some(setup),
        }
    }

    /// Coupled gear trains.
    pub fn couplings(&self) -> &[JointCoupling] {
        &self.couplings
    }

    /// Names of the motors' coordinates; `None` where the motors are at the joints.
    pub fn coordinates(&self) -> Option<&'static [&'static str]> {
        self.pantograph.map(|_| &COORDINATES[..])
    }

    /// Kind of the motors' coordinate i; `None` where the motors are at the joints.
    pub fn coordinate_kind(&self, i: usize) -> Option<JointKind> {
        self.pantograph.map(|_| match i {
            2 => JointKind::Revolute,
            _ => JointKind::Prismatic,
        })
    }

    /// The joint that coordinate i is but for a constant, and this constant: coordinate = joint + constant.
    pub fn joint_of(&self, i: usize) -> Option<(usize, f64)> {
        match (self.pantograph, i) {
            (None, _) => Some((i, 0.0)),
            (Some(_), 2) => Some((1, TURN_OFFSET)),
            (Some(_), 3) => Some((0, -geometry::DS)),
            (Some(_), _) => None,
        }
    }

    /// Names of the screws that move joints through the linkage, where friction and inertia sit that no
    /// joint has for itself; empty where the motors are at the joints.
    pub fn screws(&self) -> &'static [&'static str] {
        match self.pantograph {
            Some(_) => &["x_r", "y_r"],
            None => &[],
        }
    }

    /// Limits of the motors' coordinates (Table 5); `None` where only the robot's file knows them.
    pub fn limits(&self) -> Option<ActuationLimits> {
        self.pantograph.map(LaboratorySetup::limits)
    }

    /// Full travel of joint i by Table 5 of the CFT robot's report: q1 by x_c4, q2 by x_c3, q4 and q5
    /// as x_c1 and x_c2 leave them \[m or rad\]. Of other robots only their files know it.
    pub fn full_travel(&self, i: usize) -> Option<f64> {
        let spans = self.limits()?.spans();
        [spans[3], spans[2], 2.2, 1.7].get(i).copied()
    }

    /// Motor force or torque per volt (Table 6); `None` where the amplifiers are not known.
    pub fn gains(&self) -> Option<[f64; 4]> {
        self.pantograph.map(LaboratorySetup::gains)
    }

    /// The set-up of the amplifiers, where they are known.
    pub fn setup(&self) -> Option<LaboratorySetup> {
        self.pantograph
    }

    /// Writes `x` itself where the motors are at the joints, else what the pantograph makes of it.
    #[inline]
    fn moved(
        &self,
        x: &[f64],
        out: &mut [f64],
        found: impl FnOnce(LaboratorySetup) -> Result<[f64; 4], RobotError>,
    ) -> Result<(), RobotError> {
        match self.pantograph {
            None => out.copy_from_slice(x),
            Some(setup) => out.copy_from_slice(&found(setup)?),
        }
        Ok(())
    }

    /// Joint positions of the motors' positions.
    #[inline]
    pub fn joints(&self, x: &[f64], q: &mut [f64]) -> Result<(), RobotError> {
        self.moved(x, q, |_| pantograph::joints(four(x)))
    }

    /// Joint velocities of the motors' velocities at the pose q.
    #[inline]
    pub fn joint_velocities(&self, q: &[f64], xd: &[f64], v: &mut [f64]) -> Result<(), RobotError> {
        self.moved(xd, v, |_| pantograph::joint_velocities(four(q), four(xd)))
    }

    /// Joint accelerations of the motors' accelerations at q and v.
    #[inline]
    pub fn joint_accelerations(
        &self,
        q: &[f64],
        v: &[f64],
        xdd: &[f64],
        a: &mut [f64],
    ) -> Result<(), RobotError> {
        self.moved(xdd, a, |_| {
            pantograph::joint_accelerations(four(q), four(v), four(xdd))
        })
    }

    /// The motors' positions at a pose.
    #[inline]
    pub fn positions(&self, q: &[f64], x: &mut [f64]) {
        match self.pantograph {
            None => x.copy_from_slice(q),
            Some(_) => x.copy_from_slice(&pantograph::cartesian(four(q))),
        }
    }

    /// The motors' velocities.
    #[inline]
    pub fn velocities(&self, q: &[f64], v: &[f64], xd: &mut [f64]) {
        match self.pantograph {
            None => xd.copy_from_slice(v),
            Some(_) => xd.copy_from_slice(&pantograph::cartesian_velocities(four(q), four(v))),
        }
    }

    /// The motors' accelerations.
    #[inline]
    pub fn accelerations(&self, q: &[f64], v: &[f64], a: &[f64], xdd: &mut [f64]) {
        match self.pantograph {
            None => xdd.copy_from_slice(a),
            Some(_) => {
                let found = pantograph::cartesian_accelerations(four(q), four(v), four(a));
                xdd.copy_from_slice(&found);
            }
        }
    }

    /// Joint torques \[N or N m\] of the amplifiers' volts at a pose (eq. (66)).
    #[inline]
    pub fn torques(&self, q: &[f64], volts: &[f64], tau: &mut [f64]) {
        match self.pantograph {
            None => tau.copy_from_slice(volts),
            Some(setup) => tau.copy_from_slice(&setup.volts_to_torques(four(q), four(volts))),
        }
    }

    /// Volts of joint torques \[N or N m\] at a pose.
    #[inline]
    pub fn volts(&self, q: &[f64], tau: &[f64], volts: &mut [f64]) -> Result<(), RobotError> {
        self.moved(tau, volts, |setup| {
            setup.torques_to_volts(four(q), four(tau))
        })
    }

    /// How far a pose is from one where the motors lose hold of a joint, 1 being farthest: sin q5 of the
    /// CFT robot, 0 where links 4 and 5 are in line. `None` where there is no such pose.
    #[inline]
    pub fn clearance(&self, q: &[f64]) -> Option<f64> {
        self.pantograph.map(|_| four(q)[3].sin())
    }

    /// Torques at pose `there` of the motor forces that give `tau` at pose `here`: constant motor
    /// forces turn into other joint torques as the arm moves (eq. (63)-(66)). Where motors act on
    /// the joints directly, and at a singular pose, `tau` itself.
    #[inline]
    pub fn carry_torque(&self, here: &[f64], there: &[f64], tau: &[f64], out: &mut [f64]) {
        out.copy_from_slice(tau);
        if self.pantograph.is_some()
            && let Ok(forces) = actuation::torques_to_forces(four(here), four(tau))
        {
            out.copy_from_slice(&actuation::forces_to_torques(four(there), &forces));
        }
    }

    /// Steps of the motors' encoders \[m or rad\]; `None` where they are not known.
    pub fn encoder_steps(&self) -> Option<&'static [f64]> {
        self.pantograph.map(|_| &ENCODER_SCALE[..])
    }

    /// Rounds a pose as the encoders would whose grid is shifted by parts of a step per motor.
    /// Leaves the pose as it is where the encoders are not known or the pose is out of reach.
    pub fn round_at_encoders(&self, q: &mut [f64], shift: &[f64; 4]) {
        if self.pantograph.is_some() {
            let mut x = pantograph::cartesian(four(q));
            for ((x, step), shift) in x.iter_mut().zip(ENCODER_SCALE).zip(shift) {
                *x = ((*x / step + shift).round() - shift) * step;
            }
            if let Ok(rounded) = pantograph::joints(&x) {
                q.copy_from_slice(&rounded);
            }
        }
    }

    /// Variance of a position measured at the motors, seen at joint i, from the encoders' steps
    /// (resolution^2 / 12 each); pose-dependent on the CFT robot. `None` where the robot's
    /// encoders are not known.
    pub fn encoder_variance(&self, i: usize, q: &[f64]) -> Option<f64> {
        self.pantograph?;
        let steps = actuation::quantisation_variance();
        let covariance = actuation::joint_covariance(four(q), &steps).ok()?;
        Some(covariance[i][i])
    }
}

#[inline(always)]
fn four(x: &[f64]) -> &[f64; 4] {
    x.try_into().expect("the pantograph moves four joints")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coordinate_that_is_a_joint_differs_from_it_by_a_constant() {
        let direct = Transmission::default();
        assert_eq!(direct.joint_of(2), Some((2, 0.0)));
        let drive = Transmission::pantograph(LaboratorySetup::default());
        for (i, joint) in (0..4).filter_map(|i| Some((i, drive.joint_of(i)?))) {
            for q in [[0.35, 0.2, 0.9, 0.8], [0.31, -0.4, 1.0, 0.6]] {
                let x = pantograph::cartesian(&q);
                assert!(
                    (x[i] - q[joint.0] - joint.1).abs() < 1e-12,
                    "{i}: {x:?} {q:?}"
                );
            }
        }
        assert_eq!(drive.joint_of(0), None);
    }

    #[test]
    fn steps_of_the_encoders_are_seen_at_the_joints_through_the_pose() {
        let drive = Transmission::pantograph(LaboratorySetup::default());
        let q = [0.35, 0.2, 0.9, 0.8];
        let x = pantograph::cartesian(&q);
        // each coordinate by itself moved to and fro by its step
        let slopes = [0, 1, 2, 3].map(|k| {
            let h = ENCODER_SCALE[k];
            let at = |by: f64| {
                let mut moved = x;
                moved[k] += by;
                pantograph::joints(&moved).unwrap()
            };
            let (above, below) = (at(h), at(-h));
            [0, 1, 2, 3].map(|i| (above[i] - below[i]) / (2.0 * h))
        });
        for i in 0..4 {
            let steps = slopes.iter().zip(ENCODER_SCALE);
            let wanted: f64 = steps.map(|(s, step)| (s[i] * step).powi(2) / 12.0).sum();
            let found = drive.encoder_variance(i, &q).unwrap();
            assert!((found / wanted - 1.0).abs() < 1e-6, "{i}: {found} {wanted}");
        }
        assert_eq!(Transmission::default().encoder_variance(0, &q), None);
    }
}
