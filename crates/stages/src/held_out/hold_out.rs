//! What a model leaves of torques that it did not see: blocks of its logs set aside one after the other, or logs
//! that made nothing of it.

use crate::band::{self, Deviation, Directions, Error, Folds, FreeColumns, held_out, without_each};
use crate::input::control::Control;
use crate::input::error::IdentifyError;
use crate::input::in_memory::count_run_time;
use crate::input::log_data::LogData;
use crate::input::position_cutoff::known;
use crate::input::repeated::unseen_by;
use crate::input::robot_setup::RobotSetup;
use crate::note::{FitNote, StageNote};
use crate::observe::{KEPT, Observer, QuietSample, QuietTorques};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::{FilterSettings, MotionError, ParallelFilters, Stretch, stretches};
use cft_ident_core::robot::model::JointFriction;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::held_out::{HeldOut, TorqueExcesses};
use cft_ident_logs::log::{Block, Provenance};

/// Blocks that are set aside one after the other.
const FOLDS: usize = 3;
/// Rows over all logs by which models are moved and bands found; of longer logs pieces all along them.
const MOST_ROWS: u64 = 150_000;
/// Rows along which external torques are observed: rare excesses take more.
const MOST_OBSERVED: u64 = 1_500_000;
/// Pieces of a log that is longer.
const PIECES_OF_LONG_LOG: f64 = 12.0;
/// Errors of each joint that quantiles are formed from.
const MOST_ERRORS: usize = 40_000;
/// Time before a block from which its observer runs, in periods of the cut-off.
const LEAD_PERIODS: f64 = 12.0;

/// What is kept of it in a model file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Held {
    pub joints: Vec<HeldOut>,
    pub excesses: Option<TorqueExcesses>,
}

impl Held {
    pub(crate) fn write_into(&self, file: &mut ModelFile) {
        file.held_out.clone_from(&self.joints);
        file.excesses.clone_from(&self.excesses);
    }
}

/// Which rows of a long log are looked at.
#[derive(Debug, Clone, Copy)]
struct Pieces {
    length_s: f64,
    share: f64,
}

impl Pieces {
    /// So many rows of these logs together.
    fn of_each(most: u64, logs: &[Provenance]) -> Vec<Self> {
        let rows: u64 = logs.iter().map(|log| log.samples).sum();
        let share = (most as f64 / rows.max(1) as f64).min(1.0);
        let length = |log: &Provenance| log.duration_s / PIECES_OF_LONG_LOG;
        let each = logs.iter().map(|log| Self {
            length_s: length(log),
            share,
        });
        each.collect()
    }

    fn keep(&self, block: &mut Block, first: f64) {
        if self.share < 1.0 && self.length_s > 0.0 {
            block.retain(|t| ((t - first) / self.length_s).fract() < self.share);
        }
    }
}

/// Sets blocks of the fitted logs aside, one after the other; `machine` has the position cut-offs of the fit.
pub(crate) fn hold_out(
    setup: &RobotSetup,
    (file, model): (&ModelFile, &AugmentedModel),
    (logs, inputs): (&[LogData], &[Provenance]),
    control: &Control,
) -> Result<Held, IdentifyError> {
    Trial::new(setup, (file, model), (logs, inputs), control).run(FOLDS)
}

/// The same of logs that the model has nothing from.
pub(crate) fn on_other_logs(
    setup: &RobotSetup,
    (name, file, model): (&str, &ModelFile, &AugmentedModel),
    logs: &[LogData],
    control: &Control,
) -> Result<(Held, Vec<Provenance>), IdentifyError> {
    let setup = &setup.with_position_cutoffs(logs, &known(&model.model), control)?;
    let mut inputs = Vec::new();
    for log in logs {
        let mut blocks = log.blocks(control)?;
        let mut block = Block::default();
        while blocks.read(&mut block)? {}
        inputs.push(blocks.provenance()?);
    }
    unseen_by((name, file), &inputs)?;
    let held = Trial::new(setup, (file, model), (logs, &inputs), control).run(1)?;
    Ok((held, inputs))
}

