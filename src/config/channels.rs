//! From the `[log]` section to the columns that the reader looks for.

use nalgebra::DMatrix;

use super::log_section::{
    ActuatorChannels, ChannelsKind, DelimiterKind, JointChannels, PositionUnit, StampKind,
    TimeUnit, TorqueUnit,
};
use super::robot_file::{ModelKind, RobotFile};
use crate::log::{Channel, Channels, Conversion, Delimiter, Layout, Messages, Stamp};
use crate::robot::JointKind;
use crate::robot::cft::actuation::ENCODER_SCALE;
use crate::robot::cft::{COORDINATES, Setup, pantograph};
use crate::robot::tree::MOST_JOINTS;

impl RobotFile {
    /// The columns that a log of this robot has, and how their numbers become SI.
    ///
    /// Joint channels; for the CFT robot actuator channels where a log has no joint channels (or
    /// where `[log] channels` says so), converted by Tables 5 and 6 and eq. (57) and (66).
    pub fn layout(&self) -> Layout {
        let actuator = || (self.robot.model == ModelKind::Cft).then(|| self.actuator_layout());
        match self.log.channels {
            ChannelsKind::Joint => self.joint_layout(),
            ChannelsKind::Actuator => actuator().unwrap_or_else(|| self.joint_layout()),
            ChannelsKind::Auto => Layout {
                otherwise: actuator().map(Box::new),
                ..self.joint_layout()
            },
        }
    }

    /// Time and volts u_1..u_4 alone [V], unconverted: blocks have an empty `q`.
    pub fn volts_layout(&self) -> Layout {
        Layout {
            positions: Vec::new(),
            conversion: None,
            ..self.actuator_layout()
        }
    }

    /// Whether a logged torque (or volt) acts from its own row to the next.
    ///
    /// The volts of the CFT robot do unless the file says otherwise.
    pub fn zero_order_hold(&self, channels: Channels) -> bool {
        self.log
            .zero_order_hold
            .unwrap_or(channels == Channels::Actuator)
    }

