//! A robot as its file describes it: its dynamics, and how its logs are read and processed.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::control::Control;
use super::error::IdentifyError;
use super::first_look::FirstLook;
use super::free_swing::moves_freely;
use super::held_torque::HeldTorque;
use super::log::Log;
use super::open_log::OpenLog;
use super::reference::LoggedReference;
use super::speeds::SpeedMeter;
use cft_ident_core::friction::estimate::NARROWER;
use cft_ident_core::motion::{
    DifferenceFormula, FilterSettings, ParallelFilter, TorqueTiming, ZeroOrderHold,
};
use cft_ident_core::robot::{JointKind, Robot};
use cft_ident_core::validate::TorqueErrors;
use cft_ident_files::config::robot_file::{DifferencesKind, FilterKind};
use cft_ident_files::config::{ModelFile, RobotFile};
use cft_ident_logs::inspect::{InspectionGate, LogFault};
use cft_ident_logs::log::{Block, Layout, LogError, Reader, RowFault, escape};

/// Share of a period of the cut-off for which rows may be missing: interpolation is at the noise there.
const BRIDGED_PERIODS: f64 = 0.125;

/// The same processing with a narrower position filter.
pub fn narrowed(settings: &FilterSettings, rate_hz: f64) -> FilterSettings {
    let each = settings.joint_q_cutoffs_hz.iter();
    FilterSettings {
        q_cutoff_hz: Some(NARROWER * settings.plain_q_cutoff_hz(rate_hz)),
        joint_q_cutoffs_hz: each.map(|hz| NARROWER * hz).collect(),
        ..settings.clone()
    }
}

/// A robot as its file describes it.
#[derive(Debug, Clone)]
pub struct LoggedRobot {
    /// Name of the file, for messages.
    pub name: String,
    pub file: RobotFile,
    pub robot: Robot,
    /// Channels that are no torques are taken as they are, one gain for all joints.
    pub(crate) as_declared: bool,
    /// Position cut-offs that were found from logs, in joint order \[Hz\]; empty where none were.
    pub(crate) position_cutoffs_hz: Arc<Vec<f64>>,
    /// What the first look at each log found: a log is opened several times.
    pub(crate) looks: Arc<Mutex<BTreeMap<String, Arc<FirstLook>>>>,
    /// Torques that are taken off logs as they are read, by log.
    pub(crate) held: Arc<BTreeMap<String, HeldTorque>>,
}

impl LoggedRobot {
    /// Reads a robot file, or one that comes with the tool, such as `configs/cft.toml`.
    ///
    /// # Errors
    /// A file that cannot be read or used.
    pub fn load(path: &str) -> Result<Self, IdentifyError> {
        Ok(Self::new(path, RobotFile::load(Path::new(path))?))
    }

    /// The robot of a file that is read already.
    pub fn new(name: &str, file: RobotFile) -> Self {
        let robot = file.robot();
        LoggedRobot {
            name: name.to_owned(),
            file,
            robot,
            position_cutoffs_hz: Arc::default(),
            looks: Arc::default(),
            held: Arc::default(),
            as_declared: false,
        }
    }

    /// The robot of a model, its set-up kept as it is declared where that of the model was.
    pub fn of_model(name: &str, model: &ModelFile) -> Self {
        LoggedRobot {
            as_declared: model.provenance.as_declared,
            ..Self::new(name, model.robot.clone())
        }
    }

    /// The same robot with another file, which its logs are looked at again by.
    pub(crate) fn with_file(&self, file: RobotFile) -> Self {
        LoggedRobot {
            as_declared: self.as_declared,
            ..LoggedRobot::new(&self.name, file)
        }
    }

    /// The same robot, its file taken at its word: a set-up that contradicts itself or the logs ends no
    /// stage.
    pub fn as_declared(self) -> Self {
        LoggedRobot {
            as_declared: true,
            ..self
        }
    }

