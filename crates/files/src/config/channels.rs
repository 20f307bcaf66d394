//! From the `[log]` section to the columns that the reader looks for.

use nalgebra::DMatrix;

use super::robot_file::{ModelKind, RobotFile};
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::cft::actuation::ENCODER_SCALE;
use cft_ident_core::robot::cft::{COORDINATES, LaboratorySetup, pantograph};
use cft_ident_core::robot::tree::MOST_JOINTS;
use cft_ident_logs::log::{
    ActuatorChannels, Channel, ChannelChoice, ControllerTorque, DeclaredChannels, FurtherCommand,
    JointChannels, Layout, LogSection, PositionUnit, RowConversion, TorqueUnit, channel,
};

impl RobotFile {
    /// The columns that a log of this robot has, and how their numbers become SI.
    ///
    /// Joint channels; for the CFT robot actuator channels where a log has no joint channels (or
    /// where `[log] channels` says so), converted by Tables 5 and 6 and eq. (57) and (66).
    pub fn layout(&self) -> Layout {
        let actuator = || (self.robot.model == ModelKind::Cft).then(|| self.actuator_layout());
        match self.log.channels {
            ChannelChoice::Joint => Layout {
                otherwise: self.own_columns(),
                ..self.joint_layout()
            },
            ChannelChoice::Actuator => actuator().unwrap_or_else(|| self.joint_layout()),
            ChannelChoice::Auto => Layout {
                otherwise: actuator().map(Box::new).or_else(|| self.own_columns()),
                ..self.joint_layout()
            },
        }
    }

    /// Columns as `simulate` and `excite --samples` write them, for a robot whose own logs call them otherwise.
    fn own_columns(&self) -> Option<Box<Layout>> {
        let renamed = !self.log.joint.is_empty() || self.log.time.is_some();
        let names = self.joint_names();
        renamed.then(|| Box::new(Layout::joint_columns(&names)))
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
    pub fn zero_order_hold(&self, channels: DeclaredChannels) -> bool {
        self.log
            .zero_order_hold
            .unwrap_or(channels == DeclaredChannels::Actuator)
    }

    /// Unit of a joint's torque: "N", "Nm", or that of its channel ("A", "V", "counts", "%") where no gain
    /// takes it to a torque.
    pub fn torque_unit(&self, joint: usize) -> &'static str {
        self.unit_without_gain(joint)
            .unwrap_or_else(|| self.joint_kind(joint).torque_unit())
    }

