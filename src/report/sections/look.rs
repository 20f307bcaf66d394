//! Logs in memory beside the models that are looked at on them.

use crate::diagnose::{JointEvidence, evidence};
use crate::effect::AugmentedModel;
use crate::identify::{InMemory, LoggedRobot};
use crate::log::escape;
use crate::motion::{MotionError, ParallelFilters, Stretch};

/// Logs with the processing of a model.
pub struct Look<'a> {
    pub machine: &'a LoggedRobot,
    pub stretches: &'a [Stretch],
    /// Names of the logs, by the index that their stretches carry.
    pub names: Vec<String>,
    pub filters: ParallelFilters,
    pub cutoff_hz: f64,
}

impl<'a> Look<'a> {
    /// The logs that were read for `machine`, and their names.
    ///
    /// # Errors
    /// Settings that the sampling rate does not carry.
    pub fn new(
        machine: &'a LoggedRobot,
        in_memory: &'a InMemory,
        logs: impl Iterator<Item = String>,
    ) -> Result<Self, MotionError> {
        let settings = machine.settings();
        let filters = ParallelFilters::design(&settings, &in_memory.stretches)?;
        Ok(Look {
            machine,
            stretches: &in_memory.stretches,
            names: logs.map(|name| escape(&name)).collect(),
            filters,
            cutoff_hz: settings.cutoff_hz,
        })
    }

    /// Names of some of the logs, the first few of many.
    pub fn named(&self, logs: &[usize]) -> String {
        const MOST: usize = 3;
        let names = logs.iter().filter_map(|log| self.names.get(*log));
        let mut names: Vec<String> = names.cloned().collect();
        // spans of one log have its name
        names.dedup();
        if names.len() > MOST {
            let more = names.len() - MOST;
            names.truncate(MOST);
            names.push(format!("{more} more"));
        }
        names.join(", ")
    }

    /// Stretches of one log.
    pub fn of_log(&self, log: usize) -> impl Iterator<Item = &Stretch> {
        self.stretches.iter().filter(move |s| s.log == log)
    }

    /// What the residual of a model depends on, over the logs of `wanted`; spectra reach `orders`, one per joint.
    ///
    /// # Errors
    /// Stretches that are too short for the filter.
    pub fn evidence(
        &self,
        model: &AugmentedModel,
        wanted: &dyn Fn(usize) -> bool,
        orders: &[f64],
    ) -> Result<Vec<JointEvidence>, MotionError> {
        let stretches: Vec<&Stretch> = self.stretches.iter().filter(|s| wanted(s.log)).collect();
        let settings = (self.cutoff_hz, orders);
        evidence(model, &stretches, &self.filters, settings)
    }

    /// Lowest and highest velocity of a joint over all logs [m/s or rad/s].
    pub fn velocities(&self, joint: usize) -> Option<[f64; 2]> {
        let all = self.stretches.iter().filter_map(|s| s.v.get(joint));
        all.flatten().fold(None, |found, v| {
            let [low, high] = found.unwrap_or([*v, *v]);
            Some([low.min(*v), high.max(*v)])
        })
    }
}
