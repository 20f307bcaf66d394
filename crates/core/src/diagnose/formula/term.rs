//! What a formula is made of: products of functions of signals, with their units and what becomes of them where the
//! motion is reversed.

use crate::math::hyperbolic::tanh;
use std::collections::BTreeMap;

use crate::effect::EffectScene;
use crate::robot::FormulaSignal;

/// What a function is of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    Signal(FormulaSignal, usize),
    /// Position of two joints together.
    Sum(usize, usize),
    /// What remembers the way of a joint, with its scale [m or rad].
    State(FormulaSignal, usize, f64),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Function {
    Plain,
    Square,
    Cube,
    Abs,
    /// x |x|
    Signed,
    /// tanh(x / w)
    Tanh(f64),
    /// exp(-|x| / w)
    Decay(f64),
    /// exp(-(x / w)^2)
    Bell(f64),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor {
    pub source: Source,
    pub function: Function,
}

/// A product of factors, and of a sine and a cosine with a coefficient each where it is periodic.
#[derive(Debug, Clone, PartialEq)]
pub struct FormulaTerm {
    pub factors: Vec<Factor>,
    /// Of what, and how many times a radian or metre.
    pub wave: Option<(Source, f64)>,
}

/// Powers of the factors of a term, by their names.
pub type TermPowers = BTreeMap<String, i32>;

/// Names and units on a robot, at one joint.
pub struct TermNames<'a> {
    pub joint: usize,
    pub joints: &'a [String],
    /// m or rad of each joint, and the unit of its torque.
    pub positions: Vec<&'static str>,
    pub torques: &'a [String],
}

/// A number that shapes a formula: its name in it, value and unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeNumber {
    pub name: String,
    pub value: f64,
    pub unit: String,
    key: (String, u64),
}

impl Source {
    /// Joints whose signals it takes.
    pub fn joints(self) -> Vec<usize> {
        match self {
            Self::Signal(_, j) | Self::State(_, j, _) => vec![j],
            Self::Sum(i, j) => vec![i, j],
        }
    }

    /// Whether it changes its sign where the same way is gone backwards.
    pub fn is_odd(self) -> bool {
        use FormulaSignal::{Dahl, Direction, Play, Speed};
        match self {
            Self::Signal(of, _) | Self::State(of, ..) => {
                matches!(of, Speed | Direction | Play | Dahl)
            }
            Self::Sum(..) => false,
        }
    }

    pub fn is_position(self) -> bool {
        matches!(
            self,
            Self::Signal(FormulaSignal::Position, _) | Self::Sum(..)
        )
    }

    fn name(self, names: &TermNames) -> String {
        let of = |signal: FormulaSignal, j: usize| {
            let plain = signal.name();
            let text = format!("{plain}_{}", names.joints[j]);
            let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
            match j == names.joint {
                true => plain.to_owned(),
                false if text.chars().all(is_plain) => text,
                false => format!("{{{text}}}"),
            }
        };
        match self {
            Self::Signal(signal, j) | Self::State(signal, j, _) => of(signal, j),
            Self::Sum(i, j) => {
                let [a, b] = [i, j].map(|j| of(FormulaSignal::Position, j));
                format!("({a} + {b})")
            }
        }
    }

    /// Its unit; none for a sum of what has different ones.
    pub fn unit(self, names: &TermNames) -> Option<TermPowers> {
        use FormulaSignal as Of;
        let position = |j: usize| names.positions[j];
        let of: Vec<(&str, i32)> = match self {
            Self::Sum(i, j) if position(i) != position(j) => return None,
            Self::Signal(Of::Position, j) | Self::Sum(j, _) => vec![(position(j), 1)],
            Self::Signal(Of::Speed, j) => vec![(position(j), 1), ("s", -1)],
            Self::Signal(Of::Acceleration, j) => vec![(position(j), 1), ("s", -2)],
            Self::Signal(Of::Load, j) => vec![(&names.torques[j], 1)],
            Self::Signal(Of::Temperature, _) => vec![("degC", 1)],
            Self::Signal(Of::Time | Of::SinceReversal, _) => vec![("s", 1)],
            Self::Signal(Of::Direction | Of::Play | Of::Dahl, _) | Self::State(..) => Vec::new(),
        };
        let own = of.into_iter();
        Some(own.map(|(unit, p)| (unit.to_owned(), p)).collect())
    }

    fn series(self, scene: &EffectScene) -> Vec<f64> {
        match self {
            Self::Signal(signal, j) => signal.series(scene, j, None),
            Self::State(signal, j, scale) => signal.series(scene, j, Some(scale)),
            Self::Sum(i, j) => {
                let q = &scene.stretch.q;
                q[i].iter().zip(&q[j]).map(|(a, b)| a + b).collect()
            }
        }
    }
}

