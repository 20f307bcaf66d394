//! External torques along a log or a stream, row by row, with alarms.

use std::io::Read;

use schemars::JsonSchema;
use serde::Serialize;

use crate::band::Directions;
use crate::held_out::hold_out::{Held, on_other_logs};
use crate::input::control::Control;
use crate::input::dataset::GivenModel;
use crate::input::error::IdentifyError;
use crate::input::in_use::{AlarmTorque, levers};
use crate::input::log::Log;
use crate::input::log_data::LogData;
use crate::input::repeated::each_log_once;
use crate::input::robot_setup::RobotSetup;
use crate::input::temperatures;
use crate::note::{ModelNote, StageNote};
use crate::observe::{
    AlarmDetector, Observer, ObserverRecipe, TorqueAlarm, TorqueExplainer, TorqueExplanation,
    recipe,
};
use cft_ident_core::motion::{FilterSettings, ZeroOrderHold};
use cft_ident_files::config::held_out::{HeldOut, TorqueExcesses};
use cft_ident_logs::log::{Block, Instant, Provenance, Reader};

/// Name of a stream in messages and results.
pub const STREAM: &str = "-";

/// Where rows come from.
pub enum RowSource {
    /// A log of any format, or one in memory.
    Log(Log),
    /// CSV with a header line, or JSON lines, as they arrive.
    Stream(Box<dyn Read + Send>),
}

/// When an alarm is given.
#[derive(Debug, Clone)]
pub struct WatchSettings<'a> {
    /// False alarms an hour.
    pub per_hour: f64,
    /// Logs of the robot with nothing touching it that the model has nothing from: what they leave stands for what
    /// the model file says.
    pub unloaded: &'a [Log],
}

/// What one row shows.
#[derive(Debug, Clone, Copy)]
pub struct WatchLine<'a> {
    /// Time of the row \[s\]: what it shows was [`Watched::delay_s`] before.
    pub t: f64,
    pub origin: Instant,
    /// External torque of every joint \[N or Nm\].
    pub external: &'a [f64],
    /// Its deviation where nothing touches the robot.
    pub std: &'a [f64],
    /// The alarm that is on.
    pub alarm: Option<&'a TorqueAlarm>,
}

/// A joint's threshold.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct WatchedJoint {
    pub joint: String,
    pub unit: String,
    /// Least and greatest threshold over the ranges of speed, where the logs of the fit determine the parameters \[unit\].
    pub threshold: [f64; 2],
    /// Force at `Watched::point` that the least threshold stands for [N]; null where the joint has no lever there.
    pub force_n: Option<f64>,
    /// Its threshold is so large beside its own torque that hardly anything is seen.
    pub blind: bool,
}

/// Share of a joint's greatest torque from which on a threshold shows only crashes.
const BLIND_SHARE: f64 = 0.5;

/// What was seen along a log or a stream.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Watched {
    pub joints: Vec<WatchedJoint>,
    /// The point that forces are reported at.
    pub point: String,
    /// False alarms an hour that were asked for.
    pub false_alarms_per_hour: f64,
    /// The rate that the unloaded motion proves, with 95 %: that which was asked for, or the greatest that its time
    /// without an alarm leaves possible, where that is more.
    pub proven_per_hour: f64,
    /// Time of unloaded motion from which the threshold was found [s].
    pub calibrated_s: f64,
    /// Time by which external torques are late [s].
    pub delay_s: Option<f64>,
    /// Rows for which there is an external torque, and the time that they take [s].
    pub samples: u64,
    pub duration_s: f64,
    /// Share of them beyond the threshold.
    pub beyond: f64,
    pub alarms: Vec<TorqueAlarm>,
    /// What changed on the robot, where that explains the alarms.
    pub explanation: Option<TorqueExplanation>,
    /// Why the input ended, where that was within a line or at one that cannot be read.
    pub ended_by: Option<String>,
    #[serde(skip)]
    pub error: Option<IdentifyError>,
    #[serde(skip)]
    pub inputs: Vec<Provenance>,
    #[serde(skip)]
    pub notes: Vec<StageNote>,
}

/// Filters of an observer: positions of all joints come through one, as external torques were learnt.
fn processing(setup: &RobotSetup, excesses: &TorqueExcesses) -> FilterSettings {
    let settings = setup.settings();
    settings.with_one_position_filter(excesses.position_cutoff_hz)
}

