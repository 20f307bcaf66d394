//! Where the channels of a robot stand in a log, and how a logged number becomes an SI number.

use std::fmt;
use std::sync::Arc;

use super::section::{ColumnName, LogSection};

/// One channel: SI value = `factor` x logged number + `offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Name of the column; `#3` is the third one, whatever its name.
    pub column: String,
    /// Unit of the logged number, as a header may state it: `rad`, `deg`, `m`, `N`, ...
    pub unit: String,
    /// SI per logged unit, sign included.
    pub factor: f64,
    /// Offset in SI.
    pub offset: f64,
    /// Range after which the logged number begins anew [SI].
    pub wrap: Option<f64>,
    /// The key of the robot file that names this column; absent for a name of the contract.
    pub key: Option<String>,
    /// Whether the robot file states the unit of the logged number, or a scale for it.
    pub unit_is_said: bool,
    /// The scale that it states beside the unit, 1 where there is none.
    pub scale: f64,
}

impl Channel {
    /// A channel that is logged in `unit`, an SI unit, under its contract name.
    pub fn si(column: impl Into<String>, unit: &str) -> Self {
        Self {
            column: column.into(),
            unit: unit.to_owned(),
            factor: 1.0,
            offset: 0.0,
            wrap: None,
            key: None,
            unit_is_said: false,
            scale: 1.0,
        }
    }

    /// The same with what the robot file says of its unit and of its scale.
    pub fn said(mut self, unit: bool, scale: Option<f64>) -> Self {
        self.unit_is_said = unit || scale.is_some();
        self.scale = scale.unwrap_or(1.0);
        self
    }
}

impl LogSection {
    /// Which column is the time, and how it becomes seconds.
    pub fn time_channel(&self) -> Channel {
        let (unit, factor) = self.time_unit.unwrap_or_default().in_seconds();
        let time = || "[log] time".to_owned();
        channel(&self.time, "t".to_owned(), unit, [factor, 0.0], time)
    }
}

/// A channel by the column that the file names under `key`, else by the name of the contract; SI value =
/// `gain[0]` x logged number + `gain[1]`.
pub fn channel(
    named: &Option<ColumnName>,
    contract: String,
    unit: &str,
    [factor, offset]: [f64; 2],
    key: impl Fn() -> String,
) -> Channel {
    Channel {
        factor,
        offset,
        key: named.as_ref().map(|_| key()),
        ..Channel::si(named.as_ref().map_or(contract, |name| name.0.clone()), unit)
    }
}

/// What the position and torque channels of a layout are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeclaredChannels {
    /// Joint positions and joint torques.
    Joint,
    /// Actuator positions x_c1..x_c4 and volts u_1..u_4 of the CFT robot.
    Actuator,
}

/// Turns a row into that of the joints, in place; false, and as it was, where it belongs to no pose of the robot.
type RowMap = dyn Fn(&mut [f64], &mut [f64], &mut [f64]) -> bool + Send + Sync;

/// A conversion that the reader applies to every row, so that its blocks are joint-side.
#[derive(Clone)]
pub struct RowConversion(Arc<RowMap>);

impl RowConversion {
    /// Wraps a map of one row `(positions, torques, velocities)`; torques and velocities are empty
    /// where the log has none.
    pub fn new(
        map: impl Fn(&mut [f64], &mut [f64], &mut [f64]) -> bool + Send + Sync + 'static,
    ) -> Self {
        Self(Arc::new(map))
    }

    /// Applies it to one row; false where the row has no image.
    pub fn apply(
        &self,
        positions: &mut [f64],
        torques: &mut [f64],
        velocities: &mut [f64],
    ) -> bool {
        (self.0)(positions, torques, velocities)
    }
}

impl PartialEq for RowConversion {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl fmt::Debug for RowConversion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Conversion")
    }
}

