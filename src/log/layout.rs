//! Where the channels of a robot stand in a log, and how a logged number becomes an SI number.

use std::fmt;
use std::sync::Arc;

/// One channel: SI value = `factor` x logged number + `offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Name of the column.
    pub column: String,
    /// Unit of the logged number, as a header may state it: `rad`, `deg`, `m`, `N`, ...
    pub unit: String,
    /// SI per logged unit, sign included.
    pub factor: f64,
    /// Offset in SI.
    pub offset: f64,
    /// The key of the robot file that names this column; absent for a name of the contract.
    pub key: Option<String>,
}

impl Channel {
    /// A channel that is logged in `unit`, an SI unit, under its contract name.
    pub fn si(column: impl Into<String>, unit: &str) -> Self {
        Self {
            column: column.into(),
            unit: unit.to_owned(),
            factor: 1.0,
            offset: 0.0,
            key: None,
        }
    }
}

/// What parts the columns of a text log.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Delimiter {
    /// Found from the header line.
    #[default]
    Auto,
    /// One byte: comma, semicolon or tabulator.
    Byte(u8),
    /// One or more spaces.
    Spaces,
}

/// What the position and torque channels of a layout are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// Joint positions and joint torques.
    Joint,
    /// Actuator positions x_c1..x_c4 and volts u_1..u_4 of the CFT robot.
    Actuator,
}

/// Turns one row of actuator positions and volts into joint positions and torques, in place.
///
/// Returns false where the actuator position belongs to no pose of the robot.
type RowMap = dyn Fn(&mut [f64], &mut [f64]) -> bool + Send + Sync;

/// A conversion that the reader applies to every row, so that its blocks are joint-side.
#[derive(Clone)]
pub struct Conversion(Arc<RowMap>);

impl Conversion {
    /// Wraps a map of one row `(positions, torques)`.
    pub fn new(map: impl Fn(&mut [f64], &mut [f64]) -> bool + Send + Sync + 'static) -> Self {
        Self(Arc::new(map))
    }

    /// Applies it to one row; false where the row has no image.
    pub fn apply(&self, positions: &mut [f64], torques: &mut [f64]) -> bool {
        (self.0)(positions, torques)
    }
}

impl fmt::Debug for Conversion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Conversion")
    }
}

/// Which columns are read.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Names of the joints (or actuator coordinates), for messages.
    pub joints: Vec<String>,
    /// Time; its factor gives seconds.
    pub time: Channel,
    /// Positions in joint order.
    pub positions: Vec<Channel>,
    /// Torques in joint order; empty: the log need not have any and the blocks have none.
    pub torques: Vec<Channel>,
    /// Velocities in joint order; read only where the log has all of them.
    pub velocities: Vec<Channel>,
    /// What positions and torques are.
    pub channels: Channels,
    /// Applied to every row.
    pub conversion: Option<Conversion>,
    /// What parts the columns.
    pub delimiter: Delimiter,
    /// Layout to use instead where the log has none of this layout's positions.
    pub otherwise: Option<Box<Layout>>,
}

impl Layout {
    /// The contract's joint channels: `t`, `q_<joint>`, `tau_<joint>`, optional `dq_<joint>`, all SI.
    pub fn joint_columns(joints: &[impl AsRef<str>]) -> Self {
        let each = |prefix: &str| -> Vec<Channel> {
            joints
                .iter()
                .map(|joint| Channel::si(format!("{prefix}{}", joint.as_ref()), ""))
                .collect()
        };
        Self {
            joints: joints.iter().map(|j| j.as_ref().to_owned()).collect(),
            time: Channel::si("t", "s"),
            positions: each("q_"),
            torques: each("tau_"),
            velocities: each("dq_"),
            channels: Channels::Joint,
            conversion: None,
            delimiter: Delimiter::Auto,
            otherwise: None,
        }
    }

    /// The same layout for a log that need not hold torques: blocks then have an empty `tau`.
    ///
    /// For a trajectory of positions whose torque is asked for.
    pub fn without_torques(mut self) -> Self {
        self.torques.clear();
        self.otherwise = self
            .otherwise
            .map(|other| Box::new(other.without_torques()));
        self
    }
}
