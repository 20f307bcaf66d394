//! The regressor rows of logs, folded into the sums that a fit takes: of a log by going along it, of a reduced one from
//! the sums that it holds.

use super::control::{Control, ControlledWork};
use super::dataset::Dataset;
use super::error::IdentifyError;
use super::log_data::LogData;
use super::log_smoothing::{CutoffCosts, JointCost, LogSmoothing};
use super::reduced::reduced_log::ReducedLog;
use super::robot_setup::{RobotSetup, narrowed};
use crate::note::StageNote;
use cft_ident_core::inertia::accumulate::BlockFactors;
use cft_ident_core::inertia::accumulate_weighted;
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::inertia::encoder::{self, GRIDS, NOISY, PositionNoise, accumulate_shifted};
use cft_ident_core::inertia::jumps::{ResidualJump, jumps};
use cft_ident_core::inertia::robust::RowWeigher;
use cft_ident_core::motion::{FilterSettings, Summary};
use cft_ident_logs::log::{Block, Provenance, escape};

/// Chooses the noise that is added to positions.
const NOISE_SEED: u64 = 1;
/// Sampling step that stands for one that is not known yet \[s\].
const USUAL_STEP_S: f64 = 1e-3;

/// How the positions of a log are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PositionReading {
    /// Through the filter that the robot file declares, or that the log calls for.
    Declared,
    /// Through a narrower one, to see what smoothing changes.
    Narrower,
    /// By the encoders once more, which gives them other rounding: on the shifted grid of this number where the steps of
    /// the encoders are known, else with noise of their own level.
    Again(u32),
}

/// What the rows of a log are folded from: themselves, or sums of them that were kept.
#[derive(Clone, Copy)]
enum RowOrigin<'a> {
    Log(&'a LogData),
    Sums(&'a ReducedLog),
}

/// A log whose rows are folded.
struct FoldedLog<'a> {
    rows: RowOrigin<'a>,
    /// What it calls for by itself; none where the robot file and the columns say it.
    smoothing: Option<LogSmoothing>,
    /// What was seen of it when its rows were folded for the first time.
    seen: Option<SeenLog>,
}

/// What the first way along a log shows.
struct SeenLog {
    provenance: Provenance,
    summary: Summary,
    notes: Vec<StageNote>,
    /// Stretches in which something pushes the robot.
    jumps: Vec<ResidualJump>,
}

impl SeenLog {
    /// What orders logs.
    fn key(&self) -> (&str, Option<&str>) {
        let provenance = &self.provenance;
        (&provenance.sha256, provenance.span.as_deref())
    }
}

/// Regressor rows of logs, folded anew for each request.
pub struct LsqRows<'a> {
    pub(crate) setup: &'a RobotSetup,
    logs: Vec<FoldedLog<'a>>,
    pub(crate) control: &'a Control,
    pub(crate) work: ControlledWork,
    /// Samples of a joint at rest weigh as the fewer that they stand for; not so in plain least squares.
    pub(crate) weighs_rests: bool,
    /// Joints whose samples at standstill count.
    counted: Vec<usize>,
}

impl<'a> LsqRows<'a> {
    /// Rows of the logs of a dataset that are fitted, each smoothed as it calls for: reduced ones, then the others.
    pub(crate) fn new(
        data: &'a Dataset,
        smoothing: Vec<LogSmoothing>,
        control: &'a Control,
    ) -> Self {
        let reduced = data.reduced.iter().map(|part| RowOrigin::Sums(part));
        let recorded = data.logs.iter().map(RowOrigin::Log);
        let each = reduced.chain(recorded).zip(smoothing);
        let each = each.map(|(rows, smoothing)| (rows, Some(smoothing)));
        Self::of_each(&data.setup, each, control)
    }

    /// Rows of logs as the robot file and the columns say.
    pub(crate) fn as_declared(
        setup: &'a RobotSetup,
        logs: &'a [LogData],
        control: &'a Control,
    ) -> Self {
        let rows = logs.iter().map(|log| (RowOrigin::Log(log), None));
        Self::of_each(setup, rows, control)
    }

