//! Robot files: which machine, which friction law, how its logs are written, how they are filtered.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::document::is_default;
pub use super::limits::CoordinateLimits;
use super::limits::Limits;
use super::serial_section::{CouplingSection, FrameSection, LinkSection};
use cft_ident_core::robot::cft::{self, LaboratorySetup, ParameterStructure};
use cft_ident_core::robot::drive::JointDrive;
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::robot::{JointKind, Robot};
use cft_ident_logs::log::LogSection;

/// `[robot] model`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// The CFT transposer robot of the report.
    Cft,
    /// One prismatic or revolute joint.
    SingleJoint,
    /// Any tree of links on revolute and prismatic joints; a chain is one.
    Serial,
}

impl ModelKind {
    /// As it is written in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cft => "cft",
            Self::SingleJoint => "single-joint",
            Self::Serial => "serial",
        }
    }
}

/// `[robot]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotSection {
    /// Which model.
    pub model: ModelKind,
    /// Set-up of the CFT robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setup: Option<LaboratorySetup>,
    /// Inertial parameters of the CFT robot: 12 (the report) or 22 (the full chain).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<u32>,
    /// Joint name of a single joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Kind of a single joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<JointKind>,
    /// Acceleration of free fall in the base frame of a serial chain [m/s^2]; (0, 0, -9.81) where
    /// absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gravity: Option<[f64; 3]>,
    /// Whether each joint of a serial chain has a drive inertia; true where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_inertia: Option<bool>,
    /// URDF file of a serial chain, beside the robot file; it is read into `link`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub urdf: Option<String>,
    /// Link of the URDF where the chain ends; every branch is read where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip: Option<String>,
    /// Joints of the URDF that no log has and that stand still, and where \[m or rad\]: a stand, a rail, a torso. What
    /// they carry is fixed to the link before them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub held: BTreeMap<String, f64>,
    /// Angles and axes of a serial chain stay as they are written; where absent, one that is a rounded
    /// multiple of 15 degrees (1.5708, 0.785) is taken as that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angles_as_written: Option<bool>,
    /// Coupled gear trains of a serial chain.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coupling: Vec<CouplingSection>,
    /// Moving links of a serial chain, from the base outward.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub link: Vec<LinkSection>,
    /// Frames that are fixed to them and carry nothing, for exports.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frame: Vec<FrameSection>,
}

/// `[friction] law`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionLawKind {
    /// `Bv v + Bf1 tanh(w1 v) + Bf2 tanh(w2 v)`, eq. (18).
    DoubleTanh,
    /// `Fv v + Fc sgn(v)`.
    ViscousCoulomb,
}

impl FrictionLawKind {
    /// Names of its parameters.
    pub(super) fn names(self) -> &'static [&'static str] {
        match self {
            Self::DoubleTanh => &DoubleTanh::NAMES,
            Self::ViscousCoulomb => &ViscousCoulomb::NAMES,
        }
    }
}

/// Starting values of one joint's friction; the keys are those of the law.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionStart {
    /// Bv or Fv [N s/m or Nm s/rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub viscous: Option<f64>,
    /// Fc [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coulomb: Option<f64>,
    /// Bf1 [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coulomb_1: Option<f64>,
    /// Bf2 [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coulomb_2: Option<f64>,
    /// w1 [s/m or s/rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope_1: Option<f64>,
    /// w2 [s/m or s/rad], below `slope_1`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope_2: Option<f64>,
}

/// `[friction]`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionSection {
    /// The law; double-tanh for the CFT robot and viscous-coulomb for a single joint where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law: Option<FrictionLawKind>,
    /// `lsq` fits friction together with the inertias and needs no friction model.
    #[serde(default)]
    pub fitted_with_inertias: bool,
    /// A constant torque offset per joint is fitted with the inertias.
    #[serde(default)]
    pub offset: bool,
    /// Motors that turn several joints, by `gears` of [log], have Coulomb friction of their own, which is fitted with the
    /// inertias; where absent they have where friction is fitted so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motors: Option<bool>,
    /// Starting values by joint.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint: BTreeMap<String, FrictionStart>,
}

/// `[filter] kind`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FilterKind {
    /// Butterworth low-pass, forward and backward.
    Butterworth,
    /// Chebyshev I low-pass, forward and backward, as decimation functions use it.
    ChebyshevDecimate,
}

