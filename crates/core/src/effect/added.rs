//! An effect with its numbers, as it stands in a model.

use nalgebra::DMatrix;

use super::{
    EffectFacts, EffectPlace, EffectScene, Family, Instant, KeyValue, Law, LimitContext, Role,
    Rule, Unit,
};
use crate::robot::Robot;

/// One number of an effect as results and files have it: key, value, standard deviation, unit.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectNumber {
    pub key: String,
    pub value: f64,
    pub std: Option<f64>,
    pub unit: String,
    /// Held at a bound, for these data do not determine it.
    pub bound: bool,
}

/// An effect in a model: its law, its place and the numbers of both.
#[derive(Debug, Clone)]
pub struct ModelEffect {
    pub law: &'static Law,
    pub place: EffectPlace,
    pub shape: Vec<f64>,
    pub linear: Vec<f64>,
    /// Which of (shape, linear) a fit leaves where they are: what the data do not determine, at a bound.
    pub held: Vec<bool>,
}

impl PartialEq for ModelEffect {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
            && self.place == other.place
            && self.shape == other.shape
            && self.linear == other.linear
    }
}

impl ModelEffect {
    /// An effect with its numbers, all of them open to a fit.
    pub fn new(law: &'static Law, place: EffectPlace, shape: Vec<f64>, linear: Vec<f64>) -> Self {
        ModelEffect {
            held: vec![false; shape.len() + linear.len()],
            law,
            place,
            shape,
            linear,
        }
    }

    /// Holds the numbers whose keys are at a bound, as a file says; none of an effect whose keys are not its shape and
    /// coefficients.
    pub fn hold(&mut self, bound: &dyn Fn(&str) -> bool) {
        if self.law.reparametrised.is_none() {
            let keys = self.law.key_names();
            for (held, key) in self.held.iter_mut().zip(keys) {
                *held = bound(key);
            }
        }
    }

    /// Joints whose temperature it takes.
    pub fn temperatures(&self) -> Vec<usize> {
        let formula = self.law.formula.zip(self.place.joint());
        formula.map_or(Vec::new(), |(formula, j)| formula.temperatures(j))
    }