/// Logs smoothed by these settings; of long ones pieces all along them.
pub(crate) fn read_pieces(
    setup: &RobotSetup,
    settings: &FilterSettings,
    model: &AugmentedModel,
    (logs, inputs): (&[LogData], &[Provenance]),
    control: &Control,
) -> Result<Vec<Stretch>, IdentifyError> {
    let n = setup.robot.joints();
    let pieces = Pieces::of_each(MOST_ROWS, inputs);
    let mut all = Vec::new();
    for ((index, log), pieces) in logs.iter().enumerate().zip(&pieces) {
        let mut blocks = log.blocks(control)?;
        let mut first = None;
        let (mut found, _) = stretches(index, n, settings, &mut |block| {
            let more = blocks.read(block)?;
            if let Some(t) = block.t.first() {
                pieces.keep(block, *first.get_or_insert(*t));
            }
            Ok(more)
        })
        .map_err(|e| log.to_stage_error(&blocks, e))?;
        count_run_time(&mut found, &blocks);
        if model.takes_temperatures() {
            let temperatures = setup.temperatures_for(model, log)?;
            for stretch in &mut found {
                stretch.temperature = temperatures.along(&stretch.t, n);
            }
        }
        all.extend(found);
    }
    Ok(all)
}

struct Trial<'a> {
    setup: &'a RobotSetup,
    settings: FilterSettings,
    file: &'a ModelFile,
    model: &'a AugmentedModel,
    logs: &'a [LogData],
    inputs: &'a [Provenance],
    observed: Vec<Pieces>,
    control: &'a Control,
}

impl<'a> Trial<'a> {
    fn new(
        setup: &'a RobotSetup,
        (file, model): (&'a ModelFile, &'a AugmentedModel),
        (logs, inputs): (&'a [LogData], &'a [Provenance]),
        control: &'a Control,
    ) -> Self {
        let inputs = &inputs[..logs.len().min(inputs.len())];
        Self {
            setup,
            settings: setup.settings(),
            file,
            model,
            logs,
            inputs,
            observed: Pieces::of_each(MOST_OBSERVED, inputs),
            control,
        }
    }

    fn run(&self, folds: usize) -> Result<Held, IdentifyError> {
        let work = self.control.begin("held-out data", None);
        let logs = (self.logs, self.inputs);
        let stretches = read_pieces(self.setup, &self.settings, self.model, logs, self.control)?;
        let folds = Folds::of(&stretches, folds);
        let failed = |error| IdentifyError::motion(&self.logs[0].name(), error);
        let models = match folds.count() {
            1 => vec![self.model.clone()],
            _ => {
                let filters = ParallelFilters::design(&self.settings, &stretches);
                let speeds = self.setup.rest_speeds(self.logs)?;
                without_each(
                    self.model,
                    &self.free(),
                    &stretches,
                    &filters.map_err(failed)?,
                    &speeds,
                    &folds,
                )
                .map_err(failed)?
            }
        };
        self.control.check()?;
        let mut joints = self.errors(&stretches, &folds, &models);
        drop(stretches);
        work.doing("external torques");
        let excesses = self.quiet(&folds, &models, &mut joints)?;
        Ok(Held { joints, excesses })
    }

    /// Whether the logs gave a joint's friction and offset: what one-joint logs gave is not theirs.
    fn free(&self) -> FreeColumns {
        let joints = self.setup.robot.joint_names();
        let laws = joints.iter().zip(&self.model.model.friction);
        let friction = laws.map(|(joint, law)| {
            let known = self.file.friction_prior.iter().any(|p| p.joint == *joint);
            *law != JointFriction::None && !known
        });
        let offset = joints
            .iter()
            .map(|joint| self.file.find("offset", Some(joint)).is_some());
        FreeColumns {
            friction: friction.collect(),
            offset: offset.collect(),
        }
    }