    /// Whether torques of all joints count in units that gains relate to each other.
    ///
    /// # Errors
    /// [`IdentifyError::WithoutGains`] for a robot of several joints whose channels are currents, say.
    pub fn check_gains(&self) -> Result<(), IdentifyError> {
        let found = self.file.without_gains();
        let Some((_, unit)) = found.first().filter(|_| !self.as_declared) else {
            return Ok(());
        };
        let names = self.robot.joint_names();
        let joints: Vec<&str> = found.iter().map(|(j, _)| names[*j].as_str()).collect();
        Err(IdentifyError::WithoutGains {
            robot: escape(&self.name),
            joints: joints.join(", "),
            unit,
        })
    }

    /// Looks at a log before it is used, once.
    fn first_look(
        &self,
        log: &Log,
        layout: &Layout,
        control: &Control,
    ) -> Result<Arc<FirstLook>, IdentifyError> {
        let key = format!("{} {}", layout.torques.len(), log.key());
        let known = || self.looks.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(look) = known().get(&key) {
            return Ok(Arc::clone(look));
        }
        let mut look = self.look(log, layout, control)?;
        let off = look.gate.off();
        let kept = self.file.log.keep.contains(&RowFault::StuckChannel);
        if !off.is_empty() && look.gate.refusal().is_none() {
            let freely = kept || self.moves_freely(log, layout, (&look, &off), control)?;
            look.gate.set_freely(freely);
        }
        if let Some(rate_hz) = look.poses_hz {
            return Err(IdentifyError::Poses {
                log: escape(&log.name()),
                rate_hz,
            });
        }
        let look = Arc::new(look);
        if let Some(fault) = look.gate.refusal() {
            return Err(IdentifyError::Refused {
                log: escape(&log.name()),
                fault: Box::new(fault.clone()),
            });
        }
        known().insert(key, Arc::clone(&look));
        Ok(look)
    }

    /// Refuses logs of held poses, which say nothing of inertia: gravity is fitted to them another way.
    ///
    /// # Errors
    /// [`IdentifyError::Held`] where each log holds pose after pose, and what keeps a log from being read.
    pub fn check_moving(&self, logs: &[Log], control: &Control) -> Result<(), IdentifyError> {
        let mut held = None;
        for log in logs {
            if matches!(log, Log::Reduced(_)) {
                return Ok(());
            }
            let look = self.first_look(log, &self.file.layout(), control)?;
            let Some(share) = look.held_share else {
                return Ok(());
            };
            held = Some(IdentifyError::Held {
                log: escape(&log.name()),
                share,
            });
        }
        held.map_or(Ok(()), Err)
    }

    /// Speed up to which each joint rests, by the log in which it moves most [m/s or rad/s].
    pub(crate) fn rest_speeds(
        &self,
        logs: &[Log],
        control: &Control,
    ) -> Result<Vec<f64>, IdentifyError> {
        self.greatest(logs, |look| &look.rest_speed, control)
    }

    /// Greatest speed of every joint in these logs [m/s or rad/s].
    pub(crate) fn fastest(
        &self,
        logs: &[Log],
        control: &Control,
    ) -> Result<Vec<f64>, IdentifyError> {
        let (reduced, whole): (Vec<Log>, Vec<Log>) =
            (logs.iter().cloned()).partition(|log| matches!(log, Log::Reduced(_)));
        let mut fastest = self.greatest(&whole, |look| &look.fastest, control)?;
        for log in &reduced {
            if let Log::Reduced(part) = log {
                let pairs = fastest.iter_mut().zip(&part.fastest);
                pairs.for_each(|(fastest, of_log)| *fastest = of_log.max(*fastest));
            }
        }
        Ok(fastest)
    }

    /// What the first looks at logs found of each joint, the greatest of all logs.
    fn greatest(
        &self,
        logs: &[Log],
        of: impl Fn(&FirstLook) -> &[f64],
        control: &Control,
    ) -> Result<Vec<f64>, IdentifyError> {
        let mut greatest = vec![0.0_f64; self.robot.joints()];
        for log in logs {
            let look = self.first_look(log, &self.file.layout(), control)?;
            for (greatest, of_log) in greatest.iter_mut().zip(of(&look)) {
                *greatest = of_log.max(*greatest);
            }
        }
        Ok(greatest)
    }

    /// First and last time of a log, by its own clock [s].
    pub(crate) fn bounds(&self, log: &Log, control: &Control) -> Result<[f64; 2], IdentifyError> {
        let look = self.first_look(log, &self.file.layout(), control)?;
        let zero = look.gate.origin().seconds();
        Ok(look.bounds.map(|t| zero + t))
    }

