//! `NAME[:JOINT][:key=value,...]`: effects as they are asked for and as they came out.

use cft_ident_core::explain::ErrorText;
use std::collections::BTreeMap;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::{EffectSite, LAWS, PlantLaw, PlantRobot, RobotSites};
use crate::simulate::SimulateError;
use cft_ident_core::effect::{EffectPlace, Entry, Key, PlaceRule};
use cft_ident_core::number::is_usable;
use cft_ident_core::robot::JointKind;
use cft_ident_files::config::candidates::CandidateSection;

/// An effect as it is asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectSpec {
    pub name: String,
    /// The joint; every joint where absent.
    pub joint: Option<String>,
    /// Keys that are given, in the order in which they are given.
    pub values: Vec<(String, f64)>,
    /// Its formulas, where it is the user's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub own: Option<CandidateSection>,
}

/// An effect as it acts: all its values, with units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct EffectValue {
    pub effect: String,
    pub family: String,
    /// The joint or screw; absent (null in JSON) for the robot as a whole.
    #[serde(default)]
    pub joint: Option<String>,
    /// By key, in alphabetical order.
    pub parameters: BTreeMap<String, PlantParameter>,
}

/// One value of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PlantParameter {
    pub value: f64,
    pub unit: String,
}

impl FromStr for EffectSpec {
    type Err = SimulateError;

    fn from_str(text: &str) -> Result<Self, SimulateError> {
        let malformed = |part: &str| SimulateError::EffectSyntax {
            text: text.to_owned(),
            part: part.to_owned(),
        };
        let mut parts = text.split(':');
        let name = parts.next().unwrap_or_default().trim();
        if name.is_empty() {
            return Err(malformed(text));
        }
        let mut spec = Self {
            name: name.to_owned(),
            joint: None,
            values: Vec::new(),
            own: None,
        };
        for (place, part) in parts.enumerate() {
            let part = part.trim();
            if !part.contains('=') {
                if place > 0 || part.is_empty() {
                    return Err(malformed(part));
                }
                spec.joint = Some(part.to_owned());
                continue;
            }
            if !spec.values.is_empty() {
                return Err(malformed(part));
            }
            for pair in part.split(',') {
                let (key, value) = pair.split_once('=').ok_or_else(|| malformed(pair))?;
                let key = key.trim();
                let value: f64 = value.trim().parse().map_err(|_| malformed(pair))?;
                let twice = spec.values.iter().any(|(known, _)| known == key);
                if !is_usable(value) || key.is_empty() || twice {
                    return Err(malformed(pair));
                }
                spec.values.push((key.to_owned(), value));
            }
        }
        Ok(spec)
    }
}

impl EffectSpec {
    /// The same with its formulas, where a candidate has its name.
    pub fn or_own(mut self, candidates: &[CandidateSection]) -> Self {
        self.own = candidates.iter().find(|c| c.name == self.name).cloned();
        self
    }

