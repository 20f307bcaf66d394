//! A log as stages take it: read by a robot file.

use std::sync::Arc;

use super::control::Control;
use super::error::IdentifyError;
use super::free_swing::moves_freely;
use super::log::{Log, arrays_layout};
use super::reference::LoggedReference;
use super::robot_setup::RobotSetup;
use cft_ident_logs::log::{Layout, LogError, RowFault, escape};
use cft_ident_logs::recording::{Recording, RecordingRequest, RowBlocks, TorqueCourse};

/// A log that was read.
#[derive(Debug, Clone)]
pub struct LogData {
    /// Where it was read from.
    pub source: Log,
    recording: Arc<Recording>,
}

impl LogData {
    /// Reads logs by the channels of a robot file; what one of `beside` holds is not parsed again. A log with a fault
    /// for which fits refuse it is read, and refused where its rows are asked for.
    ///
    /// # Errors
    /// Logs that cannot be read, reduced ones among them.
    pub fn read_all(
        setup: &RobotSetup,
        logs: &[Log],
        beside: &[&[LogData]],
        control: &Control,
    ) -> Result<Vec<Self>, IdentifyError> {
        let layout = setup.file.layout();
        let mut all: Vec<Self> = Vec::with_capacity(logs.len());
        for log in logs {
            let beside: Vec<&LogData> = beside.iter().copied().flatten().chain(&all).collect();
            let read = Self::read_by(setup, log, &layout, &beside, control)?;
            all.push(read);
        }
        Ok(all)
    }

    /// Reads one log as [`Self::read_all`] does.
    ///
    /// # Errors
    /// A log that cannot be read.
    pub fn read(setup: &RobotSetup, log: &Log, control: &Control) -> Result<Self, IdentifyError> {
        Self::read_by(setup, log, &setup.file.layout(), &[], control)
    }

    /// Reads a log for its positions alone: it needs no torque channels.
    ///
    /// # Errors
    /// A log that cannot be read.
    pub fn read_positions(
        setup: &RobotSetup,
        log: &Log,
        control: &Control,
    ) -> Result<Self, IdentifyError> {
        let layout = setup.file.layout().without_torques();
        Self::read_by(setup, log, &layout, &[], control)
    }

    /// The same log by another robot file, less the same torques.
    pub(crate) fn read_again(
        &self,
        setup: &RobotSetup,
        control: &Control,
    ) -> Result<Self, IdentifyError> {
        let layout = setup.file.layout();
        let again = Self::read_by(setup, &self.source, &layout, &[self], control)?;
        let recording = Arc::unwrap_or_clone(again.recording).minus_torque_of(&self.recording);
        Ok(LogData {
            recording: Arc::new(recording),
            ..again
        })
    }

    /// The same log without some parts of it, in seconds after its first row; as it is where it is no file.
    pub(crate) fn without(
        &self,
        setup: &RobotSetup,
        parts: &[[f64; 2]],
        control: &Control,
    ) -> Result<Self, IdentifyError> {
        let Log::File(spec) = &self.source else {
            return Ok(self.clone());
        };
        let mut spec = spec.clone();
        spec.leave_out.extend(parts);
        let layout = setup.file.layout();
        let part = Self::read_by(setup, &Log::File(spec), &layout, &[self], control)?;
        let recording = Arc::unwrap_or_clone(part.recording).minus_torque_of(&self.recording);
        Ok(LogData {
            recording: Arc::new(recording),
            ..part
        })
    }

    fn read_by(
        setup: &RobotSetup,
        log: &Log,
        layout: &Layout,
        beside: &[&LogData],
        control: &Control,
    ) -> Result<Self, IdentifyError> {
        let beside = beside.iter().map(|other| &*other.recording);
        let (keep, stop) = (&setup.file.log.keep, || control.stopped());
        let request = RecordingRequest {
            layout: match log {
                Log::Arrays(_) => arrays_layout(layout, setup.robot.joint_names()),
                _ => layout.clone(),
            },
            references: setup.file.reference_layout(),
            temperatures: setup.file.temperature_layout(),
            keep,
            stop: &stop,
            beside: &beside.collect::<Vec<_>>(),
        };
        let read = match log {
            Log::File(spec) => Recording::read(spec, &request),
            Log::Arrays(arrays) => Recording::of_arrays(arrays, &request),
            Log::Reduced(part) => Err(part.without_rows()),
        };
        let read = read?;
        let (duration_s, cutoff_hz) = (read.duration_s(), setup.settings().cutoff_hz);
        if duration_s > 0.0 && duration_s * cutoff_hz < 1.0 {
            return Err(LogError::ShorterThanFilter {
                log: escape(&log.name()),
                duration_s,
                cutoff_hz,
            }
            .into());
        }
        let longest = |dt: f64| setup.settings().longest_step(dt);
        let mut read = read.cut_by(&longest);
        if setup.file.zero_order_hold(read.layout().channels) {
            read = read.held_by(setup.robot.clone());
        }
        let off = read.inspection.off();
        if !off.is_empty() && read.inspection.refusal().is_none() {
            let freely = keep.contains(&RowFault::StuckChannel)
                || swings_freely(setup, (log, &read), &off, control)?;
            read.set_swings_freely(freely);
            read = read.cut_by(&longest);
        }
        Ok(LogData {
            source: log.clone(),
            recording: Arc::new(read),
        })
    }

