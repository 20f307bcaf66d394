//! The physical model: pure functions of q, v, a and parameters; no files, no estimation.
//!
//! Vectors are in joint order, units are SI and radians.

pub mod cft;
pub mod friction;
pub mod model;
pub mod serial;
pub mod standard;

use cft::regressor::{regressor12, regressor22};
use cft::{Setup, Structure};
use serial::SerialRobot;
use std::borrow::Cow;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the model cannot answer for.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// The pantograph cannot reach these references.
    #[error(
        "the pantograph cannot reach x_r = {x_r:.6} m, y_r = {y_r:.6} m: their distance from the \
         origin is {r:.6} m and must be above 0 and at most {reach:.6} m; keep x_c1 and x_c2 \
         inside the limits of Table 5"
    )]
    OutOfReach {
        x_r: f64,
        y_r: f64,
        r: f64,
        reach: f64,
    },
    /// Links 4 and 5 are in line.
    #[error(
        "the arm is singular at q5 = {q5:.6} rad, where links 4 and 5 are in line; keep q5 inside \
         [0.78, 2.48] rad, where Table 5 keeps it"
    )]
    Singular { q5: f64 },
}

/// Name, unit and meaning of one inertial parameter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParameterInfo {
    /// Name in files and reports.
    pub name: Cow<'static, str>,
    /// Number in the report's Table 4, where it has one.
    pub theta: Option<u32>,
    /// SI unit.
    pub unit: Cow<'static, str>,
    /// What it stands for, in link masses, centres of gravity and pseudo-inertias.
    pub meaning: Cow<'static, str>,
}

/// Kind of a joint: it decides the units of position and torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum JointKind {
    /// Position in m, force in N.
    Prismatic,
    /// Position in rad, torque in N m.
    Revolute,
}

impl JointKind {
    /// "N" or "Nm".
    pub const fn torque_unit(self) -> &'static str {
        match self {
            Self::Prismatic => "N",
            Self::Revolute => "Nm",
        }
    }

    /// "m" or "rad".
    pub const fn position_unit(self) -> &'static str {
        match self {
            Self::Prismatic => "m",
            Self::Revolute => "rad",
        }
    }
}

/// A robot whose inverse dynamics are linear in its inertial parameters.
#[derive(Debug, Clone, PartialEq)]
pub enum Robot {
    /// The CFT transposer robot: joints q1, q2, q4, q5.
    Cft(CftRobot),
    /// One joint that carries one inertia: tau = inertia a + F(v).
    SingleJoint(SingleJoint),
    /// A chain of links on revolute and prismatic joints, in its base parameters.
    Serial(Arc<SerialRobot>),
}

/// The CFT robot as it is set up and modelled.
#[derive(Debug, Clone, PartialEq)]
pub struct CftRobot {
    /// Amplifiers and limits.
    pub setup: Setup,
    /// 12 or 22 inertial parameters.
    pub structure: Structure,
    names: [String; 4],
}

/// One joint with a constant inertia.
#[derive(Debug, Clone, PartialEq)]
pub struct SingleJoint {
    /// Prismatic (inertia in kg) or revolute (kg m^2).
    pub kind: JointKind,
    names: [String; 1],
}

static INERTIA_KG: [ParameterInfo; 1] = [ParameterInfo {
    name: Cow::Borrowed("inertia"),
    theta: None,
    unit: Cow::Borrowed("kg"),
    meaning: Cow::Borrowed("moving mass"),
}];
static INERTIA_KG_M2: [ParameterInfo; 1] = [ParameterInfo {
    name: Cow::Borrowed("inertia"),
    theta: None,
    unit: Cow::Borrowed("kg m^2"),
    meaning: Cow::Borrowed("moment of inertia about the joint axis"),
}];

impl Robot {
    /// The CFT robot with a set-up and a structure of the inertial parameters.
    pub fn cft(setup: Setup, structure: Structure) -> Self {
        Self::Cft(CftRobot {
            setup,
            structure,
            names: cft::JOINTS.map(String::from),
        })
    }

    /// A single joint of the name and kind given.
    pub fn single_joint(name: impl Into<String>, kind: JointKind) -> Self {
        Self::SingleJoint(SingleJoint {
            kind,
            names: [name.into()],
        })
    }

    /// A serial robot.
    pub fn serial(robot: SerialRobot) -> Self {
        Self::Serial(Arc::new(robot))
    }

    /// Number of joints n.
    pub fn joints(&self) -> usize {
        self.joint_names().len()
    }

    /// Joint names, in the order of every vector.
    pub fn joint_names(&self) -> &[String] {
        match self {
            Self::Cft(robot) => &robot.names,
            Self::SingleJoint(robot) => &robot.names,
            Self::Serial(robot) => robot.names(),
        }
    }

    /// Kind of joint i; on the CFT robot q1 slides and the others turn.
    pub fn joint_kind(&self, i: usize) -> JointKind {
        match self {
            Self::Cft(_) if i == 0 => JointKind::Prismatic,
            Self::Cft(_) => JointKind::Revolute,
            Self::SingleJoint(robot) => robot.kind,
            Self::Serial(robot) => robot.joint_kind(i),
        }
    }

