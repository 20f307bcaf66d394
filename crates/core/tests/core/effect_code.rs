//! What effects write into generated code, evaluated here as text, is what their columns say.

use std::collections::BTreeMap;

use cft_ident_core::effect::as_code::{EffectsCode, RobotProperty};
use cft_ident_core::effect::law_text::{law, slopes};
use cft_ident_core::effect::{AugmentedModel, EffectScene, Role};
use cft_ident_core::robot::tree::newton_euler::walk;

use crate::diagnosis_bench::DT;
use crate::effect_bench::machines;

const SECONDS: f64 = 2.0;

/// Numbers by the names that statements have for them: `q[0]`, `state.t`, `near_0_1`.
type TermNames = BTreeMap<String, f64>;

/// An expression of C and Rust in names, from left to right.
struct Reader<'a> {
    text: &'a [u8],
    names: &'a TermNames,
}

impl Reader<'_> {
    fn peek(&mut self) -> u8 {
        while self.text.first() == Some(&b' ') {
            self.text = &self.text[1..];
        }
        self.text.first().copied().unwrap_or(0)
    }

    fn take(&mut self, mark: u8) -> bool {
        let found = self.peek() == mark;
        if found {
            self.text = &self.text[1..];
        }
        found
    }

    fn sum(&mut self) -> f64 {
        let mut value = self.product();
        loop {
            if self.take(b'+') {
                value += self.product();
            } else if self.take(b'-') {
                value -= self.product();
            } else {
                return value;
            }
        }
    }

    fn product(&mut self) -> f64 {
        let mut value = self.operand();
        loop {
            if self.take(b'*') {
                value *= self.operand();
            } else if self.take(b'/') {
                value /= self.operand();
            } else {
                return value;
            }
        }
    }

    fn word(&mut self, belongs: impl Fn(u8, u8) -> bool) -> String {
        let mut end = 0;
        let before = |end: usize| if end == 0 { 0 } else { self.text[end - 1] };
        while end < self.text.len() && belongs(before(end), self.text[end]) {
            end += 1;
        }
        let word = String::from_utf8_lossy(&self.text[..end]).into_owned();
        self.text = &self.text[end..];
        word
    }

    fn operand(&mut self) -> f64 {
        match self.peek() {
            b'-' => {
                self.take(b'-');
                -self.operand()
            }
            b'(' => {
                self.take(b'(');
                let value = self.sum();
                assert!(self.take(b')'), "a bracket closes");
                value
            }
            b'0'..=b'9' => {
                let number = |before: u8, c: u8| {
                    c.is_ascii_digit() || b".e".contains(&c) || c == b'-' && before == b'e'
                };
                let word = self.word(number);
                word.parse()
                    .unwrap_or_else(|_| panic!("{word} is a number"))
            }
            _ => {
                let name = |_: u8, c: u8| c.is_ascii_alphanumeric() || b"_.$[]".contains(&c);
                let word = self.word(name);
                match self.take(b'(') {
                    true => self.call(&word),
                    false => *self.names.get(&word).unwrap_or_else(|| panic!("`{word}`")),
                }
            }
        }
    }

    fn call(&mut self, function: &str) -> f64 {
        let mut of = vec![self.sum()];
        while self.take(b',') {
            of.push(self.sum());
        }
        assert!(self.take(b')'), "a call closes");
        let x = of[0];
        match function {
            "sin" => x.sin(),
            "cos" => x.cos(),
            "exp" => x.exp(),
            "expm1" => x.exp_m1(),
            "tanh" => x.tanh(),
            "fabs" => x.abs(),
            "sqrt" => x.sqrt(),
            "pow" => x.powf(of[1]),
            "fmin" => x.min(of[1]),
            "fmax" => x.max(of[1]),
            "$sign" if x == 0.0 => 0.0,
            "$sign" => x.signum(),
            "$positive" => f64::from(u8::from(x > 0.0)),
            "$same" => f64::from(u8::from(x == of[1])),
            "$spline" => spline(x, &of[1..]),
            _ => panic!("`{function}` is not known"),
        }
    }
}

