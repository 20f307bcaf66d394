//! The `[log]` section of a robot file: how the logs of a machine are written.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};

use super::unit::{PositionUnit, TorqueUnit};

/// What the torque channel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
    /// Minute.
    #[serde(rename = "min")]
    Minute,
    /// Hour.
    #[serde(rename = "h")]
    Hour,
    /// Day, as MATLAB and spreadsheets count time.
    #[serde(rename = "d")]
    Day,
}

impl TimeUnit {
    /// The unit that a header states: `ms`, `msec`, `milliseconds`.
    pub(super) fn stated(text: &str) -> Option<Self> {
        Some(match &*text.trim().to_lowercase() {
            "s" | "sec" | "second" | "seconds" => Self::Second,
            "ms" | "msec" | "millisecond" | "milliseconds" => Self::Millisecond,
            "us" | "µs" | "μs" | "usec" | "microsecond" | "microseconds" => Self::Microsecond,
            "ns" | "nsec" | "nanosecond" | "nanoseconds" => Self::Nanosecond,
            "min" | "minute" | "minutes" => Self::Minute,
            "h" | "hour" | "hours" => Self::Hour,
            "d" | "day" | "days" => Self::Day,
            _ => return None,
        })
    }

    /// The unit that the name of a column ends with: `time_ms`.
    pub(super) fn of_suffix(name: &str) -> Option<Self> {
        Self::stated(name.rsplit_once('_')?.1)
    }

    /// As it is written in files, and seconds in one of it.
    pub(crate) const fn in_seconds(self) -> (&'static str, f64) {
        match self {
            Self::Second => ("s", 1.0),
            Self::Millisecond => ("ms", 1e-3),
            Self::Microsecond => ("us", 1e-6),
            Self::Nanosecond => ("ns", 1e-9),
            Self::Minute => ("min", 60.0),
            Self::Hour => ("h", 3600.0),
            Self::Day => ("d", 86_400.0),
        }
    }
}

/// A kind of finding about rows of a log, for which a fit would leave them out or mend them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RowFault {
    /// Single rows far off their neighbours: bridged.
    Spike,
    /// A channel that stands still while what it measures does not: left out.
    StuckChannel,
    /// Flat tops of a torque: left out.
    Saturation,
    /// Flat tops of a position: left out.
    Clipping,
    /// Rows that show the positions of the row before while the robot moves: left out.
    RepeatedRows,
    /// A log whose rows hold each sample for several rows: only the fresh ones are used.
    SampleAndHold,
    /// A leap of a position that no drive can make: the log is parted there.
    PositionStep,
    /// A position that begins anew after its range: followed through its turns.
    WrappedEncoder,
    /// All channels frozen for a while: left out.
    Stall,
}

/// What parts the columns of a text log.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Delimiter")]
pub enum ColumnDelimiter {
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelChoice {
    /// Joint channels where the log has them, else actuator channels.
    #[default]
    Auto,
    /// `q_<joint>`, `tau_<joint>`.
    Joint,
    /// `x_c1..x_c4`, `u_1..u_4` of the CFT robot.
    Actuator,
}

/// Which time of a message is the time of its row.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Stamp")]
pub enum StampSource {
    /// The field that `time` names, else the header's stamp, else the time of recording.
    #[default]
    Auto,
    /// The stamp in the message's header.
    Header,
    /// When the message was recorded.
    Log,
    /// When the message was published.
    Publish,
}

/// `[log.joint.NAME]`: SI value = sign x scale x unit x logged value + offset.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointChannels {
    /// Name of the joint in messages that list their joints by name; NAME where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Column of the position, by name or by number from 1, or field of a message; `q_NAME` where
    /// absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<ColumnName>,
    /// Unit of the position column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_unit: Option<PositionUnit>,
    /// 1 or -1; holds for the velocity too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_sign: Option<f64>,
    /// Factor, e.g. the inverse of a gear ratio, or m or rad per count; holds for the velocity too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_scale: Option<f64>,
    /// Offset added after scaling [m or rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_offset: Option<f64>,
    /// Range after which the logged position begins anew, in the unit of its column: 360 for an encoder
    /// of one turn in degrees, 4096 for one in counts. The position is followed through its turns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrap: Option<f64>,
    /// Column of the velocity; `dq_NAME` where absent, and then optional.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<ColumnName>,
    /// Column of the position that the controller was asked for, in the unit, sign and scale of the
    /// position; `lsq --estimator iv` simulates along it where every joint has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<ColumnName>,
    /// Column of the temperature of the joint's drive \[degC\]; a signal of formulas and of what is left of a
    /// residual. No temperature is read where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature: Option<ColumnName>,
    /// Column of the torque; `tau_NAME` where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque: Option<ColumnName>,
    /// Unit of the torque column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_unit: Option<TorqueUnit>,
    /// 1 or -1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_sign: Option<f64>,
    /// Factor, e.g. torque constant times gear ratio.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_scale: Option<f64>,
    /// Range after which the logged torque begins anew, in the unit of its column: 65536 for signed numbers of 16 bits
    /// that are logged as unsigned ones, or with another word above them. The number nearest to 0 is taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_wrap: Option<f64>,
    /// Offset added after scaling [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_offset: Option<f64>,
    /// Largest torque that the drive delivers, where the column is what it was asked for [N or Nm]: rows in which it
    /// was asked for more are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_limit: Option<f64>,
}

