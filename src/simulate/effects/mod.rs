//! Effects that a declared model may lack, integrated by the plant in its own code.
//!
//! An effect is named on the command line as `NAME[:JOINT][:key=value,...]`; without a joint it acts on
//! every joint, and a key that is left out takes a default that scales with the joint's own friction.
//! A new effect is one file here and one line in [`KINDS`].

mod ripple;
mod spec;
mod torque_offset;

pub use spec::{EffectSpec, EffectValue};

use super::SimulateError;

/// State of the plant as an effect sees it.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Time \[s\].
    pub t: f64,
    /// Joint positions, m or rad.
    pub q: &'a [f64],
    /// Joint speeds, m/s or rad/s.
    pub v: &'a [f64],
    /// The effect's own states.
    pub z: &'a [f64],
}

/// One effect on the plant. Everything but the torque has a default: most effects are static.
pub trait Effect: std::fmt::Debug + Send {
    /// Adds to `torque` what the motors must supply because of the effect, in N or N m per joint.
    fn torque(&self, motion: &Motion, torque: &mut [f64]);

    /// How many states of its own the effect integrates.
    fn states(&self) -> usize {
        0
    }

    /// Time derivatives of its own states.
    fn rates(&self, _motion: &Motion, _dz: &mut [f64]) {}

    /// Adds to the inertia matrix (row-major) and to the torque without acceleration.
    fn inertia(&self, _motion: &Motion, _mass: &mut [f64], _torque: &mut [f64]) {}

    /// Takes an accepted step into its memory; `true` when that changes its torque at this point.
    fn moved(&mut self, _motion: &Motion) -> bool {
        false
    }
}

/// What an effect is built for.
#[derive(Debug, Clone, Copy)]
pub struct Site<'a> {
    /// Joint that the effect acts on.
    pub joint: usize,
    /// Whether that joint turns (orders are then per revolution) or slides (per metre).
    pub turns: bool,
    /// Typical torque of the joint, N or N m: what default sizes are a fraction of.
    pub scale: f64,
    /// Unit of the joint's torque.
    pub unit: &'a str,
}

/// One value of an effect's definition: key, unit (`torque` stands for the joint's), default as a
/// function of the site.
pub struct Key {
    pub name: &'static str,
    pub unit: &'static str,
    pub default: fn(&Site) -> f64,
}

/// A kind of effect: its name, its keys, and how it is built from one value per key.
pub struct Kind {
    pub name: &'static str,
    pub family: &'static str,
    pub keys: &'static [Key],
    pub build: fn(&Site, &[f64]) -> Box<dyn Effect>,
}

/// All effects that the simulator knows.
pub const KINDS: &[&Kind] = &[&torque_offset::KIND, &ripple::KIND];

/// The effects of one plant, each with its slice of the extra states.
#[derive(Debug, Default)]
pub struct Effects {
    list: Vec<(Box<dyn Effect>, std::ops::Range<usize>)>,
}

impl Effects {
    /// Builds the effects; the second result is what they came out as, one entry per joint.
    ///
    /// # Errors
    /// [`SimulateError::UnknownEffect`], [`SimulateError::UnknownKey`],
    /// [`SimulateError::UnknownJoint`].
    pub fn build(
        specs: &[EffectSpec],
        joints: &[String],
        sites: &[Site],
    ) -> Result<(Self, Vec<EffectValue>), SimulateError> {
        let mut effects = Self::default();
        let mut values = Vec::new();
        for spec in specs {
            let kind = spec.kind()?;
            for site in spec.sites(joints, sites)? {
                let numbers = spec.numbers(kind, site)?;
                effects.push((kind.build)(site, &numbers));
                values.push(EffectValue::new(kind, &joints[site.joint], site, &numbers));
            }
        }
        Ok((effects, values))
    }

    /// Adds one effect.
    pub fn push(&mut self, effect: Box<dyn Effect>) {
        let first = self.states();
        let states = first..first + effect.states();
        self.list.push((effect, states));
    }

    /// Extra states of all effects.
    pub fn states(&self) -> usize {
        self.list.last().map_or(0, |(_, states)| states.end)
    }

    /// Whether there are none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Adds every effect's torque.
    pub fn torque(&self, motion: &Motion, torque: &mut [f64]) {
        for (effect, states) in &self.list {
            effect.torque(&own(motion, states), torque);
        }
    }

    /// Adds every effect's inertia.
    pub fn inertia(&self, motion: &Motion, mass: &mut [f64], torque: &mut [f64]) {
        for (effect, states) in &self.list {
            effect.inertia(&own(motion, states), mass, torque);
        }
    }

    /// Writes the rates of every effect's states.
    pub fn rates(&self, motion: &Motion, dz: &mut [f64]) {
        for (effect, states) in &self.list {
            effect.rates(&own(motion, states), &mut dz[states.clone()]);
        }
    }

    /// Tells every effect of an accepted step; `true` when one of them changed.
    pub fn moved(&mut self, motion: &Motion) -> bool {
        let mut changed = false;
        for (effect, states) in &mut self.list {
            changed |= effect.moved(&own(motion, states));
        }
        changed
    }
}

/// The motion with the states of one effect.
fn own<'a>(motion: &Motion<'a>, states: &std::ops::Range<usize>) -> Motion<'a> {
    Motion {
        z: &motion.z[states.clone()],
        ..*motion
    }
}
