//! The log as the robot file reads it.

use super::simulated_run::SimulatedRun;
use super::temperature::PlantTemperatures;
use cft_ident_files::config::robot_file::RobotFile;
use cft_ident_logs::log::{Channel, DeclaredChannels, Layout};

/// A number of each row.
type Column<const J: usize> = Box<dyn Fn(&SimulatedRun<J>, usize) -> f64>;

/// How the robot file reads logs: joint channels where it reads those, the raw channels and status behind them.
pub(super) struct LogLayout<const J: usize> {
    pub header: Vec<String>,
    columns: Vec<Column<J>>,
}

impl<const J: usize> LogLayout<J> {
    pub fn of(robot: &RobotFile, run: &SimulatedRun<J>, temperatures: PlantTemperatures) -> Self {
        let layout = robot.layout();
        let mut all = Self {
            header: Vec::new(),
            columns: Vec::new(),
        };
        all.channel(&layout.time, |run, k| run.t[k]);
        let (joint, actuator) = parts(&layout);
        if let Some(part) = joint {
            all.channels(&part.positions, |run| &run.q);
            all.channels(&part.torques, |run| &run.torque);
        }
        if let Some(part) = actuator {
            all.channels(&part.positions, |run| &run.x);
            all.channels(&part.torques, |run| &run.volts);
        }
        // velocities that the robot file names, which a log must have then: as drives estimate them, without noise
        let speeds = joint
            .into_iter()
            .flat_map(|part| part.velocities.iter().enumerate());
        for (j, channel) in speeds.filter(|(_, channel)| channel.key.is_some()) {
            all.channel(channel, move |run, k| run.actual.v[k][j]);
        }
        if actuator.is_some() {
            for i in 0..run.coordinates.len() {
                let code =
                    move |run: &SimulatedRun<J>, k: usize| f64::from(run.status[k][i].code());
                all.column(format!("status_{}", i + 1), code);
            }
        }
        for (j, joint) in run.joints.iter().enumerate() {
            let temperatures = temperatures.clone();
            if temperatures.at(j, 0.0).is_some() {
                let named = robot.log.joint.get(joint);
                let named = named.and_then(|of| of.temperature.as_ref());
                let name = named.map_or(format!("temperature_{joint}"), |name| name.0.clone());
                all.column(name, move |run, k| {
                    temperatures.at(j, run.t[k]).unwrap_or(f64::NAN)
                });
            }
        }
        all
    }

    fn column(&mut self, name: String, of: impl Fn(&SimulatedRun<J>, usize) -> f64 + 'static) {
        self.header.push(name);
        self.columns.push(Box::new(of));
    }

    /// What a channel shows of an SI value.
    fn channel(
        &mut self,
        channel: &Channel,
        of: impl Fn(&SimulatedRun<J>, usize) -> f64 + 'static,
    ) {
        let (offset, factor) = (channel.offset, channel.factor);
        let shown = move |run: &SimulatedRun<J>, k: usize| (of(run, k) - offset) / factor;
        self.column(channel.column.clone(), shown);
    }

    /// Channels of the joints or motors in their order.
    fn channels(&mut self, channels: &[Channel], of: fn(&SimulatedRun<J>) -> &Vec<[f64; J]>) {
        for (j, channel) in channels.iter().enumerate() {
            self.channel(channel, move |run, k| of(run)[k][j]);
        }
    }

    /// The rows as the log shows them, one after the other.
    pub fn values(&self, run: &SimulatedRun<J>) -> Vec<f64> {
        let row = |k| self.columns.iter().map(move |of| of(run, k));
        (0..run.rows()).flat_map(row).collect()
    }
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
