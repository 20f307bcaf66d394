//! A simulation as the user orders it: robot file, model, motion, effects; and the log that comes back.

use cft_ident_core::explain::ErrorText;
use std::ops::ControlFlow;

use super::SimulateError;
use super::effects::{EffectSpec, EffectValue, PlantEffects, RobotSites};
use super::experiment::{Experiment, SECONDS};
use super::log_layout::LogLayout;
use super::mechanism::Mechanism;
use super::plant::Plant;
use super::recorder::{LogRecorder, RowSpool};
use super::reference::Path;
use super::run::{MotionStart, MotorInput, run_in_blocks};
use super::settings_file;
use super::simulated_run::{LimitEvent, MotorStatus, RunEnding, SimulatedRun};
use super::temperature::PlantTemperatures;
use super::truth::TruthFile;
use super::volts::VoltSeries;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::robot_file::RobotFile;
use cft_ident_logs::log::DeclaredChannels;

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

/// What is known of a simulated log beside its rows.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulationSummary {
    pub truth: TruthFile,
    pub limits: Vec<LimitEvent>,
    pub ending: RunEnding,
    /// Share of the rows at which each motor channel is saturated, by coordinate.
    pub saturated: Vec<(String, f64)>,
    /// Effects of the model that are there for prediction alone and that no machine can have, with why.
    pub left_out: Vec<String>,
}

/// A simulated log in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedLog {
    /// Column names.
    pub header: Vec<String>,
    /// Rows, one after the other.
    pub values: Vec<f64>,
    pub truth: TruthFile,
    pub limits: Vec<LimitEvent>,
    pub ending: RunEnding,
    /// Share of the rows at which each motor channel is saturated, by coordinate.
    pub saturated: Vec<(String, f64)>,
    /// Effects of the model that are there for prediction alone and that no machine can have, with why.
    pub left_out: Vec<String>,
}

impl SimulatedLog {
    /// The rows.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.header.len())
    }
}

/// Takes the rows of a simulated log.
pub trait Rows {
    /// Called while the robot moves and no row is ready yet: whether to go on.
    fn goes_on(&mut self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Takes the next rows, one after the other, each with a number for every name of the header; whether to go on.
    fn take(&mut self, header: &[String], values: &[f64]) -> ControlFlow<()>;
}

/// Rows that are handed on at once.
const BLOCK: usize = 4096;

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
    fn start<const J: usize>(
        &self,
        mechanism: &Mechanism<J>,
    ) -> Result<MotionStart<J>, SimulateError> {
        let of = |numbers: &[f64]| {
            let widened = mechanism.widened(numbers, 0.0);
            widened.ok_or(SimulateError::Parameter {
                name: "number of initial conditions of a kind",
                value: numbers.len() as f64,
                rule: "must be one per motor",
            })
        };
        Ok(MotionStart::State {
            position: of(&self.position)?,
            speed: of(&self.speed)?,
        })
    }
}

/// Simulates what is ordered, from the settled start ([`MotionStart::Settled`]).
///
/// # Errors
/// [`SimulateError`]; reaching a limit is none.
pub fn simulate(order: &Order) -> Result<SimulatedLog, SimulateError> {
    simulate_from(order, None)
}

/// Simulates what is ordered, from initial conditions where they are given.
pub fn simulate_from(
    order: &Order,
    initial: Option<&InitialConditions>,
) -> Result<SimulatedLog, SimulateError> {
    struct InMemory(Vec<String>, Vec<f64>);
    impl Rows for InMemory {
        fn take(&mut self, header: &[String], values: &[f64]) -> ControlFlow<()> {
            self.0 = header.to_vec();
            self.1.extend_from_slice(values);
            ControlFlow::Continue(())
        }
    }
    let mut rows = InMemory(Vec::new(), Vec::new());
    let simulated = run_any(order, initial, &mut rows, true)?;
    Ok(SimulatedLog {
        header: rows.0,
        values: rows.1,
        truth: simulated.truth,
        limits: simulated.limits,
        ending: simulated.ending,
        saturated: simulated.saturated,
        left_out: simulated.left_out,
    })
}

