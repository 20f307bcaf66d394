//! Which columns of a log are which channels: by the robot file, or by their names.

use super::CliError;
use cft_ident_core::explain::{ErrorText, Explain};
use cft_ident_logs::inspect::{
    ChannelColumn, ChannelRole, ColumnPlan, FaultKind, InspectedChannel, LogFault, Severity,
    is_time,
};
use cft_ident_logs::log::{self, DeclaredChannels, Layout, RawReader};
use cft_ident_logs::mapping::ClockColumn;
use cft_ident_stages::identify::RobotSetup;

/// Channels by their names alone.
pub(super) fn guessed(log: &mut RawReader) -> Result<(ColumnPlan, Vec<LogFault>), CliError> {
    let time = match log.is_timed() && !log.is_recording() {
        true => None,
        false => ClockColumn::find(log).map(|time| Some((time.place, time.seconds)))?,
    };
    let columns = 0..log.names().len();
    let channels = columns.filter(|column| time.is_none_or(|(time, _)| time != *column));
    let channels = channels.map(|column| other(log, column)).collect();
    let plan = ColumnPlan {
        time,
        channels,
        keep: Vec::new(),
        held: None,
        even: None,
        band_hz: None,
    };
    Ok((plan, Vec::new()))
}

/// Channels by the robot file; what it does not name, by names. The fault is what keeps a fit from reading the log.
pub(super) fn of_robot(log: &RawReader, setup: &RobotSetup) -> (ColumnPlan, Vec<LogFault>) {
    let layout = log.layout();
    let names = log.names();
    let time = log.find(&layout.time);
    let seconds = log.recognised_s().unwrap_or(layout.time.factor);
    let time = time.or_else(|| names.iter().position(|name| is_time(name)));
    let time = time.filter(|_| layout.section.rate_hz.is_none());
    let mut known: Vec<Option<ChannelColumn>> = vec![None; names.len()];
    place(log, setup, layout, &mut known);
    if let Some(other) = &layout.otherwise {
        // A log may hold both sides of the gears.
        place(log, setup, other, &mut known);
    }
    let missing = temperatures(log, setup, &mut known);
    let columns = known.into_iter().enumerate();
    let channels = columns.filter(|(column, _)| Some(*column) != time);
    let unnamed = |column| ChannelColumn {
        unused: true,
        ..other(log, column)
    };
    let channels = channels.map(|(column, known)| known.unwrap_or_else(|| unnamed(column)));
    let plan = ColumnPlan {
        time: time.map(|time| (time, seconds)),
        channels: channels.collect(),
        keep: setup.file.log.keep.clone(),
        held: None,
        even: None,
        band_hz: Some(setup.settings().cutoff_hz),
    };
    let refused = log.refused().map(|error| refusal(error.explanation()));
    (plan, refused.into_iter().chain(missing).collect())
}

/// Finds the temperatures that the robot file names among the columns of a text log; what is not there.
fn temperatures(
    log: &RawReader,
    setup: &RobotSetup,
    known: &mut [Option<ChannelColumn>],
) -> Vec<LogFault> {
    let Some((_, layout)) = (setup.file.temperature_layout()).filter(|_| !log.is_recording())
    else {
        return Vec::new();
    };
    let mut missing = Vec::new();
    for (channel, joint) in layout.positions.iter().zip(&layout.joints) {
        let Some(column) = log.find(channel) else {
            let effect = format!(
                "no column `{}`, which the robot file names as the temperature of {joint}: it is no signal of this log",
                log::escape(&channel.column)
            );
            let remedy =
                "name the right column in [log.joint] of the robot file, or take the key out";
            missing.push(missing_channel(Severity::Warning, effect, remedy));
            continue;
        };
        let (name, role) = (&log.names()[column], ChannelRole::Temperature);
        let channel = InspectedChannel::new(name, role, Some(joint), Some("degC"));
        known[column] = Some(as_it_is(column, channel));
    }
    missing
}

