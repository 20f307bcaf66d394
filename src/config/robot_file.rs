//! Robot files: which machine, which friction law, how its logs are written, how they are filtered.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// `[robot] model`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// The CFT transposer robot of the report.
    Cft,
    /// One prismatic or revolute joint.
    SingleJoint,
    /// An open chain: not built yet.
    Serial,
}

/// `[robot] setup` of the CFT robot (Table 6 and Remark 5 of the report).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SetupKind {
    /// TUeDACS.
    Tuedacs,
    /// dSPACE.
    Dspace,
}

/// `[robot] kind` of a single joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JointKind {
    /// Position in m, torque channel in N.
    Prismatic,
    /// Position in rad, torque channel in Nm.
    Revolute,
}

/// `[robot]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotSection {
    /// Which model.
    pub model: ModelKind,
    /// Set-up of the CFT robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setup: Option<SetupKind>,
    /// Inertial parameters of the CFT robot: 12 (the report) or 22 (the full chain).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<u32>,
    /// Joint name of a single joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Kind of a single joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<JointKind>,
}

/// `[friction] law`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionLawKind {
    /// `Bv v + Bf1 tanh(w1 v) + Bf2 tanh(w2 v)`, eq. (18).
    DoubleTanh,
    /// `Fv v + Fc sgn(v)`.
    ViscousCoulomb,
}

/// Starting values of one joint's friction; the keys are those of the law.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    /// Starting values by joint.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint: BTreeMap<String, FrictionStart>,
}

/// Unit of a logged position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PositionUnit {
    /// Metre.
    #[serde(rename = "m")]
    Metre,
    /// Millimetre.
    #[serde(rename = "mm")]
    Millimetre,
    /// Radian.
    #[serde(rename = "rad")]
    Radian,
    /// Degree.
    #[serde(rename = "deg")]
    Degree,
    /// Encoder counts of the CFT robot (Table 5), actuator coordinates only.
    #[serde(rename = "counts")]
    Counts,
}

/// Unit of a logged torque or force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum TorqueUnit {
    /// Newton.
    #[serde(rename = "N")]
    Newton,
    /// Newton metre.
    #[serde(rename = "Nm")]
    NewtonMetre,
    /// Ampere of motor current, kept as such: the model is then in A.
    #[serde(rename = "A")]
    Ampere,
    /// Volt at the amplifier.
    #[serde(rename = "V")]
    Volt,
}

/// What the torque channel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TorqueIs {
    /// Torque at the joint.
    Joint,
    /// Torque at the motor.
    Motor,
    /// Motor current.
    Current,
    /// Commanded, not measured.
    Commanded,
}

/// Unit of the time column.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum TimeUnit {
    /// Second.
    #[default]
    #[serde(rename = "s")]
    Second,
    /// Millisecond.
    #[serde(rename = "ms")]
    Millisecond,
    /// Microsecond.
    #[serde(rename = "us")]
    Microsecond,
    /// Nanosecond.
    #[serde(rename = "ns")]
    Nanosecond,
}

/// What parts the columns of a text log.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DelimiterKind {
    /// Found from the header line.
    #[default]
    Auto,
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// Tabulator.
    Tab,
    /// One or more spaces.
    Space,
}

/// Which channels of a log are read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelsKind {
    /// Joint channels where the log has them, else actuator channels.
    #[default]
    Auto,
    /// `q_<joint>`, `tau_<joint>`.
    Joint,
    /// `x_c1..x_c4`, `u_1..u_4` of the CFT robot.
    Actuator,
}

/// `[log.joint.NAME]`: SI value = sign x scale x unit x logged value + offset.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointChannels {
    /// Column of the position; `q_NAME` where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<String>,
    /// Unit of the position column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_unit: Option<PositionUnit>,
    /// 1 or -1; holds for the velocity too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_sign: Option<f64>,
    /// Factor, e.g. a gear ratio; holds for the velocity too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_scale: Option<f64>,
    /// Offset added after scaling [m or rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_offset: Option<f64>,
    /// Column of the velocity; `dq_NAME` where absent, and then optional.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<String>,
    /// Column of the torque; `tau_NAME` where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque: Option<String>,
    /// Unit of the torque column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_unit: Option<TorqueUnit>,
    /// 1 or -1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_sign: Option<f64>,
    /// Factor, e.g. torque constant times gear ratio.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_scale: Option<f64>,
    /// Offset added after scaling [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_offset: Option<f64>,
}

/// `[log.actuator.x_c1]`..: raw channels of the CFT robot.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuatorChannels {
    /// Column of the position; `x_c1`.. where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<String>,
    /// Unit of the position: SI where absent, or `counts` (Table 5).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_unit: Option<PositionUnit>,
    /// 1 or -1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_sign: Option<f64>,
    /// Homing offset: the coordinate where the encoder reads 0 [m or rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub home: Option<f64>,
    /// Column of the volts; `u_1`.. where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volts: Option<String>,
    /// 1 or -1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volts_sign: Option<f64>,
}

