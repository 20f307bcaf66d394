//! Formulas of what is left, as a document and a `[[candidate]]` file hold them.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::diagnose::Diagnosed;
use crate::input::robot_setup::RobotSetup;
use cft_ident_core::diagnose::{
    FormulaEnd, FormulaSymmetry, FoundEffect, FoundFormula, JointChange,
};
use cft_ident_core::effect::EffectNumber;
use cft_ident_core::effect::formula::{FormulaDefinition, FormulaShape};
use cft_ident_core::judge::ErrorGain;
use cft_ident_core::number;
use cft_ident_core::robot::FormulaSignal;
use cft_ident_files::config::candidates::{self, CandidateSection, ShapeRange};

/// A list of keys and values as a map, in its order.
pub(super) fn by_key<S: Serializer, T: Serialize>(
    list: &[(String, T)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(list.iter().map(|(key, value)| (key, value)))
}

/// What a joint gains.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct JointGain {
    pub joint: String,
    pub value: f64,
    pub se: f64,
}

/// One number of an effect.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EffectValueFound {
    pub value: f64,
    pub std: Option<f64>,
    pub unit: String,
    /// It is held at a bound, for these data do not determine it.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub bound: bool,
}

impl EffectValueFound {
    /// The torque of an effect with its standard deviation.
    pub(super) fn of_torque([value, std]: [f64; 2], unit: &str) -> Self {
        Self {
            value,
            std: Some(std),
            unit: unit.to_owned(),
            bound: false,
        }
    }
}

/// Numbers of an effect, each with its key.
pub(crate) fn values_found(
    numbers: Vec<EffectNumber>,
) -> impl Iterator<Item = (String, EffectValueFound)> {
    let value = |n: EffectNumber| {
        let found = EffectValueFound {
            value: n.value,
            std: n.std,
            unit: n.unit,
            bound: n.bound,
        };
        (n.key, found)
    };
    numbers.into_iter().map(value)
}

/// What each joint gains.
pub(crate) fn gain_of_each(names: &[String], gain: &ErrorGain) -> Vec<JointGain> {
    let each = names.iter().zip(&gain.joints);
    let of = each.map(|(joint, [value, se])| JointGain {
        joint: joint.clone(),
        value: *value,
        se: *se,
    });
    of.collect()
}

/// Estimated parameters of an effect with units and standard deviations.
pub fn numbers_of(setup: &RobotSetup, step: &FoundEffect) -> Vec<EffectNumber> {
    let effect = &step.estimate;
    let unit = setup.torque_unit_at(effect.place);
    effect.numbers(&setup.robot, unit, Some(&step.covariance))
}

/// The formula of what is left of a joint.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FormulaResult {
    pub joint: String,
    /// What became of it.
    pub end: FormulaEnd,
    /// The torque as it would be written by hand, with its numbers.
    pub text: String,
    /// What it is functions of, in words.
    pub signals: Vec<String>,
    /// What kind of physics it is by its symmetries, in words.
    pub kind: String,
    pub symmetry: FormulaSymmetry,
    /// Formula of each coefficient.
    pub formulas: BTreeMap<String, String>,
    /// Its numbers, by key.
    pub parameters: BTreeMap<String, EffectValueFound>,
    /// Part of the squared error of blocks left out that it takes off.
    pub share: f64,
    /// Chance of a gain as large where whole parts of the residual have another sign.
    pub p_value: f64,
    /// Factor of its amplitude that the agreement between parts of the data gives, 0..1.
    pub shrinkage: f64,
    pub gain: Vec<JointGain>,
    /// Errors on data set aside without and with it, joint by joint.
    pub joints: Vec<JointChange>,
    /// Root mean square of the residual without and with it within 0.1 s of a reversal, on data set aside, in the unit of
    /// the joint's torque.
    pub at_reversals: Option<[f64; 2]>,
    /// Effects of the catalogue at the joint in whose place it stands.
    pub in_place_of: Vec<&'static str>,
    /// As a file for `--candidates`.
    pub candidate: String,
}

/// A formula as a table of a candidates file.
pub fn formula_section(definition: &FormulaDefinition) -> CandidateSection {
    let of = |k: usize| move |c: &[String; 3]| (c[0].clone(), c[k].clone());
    let shape = |s: &FormulaShape| {
        let range = ShapeRange {
            from: s.range[0],
            to: s.range[1],
            unit: s.unit.clone(),
        };
        (s.name.clone(), range)
    };
    CandidateSection {
        name: definition.name.clone(),
        joints: definition.joints.clone(),
        formulas: definition.coefficients.iter().map(of(2)).collect(),
        units: definition.coefficients.iter().map(of(1)).collect(),
        shapes: definition.shapes.iter().map(shape).collect(),
        friction: definition.friction,
        at_rest: definition.at_rest,
        meaning: definition.meaning.clone(),
    }
}

