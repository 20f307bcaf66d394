//! Effects that a declared model may lack, integrated by the plant in its own code.
//!
//! An effect is named on the command line as `NAME[:JOINT][:key=value,...]`; without a joint it acts on
//! every joint, and a key that is left out takes a default that scales with the joint (docs/developers/effects.md).
//! Most effects are torques or states of the plant ([`Effect`], [`BuiltLaw`]); delays and faults of the data are put
//! into the log that the plant left ([`Fault`]). A new effect is one file here and one line in [`LAWS`]. Effects of a
//! user's own come with their formulas ([`EffectSpec::own`]).
//!
//! A jump in speed would leave the differential equation without a solution at rest. Signs and steps of
//! the speed are therefore tanh(w v) and (1 + tanh(w v))/2, with w as steep as the joint's inertia lets an
//! explicit integrator follow ([`EffectSite::slope`]).

mod fault;
mod formula;
mod frames;
mod plant_law;
mod site;
mod spec;

pub use fault::{Fault, LoggedChannels};
pub use plant_law::{BuiltLaw, PlantLaw};
pub use site::{EffectSite, PlantRobot, RobotSites};
pub use spec::{EffectSpec, EffectValue, PlantParameter};

use std::ops::Range;

use super::SimulateError;

/// State of the plant as an effect sees it: the motor's side of every joint.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlantState<'a> {
    /// Time \[s\].
    pub t: f64,
    /// Joint positions, m or rad.
    pub q: &'a [f64],
    /// Joint speeds, m/s or rad/s.
    pub v: &'a [f64],
    /// The effect's own states.
    pub z: &'a [f64],
    /// The plant's own friction F(v), N or N m per joint.
    pub friction: &'a [f64],
    /// Joint accelerations of the links, m/s^2 or rad/s^2; known to [`Effect::rates`] and
    /// [`Effect::implicit`] only.
    pub a: &'a [f64],
    /// Motor torque less friction and added torques, N or N m; known to [`Effect::rates`] only.
    pub net: &'a [f64],
    /// Rigid-body torque of the links, N or N m; known to [`Effect::implicit`] only.
    pub load: &'a [f64],
}

/// What an effect learns before the first step.
#[derive(Debug, Clone, Copy)]
pub struct InitialCondition<'a> {
    /// Joint positions, m or rad.
    pub q: &'a [f64],
    /// Rigid-body torque of the joints at the start, N or N m.
    pub load: &'a [f64],
    /// Duration of the run \[s\].
    pub seconds: f64,
    pub seed: u64,
}

/// A joint whose motor and link are joined by a spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointTwist {
    pub joint: usize,
    /// Position of the motor beyond the link, m or rad, and its rate.
    pub deflection: f64,
    pub rate: f64,
    /// What the spring passes on to the link, N or N m.
    pub torque: f64,
}

/// One effect on the plant. Everything has a default: most effects are static torques.
pub trait Effect: Send {
    /// Adds to `torque` what the motors must supply because of the effect, in N or N m per joint.
    fn torque(&self, _motion: &PlantState, _torque: &mut [f64]) {}

    /// Joint whose torque hangs on accelerations or loads, which hang on it in turn.
    fn implicit_joint(&self) -> Option<usize> {
        None
    }

    /// Adds that torque, N or N m per joint, for accelerations and loads that are tried.
    fn implicit(&self, _motion: &PlantState, _torque: &mut [f64]) {}

    /// How many states of its own the effect integrates.
    fn states(&self) -> usize {
        0
    }

    /// Time derivatives of its own states.
    fn rates(&self, _motion: &PlantState, _dz: &mut [f64]) {}

    /// Adds to the inertia matrix (row-major) and to the rigid-body torque without acceleration.
    fn inertia(&self, _motion: &PlantState, _mass: &mut [f64], _torque: &mut [f64]) {}

    /// Adds, per joint, the torque that the effect takes per unit of a positive and of a negative load
    /// tau_l = M a + C v + G.
    fn load(&self, _motion: &PlantState, _share: &mut [[f64; 2]]) {}

    /// Multiplies, per joint, the torque that acts per unit of the logged torque, N or N m.
    fn drive(&self, _motion: &PlantState, _logged: &[f64], _acting: &mut [f64]) {}

    /// The spring that the effect puts between a motor and its link.
    fn twist(&self, _z: &[f64]) -> Option<JointTwist> {
        None
    }

    /// Readies memory and states before the first step.
    fn begin(&mut self, _beginning: &InitialCondition, _z: &mut [f64]) {}

    /// Takes an accepted step into its memory; `true` when that changes its torque at this point.
    fn moved(&mut self, _motion: &PlantState) -> bool {
        false
    }
}

