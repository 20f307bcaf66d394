//! What the commands that work on logs share: the robot with its processing, and its logs opened.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::context::Context;
use super::error::CliError;
use super::reference::Reference;
use crate::config::RobotFile;
use crate::config::robot_file::{DifferencesKind, FilterKind};
use crate::friction::estimate::NARROWER;
use crate::friction::motions::motions;
use crate::friction::prepare::SmoothedMotion;
use crate::inspect::{Cutter, Fault, Gate};
use crate::log::{Block, Instant, Layout, LogError, LogSpec, Provenance, Reader, escape};
use crate::motion::{
    Differences, FilterSettings, ParallelFilter, RunError, Summary, TorqueTiming, ZeroOrderHold,
};
use crate::robot::{JointKind, Robot};

/// Cut-off of the position filter for the friction filter's known inputs [Hz], where the robot
/// file names none and the sampling rate allows it. Wide, because the acceleration of held joints
/// answers to reversals within milliseconds; wider would let in more of the encoders' steps.
const FRICTION_POSITION_CUTOFF_HZ: f64 = 100.0;

/// Most rows of a one-joint log: half an hour at 1 kHz. A row takes 80 bytes per joint for its
/// motion, smoothed twice, and 16 bytes per nuisance direction for each of at most three problems
/// at a time: about 1 kB for a robot of four joints.
const MOST_ROWS: usize = 2_000_000;

/// A one-joint log, read and smoothed.
pub struct OneJointLog {
    pub motions: Vec<SmoothedMotion>,
    /// The same with a narrower position filter.
    pub narrower: Vec<SmoothedMotion>,
    /// The torque is held from row to row.
    pub held: bool,
    pub provenance: Provenance,
    /// What the reader left out, dropped or chose.
    pub warnings: Vec<String>,
}

/// The same processing with a narrower position filter.
pub fn narrowed(settings: &FilterSettings, rate_hz: f64) -> FilterSettings {
    let plain = (6.0 * settings.cutoff_hz).min(0.4 * rate_hz);
    FilterSettings {
        q_cutoff_hz: Some(NARROWER * settings.q_cutoff_hz.unwrap_or(plain)),
        ..settings.clone()
    }
}

/// A robot as its file describes it.
#[derive(Debug, Clone)]
pub struct Machine {
    /// Name of the file, for messages.
    pub name: String,
    pub file: RobotFile,
    pub robot: Robot,
    /// What the first look at each log found: a log is opened several times.
    gates: Arc<Mutex<BTreeMap<String, Arc<Gate>>>>,
}

/// Why a fit refuses a log.
fn refused(spec: &LogSpec, fault: &Fault) -> CliError {
    let channel = fault.channel.as_deref().map(escape).unwrap_or_default();
    CliError::input(format!(
        "{}: column `{channel}` {}",
        escape(&spec.name()),
        fault.effect
    ))
    .hint(&fault.remedy)
}

/// Why a log could not be run through, decorated.
pub fn run_error(spec: &LogSpec, error: RunError<ReadError>) -> CliError {
    match error {
        RunError::Source(ReadError::Log(error)) => error.into(),
        RunError::Source(ReadError::Interrupted) => CliError::interrupted(),
        RunError::Motion(error) => CliError::input(format!("{}: {error}", spec.name())),
    }
}

/// What stops the reading of a log.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    #[error(transparent)]
    Log(#[from] LogError),
    #[error("interrupted")]
    Interrupted,
}

/// A log that is being read.
pub struct Open<'a> {
    reader: Reader,
    context: &'a Context,
    /// Brings held motor forces to the rows' own time and pose.
    centre: Option<(&'a Robot, ZeroOrderHold)>,
    name: String,
    gate: Arc<Gate>,
    cutter: Cutter,
}

impl Open<'_> {
    /// The next block, without the rows that are marked bad; false at the end.
    pub fn read(&mut self, block: &mut Block) -> Result<bool, ReadError> {
        loop {
            if self.context.interrupted() {
                return Err(ReadError::Interrupted);
            }
            let more = self.reader.read(block)?;
            if let Some((robot, held)) = &mut self.centre {
                held.centre(robot, block);
            }
            if block.tau.is_empty() {
                // a log without torques moves with none
                block.tau.resize(block.q.len(), 0.0);
            }
            self.cutter.cut(block);
            if !more || !block.is_empty() {
                return Ok(more);
            }
        }
    }

    /// The instant from which the times of the blocks are counted.
    pub fn origin(&self) -> Instant {
        self.gate.origin()
    }

    /// What was left out, dropped or chosen, once the last block is read.
    pub fn warnings(&self) -> Vec<String> {
        let mut out = self.reader.warnings();
        let found = self.gate.warnings().into_iter();
        out.extend(found.map(|text| format!("{}: {text}", self.name)));
        let removed = self.cutter.removed();
        if removed > 0 {
            out.push(format!(
                "{}: {removed} of {} rows are left out in all, those next to bad ones included; `cft-ident inspect` tells more",
                self.name,
                self.reader.samples()
            ));
        }
        out
    }

    /// Whether torques are held from row to row and so are means of two rows here.
    pub fn is_centred(&self) -> bool {
        self.centre.is_some()
    }

    /// Name, span, checksum and size of what was read.
    pub fn provenance(&self) -> Result<Provenance, CliError> {
        Ok(self.reader.provenance()?)
    }
}

