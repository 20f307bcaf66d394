//! The law of an effect of the user's own, beside those of the catalogue.

use std::sync::Mutex;

use super::formula::{FormulaDefinition, FormulaEffect, FormulaError};
use super::law::{Law, ShapeStarts};
use super::{EffectPlace, Entry, Family, Instant, Key, LogCoverage, ShapeSearch, ShapeSpan, Unit};
use crate::robot::Robot;

/// Laws that have been made: a definition is read for every command and every file, and is the same law.
static MADE: Mutex<Vec<(FormulaDefinition, Vec<String>, &'static Law)>> = Mutex::new(Vec::new());

/// The law of a definition on a robot. It lives as long as the program: the same definition gives the same law.
pub fn law(definition: &FormulaDefinition, robot: &Robot) -> Result<&'static Law, FormulaError> {
    let mut made = MADE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let same = |(d, joints, _): &&(FormulaDefinition, Vec<String>, &'static Law)| {
        d == definition && joints == robot.joint_names()
    };
    if let Some((.., law)) = made.iter().find(same) {
        return Ok(law);
    }
    if super::entry(&definition.name).is_some() {
        return Err(FormulaError::Known {
            name: definition.name.clone(),
        });
    }
    let formula = FormulaEffect::of(definition, robot)?;
    let law = leaked(definition, formula);
    made.push((definition.clone(), robot.joint_names().to_vec(), law));
    Ok(law)
}

fn text(text: &str) -> &'static str {
    Box::leak(text.to_owned().into_boxed_str())
}

fn leaked(definition: &FormulaDefinition, formula: FormulaEffect) -> &'static Law {
    let unit = |unit: &str| Unit::Fixed(text(unit));
    let shapes = definition.shapes.iter().map(|s| {
        let [least, most] = s.range;
        let rule = format!("must be from {least} to {most}");
        Key::shape(text(&s.name), unit(&s.unit)).within(least, most, text(&rule))
    });
    let sizes = definition.coefficients.iter();
    let sizes = sizes.map(|[name, of, _]| Key::size(text(name), unit(of)));
    let keys: Vec<Key> = shapes.chain(sizes).collect();
    let (shape, linear): (Vec<&Key>, Vec<&Key>) = keys.iter().partition(|key| !key.size);
    let names = |keys: Vec<&Key>| -> &'static [&'static str] {
        let names: Vec<&'static str> = keys.iter().map(|key| key.name).collect();
        Box::leak(names.into_boxed_slice())
    };
    let (shape, linear) = (names(shape), names(linear));
    let formulas = definition.coefficients.iter();
    let formulas = formulas.map(|[name, _, formula]| format!("{name} ({formula})"));
    let formulas: Vec<String> = formulas.collect();
    let entry: &'static Entry = Box::leak(Box::new(Entry {
        name: text(&definition.name),
        families: &[Family::Own],
        keys: Box::leak(keys.into_boxed_slice()),
        search: match shape.is_empty() {
            true => ShapeSearch::Linear,
            false => ShapeSearch::Refined,
        },
        at_rest: definition.at_rest,
        friction: definition.friction,
        separate_by: "log a motion along which its formula changes while position, speed and load stay as they are",
        formula: text(&formulas.join(" + ")),
        source: match definition.meaning.is_empty() {
            true => "a formula of the user's own",
            false => text(&definition.meaning),
        },
        remedy: "look for the cause that its formula describes, or keep the refined model",
        ..Entry::USUAL
    }));
    Box::leak(Box::new(Law {
        shape,
        formula: Some(Box::leak(Box::new(formula))),
        ..Law::linear(entry, linear, |_, _, _| {})
    }))
}

impl Law {
    /// Shapes to begin the search from on these data, or what they lack.
    pub fn starts_on(&self, cover: &LogCoverage, place: EffectPlace) -> ShapeStarts {
        match &self.formula {
            Some(formula) => Ok(formula.starts()),
            None => (self.starts)(cover, place),
        }
    }

    /// Range of each shape parameter that is refined, the first of the shape, about a shape on these data.
    pub fn limits_on(
        &self,
        cover: &LogCoverage,
        place: EffectPlace,
        shape: &[f64],
    ) -> Vec<ShapeSpan> {
        match &self.formula {
            // the user's own ends: nothing is known of what lies beyond them
            Some(formula) => {
                let range = |[least, most]: &[f64; 2]| ShapeSpan::of(*least, *most);
                let ranges = formula.ranges.iter().map(range);
                ranges
                    .map(|range| range.open_below().open_above())
                    .collect()
            }
            None => (self.limits)(cover, place, shape),
        }
    }

    /// How many numbers it keeps from sample to sample.
    pub(super) fn remembered(&self) -> usize {
        match &self.formula {
            Some(formula) => formula.remembered(),
            None => self.memory.unwrap_or(0),
        }
    }