    /// Name of the log in messages and results, without folders.
    pub fn name(&self) -> String {
        self.source.name()
    }

    /// What was read, whatever is wrong with it.
    pub fn recording(&self) -> &Arc<Recording> {
        &self.recording
    }

    /// What was read, for a fit.
    ///
    /// # Errors
    /// A log whose rows are poses, and one with a fault for which fits refuse it.
    pub(crate) fn usable(&self) -> Result<&Arc<Recording>, IdentifyError> {
        let recording = &self.recording;
        if let Some(rate_hz) = recording.poses_hz {
            return Err(IdentifyError::Poses {
                log: escape(&self.name()),
                rate_hz,
            });
        }
        match recording.inspection.refusal() {
            Some(fault) => Err(IdentifyError::Refused {
                log: escape(&self.name()),
                fault: Box::new(fault.clone()),
            }),
            None => Ok(recording),
        }
    }

    /// Its rows, every torque at the time and pose of its row.
    ///
    /// # Errors
    /// A log that fits refuse.
    pub fn blocks(&self, control: &Control) -> Result<RowBlocks, IdentifyError> {
        Ok((self.usable()?.blocks()?).stopped_by(control.stop_check()))
    }

    /// Its rows, torques as logged: each may hold until the next row.
    pub(crate) fn held_blocks(&self, control: &Control) -> Result<RowBlocks, IdentifyError> {
        Ok((self.usable()?.held_blocks()?).stopped_by(control.stop_check()))
    }

    /// Its rows as they were logged, in SI units: motors' channels stay what they are.
    pub(crate) fn logged_blocks(&self, control: &Control) -> Result<RowBlocks, IdentifyError> {
        Ok((self.usable()?.logged_blocks()?).stopped_by(control.stop_check()))
    }

    /// The positions that the controller was asked for, where they are known.
    pub(crate) fn references(&self) -> Result<Option<LoggedReference>, IdentifyError> {
        let references = self.recording.references()?;
        Ok(references.map(LoggedReference::new))
    }

    /// The same log less the torques of a course.
    pub(crate) fn minus_torque(&self, course: TorqueCourse) -> Self {
        LogData {
            source: self.source.clone(),
            recording: Arc::new(self.recording.minus_torque(course)),
        }
    }

    /// First and last time, by the log's own clock [s].
    pub(crate) fn bounds(&self) -> [f64; 2] {
        let zero = self.recording.origin().seconds();
        self.recording.time_span.map(|t| zero + t)
    }

    /// Time of the first row that is read, as its rows have it [s].
    pub(crate) fn first_row(&self) -> Result<f64, IdentifyError> {
        Ok(self.usable()?.time_span[0])
    }
}

impl RobotSetup {
    /// Speed up to which each joint rests, by the log in which it moves most [m/s or rad/s].
    pub(crate) fn rest_speeds(&self, logs: &[LogData]) -> Result<Vec<f64>, IdentifyError> {
        let mut greatest = vec![0.0; self.robot.joints()];
        for log in logs {
            raise(&mut greatest, &log.usable()?.rest_speed);
        }
        Ok(greatest)
    }

    /// Greatest speed of every joint in these logs [m/s or rad/s].
    pub(crate) fn top_speeds(&self, logs: &[LogData]) -> Result<Vec<f64>, IdentifyError> {
        let mut greatest = vec![0.0; self.robot.joints()];
        for log in logs {
            raise(&mut greatest, &log.usable()?.top_speed);
        }
        Ok(greatest)
    }
}

/// Raises each number to another where that is greater.
pub(crate) fn raise(greatest: &mut [f64], others: &[f64]) {
    for (greatest, other) in greatest.iter_mut().zip(others) {
        *greatest = other.max(*greatest);
    }
}

/// Whether numbers of these logs are bridged.
pub(crate) fn bridges(logs: &[LogData]) -> Result<bool, IdentifyError> {
    for log in logs {
        if !log.usable()?.inspection.mending().bridges.is_empty() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Whether the robot moves as without its motors where torques are exactly 0.
fn swings_freely(
    setup: &RobotSetup,
    (log, read): (&Log, &Recording),
    off: &[(usize, [f64; 2])],
    control: &Control,
) -> Result<bool, IdentifyError> {
    let mut blocks = read.blocks()?.stopped_by(control.stop_check());
    // Behind coupled gears the motors' channels are not the joints'.
    let n = setup.robot.joints();
    let all = |(_, span): &(usize, [f64; 2])| (0..n).map(|j| (j, *span)).collect();
    let off = match blocks.reader().layout().conversion.is_none() {
        true => off.to_vec(),
        false => off.iter().flat_map::<Vec<_>, _>(all).collect(),
    };
    moves_freely(
        (&setup.robot, &setup.settings()),
        &log.name(),
        &mut blocks,
        &off,
    )
}