impl Machine {
    /// Reads a robot file, or one that comes with the tool.
    pub fn load(path: &str) -> Result<Self, CliError> {
        Ok(Self::new(path, RobotFile::load(Path::new(path))?))
    }

    /// The robot of a file that is read already.
    pub fn new(name: &str, file: RobotFile) -> Self {
        let robot = file.robot();
        Machine {
            name: name.to_owned(),
            file,
            robot,
            gates: Arc::default(),
        }
    }

    /// Looks at a log before it is used, once.
    fn gate(
        &self,
        spec: &LogSpec,
        layout: &Layout,
        context: &Context,
    ) -> Result<Arc<Gate>, CliError> {
        let key = format!("{} {spec}", layout.torques.len());
        let known = || self.gates.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(gate) = known().get(&key) {
            return Ok(Arc::clone(gate));
        }
        let mut reader = Reader::open(spec, &layout.clone().as_logged())?;
        let gate = Gate::look(&mut reader, &|| context.interrupted())?;
        let gate = Arc::new(gate.ok_or_else(CliError::interrupted)?);
        if let Some(fault) = gate.refusal() {
            return Err(refused(spec, fault));
        }
        known().insert(key, Arc::clone(&gate));
        Ok(gate)
    }

    /// The fault for which a fit refuses a log, where it has one.
    pub fn fault(&self, spec: &LogSpec, context: &Context) -> Result<Option<Fault>, CliError> {
        let mut reader = Reader::open(spec, &self.file.layout().as_logged())?;
        let gate = Gate::look(&mut reader, &|| context.interrupted())?;
        let gate = gate.ok_or_else(CliError::interrupted)?;
        Ok(gate.refusal().cloned())
    }