/// What untouched motion showed of external torques, where data were set aside for it.
fn learnt<'a>(
    model: &str,
    held: &[HeldOut],
    excesses: Option<&'a TorqueExcesses>,
) -> Result<&'a TorqueExcesses, IdentifyError> {
    let learnt = excesses.filter(|_| !held.is_empty());
    learnt.ok_or_else(|| IdentifyError::NothingHeldOut {
        model: model.to_owned(),
    })
}

/// The observer of [`watch`] as numbers, for rows `step_s` seconds apart and so many false alarms an hour.
///
/// # Errors
/// A model without data set aside, filters that the rate does not carry.
pub fn watch_recipe(
    given: &GivenModel,
    step_s: f64,
    per_hour: f64,
) -> Result<ObserverRecipe, IdentifyError> {
    let (name, file) = (given.name.as_str(), &given.file);
    let (setup, refined) = (&given.setup(), &given.numbers()?);
    let held = &file.held_out;
    let excesses = learnt(name, held, file.excesses.as_ref())?;
    let settings = processing(setup, excesses);
    let uncertain = Directions::of(file, &refined.model, held);
    let model = (refined, &uncertain);
    recipe(model, &settings, (held, excesses), step_s, per_hour)
        .map_err(|error| IdentifyError::motion(name, error))
}

/// Watches rows as they come; `line` gets what each shows and says whether to go on.
///
/// # Errors
/// A model without data set aside, an input whose first lines cannot be used, and interruption. An error behind the
/// first rows ends it with what was seen so far.
pub fn watch(
    given: &GivenModel,
    input: RowSource,
    settings: &WatchSettings,
    control: &Control,
    line: &mut dyn FnMut(&WatchLine) -> bool,
) -> Result<Watched, IdentifyError> {
    let (name, file) = (given.name.as_str(), &given.file);
    let (setup, refined) = (&given.setup(), &given.numbers()?);
    let (held, mut inputs) = match settings.unloaded {
        [] => (
            Held {
                joints: file.held_out.clone(),
                excesses: file.excesses.clone(),
            },
            Vec::new(),
        ),
        logs => {
            let watched = match &input {
                RowSource::Log(log) => vec![log.clone()],
                RowSource::Stream(_) => Vec::new(),
            };
            let roles = [("watched", watched), ("unloaded", logs.to_vec())];
            each_log_once(&roles, Some(&setup.file.layout()))?;
            let logs = LogData::read_all(setup, logs, &[], control)?;
            on_other_logs(setup, (name, file, refined), &logs, control)?
        }
    };
    let excesses = learnt(name, &held.joints, held.excesses.as_ref())?;
    let processing = processing(setup, excesses);
    let (cutoff, threshold) = (processing.cutoff_hz, excesses.threshold(settings.per_hour));
    let mut observer = Observer::new(refined.clone(), &processing)
        .map_err(|error| IdentifyError::motion(name, error))?
        .with_uncertain(Directions::of(file, &refined.model, &held.joints));
    let layout = setup.file.layout();
    let takes = refined.takes_temperatures();
    let mut warm = None;
    let (mut reader, of) = match input {
        RowSource::Stream(_) if takes => {
            return Err(temperatures::none_on(STREAM, refined));
        }
        RowSource::Stream(stream) => (
            Reader::of_stream(STREAM, stream, &layout)?,
            STREAM.to_owned(),
        ),
        RowSource::Log(log) => {
            let reader = match json_lines(&log) {
                Some(file) => Reader::of_stream(&log.name(), file, &layout)?,
                None => log.reader(&layout, setup.robot.joint_names(), control)?,
            };
            warm = takes.then(|| log.clone());
            (reader, log.name())
        }
    };
    let mut hold = setup
        .file
        .zero_order_hold(reader.layout().channels)
        .then(|| ZeroOrderHold::new(setup.robot.joints()));
    let mut alarms = AlarmDetector::new(&held.joints, threshold, cutoff);
    let mut explainer = TorqueExplainer::new(setup.robot.clone(), cutoff);
    let mut over = Vec::new();
    let mut span: Option<[f64; 2]> = None;
    let mut block = Block::default();
    let (mut more, mut goes_on, mut error) = (true, true, None);
    while more && goes_on {
        if control.stopped() {
            break;
        }
        match reader.read_on(&mut block) {
            Ok(read) => more = read,
            Err(found) => {
                // what came before it counts
                error = Some(IdentifyError::Log(found));
                block.clear();
                more = false;
            }
        }
        if let Some(hold) = &mut hold {
            hold.centre(&setup.robot, &mut block);
        }
        let origin = reader.origin();
        // from the first row on it is known where times are counted from
        if let Some(log) = warm.take_if(|_| !block.is_empty()) {
            observer.set_temperatures(setup.temperatures_along(refined, &log, origin)?);
        }
        let pushed = observer.push(&block, !more, &mut |o| {
            over.extend(alarms.take(o));
            if alarms.open().is_some() {
                explainer.take(o, alarms.std());
            }
            span = Some([span.map_or(o.t, |[from, _]| from), o.t]);
            goes_on &= line(&WatchLine {
                t: o.t,
                origin,
                external: o.external,
                std: alarms.std(),
                alarm: alarms.open(),
            });
        });
        if let Err(found) = pushed {
            error.get_or_insert(IdentifyError::motion(&of, found));
            more = false;
        }
    }
    over.extend(alarms.end());
    let [samples, beyond] = alarms.samples();
    if samples == 0
        && let Some(error) = error
    {
        return Err(error);
    }
    inputs.insert(0, reader.provenance()?);
    let of_reader = reader.warnings().into_iter().map(StageNote::OfReader);
    let far = far(excesses, settings.per_hour);
    let middle: Vec<f64> = (held.joints.iter())
        .map(|held| 0.5 * (held.positions_seen[0] + held.positions_seen[1]))
        .collect();
    let (levers, point) = levers(setup, &middle);
    let names = held.joints.iter().enumerate();
    let joints = names.map(|(j, held)| {
        let alarm = AlarmTorque::of(held, threshold, setup.robot.joint_kind(j), levers[j]);
        WatchedJoint {
            joint: held.joint.clone(),
            unit: setup.file.torque_unit(j).to_owned(),
            threshold: alarm.ends,
            force_n: alarm.force_n,
            blind: alarm.ends[0] > BLIND_SHARE * held.torque_seen,
        }
    });
    let joints: Vec<WatchedJoint> = joints.collect();
    let of_model = far.into_iter().chain(blind(&joints, &held.joints));
    let notes = of_reader.chain(of_model.map(StageNote::Model)).collect();
    Ok(Watched {
        point,
        joints,
        false_alarms_per_hour: settings.per_hour,
        proven_per_hour: proven_rate(excesses).max(settings.per_hour),
        calibrated_s: excesses.observed_s,
        delay_s: observer.delay_s(),
        samples,
        duration_s: span.map_or(0.0, |[from, to]| to - from),
        beyond: beyond as f64 / samples.max(1) as f64,
        explanation: (!over.is_empty())
            .then(|| explainer.explanation())
            .flatten(),
        alarms: over,
        ended_by: error.as_ref().map(ToString::to_string),
        error,
        inputs,
        notes,
    })
}

