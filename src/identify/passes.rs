//! Readings of the same logs, one after the other, each reduced to what a fit needs.

use nalgebra::DVector;
use schemars::JsonSchema;
use serde::Serialize;

use super::control::{Control, Work};
use super::error::IdentifyError;
use super::log::Log;
use super::logged_robot::{LoggedRobot, narrowed};
use crate::inertia::accumulate::BlockFactors;
use crate::inertia::accumulate_weighted;
use crate::inertia::closed_loop::Gains;
use crate::inertia::columns::RegressorColumns;
use crate::inertia::encoder::accumulate_shifted;
use crate::inertia::instruments::{self, ReferenceSource};
use crate::inertia::robust::Weigher;
use crate::log::{Block, Provenance};
use crate::motion::{FilterSettings, Summary};

/// The loop by which instruments were simulated.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Simulated {
    /// Where the reference comes from.
    pub reference: ReferenceSource,
    /// Natural frequency [rad/s].
    pub loop_frequency: f64,
    /// Share of the steps at which the simulation failed a joint.
    pub failed_steps_share: f64,
    #[serde(skip)]
    pub gains: Gains,
}

/// Which filter positions come through before they are differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PositionFilter {
    /// As the robot file says.
    Declared,
    /// Narrower, to see what smoothing changes.
    Narrower,
}

/// Readings of the same logs, one after the other.
pub struct Passes<'a> {
    pub(super) machine: &'a LoggedRobot,
    logs: &'a [Log],
    control: &'a Control,
    pub(super) work: Work,
    pub inputs: Vec<Provenance>,
    pub warnings: Vec<String>,
    /// Of the first log, by the first reading.
    pub summary: Option<Summary>,
    /// Sampling step of each log, by the first reading [s].
    steps: Vec<f64>,
}

impl<'a> Passes<'a> {
    pub fn new(machine: &'a LoggedRobot, logs: &'a [Log], control: &'a Control) -> Self {
        Passes {
            machine,
            logs,
            control,
            work: control.begin("least squares", None),
            inputs: Vec::new(),
            warnings: Vec::new(),
            summary: None,
            steps: Vec::new(),
        }
    }

    /// The processing of a log; a narrower filter is that of the log's own rate.
    fn settings(&self, filter: PositionFilter, log: usize) -> FilterSettings {
        let declared = self.machine.settings();
        match filter {
            PositionFilter::Declared => declared,
            PositionFilter::Narrower => narrowed(&declared, 1.0 / self.step_of(log)),
        }
    }

    /// Sampling step of a log that was read [s].
    fn step_of(&self, log: usize) -> f64 {
        self.steps.get(log).copied().unwrap_or(1e-3)
    }

    pub(super) fn read(
        &mut self,
        filter: PositionFilter,
        columns: &RegressorColumns,
        mut weigher: Option<&mut Weigher>,
    ) -> Result<BlockFactors, IdentifyError> {
        let first = self.summary.is_none();
        let mut total: Option<BlockFactors> = None;
        for (index, log) in self.logs.iter().enumerate() {
            let settings = self.settings(filter, index);
            let mut open = self.machine.open(log, self.control)?;
            let (sums, summary) = accumulate_weighted(
                &self.machine.robot,
                columns,
                weigher.as_deref_mut(),
                &settings,
                &mut |block| open.read(block),
            )
            .map_err(|e| IdentifyError::of_run(&log.name(), e))?;
            if first {
                self.warnings.extend(open.told(&summary));
                self.inputs.push(open.provenance()?);
                self.steps.push(summary.dt);
                self.summary.get_or_insert(summary);
            }
            match &mut total {
                None => total = Some(sums),
                Some(total) => total.merge(sums),
            }
            self.work.advance(1);
        }
        total.ok_or(IdentifyError::NoLog)
    }

    /// Rows with instruments from the loop under `theta`.
    pub(super) fn read_instruments(
        &mut self,
        filter: PositionFilter,
        columns: &RegressorColumns,
        theta: &DVector<f64>,
    ) -> Result<(BlockFactors, Simulated), IdentifyError> {
        let mut total: Option<(BlockFactors, Simulated)> = None;
        for (index, log) in self.logs.iter().enumerate() {
            let (settings, step) = (self.settings(filter, index), self.step_of(index));
            let mut open = self.machine.open(log, self.control)?;
            let mut logged = self.machine.open_reference(log)?;
            let reference = match logged {
                Some(_) => ReferenceSource::Logged,
                None => ReferenceSource::Smoothed,
            };
            let mut source = |block: &mut Block| {
                let more = open.read(block)?;
                if let Some(logged) = &mut logged {
                    logged.widen(block)?;
                }
                Ok(more)
            };
            let robot = &self.machine.robot;
            let read = instruments::accumulate(
                robot,
                columns,
                theta,
                reference,
                &settings,
                step,
                &mut source,
            )
            .map_err(|e| IdentifyError::of_run(&log.name(), e))?;
            match &mut total {
                None => {
                    let simulated = Simulated {
                        reference,
                        loop_frequency: read.gains.frequency,
                        failed_steps_share: read.indefinite,
                        gains: read.gains,
                    };
                    total = Some((read.factors, simulated));
                }
                Some((sums, simulated)) => {
                    sums.merge(read.factors);
                    simulated.failed_steps_share =
                        simulated.failed_steps_share.max(read.indefinite);
                }
            }
            self.work.advance(1);
        }
        total.ok_or(IdentifyError::NoLog)
    }

    /// Positions rounded anew on a shifted grid of the encoders.
    pub(super) fn read_shifted(
        &mut self,
        columns: &RegressorColumns,
        grid: u32,
        mut weigher: Option<&mut Weigher>,
    ) -> Result<Option<BlockFactors>, IdentifyError> {
        let mut total: Option<BlockFactors> = None;
        let settings = self.machine.settings();
        for log in self.logs {
            let mut open = self.machine.open(log, self.control)?;
            let sums = accumulate_shifted(
                &self.machine.robot,
                columns,
                weigher.as_deref_mut(),
                &settings,
                grid,
                &mut |block| open.read(block),
            )
            .map_err(|e| IdentifyError::of_run(&log.name(), e))?;
            match (&mut total, sums) {
                (Some(total), Some(sums)) => total.merge(sums),
                (none, sums) => *none = sums,
            }
            self.work.advance(1);
        }
        Ok(total)
    }
}
