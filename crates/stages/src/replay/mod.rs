//! Models replayed along logs in memory: the data of the figures of a report. Nothing is drawn here, and the report
//! reckons nothing.

mod effect;
mod friction;
mod poses;
mod residual;
mod torque;

pub use effect::EffectRows;
pub use friction::{FrictionRows, is_beyond_curve, speeds};
pub use poses::TreePoses;
pub use residual::{ResidualEvidence, ResidualPair};
pub use torque::{JointSeries, TorqueSeries};

use crate::find::diagnose::Diagnosed;
use crate::held_out::compare::Compared;
use crate::input::in_memory::InMemory;
use crate::input::robot_setup::RobotSetup;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::{MotionError, ParallelFilters, Stretch};
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::escape;

/// Logs with the processing of a robot.
pub struct LogReplay<'a> {
    pub(crate) setup: &'a RobotSetup,
    stretches: &'a [Stretch],
    /// Names of the logs, by the index that their stretches carry.
    names: Vec<String>,
    filters: ParallelFilters,
    cutoff_hz: f64,
}

impl<'a> LogReplay<'a> {
    /// The logs that were read for `machine`, and their names.
    ///
    /// # Errors
    /// Settings that the sampling rate does not carry.
    pub fn new(
        setup: &'a RobotSetup,
        in_memory: &'a InMemory,
        logs: impl Iterator<Item = String>,
    ) -> Result<Self, MotionError> {
        let settings = setup.settings();
        let filters = ParallelFilters::design(&settings, &in_memory.stretches)?;
        Ok(LogReplay {
            setup,
            stretches: &in_memory.stretches,
            names: logs.map(|name| escape(&name)).collect(),
            filters,
            cutoff_hz: settings.cutoff_hz,
        })
    }

    fn named(&self, logs: &[usize]) -> Vec<String> {
        let names = logs.iter().filter_map(|log| self.names.get(*log));
        let mut names: Vec<String> = names.cloned().collect();
        // spans of one log have its name
        names.dedup();
        names
    }

    fn all(&self) -> Vec<usize> {
        (0..self.names.len()).collect()
    }

    fn of_log(&self, log: usize) -> impl Iterator<Item = &Stretch> {
        self.stretches.iter().filter(move |s| s.log == log)
    }

    /// Lowest and highest velocity of a joint over all logs [m/s or rad/s].
    fn velocities(&self, joint: usize) -> Option<[f64; 2]> {
        let all = self.stretches.iter().filter_map(|s| s.v.get(joint));
        all.flatten().fold(None, |found, v| {
            let [low, high] = found.unwrap_or([*v, *v]);
            Some([low.min(*v), high.max(*v)])
        })
    }
}

/// What logs show beside one model.
#[derive(Debug, Clone)]
pub struct ReplayedLogs {
    /// Names of the logs.
    pub logs: Vec<String>,
    pub friction: Vec<FrictionRows>,
    pub torque: Vec<TorqueSeries>,
    pub residual: ResidualEvidence,
    /// None for a robot whose links are not known.
    pub poses: Option<TreePoses>,
}

impl ReplayedLogs {
    /// Along all logs; residual and poses are those of logs that were not `used` for the model, where some were
    /// and others were not, and the torques of these come first.
    ///
    /// # Errors
    /// Stretches that are too short for the filter.
    pub fn new(
        replay: &LogReplay,
        file: &ModelFile,
        model: &AugmentedModel,
        used: &[bool],
    ) -> Result<Self, MotionError> {
        let is_used = |log: &usize| used.get(*log) == Some(&true);
        let (seen, unseen): (Vec<_>, Vec<_>) = replay.all().into_iter().partition(is_used);
        let judged = if unseen.is_empty() { &seen } else { &unseen };
        let ordered: Vec<usize> = unseen.iter().chain(&seen).copied().collect();
        Ok(ReplayedLogs {
            logs: replay.names.clone(),
            friction: friction::friction(replay, file, model)?,
            torque: torque::torque(replay, &ordered, &[model])?,
            residual: residual::residual(replay, judged, model, None)?,
            poses: poses::poses(replay, judged),
        })
    }
}

/// What logs show beside the model of a diagnosis: the torque and the effects on held-out logs, where there are any,
/// and the residual on those that were fitted.
#[derive(Debug, Clone)]
pub struct ReplayedDiagnosis {
    /// Names of the logs of torque and effects.
    pub logs: Vec<String>,
    /// They are held out.
    pub held_out: bool,
    /// Of the given model, and of the one that was found where anything was added.
    pub torque: Vec<TorqueSeries>,
    /// Of the effects that are written, in the order in which they were found.
    pub effects: Vec<EffectRows>,
    /// Of the model that was found, along all logs.
    pub friction: Vec<FrictionRows>,
    pub residual: ResidualEvidence,
    pub poses: Option<TreePoses>,
}

impl ReplayedDiagnosis {
    /// Along the logs of the diagnosis; `refined` is the file of the model that was found.
    ///
    /// # Errors
    /// Stretches that are too short for the filter; settings that the sampling rate does not carry.
    pub fn new(
        setup: &RobotSetup,
        found: &Diagnosed,
        refined: &ModelFile,
    ) -> Result<Self, MotionError> {
        let replay = LogReplay::new(setup, &found.in_memory, found.logs.iter().cloned())?;
        let d = &found.diagnosis;
        let all = replay.all();
        let (fitted, others) = all.split_at(d.fitted_logs.min(all.len()));
        let shown = if others.is_empty() { fitted } else { others };
        // without an effect the given model stands
        let after = d.changes_model().then_some(&d.in_use);
        let models: Vec<&AugmentedModel> = [&found.given].into_iter().chain(after).collect();
        let added = d
            .written()
            .filter_map(|step| Some((step.written?, step.without.as_ref()?)));
        let rows = |(at, without)| effect::effect(&replay, (&d.in_use, without), at, shown);
        Ok(ReplayedDiagnosis {
            logs: shown.iter().map(|log| replay.names[*log].clone()).collect(),
            held_out: !others.is_empty(),
            torque: torque::torque(&replay, shown, &models)?,
            effects: added.map(rows).collect::<Result<_, _>>()?,
            friction: friction::friction(&replay, refined, &d.in_use)?,
            residual: residual::residual(&replay, fitted, &found.given, after)?,
            poses: poses::poses(&replay, shown),
        })
    }
}

/// What logs show beside two models.
#[derive(Debug, Clone)]
pub struct ReplayedPair {
    /// Names of the logs.
    pub logs: Vec<String>,
    pub torque: Vec<TorqueSeries>,
    /// Velocity, torque less all that is no friction, and friction of the model, row by row of every joint; none for a
    /// model without effects, whose friction is a curve.
    pub friction: [Option<Vec<Vec<[f64; 3]>>>; 2],
}

impl ReplayedPair {
    /// Along all logs.
    ///
    /// # Errors
    /// Stretches that are too short for the filter.
    pub fn new(replay: &LogReplay, of: &Compared) -> Result<Self, MotionError> {
        let models = [0, 1].map(|k| &of.sides[k].model);
        let [a, b] = models.map(|model| match model.effects.is_empty() {
            true => Ok(None),
            false => friction::friction_rows(replay, model).map(Some),
        });
        Ok(ReplayedPair {
            logs: replay.names.clone(),
            torque: torque::torque(replay, &replay.all(), &models)?,
            friction: [a?, b?],
        })
    }
}