    /// Unit of a joint's channel, where it is no torque and nothing says what torque it is.
    fn unit_without_gain(&self, joint: usize) -> Option<&'static str> {
        let names = self.joint_names();
        let channels = self.log.joint.get(names.get(joint)?)?;
        let unit = channels.torque_unit.filter(|unit| !unit.is_torque())?;
        let scaled = channels.torque_scale.is_some() && !self.log.relative_gains;
        (!scaled).then(|| unit.kept_label())
    }

    /// Joints whose torque channels nothing relates to those of the others: channels that are no torques
    /// of a robot of several joints, without a `torque_scale`. Each with its unit.
    pub fn without_gains(&self) -> Vec<(usize, &'static str)> {
        let names = self.joint_names();
        let alone = |joint: &usize| {
            let channels = names.get(*joint).and_then(|name| self.log.joint.get(name));
            channels.is_some_and(|c| c.torque_scale.is_none())
        };
        let joints = (0..names.len()).filter(|_| names.len() > 1);
        joints
            .filter(alone)
            .filter_map(|joint| Some((joint, self.unit_without_gain(joint)?)))
            .collect()
    }

    /// Joints whose positions are logged in counts, and whose file does not say how much one is.
    pub fn without_scale(&self) -> Vec<&str> {
        let counts = |(_, channels): &(&String, &JointChannels)| {
            channels.position_unit == Some(PositionUnit::COUNTS)
                && channels.position_scale.is_none()
        };
        let joints = self.log.joint.iter().filter(counts);
        joints.map(|(joint, _)| joint.as_str()).collect()
    }

    /// Unit that stands for that of the torque in inertial parameters, which joints share: the first
    /// that is no torque, else N or Nm.
    pub fn inertial_torque_unit(&self) -> &'static str {
        let mut joints = 0..self.joint_names().len();
        joints
            .find_map(|joint| self.unit_without_gain(joint))
            .unwrap_or_else(|| self.joint_kind(0).torque_unit())
    }

    /// The layout of a log's references as if they were its positions; `None` where a joint has none,
    /// or where logs are of actuators or of motors behind gears.
    pub fn reference_layout(&self) -> Option<Layout> {
        let mut layout = self.layout().without_torques();
        if layout.channels != DeclaredChannels::Joint || layout.conversion.is_some() {
            return None;
        }
        for (joint, position) in layout.joints.iter().zip(&mut layout.positions) {
            position.column = self.log.joint.get(joint)?.reference.clone()?.0;
            position.key = Some(format!("[log.joint.{joint}] reference"));
        }
        layout.velocities.clear();
        Some(layout)
    }

    /// The layout of the temperatures of a log as if they were positions, and which joints have one; `None` where
    /// the file names none.
    pub fn temperature_layout(&self) -> Option<(Vec<usize>, Layout)> {
        let names = self.joint_names();
        let named = names.iter().enumerate().filter_map(|(j, joint)| {
            let column = &self.log.joint.get(joint)?.temperature;
            let key = || format!("[log.joint.{joint}] temperature");
            column.as_ref()?;
            Some((j, channel(column, String::new(), "degC", [1.0, 0.0], key)))
        });
        let (joints, positions): (Vec<usize>, Vec<Channel>) = named.unzip();
        let of: Vec<&String> = joints.iter().map(|j| &names[*j]).collect();
        let layout = Layout {
            time: self.log.time_channel(),
            positions,
            section: LogSection {
                topic: self.log.temperature_topic.clone(),
                torque_topic: None,
                ..self.log.clone()
            },
            temperatures: true,
            ..Layout::joint_columns(&of)
        };
        (!joints.is_empty()).then(|| (joints, layout.without_torques()))
    }

    /// The matrix R of `[log] gears`, p = R q; `None` where the motors are at the joints.
    pub fn gear_matrix(&self) -> Option<DMatrix<f64>> {
        match self.log.gears.is_empty() {
            true => None,
            false => gear_matrix(&self.log.gears),
        }
    }

    fn joint_layout(&self) -> Layout {
        let robot = self.robot();
        let plain = JointChannels::default();
        let mut layout = Layout {
            time: self.log.time_channel(),
            zero_order_hold: self.zero_order_hold(DeclaredChannels::Joint),
            section: self.log.clone(),
            ..Layout::joint_columns(robot.joint_names())
        };
        for (index, joint) in robot.joint_names().iter().enumerate() {
            let given = self.log.joint.get(joint).unwrap_or(&plain);
            let kind = robot.joint_kind(index);
            let key = |name: &str| format!("[log.joint.{joint}] {name}");
            let unit = given.position_unit.unwrap_or(match kind {
                JointKind::Prismatic => PositionUnit::METRE,
                JointKind::Revolute => PositionUnit::RADIAN,
            });
            let gain = given.position_sign.unwrap_or(1.0) * given.position_scale.unwrap_or(1.0);
            let (gain, label) = (gain * unit.in_si(), unit.label());
            layout.positions[index] = channel(
                &given.position,
                format!("q_{joint}"),
                label,
                [gain, given.position_offset.unwrap_or(0.0)],
                || key("position"),
            )
            .said(given.position_unit.is_some(), given.position_scale);
            layout.positions[index].wrap = given.wrap.map(|range| (range * gain).abs());
            layout.velocities[index] = channel(
                &given.velocity,
                format!("dq_{joint}"),
                label,
                [gain, 0.0],
                || key("velocity"),
            )
            .said(given.position_unit.is_some(), given.position_scale);
            let gain = given.torque_sign.unwrap_or(1.0) * given.torque_scale.unwrap_or(1.0);
            let gain = gain * given.torque_unit.map_or(1.0, TorqueUnit::in_si);
            layout.torques[index] = channel(
                &given.torque,
                format!("tau_{joint}"),
                (given.torque_unit).map_or(kind.torque_unit(), TorqueUnit::label),
                [gain, given.torque_offset.unwrap_or(0.0)],
                || key("torque"),
            )
            .said(given.torque_unit.is_some(), given.torque_scale);
            layout.torques[index].wrap = given.torque_wrap.map(|range| (range * gain).abs());
        }
        if let Some(asked) = &self.log.torque {
            let named = self.commands(asked, robot.joint_names());
            for ((torque, position), (column, key)) in
                layout.torques.iter_mut().zip(&layout.positions).zip(named)
            {
                *torque = Channel {
                    wrap: None,
                    column,
                    key: Some(key),
                    ..position.clone()
                };
            }
            let joints = robot.joint_names();
            layout.conversion = (asked.pd.of(joints.len()))
                .map(|gains| of_controller(gains, asked.velocity_command.is_some()));
            let named = FurtherCommand::ALL.into_iter();
            let named = named.filter_map(|command| Some((command, asked.columns_of(command)?)));
            let further = named.flat_map(|(command, column)| {
                let each = layout.positions.iter().zip(joints).enumerate();
                each.map(move |(place, (position, joint))| {
                    let named = Channel {
                        wrap: None,
                        offset: 0.0,
                        column: column.of(place, joint),
                        key: Some(format!("[log] torque.{}", command.key())),
                        ..position.clone()
                    };
                    match command {
                        FurtherCommand::Velocity => named,
                        FurtherCommand::Torque => Channel {
                            unit: String::new(),
                            factor: position.factor.signum(),
                            ..named
                        },
                    }
                })
            });
            let further: Vec<Channel> = further.collect();
            layout.torques.extend(further);
        }
        if !self.log.gears.is_empty() {
            let offsets = layout.positions.iter_mut();
            let offsets = offsets.map(|channel| std::mem::take(&mut channel.offset));
            layout.conversion = through_gears(&self.log.gears, offsets.collect());
        }
        layout
    }

    /// Columns of the commands of joints, and the keys that name them.
    fn commands(&self, asked: &ControllerTorque, joints: &[String]) -> Vec<(String, String)> {
        let of_joint = |(place, joint): (usize, &String)| match &asked.command {
            Some(command) => (command.of(place, joint), "[log] torque.command".to_owned()),
            None => {
                let own = self.log.joint.get(joint);
                let reference = own.and_then(|own| own.reference.clone());
                (
                    reference.map_or(String::new(), |column| column.0),
                    format!("[log.joint.{joint}] reference"),
                )
            }
        };
        joints.iter().enumerate().map(of_joint).collect()
    }

    fn actuator_layout(&self) -> Layout {
        let plain = ActuatorChannels::default();
        let mut layout = Layout {
            time: self.log.time_channel(),
            velocities: Vec::new(),
            channels: DeclaredChannels::Actuator,
            conversion: Some(to_joint_side(self.robot.setup.unwrap_or_default())),
            zero_order_hold: self.zero_order_hold(DeclaredChannels::Actuator),
            section: self.log.clone(),
            ..Layout::joint_columns(&COORDINATES)
        };
        for (index, name) in COORDINATES.iter().enumerate() {
            let given = self.log.actuator.get(*name).unwrap_or(&plain);
            let key = |what: &str| format!("[log.actuator.{name}] {what}");
            let unit = given.position_unit.unwrap_or(match index {
                2 => PositionUnit::RADIAN,
                _ => PositionUnit::METRE,
            });
            let size = match unit {
                PositionUnit::COUNTS => ENCODER_SCALE[index],
                other => other.in_si(),
            };
            let scale = size * given.position_scale.unwrap_or(1.0);
            layout.positions[index] = channel(
                &given.position,
                (*name).to_owned(),
                unit.label(),
                [
                    given.position_sign.unwrap_or(1.0) * scale,
                    given.home.unwrap_or(0.0),
                ],
                || key("position"),
            )
            .said(given.position_unit.is_some(), given.position_scale);
            layout.positions[index].wrap = given.wrap.map(|range| (range * scale).abs());
            layout.torques[index] = channel(
                &given.volts,
                format!("u_{}", index + 1),
                "V",
                [
                    given.volts_sign.unwrap_or(1.0) * given.volts_scale.unwrap_or(1.0),
                    0.0,
                ],
                || key("volts"),
            )
            .said(false, given.volts_scale);
        }
        layout
    }
}

