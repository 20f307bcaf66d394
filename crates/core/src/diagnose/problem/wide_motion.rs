//! The logs again, through a position filter several times as wide as the model's.

use crate::motion::{FilterSettings, MotionError, ParallelFilters, Stretch};

/// The logs through a position filter several times as wide as the model's.
#[derive(Debug, Clone)]
pub struct WideMotion {
    /// Sample by sample beside the stretches of the case; none where the log gives no wider motion.
    pub stretches: Vec<Option<Stretch>>,
    /// The filters that these came through.
    pub filters: ParallelFilters,
}

/// How many times as wide as the model's.
pub const TIMES: f64 = 4.0;

impl WideMotion {
    /// Beside the stretches of a case, from those that were read with settings widened by [`TIMES`] and are longer at
    /// their ends.
    ///
    /// # Errors
    /// [`MotionError`] for settings that a sampling rate does not carry.
    pub fn beside(
        stretches: &[Stretch],
        wide: Vec<Stretch>,
        settings: &FilterSettings,
    ) -> Result<Self, MotionError> {
        let filters = ParallelFilters::design(settings, &wide)?;
        let beside = |narrow: &Stretch| {
            let of_log = wide.iter().filter(|w| w.log == narrow.log);
            of_log.filter_map(|w| w.beside(narrow)).next()
        };
        Ok(WideMotion {
            stretches: stretches.iter().map(beside).collect(),
            filters,
        })
    }
}
