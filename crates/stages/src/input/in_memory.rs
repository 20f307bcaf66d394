//! Logs read whole, as stretches in memory: for what looks at them many times.

use super::control::Control;
use super::error::IdentifyError;
use super::log_data::LogData;
use super::robot_setup::RobotSetup;
use crate::note::StageNote;
use cft_ident_core::motion::{FilterSettings, Stretch, Summary, stretches};
use cft_ident_logs::log::{Instant, Provenance};
use cft_ident_logs::recording::RowBlocks;

/// Most samples that are taken into memory, over all logs: 2 GB for a robot of seven joints.
const MOST_SAMPLES: usize = 9_000_000;

/// Logs in memory, as stretches at full rate.
pub struct InMemory {
    pub stretches: Vec<Stretch>,
    pub inputs: Vec<Provenance>,
    pub notes: Vec<StageNote>,
    pub summary: Summary,
    /// Instant from which the times of the first log are counted.
    pub origin: Instant,
    /// Torques are means of two rows: they come from a zero-order hold.
    pub averaged: bool,
    /// Speed up to which each joint rests [m/s or rad/s].
    pub rest_speed: Vec<f64>,
}

/// Reads logs whole, smoothed as the model declares.
///
/// # Errors
/// A log that cannot be read, or more samples than memory is meant to hold.
pub fn read_whole(
    setup: &RobotSetup,
    logs: &[LogData],
    control: &Control,
) -> Result<InMemory, IdentifyError> {
    read_each(setup, &vec![setup.settings(); logs.len()], logs, control)
}

/// Counts stretches from where the machine began to run, as far as that is known: a part of a log begins later.
pub(crate) fn count_run_time(stretches: &mut [Stretch], blocks: &RowBlocks) {
    for stretch in stretches {
        stretch.began += blocks.reader().started_s();
    }
}

/// The same as [`read_whole`], each log with the settings in its place.
pub(crate) fn read_each(
    setup: &RobotSetup,
    settings: &[FilterSettings],
    logs: &[LogData],
    control: &Control,
) -> Result<InMemory, IdentifyError> {
    let n = setup.robot.joints();
    let work = control.begin("reading", Some(logs.len() as u64));
    let (mut all, mut inputs, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    let mut last: Option<Summary> = None;
    let mut origin = None;
    let mut samples = 0;
    let mut averaged = false;
    for (index, (log, settings)) in logs.iter().zip(settings).enumerate() {
        let name = log.name();
        let mut blocks = log.blocks(control)?;
        let zero = log.recording().origin();
        origin = origin.or(Some(zero));
        averaged |= log.recording().is_held();
        let (mut found, summary) = stretches(index, n, settings, &mut |block| blocks.read(block))
            .map_err(|e| IdentifyError::of_run(&name, e))?;
        count_run_time(&mut found, &blocks);
        for stretch in &mut found {
            stretch.zero = zero.seconds();
        }
        samples += found.iter().map(Stretch::len).sum::<usize>();
        if samples > MOST_SAMPLES {
            return Err(IdentifyError::TooManySamples {
                log: name,
                samples,
                most: MOST_SAMPLES,
            });
        }
        notes.extend(log.notes_with(&blocks, &summary));
        notes.extend(setup.put_temperatures(log, &mut found)?);
        inputs.push(blocks.provenance()?);
        all.extend(found);
        last = Some(summary);
        work.advance(1);
    }
    let (Some(summary), Some(origin)) = (last, origin) else {
        return Err(IdentifyError::NoLog);
    };
    Ok(InMemory {
        stretches: all,
        inputs,
        notes,
        summary,
        origin,
        averaged,
        rest_speed: setup.rest_speeds(logs)?,
    })
}
