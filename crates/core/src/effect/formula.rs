//! Effects of a user's own: torques linear in some coefficients, each of which has a formula in the motion.

use super::law_text::exact;
use super::place::Place;
use super::scene::Scene;
use crate::math::formula::{Formula, MOST_NAMES};
use crate::robot::{FormulaSignal, Robot};

/// What a formula effect is made of, by name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Definition {
    pub name: String,
    /// Joints at which it may sit; none for all.
    pub joints: Option<Vec<String>>,
    /// Name, unit and formula of each coefficient.
    pub coefficients: Vec<[String; 3]>,
    pub shapes: Vec<Shape>,
    pub friction: bool,
    /// Whether its torque is the same at rest.
    pub at_rest: bool,
    pub meaning: String,
}

/// A number that shapes the formulas.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shape {
    pub name: String,
    pub unit: String,
    /// Least and largest value that is searched.
    pub range: [f64; 2],
}

/// Why a formula cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FormulaError {
    #[error("candidate `{name}` has the name of an effect that is known: give it another")]
    Known { name: String },
    #[error("candidate `{name}`: this robot has no joint `{joint}`; it has {known}")]
    Joint {
        name: String,
        joint: String,
        known: String,
    },
    #[error("candidate `{name}`, `{coefficient}`: `{formula}` is no formula: {why}")]
    Syntax {
        name: String,
        coefficient: String,
        formula: String,
        why: String,
    },
    #[error(
        "candidate `{name}`, `{coefficient}`: `{variable}` is not known; known are q, v, a, load, direction and \
         temperature of the joint, the same of others (q_{joint}), t{shapes}"
    )]
    Variable {
        name: String,
        coefficient: String,
        variable: String,
        joint: String,
        shapes: String,
    },
}

/// A compiled effect of a user's own.
pub struct Formulas {
    /// Joints at which it may sit.
    joints: Vec<usize>,
    columns: Vec<Column>,
    ranges: Vec<[f64; 2]>,
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
    Shape(usize),
}

impl Formulas {
    /// Reads the formulas of a definition.
    ///
    /// # Errors
    /// [`FormulaError`].
    pub(super) fn of(definition: &Definition, robot: &Robot) -> Result<Self, FormulaError> {
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
                    shapes: definition
                        .shapes
                        .iter()
                        .map(|s| format!(", {}", s.name))
                        .collect(),
                })
            });
            let inputs: Vec<Input> = inputs.collect::<Result<_, _>>()?;
            Ok(Column {
                formula: compiled,
                inputs,
            })
        };
        Ok(Formulas {
            joints,
            columns: definition
                .coefficients
                .iter()
                .map(column)
                .collect::<Result<_, _>>()?,
            ranges: definition.shapes.iter().map(|s| s.range).collect(),
        })
    }

    /// Whether it may sit at a place.
    pub(super) fn fits(&self, place: Place) -> bool {
        place.joint().is_some_and(|j| self.joints.contains(&j))
    }

    /// Joints at which it may sit.
    pub fn joints(&self) -> &[usize] {
        &self.joints
    }

    /// Joints whose temperature it takes at a joint.
    pub fn temperatures(&self, joint: usize) -> Vec<usize> {
        let inputs = self.columns.iter().flat_map(|column| &column.inputs);
        let mut of: Vec<usize> = inputs
            .filter_map(|input| match input {
                Input::Signal(FormulaSignal::Temperature, of) => Some(of.unwrap_or(joint)),
                _ => None,
            })
            .collect();
        of.sort_unstable();
        of.dedup();
        of
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
            all = all
                .iter()
                .flat_map(|begun| {
                    (0..steps)
                        .map(|i| [begun.as_slice(), &[at(i)]].concat())
                        .collect::<Vec<_>>()
                })
                .collect();
        }
        all
    }

    /// Range of each shape.
    pub(super) fn limits(&self) -> Vec<[f64; 2]> {
        self.ranges.clone()
    }

    /// Adds the columns of joint `joint` along a scene. What a formula does not give, as a root of what is negative,
    /// is no number.
    pub(super) fn fill(&self, scene: &Scene, shape: &[f64], joint: usize, out: &mut [Vec<f64>]) {
        let mut values = [0.0; MOST_NAMES];
        for (column, out) in self.columns.iter().zip(out) {
            let count = column.inputs.len();
            for (k, out) in out.iter_mut().enumerate() {
                for (value, input) in values.iter_mut().zip(&column.inputs) {
                    *value = match input {
                        Input::Signal(signal, of) => {
                            signal_at(scene, *signal, of.unwrap_or(joint), k)
                        }
                        Input::Shape(i) => shape[*i],
                    };
                }
                *out += column.formula.value(&values[..count]);
            }
        }
    }
}

impl Formulas {
    /// The torque at joint `joint` as an expression of generated code, for the text of a signal; and whether it
    /// hangs on the time.
    ///
    /// # Errors
    /// What has no text.
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
fn input(variable: &str, definition: &Definition, joints: &[String]) -> Option<Input> {
    if let Some(i) = definition.shapes.iter().position(|s| s.name == variable) {
        return Some(Input::Shape(i));
    }
    let (signal, of) = FormulaSignal::read(variable, joints)?;
    Some(Input::Signal(signal, of))
}

/// A signal of a joint at sample k.
fn signal_at(scene: &Scene, signal: FormulaSignal, joint: usize, k: usize) -> f64 {
    let s = scene.stretch;
    match signal {
        FormulaSignal::Position => s.q[joint][k],
        FormulaSignal::Speed => s.v[joint][k],
        FormulaSignal::Acceleration => s.a[joint][k],
        FormulaSignal::Load => scene.load[joint][k],
        FormulaSignal::Direction => scene.direction(joint, k),
        FormulaSignal::Temperature => {
            let known = s.temperature.get(joint).and_then(|x| x.get(k));
            known.copied().unwrap_or(f64::NAN)
        }
        // since the begin of the log, whatever its clock shows
        FormulaSignal::Time => s.began + k as f64 * s.dt,
    }
}
