//! A simulation as the user orders it: robot file, model, motion, effects; and the log that comes back.

use super::SimulateError;
use super::effects::{EffectSpec, EffectValue, Effects, Sites};
use super::experiment::{Experiment, SECONDS};
use super::mechanism::Mechanism;
use super::plant::Plant;
use super::reference::Path;
use super::run::{Drive, Start, run};
use super::settings_file;
use super::simulated_run::{Ending, LimitEvent, MotorStatus, SimulatedRun};
use super::truth::TruthFile;
use super::volts::VoltSeries;
use crate::config::ModelFile;
use crate::config::robot_file::RobotFile;
use crate::log::{Channel, Channels};

/// What is asked of the simulator.
#[derive(Debug, Clone)]
pub struct Order<'a> {
    pub robot: &'a RobotFile,
    /// Model whose parameters are the truth, and its name in messages; the synthetic ones of the CFT
    /// robot where absent.
    pub model: Option<(&'a str, &'a ModelFile)>,
    pub experiment: Experiment<'a>,
    /// Duration \[s\]; the motion's own, or 20 s, where absent.
    pub seconds: Option<f64>,
    pub effects: Vec<EffectSpec>,
    pub seed: u64,
}

/// A simulated log, ready to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedLog {
    /// Column names.
    pub header: Vec<String>,
    /// Rows, one after the other.
    pub values: Vec<f64>,
    pub truth: TruthFile,
    pub limits: Vec<LimitEvent>,
    pub ending: Ending,
    /// Share of the rows at which each motor channel is saturated, by coordinate.
    pub saturated: Vec<(String, f64)>,
}

impl SimulatedLog {
    /// The rows.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.header.len())
    }
}

/// Initial conditions of the report's block, in motor coordinates (x_c1..x_c4; the joint of a single
/// joint).
#[derive(Debug, Clone, PartialEq)]
pub struct InitialConditions {
    /// m or rad.
    pub position: Vec<f64>,
    /// m/s or rad/s.
    pub speed: Vec<f64>,
}

impl InitialConditions {
    fn start<const J: usize>(&self, mechanism: &Mechanism<J>) -> Result<Start<J>, SimulateError> {
        let of = |numbers: &[f64]| {
            let widened = mechanism.widened(numbers, 0.0);
            widened.ok_or(SimulateError::Parameter {
                name: "number of initial conditions of a kind",
                value: numbers.len() as f64,
                rule: "must be one per motor",
            })
        };
        Ok(Start::State {
            position: of(&self.position)?,
            speed: of(&self.speed)?,
        })
    }
}

/// Simulates what is ordered, from the settled start ([`Start::Settled`]).
///
/// # Errors
/// [`SimulateError`]; reaching a limit is none.
pub fn simulate(order: &Order) -> Result<SimulatedLog, SimulateError> {
    simulate_from(order, None)
}

/// Simulates what is ordered, from initial conditions where they are given.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_from(
    order: &Order,
    initial: Option<&InitialConditions>,
) -> Result<SimulatedLog, SimulateError> {
    match order.robot.joint_names().len() {
        1 => run_order::<1>(order, initial),
        2 => run_order::<2>(order, initial),
        3 => run_order::<3>(order, initial),
        4 => run_order::<4>(order, initial),
        5 => run_order::<5>(order, initial),
        6 => run_order::<6>(order, initial),
        7 => run_order::<7>(order, initial),
        8 => run_order::<8>(order, initial),
        // many joints share the code of two widths
        9..=16 => run_order::<16>(order, initial),
        _ => run_order::<32>(order, initial),
    }
}

/// Runs the order with vectors of room for J joints, and lays the log out as the robot file's `[log]` reads it.
fn run_order<const J: usize>(
    order: &Order,
    initial: Option<&InitialConditions>,
) -> Result<SimulatedLog, SimulateError> {
    let plant = Plant::<J>::of(order.robot, order.model)?;
    let (effects, effect_values) = built_effects(order, &Sites::of(&plant)?)?;
    let mechanism = &plant.mechanism;
    let mut settings = settings_file::settings(order.robot, mechanism)?;
    settings.seconds = order.seconds.unwrap_or(SECONDS);
    settings.seed = order.seed;
    // before a ladder of that length is built
    settings.samples()?;
    let (drive, own_seconds) = drive(order, &plant)?;
    let start = initial.map_or(Ok(Start::Settled), |given| given.start(mechanism))?;
    settings.seconds = order.seconds.or(own_seconds).unwrap_or(SECONDS);
    let recording = run(&plant, effects, &start, &drive, &settings)?;
    let (header, values) = lay_out(order.robot, &recording);
    let truth = truth_of(order, &plant, &recording, effect_values);
    let rows = recording.rows().max(1) as f64;
    let share = |(i, name): (usize, &String)| {
        let saturated = recording.status.iter();
        let saturated = saturated.filter(|s| s[i] == MotorStatus::Saturated).count();
        (name.clone(), saturated as f64 / rows)
    };
    let saturated = recording.coordinates.iter().enumerate().map(share);
    Ok(SimulatedLog {
        header,
        values,
        truth,
        saturated: saturated.collect(),
        ending: recording.ending,
        limits: recording.limits,
    })
}