    /// As results and files name it.
    pub fn name(&self) -> &'static str {
        self.law.entry.name
    }

    /// Family.
    pub fn family(&self) -> Family {
        match self.law.varied {
            Some(of) => of(&self.shape).0,
            None => self.law.entry.family(),
        }
    }

    /// The first rule of its entry, but for those to `skip`, that its numbers break, with the reason in words.
    pub fn broken(
        &self,
        seen: &LimitContext,
        skip: &dyn Fn(&Rule) -> bool,
    ) -> Option<(&'static Rule, String)> {
        let keys = self.law.keys(&self.shape, &self.linear);
        let value = |key: &str| keys.iter().find(|k| k.key == key).map(|k| k.value);
        let mut rules = self.law.entry.must.iter().filter(|rule| !skip(rule));
        rules.find_map(|rule| Some((rule, rule.broken(&value, seen)?)))
    }

    /// Values and covariance of its sizes, where `covariance` is that of (shape, linear), row-major. A size that
    /// has none, or an infinite one, is left out.
    pub fn sizes(&self, covariance: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let size = |k: &KeyValue| self.law.entry.key(k.key).is_some_and(|key| key.size);
        let shown = |k: &KeyValue| {
            let variance = spread(&k.slopes, &k.slopes, covariance);
            variance > 0.0 && variance.is_finite()
        };
        let mut keys = self.law.keys(&self.shape, &self.linear);
        keys.retain(|k| size(k) && shown(k));
        let of = |a: &KeyValue| {
            let row = keys.iter();
            row.map(|b| spread(&a.slopes, &b.slopes, covariance))
                .collect()
        };
        let values = keys.iter().map(|k| k.value).collect();
        (values, keys.iter().map(of).collect())
    }

    /// Holds the shape where no size is so many deviations off zero while it is free: sizes and shape trade with each other.
    /// Gives the covariance of (shape, linear) with the shape held, row-major, by that with the shape free; none where the
    /// shape stays free.
    pub(crate) fn hold_shape_beside_untold_sizes(
        &mut self,
        covariance: &[f64],
        deviations: f64,
    ) -> Option<Vec<f64>> {
        let (values, of_sizes) = self.sizes(covariance);
        let told = |(k, value): (usize, &f64)| value.powi(2) >= deviations.powi(2) * of_sizes[k][k];
        if values.iter().enumerate().any(told) {
            return None;
        }
        let (shapes, size) = (self.shape.len(), self.parameters());
        let all = DMatrix::from_row_slice(size, size, covariance);
        let is_free = |k: &usize| all[(*k, *k)] > 0.0 && all[(*k, *k)].is_finite();
        let free: Vec<usize> = (0..shapes).filter(is_free).collect();
        if values.is_empty() || free.is_empty() {
            return None;
        }
        let linear: Vec<usize> = (shapes..size).collect();
        let part = |a: &[usize], b: &[usize]| all.select_rows(a).select_columns(b);
        let by_shape = part(&free, &free).cholesky()?.solve(&part(&free, &linear));
        let beside = part(&linear, &linear) - part(&linear, &free) * by_shape;
        let mut held = DMatrix::zeros(size, size);
        held.view_mut((shapes, shapes), beside.shape())
            .copy_from(&beside);
        self.held[..shapes].fill(true);
        Some(held.as_slice().to_vec())
    }

    /// What the effect adds to joint `joint` along a scene, into `out` (zeroed before); nothing for
    /// effects that shift the torque.
    pub fn torque(&self, scene: &EffectScene, joint: usize, out: &mut [f64]) {
        out.fill(0.0);
        if self.law.entry.role == Role::Shift || !self.place.touches(joint) {
            return;
        }
        let columns = self.columns(scene, joint);
        for (column, c) in columns.iter().zip(&self.linear) {
            for (x, y) in out.iter_mut().zip(column) {
                *x += c * y;
            }
        }
    }

    /// Its columns in the rows of joint `joint`.
    pub fn columns(&self, scene: &EffectScene, joint: usize) -> Vec<Vec<f64>> {
        let mut out = vec![vec![0.0; scene.len()]; self.law.linear.len()];
        if self.place.touches(joint) {
            let mut kept = vec![f64::NAN; self.law.remembered()];
            let mut row = vec![0.0; out.len()];
            for k in 0..scene.len() {
                row.fill(0.0);
                self.at(scene, (joint, k), &mut kept, &mut row);
                for (column, x) in out.iter_mut().zip(&row) {
                    column[k] = *x;
                }
            }
        }
        out
    }

    /// The same at sample k, by what the law keeps; zero before.
    pub(super) fn at(
        &self,
        scene: &EffectScene,
        (joint, k): (usize, usize),
        kept: &mut [f64],
        out: &mut [f64],
    ) {
        let (place, shape) = (self.place, self.shape.as_slice());
        let at = Instant {
            scene,
            place,
            shape,
            joint,
            k,
        };
        self.law.at(&at, kept, out);
    }

    /// Time by which it shifts the torque of joint `joint` \[s\].
    pub fn shift(&self, joint: usize) -> f64 {
        let shifts = self.law.entry.role == Role::Shift && self.place.touches(joint);
        if shifts { self.linear[0] } else { 0.0 }
    }

    /// Whether its numbers are among those that a file of it may hold.
    pub fn can_be(&self) -> bool {
        let keys = self.law.keys(&self.shape, &self.linear);
        keys.iter().all(|of| {
            let range = self.law.entry.key(of.key).and_then(|key| key.range);
            range.is_none_or(|range| range.holds(of.value))
        })
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.shape.len() + self.linear.len()
    }

    /// Name, or name and place: `ripple of q4`.
    pub fn title(&self, robot: &Robot) -> String {
        let name = self.name();
        match (self.place, self.place.name(robot)) {
            (EffectPlace::Pair { of, .. }, Some(on)) => {
                format!("{name} of {on} with {}", robot.joint_names()[of])
            }
            (EffectPlace::Geared { other, .. }, Some(motor)) => {
                format!("{name} of {motor} and {}", robot.joint_names()[other])
            }
            (EffectPlace::Actuators, _) => format!("{name} of {}", self.place.words(robot)),
            (_, Some(place)) => format!("{name} of {place}"),
            (_, None) => name.to_owned(),
        }
    }

    /// What it is called where it was found: `ripple of q1, 2.5 mm pitch, 1.2 N`. `torque` is the torque's unit.
    pub fn said(&self, robot: &Robot, torque: &str) -> String {
        let numbers = self.numbers(robot, torque, None).into_iter();
        let words = (self.law.entry.said)(&EffectFacts {
            at: self.place.words(robot),
            with: (self.place.from()).map_or(String::new(), |j| robot.joint_names()[j].clone()),
            kind: self.place.kind(robot),
            numbers: numbers.map(|n| (n.key, n.value, n.unit)).collect(),
            curve: self.curve(),
            torque: torque.to_owned(),
        });
        match words.is_empty() {
            // an effect of the user's own has its name alone
            true => self.title(robot),
            false => words,
        }
    }

    /// The same with the catalogue's name where that is not among the words: `gear of q1 with play (backlash)`.
    pub fn said_and_named(&self, robot: &Robot, torque: &str) -> String {
        let (said, name) = (self.said(robot, torque), self.name());
        match said.contains(name) || said.contains(&name.replace('-', " ")) {
            true => said,
            false => format!("{said} ({name})"),
        }
    }

    /// Numbers as files and tables have them. `covariance` is that of (shape, linear), row-major;
    /// a shape that these data leave open has infinite variance there. `torque` is the torque's unit.
    pub fn numbers(
        &self,
        robot: &Robot,
        torque: &str,
        covariance: Option<&[f64]>,
    ) -> Vec<EffectNumber> {
        let kind = self.place.kind(robot);
        let from = self.place.from().map_or(kind, |j| robot.joint_kind(j));
        let own = self.law.keys(&self.shape, &self.linear).into_iter();
        let own = own.map(|number| {
            let unit = self.law.entry.key(number.key);
            let unit = match unit.map_or(Unit::One, |key| key.unit) {
                Unit::Signal => (self.law.signal_unit).map_or(Unit::One, |of| of(&self.shape)),
                unit => unit,
            };
            // a number of held ones alone
            let open = |(slope, held): (&f64, &bool)| *slope != 0.0 && !held;
            let bound =
                self.held.contains(&true) && !number.slopes.iter().zip(&self.held).any(open);
            let std = covariance.and_then(|c| deviation(&number.slopes, c));
            EffectNumber {
                key: number.key.to_owned(),
                value: number.value,
                std: std.filter(|_| !bound),
                unit: unit.in_files(kind, from, torque),
                bound,
            }
        });
        let place = self.place.keys().into_iter();
        let place = place.map(|(key, value)| EffectNumber {
            key: key.to_owned(),
            value,
            std: None,
            unit: String::new(),
            bound: false,
        });
        own.chain(place).collect()
    }
}

/// Covariance of two numbers with these slopes.
fn spread(one: &[f64], other: &[f64], covariance: &[f64]) -> f64 {
    let k = one.len();
    let mut sum = 0.0;
    for a in 0..k {
        for b in 0..k {
            // a variance may be infinite
            if one[a] != 0.0 && other[b] != 0.0 {
                sum += one[a] * other[b] * covariance[a * k + b];
            }
        }
    }
    sum
}

/// Standard deviation of a number with these slopes, where it is one.
fn deviation(slopes: &[f64], covariance: &[f64]) -> Option<f64> {
    let variance = spread(slopes, slopes, covariance);
    // rounding may leave nothing below nothing; what is not a number is no deviation
    let std = if variance < 0.0 { 0.0 } else { variance.sqrt() };
    std.is_finite().then_some(std)
}