    /// Its columns at one sample, one number for each linear coefficient, zero before, by what it keeps.
    pub(super) fn at(&self, at: &Instant, kept: &mut [f64], out: &mut [f64]) {
        match &self.formula {
            Some(formula) => formula.at(at, kept, out),
            None => (self.columns)(at, kept, out),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::formula::FormulaShape;
    use super::super::{EffectScene, ModelEffect};
    use super::*;
    use crate::motion::Stretch;
    use crate::robot::JointKind;
    use crate::robot::model::JointFriction;

    fn robot() -> Robot {
        Robot::single_joint("q1", JointKind::Revolute)
    }

    fn definition(formula: &str) -> FormulaDefinition {
        FormulaDefinition {
            name: "own".into(),
            coefficients: vec![["c".into(), "Nm".into(), formula.into()]],
            shapes: vec![FormulaShape {
                name: "w".into(),
                unit: "1".into(),
                range: [1.0, 16.0],
            }],
            ..FormulaDefinition::default()
        }
    }

    #[test]
    fn a_formula_is_its_column_along_the_motion() {
        let robot = robot();
        let formula = "cos(q) * tanh(w * v_q1) + a^2 - t + temperature_q1 - temperature";
        let law = law(&definition(formula), &robot).unwrap();
        let wave = |f: fn(f64) -> f64| vec![(0..20).map(|k| f(0.1 * f64::from(k))).collect()];
        let stretch = Stretch {
            dt: 0.1,
            t: (0..20).map(|k| 0.1 * f64::from(k)).collect(),
            q: wave(f64::sin),
            v: wave(f64::cos),
            a: wave(|t| -t.sin()),
            tau: wave(|_| 0.0),
            temperature: wave(|t| 20.0 + t),
            ..Stretch::default()
        };
        let load = vec![vec![0.0; 20]];
        let scene = EffectScene {
            robot: &robot,
            theta: &[1.0],
            laws: &[JointFriction::None],
            stretch: &stretch,
            hat: &load,
            load: &load,
            direction: &[Vec::new()],
            tilt: None,
        };
        let own = ModelEffect::new(law, EffectPlace::Joint(0), vec![3.0], vec![1.0]);
        for (k, x) in own.columns(&scene, 0)[0].iter().enumerate() {
            let t = 0.1 * k as f64;
            let wanted = t.sin().cos() * (3.0 * t.cos()).tanh() + t.sin().powi(2) - t;
            assert!((x - wanted).abs() < 1e-12, "{k}: {x} {wanted}");
        }
        let Ok(starts) = law.starts_on(&LogCoverage::default(), EffectPlace::Joint(0)) else {
            panic!("a formula has shapes to begin from")
        };
        assert_eq!(starts.len(), 8);
        assert!(starts.iter().all(|s| (1.0..16.0).contains(&s[0])));
    }

    #[test]
    fn the_same_definition_is_the_same_law() {
        let made = || law(&definition("q"), &robot()).unwrap();
        assert!(std::ptr::eq(made(), made()));
    }

    #[test]
    fn a_text_that_is_no_formula_of_this_robot_is_refused() {
        for (formula, says) in [
            ("cos(", "no formula"),
            ("2 q", "no formula"),
            ("cos(q_q2)", "`q_q2` is not known"),
            ("t_q1", "`t_q1` is not known"),
            ("temperature_q2", "`temperature_q2` is not known"),
            ("temp", "play and dahl of the joint"),
            ("", "no formula"),
            ("play * w", "`play` needs its scale"),
        ] {
            let error = law(&definition(formula), &robot()).unwrap_err().to_string();
            assert!(error.contains("own") && error.contains(says), "{error}");
        }
        let named = FormulaDefinition {
            name: "spring".into(),
            ..definition("q")
        };
        let error = law(&named, &robot()).err().unwrap();
        assert!(matches!(error, FormulaError::Known { .. }));
        let elsewhere = FormulaDefinition {
            joints: Some(vec!["q9".into()]),
            ..definition("q")
        };
        assert!(law(&elsewhere, &robot()).is_err());
    }

    #[test]
    fn no_change_of_a_formula_panics() {
        use rand::{RngExt, SeedableRng};
        let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let marks: Vec<char> = "()+-*/^.,{}eE0123qvwat_ <>=!&|%\u{3c0}".chars().collect();
        let robot = robot();
        for _ in 0..3000 {
            let mut formula: Vec<char> =
                "cos(q+w)*v_q1-abs(a)^2.5e-3/min(load,t)".chars().collect();
            for _ in 0..4 {
                let at = chance.random_range(0..formula.len());
                formula[at] = marks[chance.random_range(0..marks.len())];
            }
            let formula: String = formula.into_iter().collect();
            // what is read is not kept: a law would stay for good
            let _ = FormulaEffect::of(&definition(&formula), &robot);
        }
    }
}