    /// Unit of a joint's torque channel: "N", "Nm", or "A" where currents are not scaled to torques.
    pub fn torque_unit(&self, joint: usize) -> &'static str {
        let names = self.joint_names();
        let channels = names.get(joint).and_then(|name| self.log.joint.get(name));
        match channels {
            Some(c) if c.torque_unit == Some(TorqueUnit::Ampere) && c.torque_scale.is_none() => "A",
            _ => self.joint_kind(joint).torque_unit(),
        }
    }

    /// The layout of a log's references as if they were its positions; `None` where a joint has none,
    /// or where logs are of actuators or of motors behind gears.
    pub fn reference_layout(&self) -> Option<Layout> {
        let mut layout = self.layout().without_torques();
        if layout.channels != Channels::Joint || layout.conversion.is_some() {
            return None;
        }
        for (joint, position) in layout.joints.iter().zip(&mut layout.positions) {
            position.column = self.log.joint.get(joint)?.reference.clone()?;
            position.key = Some(format!("[log.joint.{joint}] reference"));
        }
        layout.velocities.clear();
        Some(layout)
    }

    fn joint_layout(&self) -> Layout {
        let robot = self.robot();
        let plain = JointChannels::default();
        let named = |joint: &String| {
            let channels = self.log.joint.get(joint);
            let name = channels.and_then(|channels| channels.name.clone());
            name.unwrap_or_else(|| joint.clone())
        };
        let mut layout = Layout {
            time: self.time_channel(),
            delimiter: self.delimiter(),
            messages: self.messages(
                robot.joint_names().iter().map(named).collect(),
                Channels::Joint,
            ),
            ..Layout::joint_columns(robot.joint_names())
        };
        for (index, joint) in robot.joint_names().iter().enumerate() {
            let channels = self.log.joint.get(joint).unwrap_or(&plain);
            let kind = robot.joint_kind(index);
            let key =
                |name: &str, given: bool| given.then(|| format!("[log.joint.{joint}] {name}"));
            let unit = channels.position_unit.unwrap_or(match kind {
                JointKind::Prismatic => PositionUnit::Metre,
                JointKind::Revolute => PositionUnit::Radian,
            });
            let gain =
                channels.position_sign.unwrap_or(1.0) * channels.position_scale.unwrap_or(1.0);
            layout.positions[index] = Channel {
                column: channels
                    .position
                    .clone()
                    .unwrap_or_else(|| format!("q_{joint}")),
                unit: unit.label().to_owned(),
                factor: gain * unit.in_si(),
                offset: channels.position_offset.unwrap_or(0.0),
                key: key("position", channels.position.is_some()),
            };
            layout.velocities[index] = Channel {
                column: channels
                    .velocity
                    .clone()
                    .unwrap_or_else(|| format!("dq_{joint}")),
                unit: unit.label().to_owned(),
                factor: gain * unit.in_si(),
                offset: 0.0,
                key: key("velocity", channels.velocity.is_some()),
            };
            layout.torques[index] = Channel {
                column: channels
                    .torque
                    .clone()
                    .unwrap_or_else(|| format!("tau_{joint}")),
                unit: channels
                    .torque_unit
                    .map_or(kind.torque_unit(), TorqueUnit::label)
                    .to_owned(),
                factor: channels.torque_sign.unwrap_or(1.0) * channels.torque_scale.unwrap_or(1.0),
                offset: channels.torque_offset.unwrap_or(0.0),
                key: key("torque", channels.torque.is_some()),
            };
        }
        if !self.log.gears.is_empty() {
            let offsets = layout.positions.iter_mut();
            let offsets = offsets.map(|channel| std::mem::take(&mut channel.offset));
            layout.conversion = through_gears(&self.log.gears, offsets.collect());
        }
        layout
    }

    fn actuator_layout(&self) -> Layout {
        let plain = ActuatorChannels::default();
        let (mut positions, mut torques) = (Vec::new(), Vec::new());
        for (index, name) in COORDINATES.iter().enumerate() {
            let channels = self.log.actuator.get(*name).unwrap_or(&plain);
            let key =
                |what: &str, given: bool| given.then(|| format!("[log.actuator.{name}] {what}"));
            let si = if index == 2 {
                PositionUnit::Radian
            } else {
                PositionUnit::Metre
            };
            let unit = channels.position_unit.unwrap_or(si);
            let size = match unit {
                PositionUnit::Counts => ENCODER_SCALE[index],
                other => other.in_si(),
            };
            positions.push(Channel {
                column: channels
                    .position
                    .clone()
                    .unwrap_or_else(|| (*name).to_owned()),
                unit: unit.label().to_owned(),
                factor: channels.position_sign.unwrap_or(1.0) * size,
                offset: channels.home.unwrap_or(0.0),
                key: key("position", channels.position.is_some()),
            });
            torques.push(Channel {
                column: channels
                    .volts
                    .clone()
                    .unwrap_or_else(|| format!("u_{}", index + 1)),
                unit: "V".to_owned(),
                factor: channels.volts_sign.unwrap_or(1.0),
                offset: 0.0,
                key: key("volts", channels.volts.is_some()),
            });
        }
        Layout {
            joints: COORDINATES.map(str::to_owned).to_vec(),
            time: self.time_channel(),
            positions,
            torques,
            velocities: Vec::new(),
            channels: Channels::Actuator,
            conversion: Some(to_joint_side(self.robot.setup.unwrap_or_default())),
            delimiter: self.delimiter(),
            messages: self.messages(COORDINATES.map(str::to_owned).to_vec(), Channels::Actuator),
            otherwise: None,
        }
    }

    /// Where the channels stand in recordings of messages, for joints of these names there.
    fn messages(&self, joints: Vec<String>, channels: Channels) -> Messages {
        Messages {
            topic: self.log.topic.clone(),
            torque_topic: self.log.torque_topic.clone(),
            stamp: match self.log.stamp {
                StampKind::Auto => Stamp::Auto,
                StampKind::Header => Stamp::Header,
                StampKind::Log => Stamp::Log,
                StampKind::Publish => Stamp::Publish,
            },
            joints,
            zero_order_hold: self.zero_order_hold(channels),
            torque_delay_s: self.log.torque_delay_s.unwrap_or(0.0),
        }
    }

    fn time_channel(&self) -> Channel {
        let (unit, factor) = match self.log.time_unit {
            TimeUnit::Second => ("s", 1.0),
            TimeUnit::Millisecond => ("ms", 1e-3),
            TimeUnit::Microsecond => ("us", 1e-6),
            TimeUnit::Nanosecond => ("ns", 1e-9),
        };
        Channel {
            factor,
            key: self.log.time.as_ref().map(|_| "[log] time".to_owned()),
            ..Channel::si(
                self.log.time.clone().unwrap_or_else(|| "t".to_owned()),
                unit,
            )
        }
    }

    fn delimiter(&self) -> Delimiter {
        match self.log.delimiter {
            DelimiterKind::Auto => Delimiter::Auto,
            DelimiterKind::Comma => Delimiter::Byte(b','),
            DelimiterKind::Semicolon => Delimiter::Byte(b';'),
            DelimiterKind::Tab => Delimiter::Byte(b'\t'),
            DelimiterKind::Space => Delimiter::Spaces,
        }
    }
}