/// Simulates what is ordered and hands the rows on block by block, so that memory does not grow with the log;
/// only a log with a fault of the data is simulated as a whole first.
pub fn simulate_rows(
    order: &Order,
    initial: Option<&InitialConditions>,
    rows: &mut dyn Rows,
) -> Result<SimulationSummary, SimulateError> {
    run_any(order, initial, rows, false)
}

fn run_any(
    order: &Order,
    initial: Option<&InitialConditions>,
    rows: &mut dyn Rows,
    in_memory: bool,
) -> Result<SimulationSummary, SimulateError> {
    match order.robot.joint_names().len() {
        1 => run_order::<1>(order, initial, rows, in_memory),
        2 => run_order::<2>(order, initial, rows, in_memory),
        // others share the code of a few widths, of which each takes a while to compile
        3..=4 => run_order::<4>(order, initial, rows, in_memory),
        5..=8 => run_order::<8>(order, initial, rows, in_memory),
        _ => run_order::<32>(order, initial, rows, in_memory),
    }
}

/// Runs the order with vectors of room for J joints, and lays the log out as the robot file's `[log]` reads it.
fn run_order<const J: usize>(
    order: &Order,
    initial: Option<&InitialConditions>,
    rows: &mut dyn Rows,
    in_memory: bool,
) -> Result<SimulationSummary, SimulateError> {
    let plant = Plant::<J>::of(order.robot, order.model)?;
    let declared = &order.robot.sensors.temperature;
    let warm = PlantTemperatures::of(declared, plant.mechanism.robot.joint_names());
    let sites = RobotSites {
        temperatures: warm.clone(),
        ..RobotSites::of(&plant)?
    };
    let (effects, effect_values, left_out) = built_effects(order, &sites)?;
    let mechanism = &plant.mechanism;
    let mut settings = settings_file::settings(order.robot, mechanism)?;
    settings.seconds = order.seconds.unwrap_or(SECONDS);
    settings.seed = order.seed;
    // A fault of the data may reach back, or ahead, as far as it likes.
    let in_memory = in_memory || effects.first_fault().is_some();
    // before a ladder of that length is built
    settings.samples(in_memory)?;
    let (drive, own_seconds) = drive(order, &plant)?;
    let start = initial.map_or(Ok(MotionStart::Settled), |given| given.start(mechanism))?;
    settings.seconds = order.seconds.or(own_seconds).unwrap_or(SECONDS);
    settings.samples(in_memory)?;

    let mut recorder = LogRecorder::new(&settings.sensors, settings.seed);
    let mut waiting = RowSpool::new(mechanism.joints());
    let block = (!in_memory).then_some(BLOCK);
    let (mut run, effects) = run_in_blocks(
        &plant,
        effects,
        &start,
        &drive,
        &settings,
        block,
        &mut |block| {
            recorder.hear(block);
            waiting.push(block)?;
            go_on(rows.goes_on())
        },
    )?;
    recorder.hear(&run);
    let layout = LogLayout::of(order.robot, &run, warm);
    let (mut saturated, mut given) = ([0_u64; J], 0_u64);
    let mut give = |run: &mut SimulatedRun<J>| {
        recorder.measure(run, mechanism, &effects);
        given += run.rows() as u64;
        for (i, status) in run.status.iter().flat_map(|row| row.iter().enumerate()) {
            saturated[i] += u64::from(*status == MotorStatus::Saturated);
        }
        go_on(rows.take(&layout.header, &layout.values(run)))
    };
    match in_memory {
        true => give(&mut run)?,
        false => {
            waiting.push(&run)?;
            let mut waited = waiting.rewind()?;
            while waited.next(BLOCK as u64, &mut run)? {
                give(&mut run)?;
            }
        }
    }
    let shares = saturated.map(|count| count as f64 / given.max(1) as f64);
    Ok(SimulationSummary {
        truth: truth_of(order, &plant, &run, effect_values),
        saturated: run.coordinates.iter().cloned().zip(shares).collect(),
        ending: run.ending,
        limits: run.limits,
        left_out,
    })
}

fn go_on(wish: ControlFlow<()>) -> Result<(), SimulateError> {
    match wish {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(SimulateError::Stopped),
    }
}