/// `[log.actuator.x_c1]`..: raw channels of the CFT robot.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ActuatorChannels {
    /// Column of the position; `x_c1`.. where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<ColumnName>,
    /// Unit of the position: SI where absent, or `counts` (Table 5).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_unit: Option<PositionUnit>,
    /// 1 or -1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_sign: Option<f64>,
    /// What the column is multiplied with beside its unit, 1 where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_scale: Option<f64>,
    /// Homing offset: the coordinate where the encoder reads 0 [m or rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub home: Option<f64>,
    /// Range after which the logged position begins anew, in the unit of its column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrap: Option<f64>,
    /// Column of the volts; `u_1`.. where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volts: Option<ColumnName>,
    /// 1 or -1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volts_sign: Option<f64>,
    /// Volts per unit of the column, 1 where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volts_scale: Option<f64>,
}

/// `[log] torque`: the torque that a controller of positions asked of a torque drive, kp (command - q) +
/// kd (velocity_command - dq) + feed_forward.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControllerTorque {
    /// Stiffness and damping, `[kp, kd]` \[Nm/rad, Nm s/rad or N/m, N s/m\]: one pair for all joints, or one of each.
    pub pd: ControllerGains,
    /// Column of the commanded position, in the unit, sign and scale of the position. `reference` of
    /// `[log.joint.NAME]` where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command: Option<ColumnsOfJoints>,
    /// Column of the commanded velocity, written as that of the position; 0 where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity_command: Option<ColumnsOfJoints>,
    /// Column of the torque that the controller adds \[N or Nm\], in the sign of the position; none where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_forward: Option<ColumnsOfJoints>,
}

/// What a controller may be asked for beside a position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FurtherCommand {
    Velocity,
    Torque,
}

impl FurtherCommand {
    /// In the order in which they stand behind the commands of the positions.
    pub const ALL: [Self; 2] = [Self::Velocity, Self::Torque];

    /// The key in `[log] torque` that names its columns.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Velocity => "velocity_command",
            Self::Torque => "feed_forward",
        }
    }
}

impl ControllerTorque {
    /// The columns of a command beside that of the position, where the file names them.
    pub fn columns_of(&self, command: FurtherCommand) -> Option<&ColumnsOfJoints> {
        match command {
            FurtherCommand::Velocity => self.velocity_command.as_ref(),
            FurtherCommand::Torque => self.feed_forward.as_ref(),
        }
    }
}

/// A column for each joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ColumnsOfJoints {
    /// One name, in which `{joint}` stands for the name of the joint.
    Pattern(String),
    /// The names, in the order of the joints.
    OfEach(Vec<String>),
}

impl ColumnsOfJoints {
    /// What stands in a pattern for the name of the joint.
    pub const JOINT: &str = "{joint}";

    /// The column of a joint, by its place and its name; empty where there is none.
    pub fn of(&self, place: usize, joint: &str) -> String {
        match self {
            Self::Pattern(pattern) => pattern.replace(Self::JOINT, joint),
            Self::OfEach(names) => names.get(place).cloned().unwrap_or_default(),
        }
    }

    /// Whether it has one column for each of so many joints.
    pub fn fits(&self, joints: usize) -> bool {
        match self {
            Self::Pattern(pattern) => joints == 1 || pattern.contains(Self::JOINT),
            Self::OfEach(names) => names.len() == joints,
        }
    }
}

/// Stiffness and damping.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ControllerGains {
    OfAll([f64; 2]),
    OfEach(Vec<[f64; 2]>),
}

