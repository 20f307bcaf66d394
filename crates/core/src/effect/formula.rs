//! Effects of a user's own: torques linear in some coefficients, each of which has a formula in the motion.

use std::collections::BTreeSet;

use super::formula_state::FormulaState;
use super::{EffectPlace, Instant, exact};
use crate::explain::Explain;
use crate::math::formula::{Formula, MOST_NAMES};
use crate::robot::{FormulaSignal, Robot};

/// What a formula effect is made of, by name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FormulaDefinition {
    pub name: String,
    /// Joints at which it may sit; none for all.
    pub joints: Option<Vec<String>>,
    /// Name, unit and formula of each coefficient.
    pub coefficients: Vec<[String; 3]>,
    pub shapes: Vec<FormulaShape>,
    pub friction: bool,
    /// Whether its torque is the same at rest.
    pub at_rest: bool,
    pub meaning: String,
}

/// A number that shapes the formulas.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FormulaShape {
    pub name: String,
    pub unit: String,
    /// Least and largest value that is searched.
    pub range: [f64; 2],
}

/// Why a formula cannot be used.
#[derive(Debug, Clone, PartialEq, Explain, thiserror::Error)]
pub enum FormulaError {
    #[explain("candidate `{name}` has the name of an effect that is known: give it another")]
    Known { name: String },
    #[explain(
        "candidate `{name}`: this robot has no joint `{joint}`",
        "it has {known}"
    )]
    Joint {
        name: String,
        joint: String,
        known: String,
    },
    #[explain("candidate `{name}`, `{coefficient}`: `{formula}` is no formula: {why}")]
    Syntax {
        name: String,
        coefficient: String,
        formula: String,
        why: String,
    },
    #[explain(
        "candidate `{name}`, `{coefficient}`: `{variable}` is not known",
        "known are q, v, a, load, direction, temperature, since_reversal, play and dahl of the joint, the same of others (q_{joint}), t{shapes}"
    )]
    Variable {
        name: String,
        coefficient: String,
        variable: String,
        joint: String,
        shapes: String,
    },
    #[explain(
        "candidate `{name}`, `{coefficient}`: `{variable}` needs its scale in m or rad: give it in `shapes` as `{scale}`"
    )]
    Scale {
        name: String,
        coefficient: String,
        variable: String,
        scale: &'static str,
    },
}

/// A compiled effect of a user's own.
pub struct FormulaEffect {
    /// Joints at which it may sit.
    joints: Vec<usize>,
    columns: Vec<Column>,
    pub(super) ranges: Vec<[f64; 2]>,
}

struct Column {
    formula: Formula,
    inputs: Vec<Input>,
}

/// What stands for a name in a formula.
#[derive(Debug, Clone, Copy)]
enum Input {
    /// Of a joint, or of the effect's own.
    Signal(FormulaSignal, Option<usize>),
    /// Of a joint, with the shape that is its scale.
    Remembered(FormulaSignal, Option<usize>, Option<usize>),
    Shape(usize),
}

impl FormulaEffect {
    /// Reads the formulas of a definition.
    pub(super) fn of(definition: &FormulaDefinition, robot: &Robot) -> Result<Self, FormulaError> {
        let name = &definition.name;
        let names = robot.joint_names();
        let place = |joint: &String| {
            let found = names.iter().position(|n| n == joint);
            found.ok_or_else(|| FormulaError::Joint {
                name: name.clone(),
                joint: joint.clone(),
                known: names.join(", "),
            })
        };
        let joints = match &definition.joints {
            None => (0..names.len()).collect(),
            Some(joints) => joints.iter().map(place).collect::<Result<_, _>>()?,
        };
        let shapes = definition.shapes.iter();
        let shapes: String = shapes.map(|s| format!(", {}", s.name)).collect();
        let column = |[coefficient, _, formula]: &[String; 3]| {
            let syntax = |why: String| FormulaError::Syntax {
                name: name.clone(),
                coefficient: coefficient.clone(),
                formula: formula.clone(),
                why,
            };
            let compiled = Formula::parse(formula).map_err(syntax)?;
            let inputs = compiled.names().iter().map(|variable| {
                input(variable, definition, names).ok_or_else(|| FormulaError::Variable {
                    name: name.clone(),
                    coefficient: coefficient.clone(),
                    variable: variable.clone(),
                    joint: names.first().cloned().unwrap_or_default(),
                    shapes: shapes.clone(),
                })
            });
            let inputs: Vec<Input> = inputs.collect::<Result<_, _>>()?;
            for (input, variable) in inputs.iter().zip(compiled.names()) {
                if let Input::Remembered(signal, _, None) = input
                    && let Some(scale) = signal.scale()
                {
                    return Err(FormulaError::Scale {
                        name: name.clone(),
                        coefficient: coefficient.clone(),
                        variable: variable.clone(),
                        scale,
                    });
                }
            }
            let formula = compiled;
            Ok(Column { formula, inputs })
        };
        let columns = definition.coefficients.iter().map(column);
        Ok(FormulaEffect {
            joints,
            columns: columns.collect::<Result<_, _>>()?,
            ranges: definition.shapes.iter().map(|s| s.range).collect(),
        })
    }