    /// Full travel of joint i by Table 5 of the CFT robot's report: q1 by x_c4, q2 by x_c3, q4 and q5
    /// as x_c1 and x_c2 leave them \[m or rad\]. Of other robots only their files know it.
    pub fn full_travel(&self, i: usize) -> Option<f64> {
        match self {
            Self::Cft(robot) => {
                let spans = robot.setup.limits().spans();
                [spans[3], spans[2], 2.2, 1.7].get(i).copied()
            }
            Self::SingleJoint(_) | Self::Serial(_) => None,
        }
    }

    /// Unit of joint i's force or torque: "N" or "Nm".
    pub fn joint_unit(&self, i: usize) -> &'static str {
        self.joint_kind(i).torque_unit()
    }

    /// The inertial parameters, in the order of the regressor's columns.
    pub fn parameters(&self) -> &[ParameterInfo] {
        match self {
            Self::Cft(robot) => match robot.structure {
                Structure::Printed12 => &cft::EXTENDED[..cft::PRINTED],
                Structure::Full22 => &cft::EXTENDED,
            },
            Self::SingleJoint(robot) => match robot.kind {
                JointKind::Prismatic => &INERTIA_KG,
                JointKind::Revolute => &INERTIA_KG_M2,
            },
            Self::Serial(robot) => robot.parameters(),
        }
    }

    /// Torques at pose `there` of the motor forces that give `tau` at pose `here`: held motor
    /// forces turn into other joint torques as the arm moves (eq. (63)-(66)). Where motors act on
    /// the joints directly, and at a singular pose, `tau` itself.
    #[inline]
    pub fn carry_torque(&self, here: &[f64], there: &[f64], tau: &[f64], out: &mut [f64]) {
        out.copy_from_slice(tau);
        if let Self::Cft(_) = self
            && let Ok(forces) = cft::actuation::torques_to_forces(four(here), four(tau))
        {
            out.copy_from_slice(&cft::actuation::forces_to_torques(four(there), &forces));
        }
    }

    /// Whether the steps of the robot's encoders are known.
    pub fn knows_encoders(&self) -> bool {
        matches!(self, Self::Cft(_))
    }

    /// Rounds a pose as the encoders would whose grid is shifted by parts of a step per motor.
    /// Leaves the pose as it is where the encoders are not known or the pose is out of reach.
    pub fn round_at_encoders(&self, q: &mut [f64], shift: &[f64; 4]) {
        if let Self::Cft(_) = self {
            let mut x = cft::pantograph::cartesian(four(q));
            for ((x, step), shift) in x.iter_mut().zip(cft::actuation::ENCODER_SCALE).zip(shift) {
                *x = ((*x / step + shift).round() - shift) * step;
            }
            if let Ok(rounded) = cft::pantograph::joints(&x) {
                q.copy_from_slice(&rounded);
            }
        }
    }

    /// Variance of a position measured at the motors, seen at joint i, from the encoders' steps
    /// (resolution^2 / 12 each); pose-dependent on the CFT robot. `None` where the robot's
    /// encoders are not known.
    pub fn encoder_variance(&self, i: usize, q: &[f64]) -> Option<f64> {
        match self {
            Self::Cft(_) => {
                let steps = cft::actuation::quantisation_variance();
                cft::actuation::joint_covariance(four(q), &steps)
                    .ok()
                    .map(|c| c[i][i])
            }
            Self::SingleJoint(_) | Self::Serial(_) => None,
        }
    }

    /// Writes Y(q, v, a), n x p row-major, so that M a + C v + G = Y theta (eq. (26)). Does not
    /// allocate.
    ///
    /// # Panics
    /// Where q, v or a does not hold n numbers or y not n p: a mistake of the caller's code.
    #[inline]
    pub fn regressor(&self, q: &[f64], v: &[f64], a: &[f64], y: &mut [f64]) {
        match self {
            Self::Cft(robot) => {
                let (q, v, a) = (four(q), four(v), four(a));
                match robot.structure {
                    Structure::Printed12 => regressor12(q, v, a, rows(y)),
                    Structure::Full22 => regressor22(q, v, a, rows(y)),
                }
            }
            Self::SingleJoint(_) => {
                assert!(
                    q.len() == 1 && v.len() == 1 && y.len() == 1,
                    "one joint, one parameter"
                );
                y[0] = a[0];
            }
            Self::Serial(robot) => robot.regressor(q, v, a, y),
        }
    }
}

#[inline(always)]
fn four(x: &[f64]) -> &[f64; 4] {
    x.try_into().expect("the CFT robot has four joints")
}

#[inline(always)]
fn rows<const P: usize>(y: &mut [f64]) -> &mut [[f64; P]; 4] {
    let (rows, rest) = y.as_chunks_mut::<P>();
    assert!(rest.is_empty(), "the regressor has 4 rows of {P}");
    rows.try_into().expect("the regressor has 4 rows")
}