/// The bytes of a file of JSON lines.
fn json_lines(log: &Log) -> Option<Box<dyn Read + Send>> {
    let Log::File(spec) = log else {
        return None;
    };
    let mut head = [0; 64];
    let count = spec.stream().ok()?.read(&mut head).ok()?;
    let is_json = head[..count].trim_ascii_start().first() == Some(&b'{');
    spec.stream().ok().filter(|_| is_json)
}

/// The joints that cannot be watched.
fn blind(joints: &[WatchedJoint], held: &[HeldOut]) -> Vec<ModelNote> {
    let each = joints.iter().zip(held).filter(|(of, _)| of.blind);
    let noted = each.map(|(of, held)| ModelNote::Blind {
        joint: of.joint.clone(),
        threshold: of.threshold[0],
        torque: held.torque_seen,
        unit: of.unit.clone(),
    });
    noted.collect()
}

/// Events in a time without one that chance leaves possible with 95 %: exp(-3) = 0.05.
const UNSEEN: f64 = 3.0;

/// Alarms an hour of which unloaded motion without one proves that they are not more.
fn proven_rate(excesses: &TorqueExcesses) -> f64 {
    UNSEEN * 3600.0 / excesses.observed_s
}

/// A rate that the calibration is too short for.
fn far(excesses: &TorqueExcesses, per_hour: f64) -> Option<ModelNote> {
    let proven_per_hour = proven_rate(excesses);
    (per_hour < proven_per_hour).then_some(ModelNote::Extrapolated {
        per_hour,
        observed_s: excesses.observed_s,
        proven_per_hour,
    })
}
