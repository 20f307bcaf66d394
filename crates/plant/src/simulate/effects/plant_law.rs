//! How the plant has an effect: default values of the entry's keys, and how it is built from one value each.

use super::{Effect, Fault, PlantRobot, Site};
use crate::simulate::SimulateError;
use cft_ident_core::effect::Entry;

/// The plant's law of an effect. It shares the entry with the estimator's, and nothing else.
pub struct PlantLaw {
    pub entry: &'static Entry,
    /// Of every key of the entry, in its order, at a site.
    pub defaults: fn(&Site) -> Vec<f64>,
    pub build: fn(&Site, &PlantRobot, &[f64]) -> Result<Built, SimulateError>,
}

/// What a law is built into.
pub enum Built {
    /// A part of the plant.
    Plant(Box<dyn Effect>),
    /// A fault of the log.
    Log(Box<dyn Fault>),
}

impl Built {
    /// An effect of the plant.
    pub(super) fn plant(effect: impl Effect + 'static) -> Result<Self, SimulateError> {
        Ok(Self::Plant(Box::new(effect)))
    }

    /// A fault of the log.
    pub(super) fn log(fault: impl Fault + 'static) -> Result<Self, SimulateError> {
        Ok(Self::Log(Box::new(fault)))
    }
}

impl PlantLaw {
    /// Builds the effect from one number per key.
    pub(super) fn built(
        &self,
        site: &Site,
        machine: &PlantRobot,
        numbers: &[f64],
    ) -> Result<Built, SimulateError> {
        let built = (self.build)(site, machine, numbers)?;
        for (key, value) in self.entry.keys.iter().zip(numbers) {
            if let Some(range) = key.range.filter(|range| !range.holds(*value)) {
                return Err(SimulateError::EffectNumber {
                    effect: self.entry.name.to_owned(),
                    key: key.name.to_owned(),
                    value: *value,
                    rule: range.rule.to_owned(),
                });
            }
        }
        Ok(built)
    }
}