/// `[filter] differences`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DifferencesKind {
    /// Three-point central differences.
    Central,
    /// A longer stencil, exact to a higher order.
    HighOrder,
}

/// `[filter]`: how logs become rows; what is absent is chosen by the stage.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FilterSection {
    /// Kind of the parallel filter over torque and all columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<FilterKind>,
    /// Cut-off of the parallel filter [Hz].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cutoff_hz: Option<f64>,
    /// Order of the parallel filter, one pass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<u32>,
    /// Pass-band ripple of a Chebyshev filter, one pass [dB].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ripple_db: Option<f64>,
    /// Every how many samples a row is kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decimation: Option<u32>,
    /// Cut-off of the position filter, used only to differentiate [Hz]; left out, that of each joint is found from
    /// its logs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_cutoff_hz: Option<f64>,
    /// Order of the position filter, one pass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_order: Option<u32>,
    /// How positions are differentiated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub differences: Option<DifferencesKind>,
    /// What is cut off each end of a segment before the parallel filter, where the position filter
    /// has not settled [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_trim_s: Option<f64>,
    /// What is cut off each end of a segment after the parallel filter [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trim_s: Option<f64>,
    /// A step longer than this many sampling steps is a gap: nothing is differentiated across it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_factor: Option<f64>,
}

/// Noise of one joint, where the user overrides what is estimated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointNoise {
    /// Step of the position measurement [m or rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_resolution: Option<f64>,
    /// Standard deviation of the torque noise [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_std: Option<f64>,
}

/// `[noise]`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseSection {
    /// Overrides by joint.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint: BTreeMap<String, JointNoise>,
}

/// `[control]` of the simulator: u = kp (x_d - x) + kd (v_d - v) per actuator coordinate, saturated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlSection {
    /// Proportional gain per coordinate [V/m or V/rad]; one number for a single joint.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kp: Vec<f64>,
    /// Derivative gain per coordinate [V s/m or V s/rad].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kd: Vec<f64>,
    /// Corner frequency of the differenced position in the derivative part [Hz].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derivative_filter_hz: Option<f64>,
    /// Control and sampling rate [Hz].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Saturation of the amplifiers [V].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturation_v: Option<f64>,
}

/// `[sensors]` of the simulator.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorsSection {
    /// Positions are rounded to encoder counts (Table 5).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantisation: Option<bool>,
    /// Standard deviation of the noise on logged volts [V].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volt_noise: Option<f64>,
    /// Standard deviation of the noise on logged torques, by joint [N or Nm].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub torque_noise: Vec<f64>,
    /// The same as a fraction of the joint's torque rms; excludes `torque_noise`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_noise_relative: Option<f64>,
    /// Standard deviation of the sampling instants, as a fraction of the step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter: Option<f64>,
    /// Fraction of samples that are lost.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dropouts: Option<f64>,
    /// How warm the drives of joints are, by joint; their logs get a column of it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub temperature: BTreeMap<String, TemperatureCourse>,
}

/// Temperature of a simulated drive: start + rise (1 - exp(-t/T)), and back again in the second half of each cycle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TemperatureCourse {
    /// At the begin [degC].
    pub start: f64,
    /// By how much it would be warmer in the end [degC].
    pub rise: f64,
    /// Time constant T [s].
    pub time_constant_s: f64,
    /// Time after which it begins anew [s]: work in the first half, a pause in the second; work alone where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycle_s: Option<f64>,
}

/// A robot file. Every section but `[robot]` may be left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotFile {
    /// Which machine.
    pub robot: RobotSection,
    /// Friction law and starting values.
    #[serde(default, skip_serializing_if = "is_default")]
    pub friction: FrictionSection,
    /// How logs are written.
    #[serde(default, skip_serializing_if = "is_default")]
    pub log: LogSection,
    /// How logs are filtered.
    #[serde(default, skip_serializing_if = "is_default")]
    pub filter: FilterSection,
    /// Overrides of estimated noise.
    #[serde(default, skip_serializing_if = "is_default")]
    pub noise: NoiseSection,
    /// Limits by joint or actuator coordinate, and of points and links.
    #[serde(default, skip_serializing_if = "is_default")]
    pub limits: Limits,
    /// Drives by joint: what play and presliding it can have.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub drive: BTreeMap<String, JointDrive>,
    /// Controller of the simulator.
    #[serde(default, skip_serializing_if = "is_default")]
    pub control: ControlSection,
    /// Sensors of the simulator.
    #[serde(default, skip_serializing_if = "is_default")]
    pub sensors: SensorsSection,
    /// What was taken otherwise than it is written, one sentence each; commands tell it as warnings.
    #[serde(skip)]
    pub notes: ReadingNotes,
}