    /// Time of the first row that is read of a log, as its rows have it [s].
    pub(crate) fn first_row(&self, log: &Log, control: &Control) -> Result<f64, IdentifyError> {
        let look = self.first_look(log, &self.file.layout(), control)?;
        Ok(look.bounds[0])
    }

    /// Whether numbers of these logs are bridged.
    pub(crate) fn bridges(&self, logs: &[Log], control: &Control) -> Result<bool, IdentifyError> {
        for log in logs {
            let look = self.first_look(log, &self.file.layout(), control)?;
            if !look.gate.mending().bridges.is_empty() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The same robot whose logs are not mended of a fault.
    pub(crate) fn keeping(&self, fault: RowFault) -> LoggedRobot {
        let mut file = self.file.clone();
        file.log.keep.push(fault);
        LoggedRobot {
            file,
            looks: Arc::default(),
            ..self.clone()
        }
    }

    /// Whether the robot moves as without its motors where torques are exactly 0.
    fn moves_freely(
        &self,
        log: &Log,
        layout: &Layout,
        (look, off): (&FirstLook, &[(usize, [f64; 2])]),
        control: &Control,
    ) -> Result<bool, IdentifyError> {
        let mut open = self.opened(log, layout, Arc::new(look.clone()), control)?;
        let of_joints = open.reader.layout().conversion.is_none();
        if self.file.zero_order_hold(open.reader.layout().channels) {
            open.centre = Some((&self.robot, ZeroOrderHold::new(self.robot.joints())));
        }
        // Behind coupled gears the motors' channels are not the joints'.
        let all =
            |(_, span): &(usize, [f64; 2])| (0..self.robot.joints()).map(|j| (j, *span)).collect();
        let off = match of_joints {
            true => off.to_vec(),
            false => off.iter().flat_map::<Vec<_>, _>(all).collect(),
        };
        moves_freely(&self.robot, &self.settings(), &log.name(), &mut open, &off)
    }

    /// The fault for which a fit refuses a log, where it has one.
    pub fn fault(&self, log: &Log, control: &Control) -> Result<Option<LogFault>, IdentifyError> {
        let look = self.look(log, &self.file.layout(), control)?;
        Ok(look.gate.refusal().cloned())
    }

    fn look(
        &self,
        log: &Log,
        layout: &Layout,
        control: &Control,
    ) -> Result<FirstLook, IdentifyError> {
        let as_logged = layout.clone().as_logged();
        let speeds = RefCell::new(SpeedMeter::new());
        let open = || {
            // Of a second reading, which mends what hides the rest, the speeds are right.
            speeds.replace(SpeedMeter::new());
            self.reader(log, &as_logged)
        };
        let mut meter = |block: &Block, read: &Layout| {
            let layouts = [Some(layout), layout.otherwise.as_deref()];
            let declared = layouts.into_iter().flatten();
            let mut declared = declared.filter(|l| l.channels == read.channels);
            let conversion = declared.next().and_then(|l| l.conversion.as_ref());
            speeds.borrow_mut().take(block, conversion);
        };
        let keep = &self.file.log.keep;
        let gate = InspectionGate::look(&open, keep, &|| control.stopped(), &mut meter)?;
        Ok(FirstLook {
            gate: gate.ok_or(IdentifyError::Interrupted)?,
            rest_speed: speeds.borrow().resting(),
            fastest: speeds.borrow().fastest(),
            bounds: speeds.borrow().bounds(),
            poses_hz: speeds.borrow().poses_hz(),
            held_share: speeds.borrow().held_share(),
            velocities: speeds.borrow().velocities(),
        })
    }

    fn reader(&self, log: &Log, layout: &Layout) -> Result<Reader, LogError> {
        log.reader(layout, self.robot.joint_names())
    }

    /// Opens a log of this layout.
    fn open_as<'a>(
        &self,
        log: &Log,
        layout: &Layout,
        control: &'a Control,
    ) -> Result<OpenLog<'a>, IdentifyError> {
        let look = self.first_look(log, layout, control)?;
        self.opened(log, layout, look, control)
    }