/// `[log]`: how the logs of this machine are written.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogSection {
    /// Column of the time; `t` where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// Unit of the time column.
    #[serde(default)]
    pub time_unit: TimeUnit,
    /// What parts the columns.
    #[serde(default)]
    pub delimiter: DelimiterKind,
    /// Joint or actuator channels.
    #[serde(default)]
    pub channels: ChannelsKind,
    /// What the torque channel is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_is: Option<TorqueIs>,
    /// The logged torque (or volt) was held from its own sample to the next.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_held: Option<bool>,
    /// Columns by joint.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint: BTreeMap<String, JointChannels>,
    /// Raw columns by actuator coordinate.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub actuator: BTreeMap<String, ActuatorChannels>,
}

/// `[filter] kind`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FilterKind {
    /// Butterworth low-pass, forward and backward.
    Butterworth,
    /// Chebyshev I low-pass, forward and backward, as decimation functions use it.
    ChebyshevDecimate,
}

/// `[filter] differences`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DifferencesKind {
    /// Three-point central differences.
    Central,
    /// A longer stencil, exact to a higher order.
    HighOrder,
}

/// `[filter]`: how logs become rows; what is absent is chosen by the stage.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    /// Cut-off of the position filter, used only to differentiate [Hz].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_cutoff_hz: Option<f64>,
    /// Order of the position filter, one pass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_order: Option<u32>,
    /// How positions are differentiated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub differences: Option<DifferencesKind>,
    /// What is cut off each end of a segment after filtering [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trim_s: Option<f64>,
}

/// Noise of one joint, where the user overrides what is estimated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseSection {
    /// Overrides by joint.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint: BTreeMap<String, JointNoise>,
}

/// `[limits.NAME]` of a joint or an actuator coordinate.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoordinateLimits {
    /// Lower and upper end [m or rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 2]>,
    /// Largest speed [m/s or rad/s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    /// Largest acceleration [m/s^2 or rad/s^2].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<f64>,
    /// Largest torque [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque: Option<f64>,
    /// Largest voltage [V].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volts: Option<f64>,
}

/// `[control]` of the simulator: u = kp (x_d - x) + kd (v_d - v) per actuator coordinate, saturated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControlSection {
    /// Proportional gain per coordinate [V/m or V/rad]; one number for a single joint.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kp: Vec<f64>,
    /// Derivative gain per coordinate [V s/m or V s/rad].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kd: Vec<f64>,
    /// Control and sampling rate [Hz].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Saturation of the amplifiers [V].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturation_v: Option<f64>,
}

/// `[sensors]` of the simulator.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorsSection {
    /// Positions are rounded to encoder counts (Table 5).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantisation: Option<bool>,
    /// Standard deviation of the noise on logged volts [V].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volt_noise: Option<f64>,
    /// Standard deviation of the noise on logged torques [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_noise: Option<f64>,
    /// The same as a fraction of the joint's torque rms; excludes `torque_noise`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_noise_relative: Option<f64>,
    /// Standard deviation of the sampling instants, as a fraction of the step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter: Option<f64>,
    /// Fraction of samples that are lost.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dropouts: Option<f64>,
}

/// A robot file. Every section but `[robot]` may be left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotFile {
    /// Which machine.
    pub robot: RobotSection,
    /// Friction law and starting values.
    #[serde(default)]
    pub friction: FrictionSection,
    /// How logs are written.
    #[serde(default)]
    pub log: LogSection,
    /// How logs are filtered.
    #[serde(default)]
    pub filter: FilterSection,
    /// Overrides of estimated noise.
    #[serde(default)]
    pub noise: NoiseSection,
    /// Limits by joint or actuator coordinate.
    #[serde(default)]
    pub limits: BTreeMap<String, CoordinateLimits>,
    /// Controller of the simulator.
    #[serde(default)]
    pub control: ControlSection,
    /// Sensors of the simulator.
    #[serde(default)]
    pub sensors: SensorsSection,
}

/// Joint names of the CFT robot, in the order of every vector.
pub const CFT_JOINTS: [&str; 4] = ["q1", "q2", "q4", "q5"];

impl RobotFile {
    /// Joint names in the order of every vector.
    pub fn joint_names(&self) -> Vec<String> {
        match self.robot.model {
            ModelKind::Cft => CFT_JOINTS.map(str::to_owned).to_vec(),
            ModelKind::SingleJoint | ModelKind::Serial => {
                vec![self.robot.joint.clone().unwrap_or_else(|| "q1".to_owned())]
            }
        }
    }

    /// The friction law: the declared one, or the model's own.
    pub fn friction_law(&self) -> FrictionLawKind {
        self.friction.law.unwrap_or(match self.robot.model {
            ModelKind::Cft => FrictionLawKind::DoubleTanh,
            ModelKind::SingleJoint | ModelKind::Serial => FrictionLawKind::ViscousCoulomb,
        })
    }
}