/// Formulas that stand in the model that is written.
pub(crate) fn written_sections(found: &Diagnosed) -> Vec<CandidateSection> {
    let all = found.diagnosis.formulas.iter();
    all.map(|f| formula_section(&f.definition)).collect()
}

/// A formula in words and numbers.
pub fn formula_result(setup: &RobotSetup, found: &FoundFormula) -> FormulaResult {
    let names = setup.robot.joint_names();
    let numbers = numbers_of(setup, &found.step);
    let signals = found.signals.iter();
    FormulaResult {
        joint: names[found.joint].clone(),
        end: found.end,
        text: formula_text(found, &numbers),
        signals: signals
            .map(|s| formula_signal_words(names, found.joint, *s))
            .collect(),
        kind: found.symmetry.words(),
        symmetry: found.symmetry,
        formulas: formula_section(&found.definition).formulas,
        parameters: values_found(numbers).collect(),
        share: found.share,
        p_value: found.p_value,
        shrinkage: found.step.shrinkage,
        gain: gain_of_each(names, &found.step.gain),
        joints: found.step.joints.clone(),
        at_reversals: found.at_reversals,
        in_place_of: found.in_place_of.iter().map(|e| e.name()).collect(),
        candidate: candidates::to_toml(&[formula_section(&found.definition)]).unwrap_or_default(),
    }
}

/// The torque as it would be written by hand: coefficients with three digits before their formulas, shapes in them.
fn formula_text(found: &FoundFormula, numbers: &[EffectNumber]) -> String {
    let of = |key: &str| numbers.iter().find(|n| n.key == key).map(|n| n.value);
    let mut text = String::new();
    for (i, [key, _, formula]) in found.definition.coefficients.iter().enumerate() {
        let value = of(key).unwrap_or(f64::NAN);
        let sign = match (i, value < 0.0) {
            (0, false) => "",
            (0, true) => "-",
            (_, false) => " + ",
            (_, true) => " - ",
        };
        let mut formula = formula.clone();
        for shape in &found.definition.shapes {
            let number = number::significant(of(&shape.name).unwrap_or(f64::NAN), 3);
            formula = put(&formula, &shape.name, &number);
        }
        text += &format!("{sign}{} {formula}", number::significant(value.abs(), 3));
    }
    text
}

/// A formula with a number in place of a name.
fn put(formula: &str, name: &str, number: &str) -> String {
    let is_part = |c: Option<char>| c.is_some_and(|c| c.is_ascii_alphanumeric() || c == '_');
    let mut out = String::new();
    let mut rest = formula;
    while let Some(at) = rest.find(name) {
        let (before, after) = (&rest[..at], &rest[at + name.len()..]);
        let last = before.chars().next_back().or(out.chars().next_back());
        out.push_str(before);
        match is_part(last) || is_part(after.chars().next()) {
            true => out.push_str(name),
            false => out.push_str(number),
        }
        rest = after;
    }
    out + rest
}

/// A signal in words; of another joint than `own` with its name.
fn formula_signal_words(
    names: &[String],
    own: usize,
    (signal, j): (FormulaSignal, usize),
) -> String {
    let word = match signal {
        FormulaSignal::Position => "position",
        FormulaSignal::Speed => "speed",
        FormulaSignal::Acceleration => "acceleration",
        FormulaSignal::Load => "load",
        FormulaSignal::Direction => "direction",
        FormulaSignal::Temperature => "temperature",
        FormulaSignal::Time => "time",
        FormulaSignal::SinceReversal => "time since reversal",
        FormulaSignal::Play | FormulaSignal::Dahl => "way since reversal",
    };
    match j == own {
        true => word.to_owned(),
        false => format!("{word} of {}", names[j]),
    }
}

#[cfg(test)]
mod tests {
    use super::put;

    #[test]
    fn a_number_stands_for_a_name_and_for_no_part_of_one() {
        assert_eq!(
            put("v*exp(-abs(v)/w)*w2", "w", "0.5"),
            "v*exp(-abs(v)/0.5)*w2"
        );
        assert_eq!(
            put("sin(n*q)*direction", "n", "3.1"),
            "sin(3.1*q)*direction"
        );
    }
}
