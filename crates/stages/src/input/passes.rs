//! Readings of the same logs, one after the other, each reduced to what a fit needs.

use nalgebra::DVector;
use schemars::JsonSchema;
use serde::Serialize;

use super::control::{Control, ControlledWork};
use super::error::IdentifyError;
use super::log_data::LogData;
use super::own_settings::{JointCost, OwnSettings};
use super::robot_setup::{RobotSetup, narrowed};
use crate::note::StageNote;
use cft_ident_core::inertia::accumulate::BlockFactors;
use cft_ident_core::inertia::accumulate_weighted;
use cft_ident_core::inertia::closed_loop::LoopGains;
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::inertia::encoder::{self, GRIDS, NOISY, PositionNoise, accumulate_shifted};
use cft_ident_core::inertia::instruments::{self, ReferenceSource};
use cft_ident_core::inertia::jumps::{ResidualJump, jumps};
use cft_ident_core::inertia::robust::RowWeigher;
use cft_ident_core::motion::{FilterSettings, Summary};
use cft_ident_logs::log::{Block, Provenance};

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

/// Chooses the noise that is added to positions.
const NOISE_SEED: u64 = 1;

/// Which filter positions come through before they are differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PositionFilter {
    /// As the robot file says.
    Declared,
    /// Narrower, to see what smoothing changes.
    Narrower,
}

/// Readings of the same logs, one after the other.
pub struct LogPasses<'a> {
    pub(crate) setup: &'a RobotSetup,
    pub(crate) logs: &'a [LogData],
    pub(crate) control: &'a Control,
    pub(crate) work: ControlledWork,
    pub inputs: Vec<Provenance>,
    pub notes: Vec<StageNote>,
    /// Stretches in which something pushes the robot, by the places of the logs, by the first reading.
    pub(crate) jumps: Vec<(usize, ResidualJump)>,
    /// Of the first log, by the first reading.
    pub summary: Option<Summary>,
    /// Sampling step of each log, by the first reading [s].
    steps: Vec<f64>,
    /// Samples weigh alike, as in plain least squares, also where a joint stands or turns.
    pub(crate) plain: bool,
    /// What each log calls for by itself; empty where the machine and the columns say it.
    own: Vec<OwnSettings>,
    /// Joints whose samples at standstill count.
    counted: Vec<usize>,
    /// Logs by their checksums: sums do not depend on the order in which logs are given.
    order: Vec<usize>,
}

impl<'a> LogPasses<'a> {
    pub fn new(setup: &'a RobotSetup, logs: &'a [LogData], control: &'a Control) -> Self {
        LogPasses {
            setup,
            logs,
            control,
            work: control.begin("least squares", None),
            inputs: Vec::new(),
            notes: Vec::new(),
            jumps: Vec::new(),
            summary: None,
            steps: Vec::new(),
            plain: false,
            own: Vec::new(),
            counted: Vec::new(),
            order: Vec::new(),
        }
    }

    /// The same with the rests and the smoothing that each log calls for by itself.
    pub(crate) fn each_by_itself(self, own: Vec<OwnSettings>) -> Self {
        LogPasses { own, ..self }
    }

    /// Samples at standstill of these joints count from here on; not where logs were reduced without them.
    pub(crate) fn count_rests(&mut self, joints: &[usize]) -> bool {
        let whole = !self
            .logs
            .iter()
            .any(|log| matches!(log, LogData::Reduced(_)));
        if whole {
            self.counted = joints.to_vec();
        }
        whole
    }

    /// Whether the narrower reading of every log can have the rates of torques among its columns.
    pub(crate) fn have_torque_rates(&self) -> bool {
        self.logs.iter().all(|log| match log {
            LogData::Reduced(part) => part.holds_torque_rates(),
            _ => true,
        })
    }

    /// The columns of a log's rows.
    fn columns_of(&self, columns: &RegressorColumns, log: usize) -> RegressorColumns {
        let mut columns = columns.clone();
        if let Some(own) = self.own.get(log) {
            columns.rest_at(own.rest_speed.clone());
        }
        for joint in &self.counted {
            if let Some(speed) = columns.rest_speed.get_mut(*joint) {
                *speed = -1.0;
            }
        }
        columns
    }