impl Function {
    fn value(self, x: f64) -> f64 {
        match self {
            Self::Plain => x,
            Self::Square => x * x,
            Self::Cube => x * x * x,
            Self::Abs => x.abs(),
            Self::Signed => x * x.abs(),
            Self::Tanh(w) => tanh(x / w),
            Self::Decay(w) => (-x.abs() / w).exp(),
            Self::Bell(w) => (-(x / w) * (x / w)).exp(),
        }
    }

    /// Its power of the source's unit, and its scale.
    fn power(self) -> (i32, Option<f64>) {
        match self {
            Self::Plain | Self::Abs => (1, None),
            Self::Square | Self::Signed => (2, None),
            Self::Cube => (3, None),
            Self::Tanh(w) | Self::Decay(w) | Self::Bell(w) => (0, Some(w)),
        }
    }

    fn keeps_sign(self) -> bool {
        use Function::{Cube, Plain, Signed, Tanh};
        matches!(self, Plain | Cube | Signed | Tanh(_))
    }
}

impl Factor {
    pub fn plain(signal: FormulaSignal, joint: usize) -> Self {
        Self::of(Function::Plain, Source::Signal(signal, joint))
    }

    pub fn of(function: Function, source: Source) -> Self {
        Self { source, function }
    }

    pub fn series(&self, scene: &EffectScene) -> Vec<f64> {
        let mut x = self.source.series(scene);
        x.iter_mut().for_each(|x| *x = self.function.value(*x));
        x
    }

    /// Whether it flips where the motion is reversed.
    pub fn is_odd(&self) -> bool {
        self.source.is_odd() && self.function.keeps_sign()
    }

    /// The same with its scales times a number, each by itself.
    fn reshaped(&self, by: f64) -> Vec<Self> {
        let (mut function, mut source) = (*self, *self);
        let mut all = Vec::new();
        if let Function::Tanh(w) | Function::Decay(w) | Function::Bell(w) = &mut function.function {
            *w *= by;
            all.push(function);
        }
        if let Source::State(_, _, way) = &mut source.source {
            *way *= by;
            all.push(source);
        }
        all
    }

    fn text(&self, names: &TermNames, shapes: &[ShapeNumber]) -> String {
        let x = self.source.name(names);
        let own = self.shapes(names).pop();
        let w = own.map_or(String::new(), |own| own.name_among(shapes));
        match self.function {
            Function::Plain => x,
            Function::Square => format!("{x}^2"),
            Function::Cube => format!("{x}^3"),
            Function::Abs => format!("abs({x})"),
            Function::Signed => format!("{x}*abs({x})"),
            Function::Tanh(_) => format!("tanh({x}/{w})"),
            Function::Decay(_) => format!("exp(-abs({x})/{w})"),
            // a minus binds before a power
            Function::Bell(_) => format!("exp(0-({x}/{w})^2)"),
        }
    }

    /// The scale of the function, or that of what it is of.
    fn shapes(&self, names: &TermNames) -> Vec<ShapeNumber> {
        let mut all = Vec::new();
        if let Source::State(signal, j, scale) = self.source {
            let name = signal.scale().unwrap_or_default();
            all.push(shape(name, "state", scale, names.positions[j]));
        }
        if let (_, Some(w)) = self.function.power() {
            let unit = self.source.unit(names);
            let unit = unit.map_or(String::new(), |u| unit_text(&u));
            let kind = std::mem::discriminant(&self.function);
            let of = format!("{kind:?} {}", self.source.name(names));
            all.push(shape("w", &of, w, &unit));
        }
        all
    }
}

/// Part of a change of a scale that is tried of the number of a wave.
const WAVES: f64 = 0.1;

fn shape(name: &str, of: &str, value: f64, unit: &str) -> ShapeNumber {
    ShapeNumber {
        name: name.to_owned(),
        value,
        unit: unit.to_owned(),
        key: (format!("{name} {of}"), value.to_bits()),
    }
}

impl ShapeNumber {
    /// Its name where it is one of these, else its own.
    fn name_among(self, shapes: &[ShapeNumber]) -> String {
        let known = shapes.iter().find(|s| s.key == self.key);
        known.map_or(self.name, |s| s.name.clone())
    }
}

impl FormulaTerm {
    pub fn of(factors: &[Factor]) -> Self {
        Self {
            factors: factors.to_vec(),
            wave: None,
        }
    }

    pub fn times(&self, factor: Factor) -> Self {
        let mut all = self.clone();
        all.factors.push(factor);
        all
    }

    pub fn count(&self) -> usize {
        1 + usize::from(self.wave.is_some())
    }