/// What drives the motors, and how long it lasts where it says so \[s\].
fn drive<const J: usize>(
    order: &Order,
    plant: &Plant<J>,
) -> Result<(Drive<J>, Option<f64>), SimulateError> {
    let mechanism = &plant.mechanism;
    let experiment = order.experiment;
    if let Some(reference) = experiment.reference(mechanism, order.seconds, order.seed)? {
        let seconds = match &reference.path {
            // A ladder lasts as long as it was built for; a list may end before the next sample.
            Path::Points(points) => Some(points.seconds()),
            Path::Fourier(series) => series.seconds(),
            _ => None,
        };
        let control = settings_file::control(order.robot, plant)?;
        return Ok((Drive::Follow { reference, control }, seconds));
    }
    let Experiment::Volts { times, volts } = experiment else {
        return Err(SimulateError::Reference {
            what: "there is neither a reference nor a series of volts".to_owned(),
        });
    };
    let n = mechanism.joints();
    if !volts.len().is_multiple_of(n) {
        return Err(SimulateError::Volts {
            what: format!("the robot has {n} motors, and the rows do not divide into {n} volts"),
        });
    }
    let rows = volts.chunks_exact(n);
    let rows = rows.filter_map(|row| mechanism.widened(row, 0.0)).collect();
    // A log's clock need not start at 0.
    let first = times.first().copied().unwrap_or(0.0);
    let times: Vec<f64> = times.iter().map(|t| t - first).collect();
    let series = VoltSeries::new(times, rows)?;
    let seconds = Some(series.seconds()).filter(|s| s.is_finite());
    Ok((Drive::Volts(series), seconds))
}

/// Effects of the model, then those of the order. An effect of the model that cannot be run names its table.
fn built_effects(
    order: &Order,
    sites: &Sites,
) -> Result<(Effects, Vec<EffectValue>), SimulateError> {
    let mut asked = Vec::new();
    if let Some((file, model)) = order.model {
        for (place, effect) in model.effects.iter().enumerate() {
            let values = effect.parameters.iter();
            let spec = EffectSpec {
                name: effect.name.clone(),
                joint: effect.joint.clone(),
                values: values.map(|(key, p)| (key.clone(), p.value)).collect(),
            };
            // Tried alone, so that what is wrong with it is said of the file and not of the command line.
            Effects::build(std::slice::from_ref(&spec), sites).map_err(|source| {
                SimulateError::ModelEffect {
                    file: file.to_owned(),
                    number: place + 1,
                    name: effect.name.clone(),
                    source: Box::new(source),
                }
            })?;
            asked.push(spec);
        }
    }
    asked.extend(order.effects.iter().cloned());
    let (effects, values) = Effects::build(&asked, sites)?;
    let joint_channels = order.robot.layout().channels == Channels::Joint;
    match effects.first_fault() {
        Some(fault) if !joint_channels => Err(SimulateError::EffectPlace {
            effect: fault.to_owned(),
            place: "this log".to_owned(),
            why: "the robot file's [log] has the motors' channels alone, and faults of the data sit in joint \
                  channels; let [log] read those"
                .to_owned(),
        }),
        _ => Ok((effects, values)),
    }
}

fn truth_of<const J: usize>(
    order: &Order,
    plant: &Plant<J>,
    recording: &SimulatedRun<J>,
    effects: Vec<EffectValue>,
) -> TruthFile {
    let robot = &plant.mechanism.robot;
    let n = robot.joints();
    let mut ending = match recording.ending {
        Ending::Completed => "completed".to_owned(),
        Ending::StoppedAtLimit => "stopped at a limit".to_owned(),
    };
    for event in &recording.limits {
        ending += &format!(
            "; {} = {:.5} at t = {:.4} s",
            event.coordinate, event.value, event.t
        );
    }
    TruthFile {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: order.seed,
        model: order.robot.robot.model.name().to_owned(),
        setup: robot
            .transmission()
            .setup()
            .map(|setup| setup.name().to_owned()),
        ending,
        volt_noise: recording.volt_noise[..n].to_vec(),
        torque_noise: recording.torque_noise[..n].to_vec(),
        parameters: plant.parameters(),
        effects,
    }
}

/// Header and rows under the names, signs, scales and offsets with which the robot file reads logs: joint
/// channels where it reads those, and for the CFT robot the raw channels and status behind them.
fn lay_out<const J: usize>(
    robot: &RobotFile,
    recording: &SimulatedRun<J>,
) -> (Vec<String>, Vec<f64>) {
    let layout = robot.layout();
    let (joint, actuator) = match (layout.channels, layout.otherwise.as_deref()) {
        (Channels::Joint, otherwise) => (Some(&layout), otherwise),
        (Channels::Actuator, _) => (None, Some(&layout)),
    };
    let mut header = vec![layout.time.column.clone()];
    for part in [joint, actuator].into_iter().flatten() {
        header.extend(
            part.positions
                .iter()
                .chain(&part.torques)
                .map(|c| c.column.clone()),
        );
    }
    if actuator.is_some() {
        let motors = 1..=recording.coordinates.len();
        header.extend(motors.map(|i| format!("status_{i}")));
    }
    let mut values = Vec::with_capacity(header.len() * recording.rows());
    for k in 0..recording.rows() {
        values.push(logged(&layout.time, recording.t[k]));
        if let Some(part) = joint {
            extend(&mut values, &part.positions, &recording.q[k]);
            extend(&mut values, &part.torques, &recording.torque[k]);
        }
        if let Some(part) = actuator {
            extend(&mut values, &part.positions, &recording.x[k]);
            extend(&mut values, &part.torques, &recording.volts[k]);
            let status = recording.status[k].iter().take(recording.coordinates.len());
            values.extend(status.map(|s| f64::from(s.code())));
        }
    }
    (header, values)
}

fn extend(values: &mut Vec<f64>, channels: &[Channel], numbers: &[f64]) {
    values.extend(
        channels
            .iter()
            .zip(numbers)
            .map(|(channel, x)| logged(channel, *x)),
    );
}

/// The number that the channel shows for an SI value.
fn logged(channel: &Channel, value: f64) -> f64 {
    (value - channel.offset) / channel.factor
}
