//! The log as the robot file reads it.

use super::simulated_run::SimulatedRun;
use super::temperature::PlantTemperatures;
use cft_ident_files::config::robot_file::RobotFile;
use cft_ident_logs::log::{Channel, DeclaredChannels, Layout};

/// How the robot file reads logs: joint channels where it reads those, the raw channels and status behind them.
pub(super) struct LogLayout {
    layout: Layout,
    pub header: Vec<String>,
    /// Joints that have a temperature.
    warm: Vec<usize>,
    temperatures: PlantTemperatures,
}

impl LogLayout {
    pub fn of<const J: usize>(
        robot: &RobotFile,
        run: &SimulatedRun<J>,
        temperatures: PlantTemperatures,
    ) -> Self {
        let layout = robot.layout();
        let mut header = vec![layout.time.column.clone()];
        let (joint, actuator) = parts(&layout);
        for part in [joint, actuator].into_iter().flatten() {
            let channels = part.positions.iter().chain(&part.torques);
            header.extend(channels.map(|c| c.column.clone()));
        }
        let speeds = joint.into_iter().flat_map(speeds);
        header.extend(speeds.map(|(_, c)| c.column.clone()));
        if actuator.is_some() {
            let motors = 1..=run.coordinates.len();
            header.extend(motors.map(|i| format!("status_{i}")));
        }
        let warm = |j: &usize| temperatures.at(*j, 0.0).is_some();
        let warm: Vec<usize> = (0..run.joints.len()).filter(warm).collect();
        header.extend(warm.iter().map(|j| {
            let joint = &run.joints[*j];
            let named = robot.log.joint.get(joint);
            let named = named.and_then(|of| of.temperature.as_ref());
            named.map_or(format!("temperature_{joint}"), |name| name.0.clone())
        }));
        Self {
            layout,
            header,
            warm,
            temperatures,
        }
    }

    /// The rows as the log shows them, one after the other.
    pub fn values<const J: usize>(&self, run: &SimulatedRun<J>) -> Vec<f64> {
        let (joint, actuator) = parts(&self.layout);
        let mut values = Vec::with_capacity(self.header.len() * run.rows());
        for k in 0..run.rows() {
            values.push(logged(&self.layout.time, run.t[k]));
            if let Some(part) = joint {
                extend(&mut values, &part.positions, &run.q[k]);
                extend(&mut values, &part.torques, &run.torque[k]);
            }
            if let Some(part) = actuator {
                extend(&mut values, &part.positions, &run.x[k]);
                extend(&mut values, &part.torques, &run.volts[k]);
            }
            for (j, channel) in joint.into_iter().flat_map(speeds) {
                values.push(logged(channel, run.actual.v[k][j]));
            }
            if actuator.is_some() {
                let status = run.status[k].iter().take(run.coordinates.len());
                values.extend(status.map(|s| f64::from(s.code())));
            }
            let warm = self.warm.iter();
            values.extend(warm.filter_map(|j| self.temperatures.at(*j, run.t[k])));
        }
        values
    }
}

/// Velocities that the robot file names, which a log must have then: as drives estimate them, without noise.
fn speeds(part: &Layout) -> impl Iterator<Item = (usize, &Channel)> {
    let all = part.velocities.iter().enumerate();
    all.filter(|(_, channel)| channel.key.is_some())
}

/// The parts of a layout that read joint channels, and motor channels.
fn parts(layout: &Layout) -> (Option<&Layout>, Option<&Layout>) {
    match layout.channels {
        // another naming of the joints' channels is no part of its own
        DeclaredChannels::Joint => {
            let other = layout.otherwise.as_deref();
            let raw = other.filter(|other| other.channels == DeclaredChannels::Actuator);
            (Some(layout), raw)
        }
        DeclaredChannels::Actuator => (None, Some(layout)),
    }
}

fn extend(values: &mut Vec<f64>, channels: &[Channel], numbers: &[f64]) {
    let pairs = channels.iter().zip(numbers);
    values.extend(pairs.map(|(channel, x)| logged(channel, *x)));
}

/// The number that the channel shows for an SI value.
fn logged(channel: &Channel, value: f64) -> f64 {
    (value - channel.offset) / channel.factor
}
