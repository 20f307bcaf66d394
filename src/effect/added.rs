//! An effect with its numbers, as it stands in a model.

use super::entry::{Family, Role};
use super::law::{Law, Scene};
use super::place::Place;
use super::unit::Unit;
use super::values::{EffectError, Values};
use crate::robot::Robot;

/// One number of an effect as results and files have it: key, value, standard deviation, unit.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectNumber {
    pub key: String,
    pub value: f64,
    pub std: Option<f64>,
    pub unit: String,
}

/// An effect in a model.
#[derive(Debug, Clone)]
pub struct Added {
    pub law: &'static Law,
    pub place: Place,
    pub shape: Vec<f64>,
    pub linear: Vec<f64>,
}

impl PartialEq for Added {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
            && self.place == other.place
            && self.shape == other.shape
            && self.linear == other.linear
    }
}

impl Added {
    /// The effect at the place and with the numbers that a file gives.
    ///
    /// # Errors
    /// [`EffectError`] for a joint or key that does not fit.
    pub(crate) fn of_values(
        law: &'static Law,
        robot: &Robot,
        joint: Option<&str>,
        values: &Values,
    ) -> Result<Self, EffectError> {
        let place = law.entry.places.named(robot, joint, values)?;
        let [shape, linear] = law.of_keys(values)?;
        Ok(Added {
            law,
            place,
            shape,
            linear,
        })
    }

    /// As results and files name it.
    /// Whether its torque is the same while its joint rests.
    pub(crate) fn at_rest(&self) -> bool {
        self.law.entry.at_rest
    }

    pub fn name(&self) -> &'static str {
        self.law.entry.name
    }

    /// Family.
    pub fn family(&self) -> Family {
        self.law.entry.family()
    }

    /// Whether its numbers have signs that the effect can have.
    pub fn is_possible(&self) -> bool {
        let keys = self.law.keys(&self.shape, &self.linear);
        let positive = |key: &str| self.law.entry.positive.contains(&key);
        keys.iter().all(|k| k.value > 0.0 || !positive(k.key))
    }

    /// What the effect adds to joint `joint` along a scene, into `out` (zeroed before); nothing for
    /// effects that shift the torque.
    pub fn torque(&self, scene: &Scene, joint: usize, out: &mut [f64]) {
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
    pub fn columns(&self, scene: &Scene, joint: usize) -> Vec<Vec<f64>> {
        let mut out = vec![vec![0.0; scene.len()]; self.law.linear.len()];
        if self.place.touches(joint) {
            (self.law.columns)(scene, self.place, &self.shape, joint, &mut out);
        }
        out
    }

    /// Time by which it shifts the torque of joint `joint` \[s\].
    pub fn shift(&self, joint: usize) -> f64 {
        if self.law.entry.role == Role::Shift && self.place.touches(joint) {
            self.linear[0]
        } else {
            0.0
        }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.shape.len() + self.linear.len()
    }

    /// Name, or name and place: `ripple of q4`.
    pub fn title(&self, robot: &Robot) -> String {
        let name = self.name();
        match (self.place, self.place.name(robot)) {
            (Place::Pair { of, .. }, Some(on)) => {
                format!("{name} of {on} with {}", robot.joint_names()[of])
            }
            (Place::Geared { other, .. }, Some(motor)) => {
                format!("{name} of {motor} and {}", robot.joint_names()[other])
            }
            (_, Some(place)) => format!("{name} of {place}"),
            (_, None) => name.to_owned(),
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
            let unit = unit.map_or(Unit::One, |key| key.unit);
            EffectNumber {
                key: number.key.to_owned(),
                value: number.value,
                std: covariance.and_then(|c| deviation(&number.slopes, c)),
                unit: unit.in_files(kind, from, torque),
            }
        });
        let place = self.place.keys().into_iter();
        let place = place.map(|(key, value)| EffectNumber {
            key: key.to_owned(),
            value,
            std: None,
            unit: String::new(),
        });
        own.chain(place).collect()
    }
}

/// Standard deviation of a number with these slopes, where it is one.
fn deviation(slopes: &[f64], covariance: &[f64]) -> Option<f64> {
    let k = slopes.len();
    let mut variance = 0.0;
    for a in 0..k {
        for b in 0..k {
            // a variance may be infinite
            if slopes[a] != 0.0 && slopes[b] != 0.0 {
                variance += slopes[a] * slopes[b] * covariance[a * k + b];
            }
        }
    }
    // rounding may leave nothing below nothing; what is not a number is no deviation
    let std = if variance < 0.0 { 0.0 } else { variance.sqrt() };
    std.is_finite().then_some(std)
}
