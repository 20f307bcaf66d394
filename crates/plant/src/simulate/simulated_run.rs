//! What a simulation gives: the log as a laboratory would have it, and beside it what was true.

use schemars::JsonSchema;
use serde::Serialize;

use super::effects::LoggedChannels;
use super::mechanism::Mechanism;

/// State of one motor channel at a sample (the status output of the report's Figure 9).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MotorStatus {
    #[default]
    Running,
    /// The amplifier gives its largest voltage.
    Saturated,
    /// The coordinate is at or beyond a limit of Table 5.
    LimitReached,
}

impl MotorStatus {
    /// 0 running, 1 saturated, 2 limit reached.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The state that [`Self::code`] names so.
    pub(super) fn of_code(code: f64) -> Self {
        let all = [Self::Running, Self::Saturated, Self::LimitReached];
        let named = |status: &Self| f64::from(status.code()) == code;
        all.into_iter().find(named).unwrap_or_default()
    }
}

/// A limit that was reached.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LimitEvent {
    pub coordinate: String,
    /// Time of the first sample at which the coordinate was outside \[s\].
    pub t: f64,
    /// Where it was, m or rad.
    pub value: f64,
    pub lower: f64,
    pub upper: f64,
}

/// How the run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RunEnding {
    /// After the time that was asked for.
    Completed,
    /// At the first limit reached; the last row shows it.
    StoppedAtLimit,
}

/// What was true at each row, and what the controller wanted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GroundTruth<const J: usize> {
    /// Joint positions, m or rad; those of the links where a joint is elastic.
    pub q: Vec<[f64; J]>,
    /// Joint speeds, m/s or rad/s.
    pub v: Vec<[f64; J]>,
    /// Joint torques that act from this sample on, N or N m.
    pub torque: Vec<[f64; J]>,
    /// Joint accelerations from this sample on, m/s^2 or rad/s^2.
    pub a: Vec<[f64; J]>,
    /// Wanted motor coordinates, m or rad; the actual ones where nothing is followed.
    pub target: Vec<[f64; J]>,
}

/// A simulated log, one entry per row.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedRun<const J: usize> {
    pub joints: Vec<String>,
    pub coordinates: Vec<String>,
    /// Time \[s\].
    pub t: Vec<f64>,
    /// Motor coordinates by the encoders, m or rad.
    pub x: Vec<[f64; J]>,
    /// Volts after saturation, kept until the next sample, with the noise of their measurement \[V\].
    pub volts: Vec<[f64; J]>,
    /// Joint positions by the encoders, m or rad.
    pub q: Vec<[f64; J]>,
    /// Joint torques of the logged volts at the logged pose, eq. (66), with their own noise, N or N m.
    pub torque: Vec<[f64; J]>,
    pub status: Vec<[MotorStatus; J]>,
    pub actual: GroundTruth<J>,
    /// The limits at which it ended.
    pub limits: Vec<LimitEvent>,
    pub ending: RunEnding,
    /// Standard deviation of the noise on the volts \[V\].
    pub volt_noise: [f64; J],
    /// Standard deviation of the noise on the torques themselves, N or N m.
    pub torque_noise: [f64; J],
}

impl<const J: usize> SimulatedRun<J> {
    pub(super) fn empty(mechanism: &Mechanism<J>, rows: usize) -> Self {
        let mut run = Self {
            joints: mechanism.robot.joint_names().to_vec(),
            coordinates: mechanism.robot.coordinate_names(),
            t: Vec::with_capacity(rows),
            x: Vec::new(),
            volts: Vec::new(),
            q: Vec::new(),
            torque: Vec::new(),
            status: Vec::with_capacity(rows),
            actual: GroundTruth::default(),
            limits: Vec::new(),
            ending: RunEnding::Completed,
            volt_noise: [0.0; J],
            torque_noise: [0.0; J],
        };
        for column in run.columns() {
            column.reserve_exact(rows);
        }
        run
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.t.len()
    }

    /// Forgets the rows, and keeps what is known of the run.
    pub(super) fn clear(&mut self) {
        self.t.clear();
        self.status.clear();
        for column in self.columns() {
            column.clear();
        }
    }

    /// Keeps the rows that are marked.
    pub(super) fn retain(&mut self, kept: &[bool]) {
        retain(&mut self.t, kept);
        retain(&mut self.status, kept);
        for column in self.columns() {
            retain(column, kept);
        }
    }

    /// Every column of numbers per joint or motor.
    fn columns(&mut self) -> [&mut Vec<[f64; J]>; 9] {
        [
            &mut self.x,
            &mut self.volts,
            &mut self.q,
            &mut self.torque,
            &mut self.actual.q,
            &mut self.actual.v,
            &mut self.actual.torque,
            &mut self.actual.a,
            &mut self.actual.target,
        ]
    }

    /// The joint channels as faults of the data see them.
    pub(super) fn joint_channels(&mut self) -> LoggedChannels<'_> {
        LoggedChannels {
            t: &self.t,
            q: self.q.as_flattened_mut(),
            torque: self.torque.as_flattened_mut(),
            joints: J,
        }
    }
}

/// Keeps the entries that are marked.
fn retain<T>(column: &mut Vec<T>, kept: &[bool]) {
    let mut marks = kept.iter();
    column.retain(|_| marks.next().copied().unwrap_or(true));
}