    /// Rows of a reduced log alone.
    pub(crate) fn of_reduced(
        setup: &'a RobotSetup,
        part: &'a ReducedLog,
        control: &'a Control,
    ) -> Self {
        let rows = std::iter::once((RowOrigin::Sums(part), None));
        Self::of_each(setup, rows, control)
    }

    fn of_each(
        setup: &'a RobotSetup,
        rows: impl Iterator<Item = (RowOrigin<'a>, Option<LogSmoothing>)>,
        control: &'a Control,
    ) -> Self {
        let log = |(rows, smoothing)| FoldedLog {
            rows,
            smoothing,
            seen: None,
        };
        LsqRows {
            setup,
            logs: rows.map(log).collect(),
            control,
            work: control.begin("least squares", None),
            weighs_rests: true,
            counted: Vec::new(),
        }
    }

    fn seen(&self) -> impl Iterator<Item = &SeenLog> {
        self.logs.iter().filter_map(|log| log.seen.as_ref())
    }

    /// What was folded, once it was.
    pub(crate) fn inputs(&self) -> Vec<Provenance> {
        self.seen().map(|seen| seen.provenance.clone()).collect()
    }

    /// What the cut-offs of each log's position filters cost.
    pub(crate) fn cutoff_costs(&self) -> Vec<&CutoffCosts> {
        let smoothing = self.logs.iter().filter_map(|log| log.smoothing.as_ref());
        smoothing.map(|smoothing| &smoothing.costs).collect()
    }

    /// What was left out of the logs, mended or chosen.
    pub(crate) fn notes(&self) -> Vec<StageNote> {
        self.seen().flat_map(|seen| seen.notes.clone()).collect()
    }

    /// Processing of the first log.
    pub(crate) fn summary(&self) -> Option<&Summary> {
        self.seen().next().map(|seen| &seen.summary)
    }

    /// Stretches in which something pushes the robot, with their logs.
    pub(crate) fn jumps(&self) -> Vec<(&LogData, &ResidualJump)> {
        let mut all = Vec::new();
        for log in &self.logs {
            if let (RowOrigin::Log(data), Some(seen)) = (log.rows, &log.seen) {
                all.extend(seen.jumps.iter().map(|jump| (data, jump)));
            }
        }
        all
    }

    /// The logs whose rows are there, with their places among all.
    pub(crate) fn recorded(&self) -> impl Iterator<Item = (usize, &LogData)> {
        let logs = self.logs.iter().enumerate();
        logs.filter_map(|(place, log)| match log.rows {
            RowOrigin::Log(data) => Some((place, data)),
            RowOrigin::Sums(_) => None,
        })
    }

    /// Samples at standstill of these joints count from here on; not where logs were reduced without them.
    pub(crate) fn count_rests(&mut self, joints: &[usize]) -> bool {
        let of_reduced = |log: &FoldedLog| matches!(log.rows, RowOrigin::Sums(_));
        let whole = !self.logs.iter().any(of_reduced);
        if whole {
            self.counted = joints.to_vec();
        }
        whole
    }

    /// Whether rows by the narrower filter can have the rates of torques among their columns.
    pub(crate) fn have_torque_rates(&self) -> bool {
        self.logs.iter().all(|log| match log.rows {
            RowOrigin::Sums(part) => part.holds_torque_rates(),
            RowOrigin::Log(_) => true,
        })
    }

    /// The shortest sampling step of the logs that were read [s].
    pub(crate) fn shortest_step(&self) -> f64 {
        let steps = self.seen().map(|seen| seen.summary.dt);
        steps.reduce(f64::min).unwrap_or(USUAL_STEP_S)
    }

    /// Readings of a log with its positions read by the encoders once more: on so many shifted grids, or with their noise.
    pub(crate) fn readings_again(&self) -> u32 {
        match self.knows_encoders() {
            true => GRIDS,
            false => NOISY,
        }
    }

    /// The columns of a log's rows.
    pub(crate) fn columns_of(&self, log: usize, columns: &RegressorColumns) -> RegressorColumns {
        let mut columns = columns.clone();
        if let Some(smoothing) = &self.logs[log].smoothing {
            columns.rest_at(smoothing.rest_speed.clone());
        }
        for joint in &self.counted {
            if let Some(speed) = columns.rest_speed.get_mut(*joint) {
                *speed = -1.0;
            }
        }
        columns
    }

    /// The processing of a log; a narrower filter is that of the log's own rate.
    pub(crate) fn settings_of(&self, log: usize, reading: PositionReading) -> FilterSettings {
        let mut declared = self.setup.settings();
        declared.weighs_rests = self.weighs_rests;
        if let Some(smoothing) = &self.logs[log].smoothing {
            (declared.joint_q_cutoffs_hz).clone_from(&smoothing.cutoffs_hz);
        }
        match reading {
            PositionReading::Narrower => narrowed(&declared, 1.0 / self.step_of(log)),
            PositionReading::Declared | PositionReading::Again(_) => declared,
        }
    }

    /// Sampling step of a log [s].
    pub(crate) fn step_of(&self, log: usize) -> f64 {
        let seen = self.logs[log].seen.as_ref();
        seen.map_or(USUAL_STEP_S, |seen| seen.summary.dt)
    }

    /// The sums of all logs as one, merged in the order of the logs' checksums: they do not depend on the order in which
    /// logs are given.
    fn merged(&self, sums: Vec<BlockFactors>) -> Option<BlockFactors> {
        let sums = self.in_order(sums).map(|(_, sums)| sums);
        sums.reduce(|mut total, sums| {
            total.merge(sums);
            total
        })
    }

    /// What is of each log, in the order of the logs' checksums.
    fn in_order<T>(&self, of_logs: Vec<T>) -> impl Iterator<Item = (&SeenLog, T)> {
        let mut keyed: Vec<(&SeenLog, T)> = self.seen().zip(of_logs).collect();
        keyed.sort_by(|(a, _), (b, _)| a.key().cmp(&b.key()));
        keyed.into_iter()
    }

    /// Names of the logs, in the order in which their sums are merged.
    pub(crate) fn names_in_order(&self) -> Vec<String> {
        let unit = self.seen().map(|_| ()).collect();
        let names = self.in_order(unit).map(|(seen, ())| {
            let span = seen.provenance.span.iter();
            let span: String = span.map(|span| format!("@{span}")).collect();
            escape(&seen.provenance.name) + &span
        });
        names.collect()
    }

    /// The rows of all logs; where a weigher is given, each by its weight.
    pub(crate) fn fold(
        &mut self,
        reading: PositionReading,
        columns: &RegressorColumns,
        weigher: Option<&mut RowWeigher>,
    ) -> Result<BlockFactors, IdentifyError> {
        let folded = self.fold_each(reading, columns, weigher)?;
        folded.ok_or(IdentifyError::NoLog)
    }

    /// The rows of all logs with positions read by the encoders once more; none where a log lacks such rows, and where noise
    /// says nothing in any of them.
    pub(crate) fn fold_again(
        &mut self,
        reading: u32,
        columns: &RegressorColumns,
        weigher: Option<&mut RowWeigher>,
    ) -> Result<Option<BlockFactors>, IdentifyError> {
        let tells = |log: usize| self.telling_noise(log).is_some();
        if !self.knows_encoders() && !(0..self.logs.len()).any(tells) {
            return Ok(None);
        }
        self.fold_each(PositionReading::Again(reading), columns, weigher)
    }

    fn fold_each(
        &mut self,
        reading: PositionReading,
        columns: &RegressorColumns,
        mut weigher: Option<&mut RowWeigher>,
    ) -> Result<Option<BlockFactors>, IdentifyError> {
        let mut all = Vec::with_capacity(self.logs.len());
        for log in 0..self.logs.len() {
            let columns = self.columns_of(log, columns);
            let sums = match self.logs[log].rows {
                RowOrigin::Sums(part) => self.fold_reduced(log, part, (reading, columns))?,
                RowOrigin::Log(data) => {
                    let weigher = weigher.as_deref_mut();
                    self.fold_recorded(log, data, (reading, &columns), weigher)?
                }
            };
            let Some(sums) = sums else {
                return Ok(None);
            };
            all.push(sums);
            self.work.advance(1);
        }
        Ok(self.merged(all))
    }

    /// The rows of a log, filtered and decimated, folded into the sums of its blocks.
    fn fold_recorded(
        &mut self,
        log: usize,
        data: &LogData,
        (reading, columns): (PositionReading, &RegressorColumns),
        weigher: Option<&mut RowWeigher>,
    ) -> Result<Option<BlockFactors>, IdentifyError> {
        let settings = self.settings_of(log, reading);
        let mut noise = self.noise_of(log, reading);
        let mut blocks = data.blocks(self.control)?;
        let mut read = |block: &mut Block| {
            let more = blocks.read(block)?;
            if let Some(noise) = &mut noise {
                noise.add(block);
            }
            Ok(more)
        };
        let robot = &self.setup.robot;
        if let (PositionReading::Again(grid), true) = (reading, self.knows_encoders()) {
            let sums = accumulate_shifted(robot, columns, weigher, &settings, grid, &mut read);
            let sums = sums.map_err(|e| data.to_stage_error(&blocks, e))?;
            return Ok(sums.map(|sums| sums.in_one_block()));
        }
        let folded = accumulate_weighted(robot, columns, weigher, &settings, &mut read);
        let (mut sums, summary) = folded.map_err(|e| data.to_stage_error(&blocks, e))?;
        if self.logs[log].seen.is_none() {
            self.logs[log].seen = Some(SeenLog {
                provenance: blocks.provenance()?,
                notes: data.notes_with(&blocks, &summary),
                // what cannot be fitted is reported by the fit itself
                jumps: jumps(&mut sums).unwrap_or_default(),
                summary,
            });
        }
        Ok(Some(match reading {
            PositionReading::Declared => sums,
            PositionReading::Narrower | PositionReading::Again(_) => sums.in_one_block(),
        }))
    }

    /// The rows of a reduced log, which it holds for each reading.
    fn fold_reduced(
        &mut self,
        log: usize,
        part: &ReducedLog,
        (reading, columns): (PositionReading, RegressorColumns),
    ) -> Result<Option<BlockFactors>, IdentifyError> {
        self.logs[log].seen.get_or_insert_with(|| SeenLog {
            provenance: part.provenance.clone(),
            summary: part.summary.clone(),
            notes: part.notes.clone(),
            jumps: Vec::new(),
        });
        let again = match reading {
            PositionReading::Declared => return Ok(Some(part.rows(columns)?)),
            PositionReading::Narrower => return Ok(Some(part.narrower_rows(columns)?)),
            PositionReading::Again(again) => again,
        };
        if self.knows_encoders() {
            return Ok(part.shifted_rows(again, columns)?);
        }
        let noisy = match self.telling_noise(log) {
            Some(_) => part.shifted_rows(again, columns.clone())?,
            None => None,
        };
        match noisy {
            Some(rows) => Ok(Some(rows)),
            None => Ok(Some(part.rows(columns)?)),
        }
    }

    fn knows_encoders(&self) -> bool {
        self.setup.robot.transmission().encoder_steps().is_some()
    }

    /// Noise of the level of a log's own positions, where they are read again and nothing is known of the encoders.
    fn noise_of(&self, log: usize, reading: PositionReading) -> Option<PositionNoise> {
        let PositionReading::Again(again) = reading else {
            return None;
        };
        let steps = self.telling_noise(log).filter(|_| !self.knows_encoders())?;
        Some(PositionNoise::new(&steps, again, NOISE_SEED))
    }

    /// Intervals of the noise of a log's positions, where it says something in a fit \[m or rad\].
    fn telling_noise(&self, log: usize) -> Option<Vec<f64>> {
        let of_joint = &self.logs[log].smoothing.as_ref()?.costs.of_joint;
        let tells = |cost: &JointCost| encoder::tells(cost.at.share);
        let step = |cost: &Option<JointCost>| cost.as_ref().map_or(0.0, |cost| cost.at.step);
        let steps = || of_joint.iter().map(step).collect();
        of_joint.iter().flatten().any(tells).then(steps)
    }
}