    /// Whether it may sit at a place.
    pub(super) fn fits(&self, place: EffectPlace) -> bool {
        place.joint().is_some_and(|j| self.joints.contains(&j))
    }

    /// Joints at which it may sit.
    pub fn joints(&self) -> &[usize] {
        &self.joints
    }

    /// Joints whose temperature it takes at a joint.
    pub fn temperatures(&self, joint: usize) -> Vec<usize> {
        let inputs = self.columns.iter().flat_map(|column| &column.inputs);
        let temperatures = inputs.filter_map(|input| match input {
            Input::Signal(FormulaSignal::Temperature, of) => Some(of.unwrap_or(joint)),
            _ => None,
        });
        Vec::from_iter(temperatures.collect::<BTreeSet<usize>>())
    }

    /// Shapes to try: a few over the range of each, in equal ratios where the range is of one sign.
    pub(super) fn starts(&self) -> Vec<Vec<f64>> {
        let steps = match self.ranges.len() {
            0 | 1 => 8,
            2 => 5,
            _ => 3,
        };
        let mut all = vec![Vec::new()];
        for [from, to] in &self.ranges {
            let at = |i: usize| {
                let share = (i as f64 + 0.5) / steps as f64;
                match from * to > 0.0 {
                    true => from * (to / from).powf(share),
                    false => from + (to - from) * share,
                }
            };
            let longer = |begun: &Vec<f64>| -> Vec<Vec<f64>> {
                (0..steps)
                    .map(|i| [begun.as_slice(), &[at(i)]].concat())
                    .collect()
            };
            all = all.iter().flat_map(longer).collect();
        }
        all
    }

    /// How many numbers it keeps from sample to sample; NaN at the begin of a stretch.
    pub(super) fn remembered(&self) -> usize {
        let inputs = self.columns.iter().flat_map(|column| &column.inputs);
        let own = inputs.filter(|input| matches!(input, Input::Remembered(..)));
        FormulaState::SIZE * own.count()
    }

    /// Adds its columns at a sample to `out`; what a formula does not give, as a root of what is negative, is no number.
    pub(super) fn at(&self, at: &Instant, kept: &mut [f64], out: &mut [f64]) {
        let &Instant {
            scene,
            shape,
            joint,
            k,
            ..
        } = at;
        let mut values = [0.0; MOST_NAMES];
        let mut kept = kept.chunks_exact_mut(FormulaState::SIZE);
        for (column, out) in self.columns.iter().zip(out) {
            for (value, input) in values.iter_mut().zip(&column.inputs) {
                *value = match input {
                    Input::Signal(signal, of) => signal.at(scene, of.unwrap_or(joint), k),
                    Input::Remembered(signal, of, scale) => {
                        let scale = scale.map_or(1.0, |i| shape[i]);
                        let of = of.unwrap_or(joint);
                        let next = |kept| FormulaState(kept).next(*signal, scale, scene, (of, k));
                        kept.next().map_or(f64::NAN, next)
                    }
                    Input::Shape(i) => shape[*i],
                };
            }
            *out += column.formula.value(&values[..column.inputs.len()]);
        }
    }

    /// The torque at joint `joint` as an expression of generated code, and whether it hangs on the time.
    pub(super) fn code(
        &self,
        joint: usize,
        (shape, linear): (&[f64], &[f64]),
        signal: &dyn Fn(FormulaSignal, usize) -> Option<String>,
    ) -> Option<(String, bool)> {
        let mut timed = false;
        let mut term = |(column, coefficient): (&Column, &f64)| {
            let inputs = column.inputs.iter().map(|input| match input {
                Input::Shape(i) => Some(exact(shape[*i])),
                // no program remembers it yet
                Input::Remembered(..) => None,
                Input::Signal(of, other) => {
                    timed |= *of == FormulaSignal::Time;
                    signal(*of, other.unwrap_or(joint))
                }
            });
            let inputs: Vec<String> = inputs.collect::<Option<_>>()?;
            let formula = column.formula.code(&inputs).ok()?;
            Some(format!("{} * {formula}", exact(*coefficient)))
        };
        let terms = self.columns.iter().zip(linear).map(&mut term);
        let terms: Vec<String> = terms.collect::<Option<_>>()?;
        Some((terms.join(" + "), timed))
    }
}

/// What a name in a formula means.
fn input(variable: &str, definition: &FormulaDefinition, joints: &[String]) -> Option<Input> {
    if let Some(i) = definition.shapes.iter().position(|s| s.name == variable) {
        return Some(Input::Shape(i));
    }
    let (signal, of) = FormulaSignal::read(variable, joints)?;
    let scale = |name| definition.shapes.iter().position(|s| s.name == name);
    Some(match signal.remembers() {
        true => Input::Remembered(signal, of, signal.scale().and_then(scale)),
        false => Input::Signal(signal, of),
    })
}