    /// Opens a log of this layout.
    fn open_as<'a>(
        &self,
        spec: &LogSpec,
        layout: &Layout,
        context: &'a Context,
    ) -> Result<Open<'a>, CliError> {
        let gate = self.gate(spec, layout, context)?;
        Ok(Open {
            reader: Reader::open(spec, layout)?,
            context,
            centre: None,
            name: escape(&spec.name()),
            cutter: gate.cutter(self.settings().gap_factor),
            gate,
        })
    }

    /// Opens a log, its torques as logged, and says whether they are held from row to row.
    fn open_raw<'a>(
        &self,
        spec: &LogSpec,
        context: &'a Context,
    ) -> Result<(Open<'a>, bool), CliError> {
        let open = self.open_as(spec, &self.file.layout(), context)?;
        let held = self.file.zero_order_hold(open.reader.layout().channels);
        Ok((open, held))
    }

    /// Opens a log for its positions alone: it needs no torque channels.
    pub fn open_positions<'a>(
        &self,
        spec: &LogSpec,
        context: &'a Context,
    ) -> Result<Open<'a>, CliError> {
        self.open_as(spec, &self.file.layout().without_torques(), context)
    }

    /// The references of a log, where the robot file names one for every joint.
    pub fn open_reference(&self, spec: &LogSpec) -> Result<Option<Reference>, CliError> {
        match self.file.reference_layout() {
            Some(layout) => Ok(Some(Reference::new(Reader::open(spec, &layout)?))),
            None => Ok(None),
        }
    }

    /// Opens a log with every torque at the time and pose of its row.
    pub fn open<'a>(&'a self, spec: &LogSpec, context: &'a Context) -> Result<Open<'a>, CliError> {
        let (mut open, held) = self.open_raw(spec, context)?;
        open.centre = held.then(|| (&self.robot, ZeroOrderHold::new(self.robot.joints())));
        Ok(open)
    }

    /// Processing of logs for least squares and validation.
    pub fn settings(&self) -> FilterSettings {
        let f = &self.file.filter;
        let plain = FilterSettings::default();
        let order = f.order.map(|o| o as usize);
        FilterSettings {
            cutoff_hz: f.cutoff_hz.unwrap_or(plain.cutoff_hz),
            filter: match f.kind {
                Some(FilterKind::ChebyshevDecimate) => ParallelFilter::Chebyshev {
                    order: order.unwrap_or(8),
                    ripple_db: f.ripple_db.unwrap_or(0.05),
                },
                Some(FilterKind::Butterworth) | None => ParallelFilter::Butterworth {
                    order: order.unwrap_or(4),
                },
            },
            decimation: f.decimation.map(|d| d as usize),
            q_cutoff_hz: f.position_cutoff_hz,
            q_order: f.position_order.map_or(plain.q_order, |o| o as usize),
            differences: match f.differences {
                Some(DifferencesKind::Central) => Differences::Central,
                Some(DifferencesKind::HighOrder) | None => Differences::HighOrder,
            },
            // held torques are brought to their rows' time as the log is read
            torque: TorqueTiming::Sampled,
            gap_factor: f.gap_factor.unwrap_or(plain.gap_factor),
            q_trim_s: f.position_trim_s,
            trim_s: f.trim_s,
        }
    }

    /// Smoothing of the motion that the friction filter takes as known.
    fn friction_settings(&self, rate_hz: f64) -> FilterSettings {
        FilterSettings {
            q_cutoff_hz: Some(
                self.file
                    .filter
                    .position_cutoff_hz
                    .unwrap_or(FRICTION_POSITION_CUTOFF_HZ)
                    .min(0.2 * rate_hz),
            ),
            differences: Differences::HighOrder,
            q_trim_s: None,
            ..self.settings()
        }
    }

    /// Reads a one-joint log into memory and smooths its motion, once as declared and once with a
    /// narrower filter, by which the smoothing's own part in an estimate is seen.
    pub fn motions(&self, spec: &LogSpec, context: &Context) -> Result<OneJointLog, CliError> {
        let (mut log, held) = self.open_raw(spec, context)?;
        let mut whole = Block::default();
        let mut block = Block::default();
        loop {
            let more = log
                .read(&mut block)
                .map_err(|e| run_error(spec, RunError::Source(e)))?;
            if !more {
                break;
            }
            whole.t.extend_from_slice(&block.t);
            if whole.t.len() > MOST_ROWS {
                return Err(CliError::input(format!(
                    "{}: more than {MOST_ROWS} rows; the friction filter passes over a one-joint log many times and holds it in memory",
                    spec.name()
                ))
                .hint("give a span of it, such as FILE@0..600s: minutes are enough for friction"));
            }
            whole.q.extend_from_slice(&block.q);
            whole.tau.extend_from_slice(&block.tau);
        }
        let rate = match (whole.t.first(), whole.t.last()) {
            (Some(first), Some(last)) if last > first => {
                (whole.t.len() - 1) as f64 / (last - first)
            }
            _ => 1.0,
        };
        let declared = self.friction_settings(rate);
        let narrower = narrowed(&declared, rate);
        let smooth = |settings: &FilterSettings| {
            let n = self.robot.joints();
            motions(&whole.t, &whole.q, &whole.tau, n, settings)
                .map_err(|e| CliError::input(format!("{}: {e}", spec.name())))
        };
        Ok(OneJointLog {
            motions: smooth(&declared)?,
            narrower: smooth(&narrower)?,
            held,
            warnings: log.warnings(),
            provenance: log.provenance()?,
        })
    }

    /// Travel of a joint by its machine, else by the file's limits; a turn, or a metre, where neither
    /// has one.
    fn range(&self, j: usize, name: &str) -> f64 {
        if let Some(range) = self.robot.transmission().full_travel(j) {
            return range;
        }
        let limits = self.file.limits.get(name).and_then(|l| l.position);
        match (limits, self.robot.joint_kind(j)) {
            (Some([low, high]), _) => high - low,
            (None, JointKind::Revolute) => std::f64::consts::TAU,
            (None, JointKind::Prismatic) => 1.0,
        }
    }

    /// Full travel of each joint, by which motions of metres and radians are compared.
    pub fn ranges(&self) -> Vec<f64> {
        if self.robot.joints() == 1 {
            return vec![f64::MIN_POSITIVE];
        }
        let names = self.robot.joint_names().iter().enumerate();
        let range = |(j, name): (usize, &String)| self.range(j, name);
        names.map(range).collect()
    }
}

/// Warnings about what the processing left out of a log.
pub fn summary_warnings(spec: &LogSpec, summary: &Summary) -> Vec<String> {
    let mut out = Vec::new();
    let name = spec.name();
    if summary.skipped.segments > 0 {
        let spans: Vec<String> = summary
            .skipped
            .spans_s
            .iter()
            .take(3)
            .map(|[a, b]| format!("{a:.3}..{b:.3} s"))
            .collect();
        out.push(format!(
            "{name}: {} stretch(es) between gaps are too short to filter and are left out ({} samples; {})",
            summary.skipped.segments,
            summary.skipped.samples,
            spans.join(", ")
        ));
    }
    if summary.segments > 1 {
        out.push(format!(
            "{name}: gaps part it into {} stretches; nothing is differentiated across them",
            summary.segments
        ));
    }
    if summary.interpolated > 0 {
        out.push(format!(
            "{name}: the clock is uneven, {} of {} samples were interpolated onto an even one",
            summary.interpolated, summary.samples
        ));
    }
    out
}