    /// What each block leaves of the torques by the model of the others.
    fn errors(
        &self,
        stretches: &[Stretch],
        folds: &Folds,
        models: &[AugmentedModel],
    ) -> Vec<HeldOut> {
        let n = self.setup.robot.joints();
        let samples: usize = stretches.iter().map(Stretch::len).sum();
        let every = samples.div_ceil(MOST_ERRORS).max(1);
        let model = &self.model.model;
        let deviation = Deviation::new(&self.file.model_covariance(model), model);
        let mut errors: Vec<Vec<Error>> = vec![Vec::with_capacity(samples / every + 1); n];
        let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut variances = vec![0.0; n];
        for stretch in stretches {
            let of_fold: Vec<usize> = (stretch.t.iter())
                .map(|t| folds.of_time(stretch.log, *t))
                .collect();
            for (fold, model) in models.iter().enumerate() {
                let Some(from) = of_fold.iter().position(|f| *f == fold) else {
                    continue;
                };
                let until = of_fold.iter().rposition(|f| *f == fold).unwrap_or(from) + 1;
                // effects remember from the begin of the stretch
                let begin = if model.effects.is_empty() { from } else { 0 };
                let hat = model.reconstruct(&stretch.part(begin, until));
                for k in (from..until).step_by(every) {
                    stretch.at(k, &mut q, &mut v, &mut a);
                    deviation.variances([&q, &v, &a], &mut variances);
                    for (j, errors) in errors.iter_mut().enumerate() {
                        let torque = hat[j][k - begin];
                        errors.push(Error {
                            position: q[j],
                            speed: v[j],
                            acceleration: a[j],
                            torque,
                            error: stretch.tau[j][k] - torque,
                            variance: variances[j],
                        });
                    }
                }
            }
        }
        let dt = stretches.first().map_or(1e-3, |s| s.dt);
        let independent = (2.0 * self.settings.cutoff_hz * dt * every as f64).min(1.0);
        let names = self.setup.robot.joint_names().iter();
        let plain = self.settings.plain_q_cutoff_hz(1.0 / dt);
        let all = names.zip(&errors).enumerate();
        all.map(|(j, (joint, errors))| {
            let mut held = held_out(joint, errors, independent);
            held.samples = samples as u64;
            let own = self.settings.joint_q_cutoffs_hz.get(j);
            held.position_cutoff_hz = own.copied().unwrap_or(plain);
            held
        })
        .collect()
    }

    /// External torques along the blocks, each by the model of the others.
    fn quiet(
        &self,
        folds: &Folds,
        models: &[AugmentedModel],
        held: &mut [HeldOut],
    ) -> Result<Option<TorqueExcesses>, IdentifyError> {
        let cutoff = self.settings.cutoff_hz;
        // what knows the past alone gains nothing by a wide filter, and accelerations take its noise
        let plain = self.settings.plain_q_cutoff_hz(f64::INFINITY);
        let each = self.settings.joint_q_cutoffs_hz.iter();
        let position = each.copied().fold(plain, f64::min);
        let settings = self.settings.with_one_position_filter(position);
        let uncertain = Directions::of(self.file, &self.model.model, held);
        let mut quiet = QuietTorques::default();
        for (index, log) in self.logs.iter().enumerate() {
            let failed = |error| IdentifyError::motion(&log.name(), error);
            let mut blocks = log.blocks(self.control)?;
            let temperatures = (self.setup).temperatures_for(self.model, log)?;
            let mut watched: Vec<Watched> = (models.iter().enumerate())
                .map(|(fold, model)| Watched::new((index, fold), (model, &uncertain), &settings))
                .collect::<Result<_, _>>()
                .map_err(failed)?;
            for watched in &mut watched {
                watched.observer.set_temperatures(temperatures.clone());
            }
            let (mut block, mut first, mut more) = (Block::default(), None, true);
            while more {
                more = blocks.read(&mut block)?;
                if let Some(t) = block.t.first() {
                    let first = *first.get_or_insert(*t);
                    self.observed[index].keep(&mut block, first);
                }
                for watched in &mut watched {
                    let push = &mut |sample: QuietSample| quiet.push(sample);
                    (watched.take(&block, !more, folds, push)).map_err(failed)?;
                    if quiet.step_s == 0.0 && watched.next > f64::NEG_INFINITY {
                        quiet.step_s = watched.kept_s();
                    }
                }
            }
        }
        let learnt = quiet.learn(held, cutoff, position);
        if learnt.is_none() {
            // torques of too few samples: those of the band stand for them
            for held in held.iter_mut() {
                let wide = held.half_width_95.iter().flatten();
                let wide = wide.fold(f64::MIN_POSITIVE, |m, x| m.max(*x));
                held.external_std = vec![wide / band::NORMAL_95; held.speed_edges.len() + 1];
                held.external_99 = 2.6;
            }
        }
        Ok(learnt)
    }
}

