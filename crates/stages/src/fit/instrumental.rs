//! Rows whose instruments are the regressor along simulated positions.

use nalgebra::DVector;
use schemars::JsonSchema;
use serde::Serialize;

use crate::input::error::IdentifyError;
use crate::input::lsq_rows::{LsqRows, PositionReading};
use cft_ident_core::inertia::accumulate::BlockFactors;
use cft_ident_core::inertia::closed_loop::LoopGains;
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::inertia::instruments::{self, ReferenceSource};
use cft_ident_logs::log::Block;

/// The loop by which instruments were simulated.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SimulatedLoop {
    /// Where the reference comes from.
    pub reference: ReferenceSource,
    /// Natural frequency [rad/s].
    pub loop_frequency: f64,
    /// Share of the steps at which the simulation failed a joint.
    pub failed_steps_share: f64,
    #[serde(skip)]
    pub gains: LoopGains,
}

/// Rows with instruments from the loop under `theta`.
pub(crate) fn fold_instruments(
    rows: &LsqRows,
    reading: PositionReading,
    columns: &RegressorColumns,
    theta: &DVector<f64>,
) -> Result<(BlockFactors, SimulatedLoop), IdentifyError> {
    let mut total: Option<(BlockFactors, SimulatedLoop)> = None;
    for (index, log) in rows.recorded() {
        let settings = rows.settings_of(index, reading);
        let mut blocks = log.blocks(rows.control)?;
        let mut logged = log.references()?;
        let reference = match logged {
            Some(_) => ReferenceSource::Logged,
            None => ReferenceSource::Smoothed,
        };
        let mut source = |block: &mut Block| {
            let more = blocks.read(block)?;
            if let Some(logged) = &mut logged {
                logged.widen(block)?;
            }
            Ok(more)
        };
        let read = instruments::accumulate(
            &rows.setup.robot,
            &rows.columns_of(index, columns),
            theta,
            reference,
            &settings,
            rows.step_of(index),
            &mut source,
        )
        .map_err(|e| IdentifyError::of_run(&log.name(), e))?;
        match &mut total {
            None => {
                let simulated = SimulatedLoop {
                    reference,
                    loop_frequency: read.gains.frequency,
                    failed_steps_share: read.indefinite,
                    gains: read.gains,
                };
                total = Some((read.factors, simulated));
            }
            Some((sums, simulated)) => {
                sums.merge(read.factors);
                simulated.failed_steps_share = simulated.failed_steps_share.max(read.indefinite);
            }
        }
        rows.work.advance(1);
    }
    total.ok_or(IdentifyError::NoLog)
}