/// Sentences about the reading of a file. They are no part of what it says: two files that say the same
/// are equal, whatever was noted of them.
#[derive(Debug, Clone, Default)]
pub struct ReadingNotes(pub Vec<String>);

impl PartialEq for ReadingNotes {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl RobotFile {
    /// The physical model that the file describes.
    pub fn robot(&self) -> Robot {
        match self.robot.model {
            ModelKind::Cft => Robot::cft(
                self.robot.setup.unwrap_or_default(),
                match self.robot.parameters {
                    Some(22) => ParameterStructure::Full22,
                    _ => ParameterStructure::Printed12,
                },
            ),
            ModelKind::Serial if self.friction.motors == Some(true) => {
                let mut section = self.robot.clone();
                section.coupling.extend(self.trains());
                section.checked_serial()
            }
            ModelKind::Serial => self.robot.checked_serial(),
            ModelKind::SingleJoint => Robot::single_joint(
                self.robot.joint.as_deref().unwrap_or("q1"),
                self.robot.kind.unwrap_or(JointKind::Revolute),
            ),
        }
    }

    /// Says whether motors that turn several joints have friction, where the file does not.
    pub(super) fn settle_motors(&mut self) {
        let fitted = self.friction.fitted_with_inertias
            && self.friction_law() == FrictionLawKind::ViscousCoulomb
            && self.robot.model == ModelKind::Serial
            && self.robot.coupling.is_empty();
        if self.friction.motors.is_none() && fitted && !self.trains().is_empty() {
            self.friction.motors = Some(true);
        }
    }

    /// Motors that turn two joints.
    fn trains(&self) -> Vec<CouplingSection> {
        let names = self.robot.chain_joints();
        let train = |(row, ratios): (usize, &Vec<f64>)| {
            let mut turned = (0..ratios.len()).filter(|j| ratios[*j] != 0.0);
            let (Some(a), Some(b), None) = (turned.next(), turned.next(), turned.next()) else {
                return None;
            };
            let (motor, other) = if b == row { (b, a) } else { (a, b) };
            Some(CouplingSection {
                motor: names.get(motor)?.clone(),
                other: names.get(other)?.clone(),
                ratio: ratios[other] / ratios[motor],
            })
        };
        let rows = self.log.gears.iter().enumerate();
        rows.filter_map(train).collect()
    }

    /// Joint names in the order of every vector.
    pub fn joint_names(&self) -> Vec<String> {
        match self.robot.model {
            ModelKind::Serial => self.robot.chain_joints(),
            _ => self.robot().joint_names().to_vec(),
        }
    }

    /// Whether an independent joint turns or slides. The chain of a serial robot is not built for it, and its
    /// base parameters are not looked for.
    pub fn joint_kind(&self, joint: usize) -> JointKind {
        match self.robot.model {
            ModelKind::Serial => self.robot.chain_kind(joint),
            _ => self.robot().joint_kind(joint),
        }
    }

    /// Joint names, and the actuator coordinates of the CFT robot.
    pub fn coordinate_names(&self) -> Vec<String> {
        let mut names = self.joint_names();
        if self.robot.model == ModelKind::Cft {
            names.extend(cft::COORDINATES.map(str::to_owned));
        }
        names
    }

    /// Whether the direction of gravity is the file's to declare.
    pub fn declares_gravity(&self) -> bool {
        self.robot.model == ModelKind::Serial
    }

    /// Whether the torques need friction that only `friction` can find before the inertias are fitted: the
    /// report's law, which is not linear in its slopes, on the report's robot.
    pub fn needs_friction_first(&self) -> bool {
        self.robot.model == ModelKind::Cft
            && !self.friction.fitted_with_inertias
            && self.friction_law() == FrictionLawKind::DoubleTanh
    }

    /// The friction law: the declared one, or the model's own.
    pub fn friction_law(&self) -> FrictionLawKind {
        self.friction.law.unwrap_or(match self.robot.model {
            ModelKind::Cft => FrictionLawKind::DoubleTanh,
            ModelKind::SingleJoint | ModelKind::Serial => FrictionLawKind::ViscousCoulomb,
        })
    }
}