/// One block of a log behind the observer, by the model of the others.
struct Watched {
    log: usize,
    fold: usize,
    observer: Observer,
    /// How uncertain the parameters make torques: asked for at the samples that are kept.
    uncertain: Directions,
    /// Samples are kept at least so far apart \[s\].
    every: f64,
    /// Time before the block from which the observer runs \[s\].
    lead: f64,
    /// Time from which the next sample is kept \[s\].
    next: f64,
    begins: bool,
    /// Nothing of the block comes any more.
    done: bool,
}

impl Watched {
    fn new(
        (log, fold): (usize, usize),
        (model, uncertain): (&AugmentedModel, &Directions),
        settings: &FilterSettings,
    ) -> Result<Self, MotionError> {
        Ok(Self {
            log,
            fold,
            observer: Observer::new(model.clone(), settings)?,
            uncertain: uncertain.clone(),
            every: 1.0 / (KEPT * settings.cutoff_hz),
            lead: LEAD_PERIODS / settings.cutoff_hz,
            next: f64::NEG_INFINITY,
            begins: true,
            done: false,
        })
    }

    /// Hands on the samples of its block that these rows of the log determine; `last` ends the log.
    fn take(
        &mut self,
        rows: &Block,
        last: bool,
        folds: &Folds,
        push: &mut dyn FnMut(QuietSample),
    ) -> Result<(), MotionError> {
        let of = |t: f64| folds.of_time(self.log, t);
        let (fold, every) = (self.fold, self.every);
        let mut variance = Vec::new();
        let reached = |t: &f64| of(*t + self.lead) >= fold;
        if self.done || !(last || rows.t.last().is_some_and(reached)) {
            return Ok(());
        }
        let mut own = rows.clone();
        own.retain(|t| of(t) == fold || of(t + self.lead) == fold);
        // blocks stand one behind the other: what is left of this one goes before the next one's samples
        self.done = last || rows.t.last().is_some_and(|t| of(*t) > fold);
        self.observer.push(&own, self.done, &mut |o| {
            self.begins |= o.begins;
            if of(o.t) != fold || o.t < self.next {
                return;
            }
            self.next = o.t + every * (1.0 - 1e-6);
            variance.resize(o.q.len(), 0.0);
            self.uncertain.variances([o.q, o.v, o.a], &mut variance);
            (variance.iter_mut().zip(o.variance)).for_each(|(all, own)| *all += own);
            push(QuietSample {
                t: o.t,
                begins: std::mem::take(&mut self.begins),
                external: o.external,
                speed: o.speed,
                variance: &variance,
            });
        })
    }

    /// Time between the samples that are kept: a multiple of the sampling step, where that is known \[s\].
    fn kept_s(&self) -> f64 {
        let step = self.observer.step_s().unwrap_or(self.every);
        step * (self.every / step).ceil().max(1.0)
    }
}

/// A note where a model goes without: interruption is passed on.
pub(crate) fn or_note(
    held: Result<Held, IdentifyError>,
    notes: &mut Vec<StageNote>,
) -> Result<Held, IdentifyError> {
    match held {
        Err(IdentifyError::Interrupted) => Err(IdentifyError::Interrupted),
        Err(error) => {
            let error = error.to_string();
            notes.push(StageNote::Fit(FitNote::NothingSetAside { error }));
            Ok(Held::default())
        }
        Ok(held) => Ok(held),
    }
}
