//! Effects that a declared model may lack.
//!
//! Each effect is a small file with its [`Entry`], what is known of it whoever models it, and the estimator's
//! [`Law`]: columns of torque along a recorded motion. The simulator reads the entries and integrates laws of
//! its own, so that the two check each other. A new effect is a file here and a line in [`LAWS`], a file in
//! the simulator and a line there.

mod added;
pub mod as_code;
mod augmented_model;
pub(crate) mod cover;
pub(crate) mod entry;
mod facts;
pub mod formula;
mod formula_state;
mod law;
pub mod law_text;
mod order;
pub mod own;
pub(crate) mod physics;
pub(crate) mod place;
mod sampled;
mod scene;
mod shape_range;
mod signal;
mod site;
pub(crate) mod unit;
mod values;

use std::collections::BTreeMap;

pub use added::{EffectNumber, ModelEffect};
pub use augmented_model::{AugmentedModel, StretchTorques, shifted};
pub use cover::{JointCover, LogCoverage, stationary_joints};
pub use entry::{Entry, Family, Key, Range, Role, ShapeSearch, SpeedLadder};
pub use facts::EffectFacts;
pub use law::Law;
pub use order::is_whole as order_is_whole;
pub use physics::{Limit, LimitContext, LimitedNumber, Rule};
pub use place::{EffectPlace, PlaceRule};
pub use sampled::SampledModel;
pub use scene::EffectScene;
pub use shape_range::ShapeSpan;
pub use signal::CurveSignal;
pub use unit::Unit;
pub use values::{EffectError, EffectValues};

use crate::robot::Robot;
use crate::robot::model::JointFriction;
use law::{EffectReparametrisation, KeyValue, jumps_or_is_none};
use law_text::exact;
use scene::Instant;
use site::{CodeSite, RobotProperty};

/// Files of effects, and what each has in a list.
macro_rules! catalogue {
    ($(#[$doc:meta])* $list:ident: $what:ty = $each:ident of $($file:ident,)*) => {
        $(pub mod $file;)*
        $(#[$doc])*
        pub static $list: &[&$what] = &[$(&$file::$each),*];
    };
}

catalogue! {
    /// All that the diagnosis looks for, in the order in which they are preferred where the data do not separate
    /// them: data first, then what forges others, then what is simple.
    LAWS: Law = LAW of
    delay,
    torque_offset,
    gravity_tilt,
    gain,
    gain_change,
    asymmetric_friction,
    stribeck,
    smooth_coulomb,
    nonlinear_viscous,
    load_friction,
    drive_efficiency,
    actuator_friction,
    rotor_inertia,
    rigid_body_terms,
    presliding,
    backlash,
    backlash_impact,
    ripple,
    torque_ripple,
    position_friction,
    pose_friction,
    weight,
    spring,
    counterbalance,
    coupling,
    elasticity,
    payload,
    carried,
    warm_up,
    drift,
    settling_drift,
    empirical,
}

catalogue! {
    /// What is cut out or refused where it shows: it has no law.
    FAULTS: Entry = ENTRY of
    disturbance,
    saturation,
    quantisation,
    stuck_channel,
    wrong_sign_or_order,
    filter,
}

/// The law of a name on a robot: that which fits there, where there are several.
pub fn law(robot: &Robot, name: &str) -> Option<&'static Law> {
    let of_name = || LAWS.iter().copied().filter(|law| law.entry.name == name);
    let plain = vec![JointFriction::None; robot.joints()];
    let here = of_name().find(|law| !law.places(robot, &plain).is_empty());
    here.or_else(|| of_name().next())
}

/// The entry of a name.
pub fn entry(name: &str) -> Option<&'static Entry> {
    let laws = LAWS.iter().map(|law| law.entry);
    laws.chain(FAULTS.iter().copied())
        .find(|entry| entry.name == name)
}

/// Names of all that a model file may have, each once.
pub fn names() -> impl Iterator<Item = &'static str> {
    let repeated = |i: usize| i > 0 && LAWS[i - 1].entry.name == LAWS[i].entry.name;
    let laws = LAWS.iter().enumerate();
    laws.filter_map(move |(i, law)| (!repeated(i)).then_some(law.entry.name))
}

/// The effect of a model file.
///
/// # Errors
/// [`EffectError`] for a name, joint or key that does not fit.
pub fn read(
    robot: &Robot,
    name: &str,
    joint: Option<&str>,
    given: &BTreeMap<String, f64>,
) -> Result<ModelEffect, EffectError> {
    let law = law(robot, name).ok_or_else(|| EffectError::Unknown {
        name: name.to_owned(),
        known: names().collect::<Vec<_>>().join(", "),
    })?;
    read_as(law, robot, joint, given)
}

/// The effect of a model file whose law is known.
///
/// # Errors
/// [`EffectError`] for a joint or key that does not fit.
pub fn read_as(
    law: &'static Law,
    robot: &Robot,
    joint: Option<&str>,
    given: &BTreeMap<String, f64>,
) -> Result<ModelEffect, EffectError> {
    let values = EffectValues {
        effect: law.entry.name,
        known: &law.key_names(),
        given,
    };
    let place = law.entry.places.named(robot, joint, &values)?;
    let [shape, linear] = law.of_keys(&values)?;
    Ok(ModelEffect::new(law, place, shape, linear))
}

#[cfg(test)]
mod recovered;
#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::JointKind;

    #[test]
    fn every_effect_that_can_be_found_has_words_and_a_remedy() {
        for law in LAWS {
            let entry = law.entry;
            let number = |key: &Key| (key.name.to_owned(), 0.5, "N".to_owned());
            let said = (entry.said)(&EffectFacts {
                at: "q1".into(),
                with: "q2".into(),
                kind: JointKind::Prismatic,
                numbers: entry.keys.iter().map(number).collect(),
                curve: None,
                torque: "N".into(),
            });
            let name = entry.name;
            assert!(said.len() > 10 && !said.contains('-'), "{name}: {said}");
            assert!(!said.contains("NaN"), "{name}: {said}");
            assert!(
                entry.remedy.len() > 20 && !entry.remedy.ends_with('.'),
                "{name}"
            );
        }
    }
}