    /// The sums of all logs as one.
    fn together(&self, sums: Vec<BlockFactors>) -> Result<BlockFactors, IdentifyError> {
        let mut sums: Vec<Option<BlockFactors>> = sums.into_iter().map(Some).collect();
        let mut total: Option<BlockFactors> = None;
        let in_order = self.order.iter();
        for sums in in_order.filter_map(|log| sums.get_mut(*log)?.take()) {
            match &mut total {
                None => total = Some(sums),
                Some(total) => total.merge(sums),
            }
        }
        total.ok_or(IdentifyError::NoLog)
    }

    /// The processing of a log; a narrower filter is that of the log's own rate.
    fn settings(&self, filter: PositionFilter, log: usize) -> FilterSettings {
        let mut declared = self.setup.settings();
        declared.weighs_rests = !self.plain;
        if let Some(own) = self.own.get(log) {
            declared.joint_q_cutoffs_hz.clone_from(&own.cutoffs_hz);
        }
        match filter {
            PositionFilter::Declared => declared,
            PositionFilter::Narrower => narrowed(&declared, 1.0 / self.step_of(log)),
        }
    }

    /// The shortest sampling step of the logs that were read [s].
    pub(crate) fn shortest_step(&self) -> f64 {
        let steps = self.steps.iter().copied();
        steps.reduce(f64::min).unwrap_or(1e-3)
    }

    /// Sampling step of a log that was read [s].
    fn step_of(&self, log: usize) -> f64 {
        self.steps.get(log).copied().unwrap_or(1e-3)
    }

    /// Rows as the robot file says, each log by itself as it stands in a file of reduced logs.
    pub(crate) fn read_condensed(
        &mut self,
        columns: &RegressorColumns,
    ) -> Result<BlockFactors, IdentifyError> {
        self.read_as(PositionFilter::Declared, columns, None, true)
    }

    pub(crate) fn read(
        &mut self,
        filter: PositionFilter,
        columns: &RegressorColumns,
        weigher: Option<&mut RowWeigher>,
    ) -> Result<BlockFactors, IdentifyError> {
        self.read_as(filter, columns, weigher, false)
    }

    fn read_as(
        &mut self,
        filter: PositionFilter,
        columns: &RegressorColumns,
        mut weigher: Option<&mut RowWeigher>,
        condensed: bool,
    ) -> Result<BlockFactors, IdentifyError> {
        let first = self.summary.is_none();
        let mut all = Vec::new();
        for (index, log) in self.logs.iter().enumerate() {
            let settings = self.settings(filter, index);
            let columns = self.columns_of(columns, index);
            if let LogData::Reduced(part) = log {
                all.push(match filter {
                    PositionFilter::Declared => part.rows(columns)?,
                    PositionFilter::Narrower => part.narrower_rows(columns)?,
                });
                if first {
                    self.notes.extend(part.notes.iter().cloned());
                    self.saw(part.provenance.clone(), part.summary.clone());
                }
                continue;
            }
            let mut open = log.open(self.control)?;
            let (sums, summary) = accumulate_weighted(
                &self.setup.robot,
                &columns,
                weigher.as_deref_mut(),
                &settings,
                &mut |block| open.read(block),
            )
            .map_err(|e| open.ended(e))?;
            let samples = open.provenance()?.samples;
            if first {
                // what cannot be fitted is reported by the fit itself
                let found = jumps(&sums).unwrap_or_default();
                self.jumps
                    .extend(found.into_iter().map(|jump| (index, jump)));
                self.notes.extend(open.notes_with(&summary));
                self.saw(open.provenance()?, summary);
            }
            all.push(match filter {
                PositionFilter::Declared if condensed => sums.condensed(samples, self.others()),
                PositionFilter::Declared => sums,
                PositionFilter::Narrower => sums.in_one_block(),
            });
            self.work.advance(1);
        }
        if first {
            let key = |log: &usize| (&self.inputs[*log].sha256, &self.inputs[*log].span);
            let mut order: Vec<usize> = (0..all.len()).collect();
            order.sort_by(|a, b| key(a).cmp(&key(b)));
            self.order = order;
        }
        self.together(all)
    }

    /// Readings of a log besides the first: by a narrower position filter, and on the encoders' grids.
    fn others(&self) -> u64 {
        1 + u64::from(self.readings_again())
    }

    /// Remembers what the first reading of a log found.
    fn saw(&mut self, input: Provenance, summary: Summary) {
        self.inputs.push(input);
        self.steps.push(summary.dt);
        self.summary.get_or_insert(summary);
    }