impl ControllerGains {
    /// Of each of so many joints; none where another number of pairs is given.
    pub fn of(&self, joints: usize) -> Option<Vec<[f64; 2]>> {
        match self {
            Self::OfAll(pair) => Some(vec![*pair; joints]),
            Self::OfEach(pairs) => (pairs.len() == joints).then(|| pairs.clone()),
        }
    }
}

/// `[log] sign`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TorqueSign {
    /// From the side on which a held joint hangs off its command (`reference` in `[log.joint]`).
    Hang,
}

/// `[log]`: how the logs of this machine are written.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogSection {
    /// Column of the time, or field of a message; `t` where absent. A column of whole seconds with one of their
    /// nanoseconds, milli- or microseconds beside it, `["sec", "nanosec"]`, is one clock.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<ColumnName>,
    /// Unit of the time column; where absent the header's, else by the size of the numbers and of
    /// their steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_unit: Option<TimeUnit>,
    /// Rate of a text log that has no column of times [Hz]: its rows lie evenly, the first at 0. Messages of a
    /// recording are put on an even clock of this rate, lost ones left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Kinds of findings about rows that are reported but not acted upon: the rows stay in a fit as they
    /// were logged.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep: Vec<RowFault>,
    /// What parts the columns.
    #[serde(default, skip_serializing_if = "is_default")]
    pub delimiter: ColumnDelimiter,
    /// Line of a text log that names its columns, from 1; found where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub header_line: Option<u64>,
    /// Topic of a recording that holds the positions; found where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub topic: Option<String>,
    /// Topic of the torques, where they have one of their own; found where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_topic: Option<String>,
    /// Topic of the temperatures; found where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_topic: Option<String>,
    /// Which time of a message counts.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stamp: StampSource,
    /// Time by which torques lag behind the positions [s]; it is taken off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_delay_s: Option<f64>,
    /// Joint or actuator channels.
    #[serde(default, skip_serializing_if = "is_default")]
    pub channels: ChannelChoice,
    /// What the torque channel is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_is: Option<TorqueIs>,
    /// Torques are those that a controller asked for, and not a column of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque: Option<ControllerTorque>,
    /// Where the sign of torques or currents comes from, whose channels hold their size alone: `lsq --static` takes it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sign: Option<TorqueSign>,
    /// `torque_scale` of the joints is right but for one factor that all have in common, as `lsq
    /// --fit-gains` finds it without a payload: the model stays in the unit of the channels.
    #[serde(default, skip_serializing_if = "is_default")]
    pub relative_gains: bool,
    /// The logged torque (or volt) was held from its own sample to the next.
    #[serde(rename = "torque_held", skip_serializing_if = "Option::is_none")]
    pub zero_order_hold: Option<bool>,
    /// Rows of the matrix R of coupled gears, p = R q, where the log is of the motors' side:
    /// q = R^-1 p + offset, tau = R' c.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gears: Vec<Vec<f64>>,
    /// Columns by joint.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint: BTreeMap<String, JointChannels>,
    /// Raw columns by actuator coordinate.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub actuator: BTreeMap<String, ActuatorChannels>,
}

/// A column by its name, or by its number from 1: `3` is kept as `#3`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnName(pub String);

impl<'de> Deserialize<'de> for ColumnName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NameOrNumber)
    }
}

impl JsonSchema for ColumnName {
    fn schema_name() -> Cow<'static, str> {
        "NameOrNumber".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"type": "string"},
            {"type": "integer", "format": "uint32", "minimum": 0},
            {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2},
        ]})
    }
}

struct NameOrNumber;

impl<'de> Visitor<'de> for NameOrNumber {
    type Value = ColumnName;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a column, or its number from 1")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<ColumnName, E> {
        Ok(ColumnName(name.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<ColumnName, A::Error> {
        let mut names: Vec<String> = Vec::new();
        while let Some(name) = seq.next_element()? {
            names.push(name);
        }
        match names.len() {
            2 => Ok(ColumnName(names.join("+"))),
            n => Err(A::Error::custom(format!(
                "{n} columns; a clock has two at most: seconds and their nanoseconds"
            ))),
        }
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<ColumnName, E> {
        if number < 1 {
            return Err(E::custom(format!(
                "columns are numbered from 1, not {number}"
            )));
        }
        Ok(ColumnName(format!("#{number}")))
    }
}

/// What is as where it is not written, is not written.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