/// What drives the motors, and how long it lasts where it says so \[s\].
fn drive<const J: usize>(
    order: &Order,
    plant: &Plant<J>,
) -> Result<(MotorInput<J>, Option<f64>), SimulateError> {
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
        return Ok((MotorInput::Follow { reference, control }, seconds));
    }
    let Experiment::Volts { times, volts } = experiment else {
        let what = "there is neither a reference nor a series of volts";
        return Err(SimulateError::reference(ErrorText::new(what)));
    };
    let n = mechanism.joints();
    if !volts.len().is_multiple_of(n) {
        return Err(SimulateError::Volts {
            what: format!("the robot has {n} motors, and the rows do not divide into {n} volts")
                .into(),
        });
    }
    let rows = volts.chunks_exact(n);
    let rows = rows.filter_map(|row| mechanism.widened(row, 0.0)).collect();
    // A log's clock need not start at 0.
    let first = times.first().copied().unwrap_or(0.0);
    let times: Vec<f64> = times.iter().map(|t| t - first).collect();
    let series = VoltSeries::new(times, rows)?;
    let seconds = Some(series.seconds()).filter(|s| s.is_finite());
    Ok((MotorInput::Volts(series), seconds))
}

/// Effects of the model, then those of the order; what of the model is left out, and why.
fn built_effects(
    order: &Order,
    sites: &RobotSites,
) -> Result<(PlantEffects, Vec<EffectValue>, Vec<String>), SimulateError> {
    let (mut asked, mut left_out) = (Vec::new(), Vec::new());
    if let Some((file, model)) = order.model {
        for (place, effect) in model.effects.iter().enumerate() {
            let values = effect.parameters.iter();
            let spec = EffectSpec {
                name: effect.name.clone(),
                joint: effect.joint.clone(),
                values: values.map(|(key, p)| (key.clone(), p.value)).collect(),
                own: None,
            }
            .or_own(&model.candidates);
            // Tried alone, so that what is wrong with it is said of the file and not of the command line.
            match PlantEffects::build(std::slice::from_ref(&spec), sites) {
                Ok(_) => asked.push(spec),
                // what is no statement on the machine need not be possible on one
                Err(source @ SimulateError::EffectNumber { .. }) if effect.prediction_only => {
                    left_out.push(source.to_string());
                }
                Err(source) => {
                    return Err(SimulateError::ModelEffect {
                        file: file.to_owned(),
                        number: place + 1,
                        name: effect.name.clone(),
                        source: Box::new(source),
                    });
                }
            }
        }
    }
    asked.extend(order.effects.iter().cloned());
    let (effects, values) = PlantEffects::build(&asked, sites)?;
    let joint_channels = order.robot.layout().channels == DeclaredChannels::Joint;
    match effects.first_fault() {
        Some(fault) if !joint_channels => Err(SimulateError::EffectPlace {
            effect: fault.to_owned(),
            place: "this log".to_owned(),
            why: ErrorText::new("the robot file's [log] has the motors' channels alone, and faults of the data sit in joint channels").remedy("let [log] read those"),
        }),
        _ => Ok((effects, values, left_out)),
    }
}

fn truth_of<const J: usize>(
    order: &Order,
    plant: &Plant<J>,
    recording: &SimulatedRun<J>,
    effects: Vec<EffectValue>,
) -> TruthFile {
    let robot = &plant.mechanism.robot;
    let (n, setup) = (robot.joints(), robot.transmission().setup());
    let mut ending = match recording.ending {
        RunEnding::Completed => "completed".to_owned(),
        RunEnding::StoppedAtLimit => "stopped at a limit".to_owned(),
    };
    for LimitEvent {
        coordinate,
        value,
        t,
        ..
    } in &recording.limits
    {
        ending += &format!("; {coordinate} = {value:.5} at t = {t:.4} s");
    }
    TruthFile {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: order.seed,
        model: order.robot.robot.model.name().to_owned(),
        setup: setup.map(|setup| setup.name().to_owned()),
        ending,
        volt_noise: recording.volt_noise[..n].to_vec(),
        torque_noise: recording.torque_noise[..n].to_vec(),
        parameters: plant.parameters(),
        effects,
    }
}
