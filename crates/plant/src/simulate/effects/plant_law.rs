//! How the plant has an effect: default values of the entry's keys, and how it is built from one value each.

use super::{Effect, EffectSite, Fault, LoggedChannels, PlantRobot, PlantState};
use crate::simulate::SimulateError;
use cft_ident_core::effect::Entry;

/// The plant's law of an effect. It shares the entry with the estimator's, and nothing else.
pub struct PlantLaw {
    pub entry: &'static Entry,
    /// Of every key of the entry, in its order, at a site.
    pub defaults: fn(&EffectSite) -> Vec<f64>,
    pub build: fn(&EffectSite, &PlantRobot, &[f64]) -> Result<BuiltLaw, SimulateError>,
}

/// What a law is built into.
pub enum BuiltLaw {
    /// A part of the plant.
    Plant(Box<dyn Effect>),
    /// A fault of the log.
    Log(Fault),
}

/// One joint at an instant: all that a torque without memory may hang on.
pub(super) struct JointState {
    pub t: f64,
    pub q: f64,
    pub v: f64,
    /// The plant's own friction F(v).
    pub friction: f64,
}

/// [`Effect::torque`] alone.
struct Torque<F>(F);

impl<F: Fn(&PlantState, &mut [f64]) + Send> Effect for Torque<F> {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        (self.0)(motion, torque);
    }
}

/// [`Effect::inertia`] alone.
struct Inertia<F>(F);

impl<F: Fn(&PlantState, &mut [f64], &mut [f64]) + Send> Effect for Inertia<F> {
    fn inertia(&self, motion: &PlantState, mass: &mut [f64], torque: &mut [f64]) {
        (self.0)(motion, mass, torque);
    }
}

impl BuiltLaw {
    /// An effect of the plant.
    pub(super) fn plant(effect: impl Effect + 'static) -> Result<Self, SimulateError> {
        Ok(Self::Plant(Box::new(effect)))
    }

    /// A torque at the site's joint.
    pub(super) fn torque(
        site: &EffectSite,
        torque: impl Fn(JointState) -> f64 + Send + 'static,
    ) -> Result<Self, SimulateError> {
        let j = site.joint();
        Self::torques(move |motion, torques| {
            torques[j] += torque(JointState {
                t: motion.t,
                q: motion.q[j],
                v: motion.v[j],
                friction: motion.friction[j],
            });
        })
    }

    /// Torques that are added in place.
    pub(super) fn torques(
        add: impl Fn(&PlantState, &mut [f64]) + Send + 'static,
    ) -> Result<Self, SimulateError> {
        Self::plant(Torque(add))
    }

    /// Inertia, and rigid-body torque without acceleration, that are added in place.
    pub(super) fn inertia(
        add: impl Fn(&PlantState, &mut [f64], &mut [f64]) + Send + 'static,
    ) -> Result<Self, SimulateError> {
        Self::plant(Inertia(add))
    }

    /// A fault of the log, behind the noise of the torque or before it.
    pub(super) fn log(
        before_noise: bool,
        apply: impl Fn(&mut LoggedChannels) + Send + 'static,
    ) -> Result<Self, SimulateError> {
        let apply = Box::new(apply);
        Ok(Self::Log(Fault {
            apply,
            before_noise,
        }))
    }
}

impl PlantLaw {
    /// Builds the effect from one number per key.
    pub(super) fn built(
        &self,
        site: &EffectSite,
        machine: &PlantRobot,
        numbers: &[f64],
    ) -> Result<BuiltLaw, SimulateError> {
        let built = (self.build)(site, machine, numbers)?;
        for (key, value) in self.entry.keys.iter().zip(numbers) {
            if let Some(range) = key.range.filter(|range| !range.holds(*value)) {
                let (effect, rule) = (self.entry.name, range.rule);
                return Err(SimulateError::number(effect, key.name, *value, rule));
            }
        }
        Ok(built)
    }
}