    /// The same with each of its shapes by itself times some numbers.
    pub fn reshaped(&self, by: &[f64]) -> Vec<Self> {
        let mut all = Vec::new();
        for (i, factor) in self.factors.iter().enumerate() {
            for changed in by.iter().flat_map(|x| factor.reshaped(*x)) {
                let mut own = self.clone();
                own.factors[i] = changed;
                all.push(own);
            }
        }
        if let Some((source, n)) = self.wave.filter(|(_, n)| !is_whole(*n)) {
            // the travel sets how well the number of a wave is known: near enough for the refinement that follows
            all.extend(by.iter().map(|x| FormulaTerm {
                wave: Some((source, n * (1.0 + WAVES * (x - 1.0)))),
                ..self.clone()
            }));
        }
        all
    }

    /// How much there is in it to read.
    pub fn length(&self) -> usize {
        let function = |f: &Factor| 1 + usize::from(f.function != Function::Plain);
        self.factors.iter().map(function).sum::<usize>() + 2 * usize::from(self.wave.is_some())
    }

    pub fn sources(&self) -> impl Iterator<Item = Source> + '_ {
        let wave = self.wave.iter().map(|(source, _)| *source);
        self.factors.iter().map(|f| f.source).chain(wave)
    }

    /// Whether it flips where the motion is reversed.
    pub fn is_odd(&self) -> bool {
        self.factors.iter().filter(|f| f.is_odd()).count() % 2 == 1
    }

    /// Unit of its coefficients at a joint; none where no one constant makes the units right.
    pub fn unit(&self, names: &TermNames) -> Option<String> {
        let mut all = TermPowers::from([(names.torques[names.joint].clone(), 1)]);
        for factor in &self.factors {
            let (power, _) = factor.function.power();
            for (unit, p) in factor.source.unit(names)? {
                *all.entry(unit).or_default() -= power * p;
            }
        }
        if let Some((source, n)) = self.wave {
            let unit = source.unit(names)?;
            // what a wave is of must be an angle, or have a number with a unit of its own
            let angle = source.is_position() && unit.keys().all(|u| u == "rad");
            if !angle && (!source.is_position() || is_whole(n)) {
                return None;
            }
        }
        all.retain(|_, p| *p != 0);
        Some(unit_text(&all))
    }

    pub fn shapes(&self, names: &TermNames) -> Vec<ShapeNumber> {
        let mut all: Vec<ShapeNumber> = self.factors.iter().flat_map(|f| f.shapes(names)).collect();
        if let Some((source, n)) = self.wave.filter(|(_, n)| !is_whole(*n)) {
            let unit = source.unit(names).unwrap_or_default();
            let inverse: TermPowers = unit.into_iter().map(|(u, p)| (u, -p)).collect();
            all.push(shape("n", &source.name(names), n, &unit_text(&inverse)));
        }
        all
    }

    pub fn texts(&self, names: &TermNames, shapes: &[ShapeNumber]) -> Vec<String> {
        let factors: Vec<String> = self.factors.iter().map(|f| f.text(names, shapes)).collect();
        let Some((source, n)) = self.wave else {
            return vec![factors.join("*")];
        };
        let own = self.shapes(names).pop().filter(|_| !is_whole(n));
        let n = own.map_or(format!("{n}"), |own| own.name_among(shapes));
        let of = |wave: &str| {
            let x = source.name(names);
            let last = match n.as_str() {
                "1" => format!("{wave}({x})"),
                n => format!("{wave}({n}*{x})"),
            };
            [factors.as_slice(), &[last]].concat().join("*")
        };
        vec![of("sin"), of("cos")]
    }
}

/// Whether a wave goes round a whole number of times.
fn is_whole(n: f64) -> bool {
    n == n.round()
}

/// Powers of units as a text: `Nm s^2/rad^2`.
pub fn unit_text(powers: &TermPowers) -> String {
    let part = |above: bool| {
        let own = powers
            .iter()
            .filter(|(_, p)| (**p > 0) == above && **p != 0);
        let texts = own.map(|(unit, p)| match p.abs() {
            1 => unit.clone(),
            p => format!("{unit}^{p}"),
        });
        texts.collect::<Vec<String>>().join(" ")
    };
    let above = match part(true) {
        none if none.is_empty() => "1".to_owned(),
        above => above,
    };
    match part(false) {
        none if none.is_empty() => above,
        below if below.contains(' ') => format!("{above}/({below})"),
        below => format!("{above}/{below}"),
    }
}

/// Names of the numbers that shape terms, each its own; those that are the same stand once.
pub fn named(terms: &[FormulaTerm], names: &TermNames) -> Vec<ShapeNumber> {
    let mut all: Vec<ShapeNumber> = Vec::new();
    for own in terms.iter().flat_map(|t| t.shapes(names)) {
        if all.iter().any(|s| s.key == own.key) {
            continue;
        }
        let alike = all.iter().filter(|s| s.name.starts_with(&own.name)).count();
        let name = match (alike, own.name.len()) {
            (0, _) | (_, 2..) => own.name.clone(),
            (k, _) => format!("{}{}", own.name, k + 1),
        };
        all.push(ShapeNumber { name, ..own });
    }
    all
}
