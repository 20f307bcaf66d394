//! One-joint logs in memory, smoothed for the friction filter.

use super::control::Control;
use super::error::IdentifyError;
use super::log_data::LogData;
use super::robot_setup::{RobotSetup, narrowed};
use crate::note::StageNote;
use cft_ident_core::friction::motions::motions;
use cft_ident_core::friction::prepare::SmoothedMotion;
use cft_ident_core::motion::{DifferenceFormula, FilterSettings};
use cft_ident_logs::log::{Block, Provenance};

/// Position cut-off where none is declared \[Hz\]: stationary joints answer to reversals within milliseconds.
const FRICTION_POSITION_CUTOFF_HZ: f64 = 100.0;

/// Most rows of a one-joint log, half an hour at 1 kHz: about 1 kB a row for a robot of four joints.
const MOST_ROWS: usize = 2_000_000;

/// A one-joint log, read and smoothed.
pub struct OneJointLog {
    pub motions: Vec<SmoothedMotion>,
    /// The same with a narrower position filter.
    pub narrower: Vec<SmoothedMotion>,
    /// The torque comes from a zero-order hold.
    pub zero_order_hold: bool,
    pub provenance: Provenance,
    /// What the reader left out, dropped or chose.
    pub notes: Vec<StageNote>,
}

/// Smoothing of the motion that the friction filter takes as known.
fn processing(setup: &RobotSetup, rate_hz: f64) -> FilterSettings {
    FilterSettings {
        q_cutoff_hz: Some(
            setup
                .file
                .filter
                .position_cutoff_hz
                .unwrap_or(FRICTION_POSITION_CUTOFF_HZ)
                .min(0.2 * rate_hz),
        ),
        differences: DifferenceFormula::HighOrder,
        q_trim_s: None,
        // the filter takes rows as they come, and needs none between
        bridge_s: 0.0,
        ..setup.settings()
    }
}

/// Reads a one-joint log into memory and smooths its motion, once as declared and once with a
/// narrower filter, by which the smoothing's own part in an estimate is seen.
pub fn read(
    setup: &RobotSetup,
    log: &LogData,
    control: &Control,
) -> Result<OneJointLog, IdentifyError> {
    let mut blocks = log.held_blocks(control)?;
    let mut whole = Block::default();
    let mut block = Block::default();
    while blocks.read(&mut block)? {
        whole.t.extend_from_slice(&block.t);
        if whole.t.len() > MOST_ROWS {
            return Err(IdentifyError::TooManyRows {
                log: log.name(),
                most: MOST_ROWS,
            });
        }
        whole.q.extend_from_slice(&block.q);
        whole.tau.extend_from_slice(&block.tau);
    }
    let rate = match (whole.t.first(), whole.t.last()) {
        (Some(first), Some(last)) if last > first => (whole.t.len() - 1) as f64 / (last - first),
        _ => 1.0,
    };
    let declared = processing(setup, rate);
    let narrower = narrowed(&declared, rate);
    let smooth = |settings: &FilterSettings| {
        let n = setup.robot.joints();
        motions(&whole.t, &whole.q, &whole.tau, n, settings)
            .map_err(|e| IdentifyError::motion(&log.name(), e))
    };
    Ok(OneJointLog {
        motions: smooth(&declared)?,
        narrower: smooth(&narrower)?,
        zero_order_hold: log.recording().is_held(),
        notes: log.notes(&blocks),
        provenance: blocks.provenance()?,
    })
}