    /// Opens a log that was looked at.
    fn opened<'a>(
        &self,
        log: &Log,
        layout: &Layout,
        look: Arc<FirstLook>,
        control: &'a Control,
    ) -> Result<OpenLog<'a>, IdentifyError> {
        let mut reader = self.reader(log, layout)?;
        reader.mend(look.gate.mending());
        Ok(OpenLog {
            reader,
            control,
            centre: None,
            held: None,
            name: escape(&log.name()),
            cutter: look.gate.cutter(&|dt| self.settings().longest_step(dt)),
            look,
        })
    }

    /// Opens a log, its torques as logged, and says whether each holds until the next row.
    pub(crate) fn open_raw<'a>(
        &self,
        log: &Log,
        control: &'a Control,
    ) -> Result<(OpenLog<'a>, bool), IdentifyError> {
        let open = self.open_as(log, &self.file.layout(), control)?;
        let zero_order_hold = self.file.zero_order_hold(open.reader.layout().channels);
        Ok((open, zero_order_hold))
    }

    /// Opens a log for its positions alone: it needs no torque channels.
    pub fn open_positions<'a>(
        &self,
        log: &Log,
        control: &'a Control,
    ) -> Result<OpenLog<'a>, IdentifyError> {
        self.open_as(log, &self.file.layout().without_torques(), control)
    }

    /// The references of a log, where the robot file names one for every joint.
    pub(crate) fn open_reference(
        &self,
        log: &Log,
    ) -> Result<Option<LoggedReference>, IdentifyError> {
        let plain = || self.file.layout().without_torques();
        let opened = match log {
            Log::File(_) => self
                .file
                .reference_layout()
                .map(|layout| (log.clone(), layout)),
            Log::Arrays(arrays) => arrays
                .references()
                .map(|references| (Log::Arrays(Arc::clone(references)), plain())),
            Log::Reduced(_) => None,
        };
        let Some((log, layout)) = opened else {
            return Ok(None);
        };
        Ok(Some(LoggedReference::new(self.reader(&log, &layout)?)))
    }

    /// Opens a log as it was logged, in SI units: motors' channels stay what they are.
    pub(crate) fn open_channels<'a>(
        &self,
        log: &Log,
        control: &'a Control,
    ) -> Result<OpenLog<'a>, IdentifyError> {
        self.open_as(log, &self.file.layout().as_logged(), control)
    }

    /// Opens a log with every torque at the time and pose of its row.
    pub fn open<'a>(
        &'a self,
        log: &Log,
        control: &'a Control,
    ) -> Result<OpenLog<'a>, IdentifyError> {
        let (mut open, zero_order_hold) = self.open_raw(log, control)?;
        open.centre =
            zero_order_hold.then(|| (&self.robot, ZeroOrderHold::new(self.robot.joints())));
        open.held = self.held.get(&log.key());
        Ok(open)
    }

    /// Names the unit of every joint's torque as its channel has it.
    pub(crate) fn name_units(&self, errors: &mut TorqueErrors) {
        for (j, error) in errors.joints.iter_mut().enumerate() {
            error.unit = self.file.torque_unit(j);
        }
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
            joint_q_cutoffs_hz: self.position_cutoffs_hz.to_vec(),
            q_order: f.position_order.map_or(plain.q_order, |o| o as usize),
            differences: match f.differences {
                Some(DifferencesKind::Central) => DifferenceFormula::Central,
                Some(DifferencesKind::HighOrder) | None => DifferenceFormula::HighOrder,
            },
            // torques that hold are brought to their rows' time as the log is read
            torque: TorqueTiming::Sampled,
            gap_factor: f.gap_factor.unwrap_or(plain.gap_factor),
            // a factor that is declared is meant
            bridge_s: match f.gap_factor {
                Some(_) => 0.0,
                None => BRIDGED_PERIODS / f.cutoff_hz.unwrap_or(plain.cutoff_hz),
            },
            q_trim_s: f.position_trim_s,
            trim_s: f.trim_s,
            // each log says when its joints rest
            rest_speed: Vec::new(),
            weighs_rests: true,
            thin: false,
        }
    }

    /// Travel of a joint by its machine, else by the file's limits; a turn, or a metre, where neither has one.
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
