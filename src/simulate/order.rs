//! A simulation as the user orders it: robot file, model, motion, effects; and the log that comes back.

use super::SimulateError;
use super::cft::CftPlant;
use super::cft_experiment;
use super::controller::Control;
use super::effects::{EffectSpec, EffectValue, Effects, Sites};
use super::from_files;
use super::plant::Plant;
use super::recording::{Ending, LimitEvent, Recording, Status};
use super::reference::{Path, Reference};
use super::run::{Drive, Start, run};
use super::serial_experiment;
use super::settings::Settings;
use super::truth::TruthFile;
use super::volts::VoltSeries;
use crate::config::model_file::Parameter;
use crate::config::robot_file::{ModelKind, RobotFile};
use crate::config::{ModelFile, Trajectory};
use crate::log::{Channel, Channels};

/// Duration of a motion that sets none \[s\].
const SECONDS: f64 = 20.0;

/// What the robot is to do.
#[derive(Debug, Clone, Copy)]
pub enum Motion<'a> {
    /// Table 3 on the CFT robot, a ladder on a single joint.
    Usual,
    /// A trajectory file.
    Trajectory(&'a Trajectory),
    /// One joint (or motor coordinate) runs a ladder of speeds, within a part of its range about the middle.
    Move { joint: &'a str, part: f64 },
    /// Volts of a log: times \[s\], and volts row by row.
    Volts { times: &'a [f64], volts: &'a [f64] },
}

impl<'a> Motion<'a> {
    /// One joint over all of its range.
    pub fn of_joint(joint: &'a str) -> Self {
        Motion::Move { joint, part: 1.0 }
    }
}

/// What is asked of the simulator.
#[derive(Debug, Clone)]
pub struct Order<'a> {
    pub robot: &'a RobotFile,
    /// Model whose parameters are the truth, and its name in messages; the synthetic ones of the CFT
    /// robot where absent.
    pub model: Option<(&'a str, &'a ModelFile)>,
    pub motion: Motion<'a>,
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
    fn start<const J: usize>(&self) -> Result<Start<J>, SimulateError> {
        let fixed = |numbers: &[f64]| {
            <[f64; J]>::try_from(numbers).map_err(|_| SimulateError::Parameter {
                name: "number of initial conditions of a kind",
                value: numbers.len() as f64,
                rule: "must be one per motor",
            })
        };
        Ok(Start::State {
            position: fixed(&self.position)?,
            speed: fixed(&self.speed)?,
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
    match order.robot.robot.model {
        ModelKind::Cft => cft(order, initial),
        ModelKind::SingleJoint => single(order, initial),
        ModelKind::Serial => match order.robot.joint_names().len() {
            1 => serial::<1>(order, initial),
            2 => serial::<2>(order, initial),
            3 => serial::<3>(order, initial),
            4 => serial::<4>(order, initial),
            5 => serial::<5>(order, initial),
            6 => serial::<6>(order, initial),
            7 => serial::<7>(order, initial),
            _ => serial::<8>(order, initial),
        },
    }
}

fn cft(order: &Order, initial: Option<&InitialConditions>) -> Result<SimulatedLog, SimulateError> {
    let truth = from_files::cft_truth(order.robot, order.model)?;
    truth.check()?;
    let setup = truth.setup;
    let limits = from_files::cft_limits(order.robot, setup);
    let plant = CftPlant::new(&truth).with_limits(limits);
    let (effects, values) = built_effects(order, &Sites::cft(&truth)?)?;
    let reference = match order.motion {
        Motion::Usual => Some(cft_experiment::excitation(setup)),
        Motion::Trajectory(trajectory) => Some(from_files::cft_reference(
            order.robot,
            trajectory,
            setup,
            order.seconds,
            order.seed,
        )?),
        Motion::Move { joint, part } => {
            let mover = cft_experiment::Mover::named(joint)?;
            let seconds = order.seconds.unwrap_or(SECONDS);
            let ladder = cft_experiment::OneJointMove {
                mover,
                limits: Some(limits),
                part,
                ..cft_experiment::OneJointMove::new(0, seconds, Some(order.seed))
            };
            Some(ladder.reference(setup)?)
        }
        Motion::Volts { .. } => None,
    };
    let control = from_files::control(order.robot, Control::cft(setup))?;
    let start = initial.map_or(Ok(Start::Settled), InitialConditions::start)?;
    let driven = Driven {
        parameters: truth.parameters(),
        values,
        effects,
        start,
        reference,
        control,
        saturation: None,
    };
    let mut outcome = execute(order, &plant, driven)?;
    outcome.truth.setup = Some(setup.name().to_owned());
    Ok(outcome)
}

fn single(
    order: &Order,
    initial: Option<&InitialConditions>,
) -> Result<SimulatedLog, SimulateError> {
    let truth = from_files::single_joint_truth(order.robot, order.model)?;
    truth.check()?;
    let (effects, values) = built_effects(order, &Sites::single_joint(&truth))?;
    let seconds = order.seconds.unwrap_or(SECONDS);
    let reference = match order.motion {
        Motion::Move { joint, .. } if joint != truth.name => {
            return Err(SimulateError::UnknownJoint {
                name: joint.to_owned(),
                known: truth.name,
            });
        }
        Motion::Usual | Motion::Move { .. } => {
            let part = match order.motion {
                Motion::Move { part, .. } => part,
                _ => 1.0,
            };
            let ladder = from_files::LadderOf::Usual { part };
            Some(from_files::single_joint_ladder(
                order.robot,
                &truth,
                ladder,
                seconds,
                order.seed,
            )?)
        }
        Motion::Trajectory(trajectory) => Some(from_files::single_joint_reference(
            order.robot,
            &truth,
            trajectory,
            order.seconds,
            order.seed,
        )?),
        Motion::Volts { .. } => None,
    };
    let control = from_files::control(order.robot, truth.control())?;
    let saturation = order.robot.control.saturation_v.or_else(|| {
        let limits = order.robot.limits.get(&truth.name)?;
        limits.torque.or(limits.volts)
    });
    let saturation = saturation.unwrap_or(f64::INFINITY);
    let start = initial.map_or(Ok(Start::Settled), InitialConditions::start)?;
    let driven = Driven {
        parameters: truth.parameters(),
        values,
        effects,
        start,
        reference,
        control,
        saturation: Some(saturation),
    };
    execute(order, &truth, driven)
}

fn serial<const J: usize>(
    order: &Order,
    initial: Option<&InitialConditions>,
) -> Result<SimulatedLog, SimulateError> {
    let truth = serial_experiment::truth::<J>(order)?;
    let (robot, theta) = truth.rigid_body();
    let places = Sites::serial(robot, theta, truth.sites());
    let (effects, values) = built_effects(order, &places)?;
    let reference = serial_experiment::reference(order, &truth)?;
    let control = from_files::control(order.robot, truth.control())?;
    let saturation = order.robot.control.saturation_v.unwrap_or(f64::INFINITY);
    let start = initial.map_or(Ok(Start::Settled), InitialConditions::start)?;
    let driven = Driven {
        parameters: truth.parameters(),
        values,
        effects,
        start,
        reference,
        control,
        saturation: Some(saturation),
    };
    execute(order, &truth, driven)
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

/// What the plant is run with.
struct Driven<const J: usize> {
    /// What is true of the plant, and of the effects.
    parameters: Vec<Parameter>,
    values: Vec<EffectValue>,
    effects: Effects,
    start: Start<J>,
    /// `None` where volts are played back.
    reference: Option<Reference<J>>,
    control: Control<J>,
    /// \[V\]; that of `[control]`, or 10 V, where absent.
    saturation: Option<f64>,
}

/// Runs the plant and lays the log out as the robot file's `[log]` reads it.
fn execute<P: Plant<J>, const J: usize>(
    order: &Order,
    plant: &P,
    driven: Driven<J>,
) -> Result<SimulatedLog, SimulateError> {
    let Driven {
        parameters,
        values: effect_values,
        effects,
        start,
        reference,
        control,
        saturation,
    } = driven;
    let (drive, own_seconds) = match (reference, order.motion) {
        (Some(reference), _) => {
            let seconds = match &reference.path {
                // A ladder lasts as long as it was built for; a list may end before the next sample.
                Path::Points(points) => Some(points.seconds()),
                Path::Fourier(series) => series.seconds(),
                _ => None,
            };
            (Drive::Follow { reference, control }, seconds)
        }
        (None, Motion::Volts { times, volts }) => {
            let (rows, rest) = volts.as_chunks::<J>();
            if !rest.is_empty() {
                return Err(SimulateError::Volts {
                    what: format!(
                        "the robot has {J} motors, and the rows do not divide into {J} volts"
                    ),
                });
            }
            // A log's clock need not start at 0.
            let first = times.first().copied().unwrap_or(0.0);
            let times: Vec<f64> = times.iter().map(|t| t - first).collect();
            let series = VoltSeries::new(times, rows.to_vec())?;
            let seconds = Some(series.seconds()).filter(|s| s.is_finite());
            (Drive::Volts(series), seconds)
        }
        (None, _) => {
            return Err(SimulateError::Reference {
                what: "there is neither a reference nor a series of volts".to_owned(),
            });
        }
    };
    let mut settings: Settings<J> = from_files::settings(order.robot)?;
    settings.seconds = order.seconds.or(own_seconds).unwrap_or(SECONDS);
    settings.seed = order.seed;
    settings.saturation = saturation
        .or(order.robot.control.saturation_v)
        .unwrap_or(settings.saturation);
    let recording = run(plant, effects, &start, &drive, &settings)?;
    let (header, values) = lay_out(order.robot, &recording);
    let rows = recording.rows().max(1) as f64;
    let saturated = (0..J).map(|i| {
        let count = recording
            .status
            .iter()
            .filter(|s| s[i] == Status::Saturated)
            .count();
        (recording.coordinates[i].clone(), count as f64 / rows)
    });
    Ok(SimulatedLog {
        header,
        values,
        truth: truth_of(order, &recording, parameters, effect_values),
        saturated: saturated.collect(),
        ending: recording.ending,
        limits: recording.limits,
    })
}

fn truth_of<const J: usize>(
    order: &Order,
    recording: &Recording<J>,
    parameters: Vec<Parameter>,
    effects: Vec<EffectValue>,
) -> TruthFile {
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
        model: match order.robot.robot.model {
            ModelKind::Cft => "cft",
            ModelKind::SingleJoint => "single-joint",
            ModelKind::Serial => "serial",
        }
        .to_owned(),
        setup: None,
        ending,
        volt_noise: recording.volt_noise.to_vec(),
        torque_noise: recording.torque_noise.to_vec(),
        parameters,
        effects,
    }
}

/// Header and rows under the names, signs, scales and offsets with which the robot file reads logs: joint
/// channels where it reads those, and for the CFT robot the raw channels and status behind them.
fn lay_out<const J: usize>(robot: &RobotFile, recording: &Recording<J>) -> (Vec<String>, Vec<f64>) {
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
        header.extend((1..=J).map(|i| format!("status_{i}")));
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
            values.extend(recording.status[k].map(|s| f64::from(s.code())));
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