/// Cox and de Boor: a cubic B-spline of six coefficients on three pieces, x from 0 to 1; constant beyond.
fn spline(x: f64, coefficients: &[f64]) -> f64 {
    fn basis(i: i32, degree: i32, x: f64) -> f64 {
        let (from, d) = (f64::from(i), f64::from(degree));
        match degree {
            0 => f64::from(u8::from((from..from + 1.0).contains(&x))),
            _ => {
                (x - from) / d * basis(i, degree - 1, x)
                    + (from + d + 1.0 - x) / d * basis(i + 1, degree - 1, x)
            }
        }
    }
    let x = (3.0 * x).clamp(0.0, 3.0 - 1e-12);
    let each = (0..6).zip(coefficients);
    each.map(|(i, c)| c * basis(i - 3, 3, x)).sum()
}

/// Runs statements; torques of joints are among the names.
fn run(statements: &[String], names: &mut TermNames) {
    for statement in statements {
        let text = statement.trim_end_matches(';');
        let (to, text, adds) = match text.strip_prefix("let ") {
            Some(rest) => {
                let (name, text) = rest.split_once(" = ").expect("a constant");
                (name, text, false)
            }
            None => {
                let (name, text) = text.split_once(" += ").expect("a torque");
                (name, text, true)
            }
        };
        let mut reader = Reader {
            text: text.as_bytes(),
            names,
        };
        let value = reader.sum();
        assert_eq!(reader.peek(), 0, "{text}");
        let before = if adds { names[to] } else { 0.0 };
        names.insert(to.to_owned(), before + value);
    }
}

#[test]
fn statements_of_an_effect_add_the_torque_of_its_columns() {
    let mut seen = BTreeMap::new();
    for machine in machines() {
        let stretch = machine.stretch(SECONDS);
        let robot = &machine.model.robot;
        let n = robot.joints();
        for effect in machine.effects(&stretch) {
            let model = machine.with(&effect);
            let torques = model.torques(&stretch);
            let plain = AugmentedModel::plain(machine.model.clone()).torques(&stretch);
            let scene = EffectScene {
                robot,
                theta: &machine.model.theta,
                laws: &machine.model.friction,
                stretch: &stretch,
                hat: &plain.hat,
                load: &plain.load,
                direction: &torques.direction,
                tilt: Some(&plain.tilt),
            };
            let title = format!("{} {}", machine.name, effect.title(robot));
            let code = EffectsCode::of(&model).unwrap_or_else(|error| panic!("{title}: {error}"));
            assert_eq!(code.titles, [effect.title(robot)]);
            assert_eq!(code.remember_anything(), !code.steps.is_empty());
            assert_eq!(code.of_friction.len(), code.friction.len());
            let lead = if effect.law.entry.role == Role::Shift {
                effect.linear[0]
            } else {
                0.0
            };
            for (j, at) in code.lead_s.iter().enumerate() {
                let expected = if effect.place.touches(j) { lead } else { 0.0 };
                assert_eq!(*at, expected, "{title}");
            }
            // what is kept from sample to sample is compared where code is run
            if !code.memory.is_empty() || lead != 0.0 {
                continue;
            }
            let mut added = vec![vec![0.0; scene.len()]; n];
            (0..n).for_each(|j| effect.torque(&scene, j, &mut added[j]));
            for k in (0..scene.len()).step_by(7) {
                let mut names = TermNames::new();
                for j in 0..n {
                    let of = [("q", &stretch.q), ("v", &stretch.v), ("a", &stretch.a)];
                    for (name, x) in of.into_iter().chain([("load", &plain.load)]) {
                        names.insert(format!("{name}[{j}]"), x[j][k]);
                    }
                    names.insert(format!("tau[{j}]"), 0.0);
                }
                names.insert("state.t".to_owned(), stretch.began + DT * k as f64);
                for part in [&code.friction, &code.added, &code.steps, &code.askew] {
                    run(part, &mut names);
                }
                let state = [&stretch.q, &stretch.v, &stretch.a];
                let [q, v, a] = state.map(|x| x.iter().map(|x| x[k]).collect::<Vec<f64>>());
                let mut by_bodies = vec![0.0; n];
                if let Some(bodies) = &code.extra {
                    walk(robot.tree(), &q, &v, &a, |link, on, row| {
                        let own = row.iter().zip(&bodies[link]);
                        by_bodies[on] += own.map(|(y, x)| y * x).sum::<f64>();
                    });
                }
                if let Some([gx, gy]) = code.tilt {
                    let mut by_gravity = vec![[0.0; 2]; n];
                    robot
                        .tilt(&machine.model.theta)
                        .torques(&q, &mut by_gravity);
                    let each = by_bodies.iter_mut().zip(&by_gravity);
                    each.for_each(|(sum, [x, y])| *sum += gx * x + gy * y);
                }
                for j in 0..n {
                    let found = names[&format!("tau[{j}]")] + by_bodies[j];
                    let off = (found - added[j][k]).abs();
                    assert!(
                        off < 1e-9 * (1.0 + found.abs()),
                        "{title} {j} {k}: {found} {}",
                        added[j][k]
                    );
                }
            }
            *seen.entry(effect.name()).or_insert(0) += 1;
        }
    }
    assert!(seen.len() >= 20, "{seen:?}");
}