/// Which columns are read.
///
/// In recordings of messages a channel's column is the path of a field (`a.b[2]`, `/a/b/2`). Where a
/// message has no such field, the channel is looked for as `position`, `velocity` or `effort` of the
/// joint that the list `name` holds, as in `sensor_msgs/msg/JointState`.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Names of the joints (or actuator coordinates), for messages.
    pub joints: Vec<String>,
    /// Time; its factor gives seconds.
    pub time: Channel,
    /// Positions in joint order.
    pub positions: Vec<Channel>,
    /// Torques in joint order; empty: the log need not have any and the blocks have none. Behind one of each joint
    /// may stand more of which the conversion makes those, as [`Layout::joint_of`] says.
    pub torques: Vec<Channel>,
    /// Velocities in joint order; read only where the log has all of them.
    pub velocities: Vec<Channel>,
    /// What positions and torques are.
    pub channels: DeclaredChannels,
    /// Applied to every row.
    pub conversion: Option<RowConversion>,
    /// A torque holds from its row, or from its message, to the next; else it is interpolated where
    /// messages of an own topic have it.
    pub zero_order_hold: bool,
    /// How the logs are written: delimiter, topics, stamps, names of joints in messages.
    pub section: LogSection,
    /// What stands in the places of positions are temperatures.
    pub temperatures: bool,
    /// Layout to use instead where the log has none of this layout's positions.
    pub otherwise: Option<Box<Layout>>,
}

impl Layout {
    /// The contract's joint channels: `t`, `q_<joint>`, `tau_<joint>`, optional `dq_<joint>`, all SI.
    pub fn joint_columns(joints: &[impl AsRef<str>]) -> Self {
        let joints: Vec<String> = joints.iter().map(|j| j.as_ref().to_owned()).collect();
        let each = |prefix: &str| {
            let channel = |joint| Channel::si(format!("{prefix}{joint}"), "");
            joints.iter().map(channel).collect()
        };
        Self {
            time: Channel::si("t", "s"),
            positions: each("q_"),
            torques: each("tau_"),
            velocities: each("dq_"),
            joints,
            channels: DeclaredChannels::Joint,
            conversion: None,
            zero_order_hold: false,
            section: LogSection::default(),
            temperatures: false,
            otherwise: None,
        }
    }

    /// Largest torque that the drive of a joint delivers, where the robot file says so.
    pub fn torque_limit(&self, joint: &str) -> Option<f64> {
        self.section.joint.get(joint)?.torque_limit
    }

    /// Place of the joint that a channel is of, by its place among those of its kind: behind one of each joint stand
    /// the further commands of a controller's law, each kind in joint order again.
    pub fn joint_of(&self, place: usize) -> usize {
        place % self.joints.len().max(1)
    }

    /// What its positions are, in words.
    pub(super) fn what(&self) -> &'static str {
        match self.temperatures {
            true => "temperature",
            false => "position",
        }
    }

    /// Name of a joint in messages that list their joints by name.
    pub(super) fn name_in_messages(&self, joint: usize) -> Option<&str> {
        let joint = self.joints.get(joint)?;
        let named = self.section.joint.get(joint);
        Some(named.and_then(|c| c.name.as_deref()).unwrap_or(joint))
    }

    /// Whether any column is given by its number (`#1`, `#2`, ...), as a log without a header needs.
    pub(super) fn by_number(&self) -> bool {
        let channels = self.positions.iter().chain(&self.torques);
        let mut channels = channels.chain([&self.time]);
        channels.any(|channel| column_number(&channel.column).is_some())
    }

    /// The same layout with the conversions that `declared` has for these channels.
    pub(super) fn converted_as(mut self, declared: &Self) -> Self {
        let other = declared.otherwise.as_deref();
        let of = [Some(declared), other].into_iter().flatten();
        if let Some(of) = of.into_iter().find(|of| of.channels == self.channels) {
            self.conversion = of.conversion.clone();
            self.otherwise = of.otherwise.clone();
        }
        self
    }

    /// The same layout without its conversions: blocks hold what was logged, in SI units.
    pub fn as_logged(mut self) -> Self {
        self.conversion = None;
        self.otherwise = self.otherwise.map(|other| Box::new(other.as_logged()));
        self
    }

    /// The same layout for a log that need not hold torques: blocks then have an empty `tau`.
    ///
    /// For a trajectory of positions whose torque is asked for.
    pub fn without_torques(mut self) -> Self {
        self.torques.clear();
        let other = self.otherwise;
        self.otherwise = other.map(|other| Box::new(other.without_torques()));
        self
    }
}

/// Index of the column that `#1`, `#2`, ... stands for.
pub(super) fn column_number(column: &str) -> Option<usize> {
    let number: usize = column.strip_prefix('#')?.parse().ok()?;
    number.checked_sub(1)
}