/// Actuator positions to joints by eq. (57), volts to joint torques by Table 6 and eq. (66).
fn to_joint_side(setup: LaboratorySetup) -> RowConversion {
    RowConversion::new(move |positions, torques, _| {
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

/// Commands in the places of torques to the torques that a controller with these gains asked for; it cannot where
/// velocities are wanted and the log has none. Behind the commands of the positions stand those of the velocities,
/// where `with_speeds` says so, and the torques that the controller adds, where there are more numbers.
fn of_controller(gains: Vec<[f64; 2]>, with_speeds: bool) -> RowConversion {
    RowConversion::new(move |positions, torques, velocities| {
        let n = gains.len();
        let (torques, further) = torques.split_at_mut(n.min(torques.len()));
        let (speeds, added) = further.split_at(if with_speeds { n.min(further.len()) } else { 0 });
        let number = |of: &[f64], j: usize| of.get(j).copied().unwrap_or(0.0);
        for (j, torque) in torques.iter_mut().enumerate() {
            let [kp, kd] = gains[j];
            let damped = match velocities.get(j) {
                Some(velocity) => kd * (number(speeds, j) - velocity),
                None if kd == 0.0 => 0.0,
                None => return false,
            };
            *torque = kp * (*torque - positions[j]) + damped + number(added, j);
        }
        true
    })
}

/// Motor side to joint side for p = R q: q = R^-1 p + offset, tau = R' c; `None` where R has no inverse.
fn through_gears(gears: &[Vec<f64>], offsets: Vec<f64>) -> Option<RowConversion> {
    let n = gears.len();
    let inverse = gear_matrix(gears)?.try_inverse()?;
    let transposed = gear_matrix(gears)?.transpose();
    Some(RowConversion::new(move |positions, torques, velocities| {
        if n > MOST_JOINTS || positions.len() != n {
            return false;
        }
        let times = |side: &mut [f64], matrix: &DMatrix<f64>| {
            let mut out = [0.0; MOST_JOINTS];
            for (row, out) in out.iter_mut().enumerate().take(n) {
                let products = side.iter().enumerate();
                *out = products.map(|(column, x)| matrix[(row, column)] * x).sum();
            }
            side.copy_from_slice(&out[..side.len()]);
        };
        times(positions, &inverse);
        for (position, offset) in positions.iter_mut().zip(&offsets) {
            *position += offset;
        }
        if velocities.len() == n {
            times(velocities, &inverse);
        }
        if torques.len() == n {
            times(torques, &transposed);
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