/// Files of effects, and the law of each in the list.
macro_rules! catalogue {
    ($(#[$doc:meta])* $list:ident of $($file:ident,)*) => {
        $(mod $file;)*
        $(#[$doc])*
        pub static $list: &[&PlantLaw] = &[$(&$file::LAW),*];
    };
}

catalogue! {
    /// All effects that the simulator knows, in the order of docs/developers/effects.md.
    LAWS of
    torque_offset,
    asymmetric_friction,
    gravity_tilt,
    stribeck,
    smooth_coulomb,
    nonlinear_viscous,
    actuator_friction,
    load_friction,
    drive_efficiency,
    gain,
    gain_change,
    position_friction,
    pose_friction,
    ripple,
    torque_ripple,
    weight,
    spring,
    counterbalance,
    backlash,
    backlash_impact,
    presliding,
    delay,
    elasticity,
    rotor_inertia,
    rigid_body_terms,
    payload,
    coupling,
    warm_up,
    drift,
    settling_drift,
    empirical,
    disturbance,
    saturation,
    quantisation,
    stuck_channel,
    wrong_sign_or_order,
    filter,
}

/// The effects of one plant, each with its slice of the extra states, and the faults of its log.
#[derive(Default)]
pub struct PlantEffects {
    list: Vec<(Box<dyn Effect>, Range<usize>)>,
    /// By name.
    faults: Vec<(&'static str, Fault)>,
}

impl std::fmt::Debug for PlantEffects {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} effects", self.list.len() + self.faults.len())
    }
}

impl PlantEffects {
    /// Builds the effects; the second result is what they came out as, one entry per joint.
    ///
    /// # Errors
    /// [`SimulateError::UnknownEffect`], [`SimulateError::UnknownKey`], [`SimulateError::UnknownJoint`],
    /// [`SimulateError::EffectPlace`], [`SimulateError::EffectNumber`].
    pub fn build(
        specs: &[EffectSpec],
        sites: &RobotSites,
    ) -> Result<(Self, Vec<EffectValue>), SimulateError> {
        let mut effects = Self::default();
        let mut values = Vec::new();
        for spec in specs {
            if let Some(candidate) = &spec.own {
                for (effect, value) in formula::build(spec, candidate, sites)? {
                    effects.push(effect);
                    values.push(value);
                }
                continue;
            }
            let law = spec.law()?;
            for site in spec.sites(law.entry.places, sites)? {
                let numbers = spec.numbers(law, site)?;
                match law.built(site, &sites.machine, &numbers)? {
                    BuiltLaw::Plant(effect) => effects.push(effect),
                    BuiltLaw::Log(fault) => effects.faults.push((law.entry.name, fault)),
                }
                values.push(EffectValue::new(law.entry, site, &sites.machine, &numbers));
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
    pub(super) fn states(&self) -> usize {
        self.list.last().map_or(0, |(_, states)| states.end)
    }

    /// Whether the plant has none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Name of the first fault of the log.
    pub(super) fn first_fault(&self) -> Option<&'static str> {
        self.faults.first().map(|(name, _)| *name)
    }

    /// Shows every effect the motion with its own states.
    pub(super) fn each(
        &self,
        motion: &PlantState,
        mut visit: impl FnMut(&dyn Effect, &PlantState),
    ) {
        for (effect, states) in &self.list {
            visit(effect.as_ref(), &own(motion, states));
        }
    }

    /// Joints whose torque hangs on accelerations or loads, some more than once.
    pub(super) fn implicit_joints(&self) -> impl Iterator<Item = usize> {
        let each = self.list.iter();
        each.filter_map(|(effect, _)| effect.implicit_joint())
    }

    /// The springs between motors and links, for the states z of all effects.
    pub(super) fn twists<'a>(&'a self, z: &'a [f64]) -> impl Iterator<Item = JointTwist> + 'a {
        let each = self.list.iter();
        each.filter_map(|(effect, states)| effect.twist(&z[states.clone()]))
    }

    /// Writes the rates of every effect's states.
    pub(super) fn rates(&self, motion: &PlantState, dz: &mut [f64]) {
        for (effect, states) in &self.list {
            effect.rates(&own(motion, states), &mut dz[states.clone()]);
        }
    }

    /// Readies every effect before the first step.
    pub(super) fn begin(&mut self, beginning: &InitialCondition, z: &mut [f64]) {
        for (effect, states) in &mut self.list {
            effect.begin(beginning, &mut z[states.clone()]);
        }
    }

    /// Informs every effect of an accepted step; `true` when one of them changed.
    pub(super) fn moved(&mut self, motion: &PlantState) -> bool {
        let mut changed = false;
        for (effect, states) in &mut self.list {
            changed |= effect.moved(&own(motion, states));
        }
        changed
    }

    /// Puts the faults into a log: those that come before the noise of the torque, or those after.
    pub(super) fn spoil(&self, log: &mut LoggedChannels, before_noise: bool) {
        for (_, fault) in &self.faults {
            if fault.before_noise == before_noise {
                (fault.apply)(log);
            }
        }
    }
}

/// The motion with the states of one effect.
fn own<'a>(motion: &PlantState<'a>, states: &Range<usize>) -> PlantState<'a> {
    PlantState {
        z: &motion.z[states.clone()],
        ..*motion
    }
}

/// Sign of the speed as steep as w, s/m or s/rad.
#[inline]
fn sign(w: f64, v: f64) -> f64 {
    (w * v).tanh()
}

/// One for a positive speed and zero for a negative one, as steep as w.
#[inline]
fn step(w: f64, v: f64) -> f64 {
    0.5 * (1.0 + (w * v).tanh())
}