/// Finds the channels of a layout among the columns that are not known yet.
fn place(
    log: &RawReader,
    setup: &RobotSetup,
    layout: &Layout,
    known: &mut [Option<ChannelColumn>],
) {
    let raw = layout.channels == DeclaredChannels::Actuator;
    let kinds = [
        (&layout.positions, ChannelRole::Position),
        (&layout.velocities, ChannelRole::Velocity),
        (&layout.torques, ChannelRole::Torque),
    ];
    for (channels, role) in kinds {
        for (j, channel) in channels.iter().enumerate() {
            let Some(column) = log.find(channel).filter(|column| known[*column].is_none()) else {
                continue;
            };
            let (j, law) = (layout.joint_of(j), layout.section.torque.is_some());
            let role = match role {
                ChannelRole::Torque if law => ChannelRole::Command,
                role => role,
            };
            let joint = &layout.joints[j];
            let kind = match raw {
                true => setup.robot.coordinate_kind(j),
                false => setup.robot.joint_kind(j),
            };
            let position = kind.position_unit();
            let unit = match role {
                ChannelRole::Velocity => format!("{position}/s"),
                ChannelRole::Torque if raw => "V".to_owned(),
                ChannelRole::Torque => setup.file.torque_unit(j).to_owned(),
                ChannelRole::Command if channel.unit.is_empty() => {
                    setup.file.torque_unit(j).to_owned()
                }
                _ => position.to_owned(),
            };
            let name = &log.names()[column];
            let mut seen = InspectedChannel::new(name, role, Some(joint), Some(&unit));
            (seen.limits, seen.saturates) = limits(setup, (j, joint), role, raw);
            if role == ChannelRole::Torque && !raw && !["N", "Nm"].contains(&&*unit) {
                // the limit is that of a torque
                seen.limits = None;
            }
            if role == ChannelRole::Position {
                let limits = setup.file.limits.get(joint);
                seen.speed = limits.and_then(|limits| limits.speed);
            }
            if role == ChannelRole::Torque && !raw {
                seen.delivers = layout.torque_limit(joint);
            }
            seen.factor = channel.factor;
            known[column] = Some(ChannelColumn {
                column,
                factor: channel.factor,
                offset: channel.offset,
                wrap: channel.wrap,
                channel: seen,
                unused: false,
            });
        }
    }
}

/// A column that no robot file names.
fn other(log: &RawReader, column: usize) -> ChannelColumn {
    let mut channel = InspectedChannel::guessed(&log.names()[column]);
    channel.unit = log.unit(column).map(str::to_owned);
    as_it_is(column, channel)
}

/// A column whose numbers are those of its channel.
fn as_it_is(column: usize, channel: InspectedChannel) -> ChannelColumn {
    ChannelColumn {
        column,
        factor: 1.0,
        offset: 0.0,
        wrap: None,
        channel,
        unused: false,
    }
}

/// The unit that the name of a joint's column states, where it is none that a `JointState` has.
pub(super) fn unit_of_joint(name: &str) -> Option<&str> {
    let joint = ["q_", "dq_", "tau_"]
        .iter()
        .any(|kind| name.starts_with(kind));
    let unit = log::unit_of(name).filter(|_| joint)?;
    let known = [
        "deg", "mm", "cm", "A", "V", "counts", "deg/s", "mm/s", "Nmm", "rpm",
    ];
    known.contains(&unit).then_some(unit)
}

/// Limits of a channel, and whether a number at the limit is what was applied.
fn limits(
    setup: &RobotSetup,
    (j, joint): (usize, &str),
    role: ChannelRole,
    raw: bool,
) -> (Option<[f64; 2]>, bool) {
    // Volts are logged as the amplifier gave them.
    let applied = raw && role == ChannelRole::Torque;
    let Some(limits) = setup.file.limits.get(joint) else {
        // Table 5 of the report
        let of_set_up = match (setup.robot.transmission().limits(), role, raw) {
            (Some(limits), ChannelRole::Position, true) => limits.of(j),
            _ => None,
        };
        return (of_set_up, applied);
    };
    let both = |limit: Option<f64>| limit.map(|limit| [-limit, limit]);
    match role {
        ChannelRole::Position => (limits.position, false),
        ChannelRole::Velocity => (both(limits.speed), false),
        ChannelRole::Torque if raw => (both(limits.volts), true),
        ChannelRole::Torque => (both(limits.torque), false),
        _ => (None, false),
    }
}

/// What keeps the strict reader from a log, as a fault.
fn refusal(problem: ErrorText) -> LogFault {
    missing_channel(Severity::Error, problem.what, &problem.remedies.join("; "))
}

fn missing_channel(severity: Severity, effect: String, remedy: &str) -> LogFault {
    LogFault::whole(severity, FaultKind::MissingChannel, 0.0, effect, remedy)
}