/// Actuator positions to joints by eq. (57), volts to joint torques by Table 6 and eq. (66).
fn to_joint_side(setup: Setup) -> Conversion {
    Conversion::new(move |positions, torques, _| {
        let Ok(x) = <[f64; 4]>::try_from(&*positions) else {
            return false;
        };
        let Ok(q) = pantograph::joints(&x) else {
            return false;
        };
        positions.copy_from_slice(&q);
        // A log that is read without torques has no volts either.
        if let Ok(volts) = <[f64; 4]>::try_from(&*torques) {
            torques.copy_from_slice(&setup.volts_to_torques(&q, &volts));
        }
        true
    })
}

/// Motor side to joint side, for gears that take joint positions to those of the motors, p = R q:
/// q = R^-1 p + offset, tau = R' c. `None` where R has no inverse.
fn through_gears(gears: &[Vec<f64>], offsets: Vec<f64>) -> Option<Conversion> {
    let n = gears.len();
    let inverse = gear_matrix(gears)?.try_inverse()?;
    let inverse: Vec<Vec<f64>> = inverse
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect();
    let gears = gears.to_vec();
    Some(Conversion::new(move |positions, torques, velocities| {
        if n > MOST_JOINTS || positions.len() != n {
            return false;
        }
        let times = |side: &mut [f64], entry: &dyn Fn(usize, usize) -> f64| {
            let mut out = [0.0; MOST_JOINTS];
            for (row, out) in out.iter_mut().enumerate().take(n) {
                let products = side.iter().enumerate();
                *out = products.map(|(column, x)| entry(row, column) * x).sum();
            }
            side.copy_from_slice(&out[..side.len()]);
        };
        times(positions, &|row, column| inverse[row][column]);
        for (position, offset) in positions.iter_mut().zip(&offsets) {
            *position += offset;
        }
        if velocities.len() == n {
            times(velocities, &|row, column| inverse[row][column]);
        }
        if torques.len() == n {
            times(torques, &|row, column| gears[column][row]);
        }
        true
    }))
}

/// The matrix R of `[log] gears`; `None` where it is not square.
pub(super) fn gear_matrix(gears: &[Vec<f64>]) -> Option<DMatrix<f64>> {
    let n = gears.len();
    let square = gears.iter().all(|row| row.len() == n);
    square.then(|| DMatrix::from_fn(n, n, |row, column| gears[row][column]))
}