#[test]
fn a_law_as_text_is_the_law_and_its_slopes_are_those_of_its_numbers() {
    for machine in machines() {
        for friction in &machine.model.friction {
            for v in [-1.7, -0.02, 0.01, 0.6] {
                let names = TermNames::from([("v[0]".to_owned(), v)]);
                let value = |text: &str| {
                    let mut reader = Reader {
                        text: text.as_bytes(),
                        names: &names,
                    };
                    reader.sum()
                };
                let off = value(&law(friction, "v[0]")) - friction.torque(v);
                assert!(off.abs() < 1e-13);
                let mut gradient = [0.0; 5];
                friction.gradient(v, &mut gradient);
                let texts = slopes(friction, "v[0]");
                assert_eq!(texts.len(), friction.parameters());
                for (text, slope) in texts.iter().zip(gradient) {
                    assert!((value(text) - slope).abs() < 1e-13, "{text}");
                }
            }
        }
    }
}

#[test]
fn an_effect_that_is_a_property_of_links_has_the_numbers_of_its_code() {
    for machine in machines() {
        let stretch = machine.stretch(SECONDS);
        for effect in machine.effects(&stretch) {
            let code = EffectsCode::of(&machine.with(&effect)).expect("all have code");
            match effect.property() {
                Some(RobotProperty::Gravity(own)) => {
                    assert_eq!(own.as_slice(), effect.linear);
                    assert!(code.tilt.is_none_or(|tilt| tilt == own));
                }
                Some(RobotProperty::Body(body)) => {
                    let bodies = code.extra.expect("a body is one more");
                    let last = bodies.last().expect("there are links");
                    let off = last.iter().zip(body.standard());
                    assert!(off.into_iter().all(|(a, b)| (a - b).abs() < 1e-12));
                    assert!(
                        bodies[..bodies.len() - 1]
                            .iter()
                            .flatten()
                            .all(|x| *x == 0.0)
                    );
                }
                Some(RobotProperty::Drive { joint, inertia }) => {
                    assert_eq!(Some(joint), effect.place.joint());
                    assert_eq!(inertia, effect.linear[0]);
                }
                None => assert!(code.tilt.is_none() || effect.name() == "gravity-tilt"),
            }
        }
    }
}