    /// The law that the name stands for.
    pub(super) fn law(&self) -> Result<&'static PlantLaw, SimulateError> {
        let found = LAWS.iter().find(|law| law.entry.name == self.name);
        found.copied().ok_or_else(|| {
            let known: Vec<&str> = LAWS.iter().map(|law| law.entry.name).collect();
            let (name, known) = (self.name.clone(), known.join(", "));
            SimulateError::UnknownEffect { name, known }
        })
    }

    /// The sites that the effect acts on: the one that is named, or all that the effect may sit at.
    pub(super) fn sites<'a>(
        &self,
        places: PlaceRule,
        sites: &'a RobotSites,
    ) -> Result<&'a [EffectSite], SimulateError> {
        let whole = sites.whole.as_slice();
        let refuse = |why: ErrorText| match whole.first().or(sites.joints.first()) {
            Some(site) => site.refuse(&self.name, why),
            None => SimulateError::unknown_joint("", &[]),
        };
        let (joints, screws): (&[EffectSite], &[EffectSite]) = match places {
            PlaceRule::Joints | PlaceRule::JointsOrAll | PlaceRule::Pairs | PlaceRule::Others => {
                (&sites.joints, &[])
            }
            PlaceRule::Actuators if sites.screws.is_empty() => {
                return Err(refuse(ErrorText::new("it sits at the screws of the CFT robot, x_r and y_r").remedy("a single joint's own friction is `nonlinear-viscous`, `asymmetric-friction` or `stribeck`")));
            }
            PlaceRule::Actuators => (&[], &sites.screws),
            PlaceRule::JointsAndActuators => (&sites.joints, &sites.screws),
            PlaceRule::Whole if self.joint.is_some() => {
                return Err(refuse(
                    ErrorText::new("it concerns all joints together").remedy("leave the joint out"),
                ));
            }
            PlaceRule::Whole => (whole, &[]),
        };
        let Some(name) = &self.joint else {
            return Ok(if screws.is_empty() { joints } else { screws });
        };
        let named = |list: &'a [EffectSite]| {
            let place = list.iter().position(|site| site.name == *name)?;
            list.get(place..=place)
        };
        named(joints).or_else(|| named(screws)).ok_or_else(|| {
            let known = joints.iter().chain(screws).map(|site| site.name.clone());
            SimulateError::unknown_joint(name, &known.collect::<Vec<_>>())
        })
    }

    /// Refuses the first key that is none of those known.
    pub(super) fn check_keys(&self, known: Vec<&str>) -> Result<(), SimulateError> {
        let mut given = self.values.iter().map(|(key, _)| key);
        match given.find(|key| !known.contains(&key.as_str())) {
            None => Ok(()),
            Some(key) => Err(SimulateError::UnknownKey {
                effect: self.name.clone(),
                key: key.clone(),
                known: known.join(", "),
            }),
        }
    }

    /// The number that is given for a key.
    pub(super) fn given(&self, key: &str) -> Option<f64> {
        let mut all = self.values.iter();
        all.find(|(name, _)| name == key).map(|(_, value)| *value)
    }

    /// One number per key of the effect.
    pub(super) fn numbers(
        &self,
        law: &PlantLaw,
        site: &EffectSite,
    ) -> Result<Vec<f64>, SimulateError> {
        let keys = law.entry.keys;
        self.check_keys(keys.iter().map(|key| key.name).collect())?;
        let sized = |key: &Key| key.size && self.given(key.name).is_some();
        let sized = keys.iter().any(sized);
        let number = |(key, default): (&Key, f64)| match self.given(key.name) {
            Some(number) => number,
            None if key.size && sized => 0.0,
            None => default,
        };
        let defaults = (law.defaults)(site);
        Ok(keys.iter().zip(defaults).map(number).collect())
    }
}

impl EffectValue {
    pub(super) fn new(
        entry: &Entry,
        site: &EffectSite,
        machine: &PlantRobot,
        numbers: &[f64],
    ) -> Self {
        let pairs = || entry.keys.iter().zip(numbers);
        let own = match site.turns {
            true => JointKind::Revolute,
            false => JointKind::Prismatic,
        };
        // Joints are counted from one; `from` is a joint where units follow it.
        let of_two = matches!(entry.places, PlaceRule::Pairs | PlaceRule::Others);
        let from = pairs().find(|(key, _)| of_two && key.name == "from");
        let joint = |(_, number): (_, &f64)| (*number - 1.0).max(0.0) as usize;
        let from = from.map_or(own, |pair| machine.robot.joint_kind(joint(pair)));
        let torque = if site.turns { "Nm" } else { "N" };
        let parameter = |(key, &value): (&Key, &f64)| {
            let unit = key.unit.text(own, from, torque);
            (key.name.to_owned(), PlantParameter { value, unit })
        };
        Self {
            effect: entry.name.to_owned(),
            family: entry.family().name().to_owned(),
            joint: (site.place != EffectPlace::All).then(|| site.name.clone()),
            parameters: pairs().map(parameter).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_joints_and_values_are_read_in_every_permitted_form() {
        let read = |text: &str| text.parse::<EffectSpec>().expect(text);
        let bare = read("ripple");
        assert_eq!((bare.joint, bare.values), (None, vec![]));
        let joint = read("ripple:q4");
        assert_eq!(joint.joint.as_deref(), Some("q4"));
        let full = read("ripple:q4:order=12, sin=0.3,cos=-1e-2");
        assert_eq!(full.values.len(), 3);
        assert_eq!(full.values[2], ("cos".to_owned(), -0.01));
        assert_eq!(
            read("ripple:order=3").values,
            vec![("order".to_owned(), 3.0)]
        );
    }

    #[test]
    fn malformed_effects_name_the_part_that_cannot_be_read() {
        for (text, bad) in [
            ("", ""),
            ("ripple:q4:order", "order"),
            ("ripple:q4:order=x", "order=x"),
            ("ripple:q4:order=1,order=2", "order=2"),
            ("ripple:q4:order=inf", "order=inf"),
            ("ripple::order=1", ""),
            ("ripple:order=1:q4", "q4"),
        ] {
            match text.parse::<EffectSpec>() {
                Err(SimulateError::EffectSyntax { part, .. }) => assert_eq!(part, bad, "{text}"),
                other => panic!("{text}: {other:?}"),
            }
        }
    }
}