    /// Rows with instruments from the loop under `theta`.
    pub(crate) fn read_instruments(
        &mut self,
        filter: PositionFilter,
        columns: &RegressorColumns,
        theta: &DVector<f64>,
    ) -> Result<(BlockFactors, SimulatedLoop), IdentifyError> {
        let mut total: Option<(BlockFactors, SimulatedLoop)> = None;
        for (index, log) in self.logs.iter().enumerate() {
            let (settings, step) = (self.settings(filter, index), self.step_of(index));
            let mut open = log.open(self.control)?;
            let mut logged = log.references()?;
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
            let robot = &self.setup.robot;
            let columns = self.columns_of(columns, index);
            let read = instruments::accumulate(
                robot,
                &columns,
                theta,
                reference,
                &settings,
                step,
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
                    simulated.failed_steps_share =
                        simulated.failed_steps_share.max(read.indefinite);
                }
            }
            self.work.advance(1);
        }
        total.ok_or(IdentifyError::NoLog)
    }

    /// Readings of a log with its positions read by the encoders once more: on so many shifted grids, or with their noise.
    pub(crate) fn readings_again(&self) -> u32 {
        let known = self.setup.robot.transmission().encoder_steps();
        known.map_or(NOISY, |_| GRIDS)
    }

    /// Intervals of the noise of a log's positions, where it says something in a fit \[m or rad\].
    fn noise_that_tells(&self, log: usize) -> Option<Vec<f64>> {
        let of_joint = &self.own.get(log)?.costs.of_joint;
        let tells = |cost: &JointCost| encoder::tells(cost.at.share);
        let step = |cost: &Option<JointCost>| cost.as_ref().map_or(0.0, |cost| cost.at.step);
        let steps = || of_joint.iter().map(step).collect();
        of_joint.iter().flatten().any(tells).then(steps)
    }

    /// A log whose positions get noise of their own level once more; as it is where that says nothing.
    fn read_noisy(
        &self,
        columns: RegressorColumns,
        reading: u32,
        index: usize,
        weigher: Option<&mut RowWeigher>,
    ) -> Result<BlockFactors, IdentifyError> {
        let log = &self.logs[index];
        let steps = self.noise_that_tells(index);
        if let LogData::Reduced(part) = log {
            let noisy = match steps {
                None => None,
                Some(_) => part.shifted_rows(reading, columns.clone())?,
            };
            return Ok(match noisy {
                Some(rows) => rows,
                None => part.rows(columns)?,
            });
        }
        let mut noise = steps.map(|steps| PositionNoise::new(&steps, reading, NOISE_SEED));
        let settings = self.settings(PositionFilter::Declared, index);
        let mut open = log.open(self.control)?;
        let read = accumulate_weighted(
            &self.setup.robot,
            &columns,
            weigher,
            &settings,
            &mut |block| {
                let more = open.read(block)?;
                if let Some(noise) = &mut noise {
                    noise.add(block);
                }
                Ok(more)
            },
        );
        Ok(read.map_err(|e| open.ended(e))?.0.in_one_block())
    }

    /// Positions read by the encoders once more.
    pub(crate) fn read_shifted(
        &mut self,
        columns: &RegressorColumns,
        grid: u32,
        mut weigher: Option<&mut RowWeigher>,
    ) -> Result<Option<BlockFactors>, IdentifyError> {
        let unknown = self.setup.robot.transmission().encoder_steps().is_none();
        if unknown && (0..self.logs.len()).all(|log| self.noise_that_tells(log).is_none()) {
            return Ok(None);
        }
        let mut all = Vec::new();
        for (index, log) in self.logs.iter().enumerate() {
            let settings = self.settings(PositionFilter::Declared, index);
            let columns = self.columns_of(columns, index);
            if unknown {
                all.push(self.read_noisy(columns, grid, index, weigher.as_deref_mut())?);
                self.work.advance(1);
                continue;
            }
            if let LogData::Reduced(part) = log {
                all.extend(part.shifted_rows(grid, columns)?);
                continue;
            }
            let mut open = log.open(self.control)?;
            let sums = accumulate_shifted(
                &self.setup.robot,
                &columns,
                weigher.as_deref_mut(),
                &settings,
                grid,
                &mut |block| open.read(block),
            )
            .map_err(|e| open.ended(e))?;
            all.extend(sums.map(|sums| sums.in_one_block()));
            self.work.advance(1);
        }
        match all.len() == self.logs.len() {
            true => Ok(Some(self.together(all)?)),
            false => Ok(None),
        }
    }
}
