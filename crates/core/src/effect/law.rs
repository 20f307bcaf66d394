//! How the estimator sees an effect: columns of torque along a recorded motion, linear in some parameters and
//! shaped by others.

use super::formula::FormulaEffect;
use super::{
    CodeSite, EffectError, EffectPlace, EffectValues, Entry, Family, Instant, LogCoverage,
    RobotProperty, ShapeSpan, Unit,
};
use crate::robot::Robot;
use crate::robot::model::JointFriction;

/// Shapes to begin the search from, or what the data lack for the effect.
pub type ShapeStarts = Result<Vec<Vec<f64>>, String>;

/// Columns of a joint at one sample: what the law keeps from the one before, and a number for each coefficient, 0 before.
pub(super) type Columns = fn(&Instant, &mut [f64], &mut [f64]);

/// The estimator's law of an effect. What a formula may stand for is asked of its methods.
pub struct Law {
    pub entry: &'static Entry,
    /// Whether it can sit at one of the entry's places on this robot.
    pub(super) fits: fn(&Robot, &[JointFriction], EffectPlace) -> bool,
    /// Parameters that shape the columns, searched.
    pub shape: &'static [&'static str],
    /// Coefficients of the columns, one each.
    pub linear: &'static [&'static str],
    /// Shapes to try on these data, or what they lack.
    pub(super) starts: fn(&LogCoverage, EffectPlace) -> ShapeStarts,
    /// Range of each shape parameter that is refined, the first of the shape, about a shape on these data.
    pub(super) limits: fn(&LogCoverage, EffectPlace, &[f64]) -> Vec<ShapeSpan>,
    pub(super) columns: Columns,
    /// How many numbers it keeps from sample to sample, NaN at the begin of a stretch, where a column depends on samples
    /// before it.
    pub memory: Option<usize>,
    /// Direction of the joint's friction at a speed, where the effect makes it smooth: shape, speed.
    pub direction: Option<fn(&[f64], f64) -> f64>,
    /// Family and whether it is the same torque at rest, where these hang on the shape.
    pub varied: Option<FamilyByShape>,
    /// Unit of the keys whose unit is the signal's, by the shape.
    pub(super) signal_unit: Option<fn(&[f64]) -> Unit>,
    /// Part of a shape by which it is moved for the slope of its torque.
    pub slope_step: f64,
    /// Formulas of a user's own, in place of the functions above.
    pub formula: Option<&'static FormulaEffect>,
    /// What it adds to generated code; formulas write their own.
    pub(super) code: Option<fn(&mut CodeSite)>,
    /// The property of links, drives or the base that it is, where it is one: place, shape, coefficients.
    pub(super) property: fn(EffectPlace, &[f64], &[f64]) -> Option<RobotProperty>,
    /// Between the entry's keys and shape and coefficients, where they are not the same.
    pub(super) reparametrised: Option<EffectReparametrisation>,
}

/// Family and whether it is the same torque at rest, by the shape.
pub type FamilyByShape = fn(&[f64]) -> (Family, bool);

/// Two ways to say the numbers of one effect.
pub(super) struct EffectReparametrisation {
    /// Shape and coefficients of the keys in a file.
    pub of_keys: fn(&EffectValues) -> Result<[Vec<f64>; 2], EffectError>,
    /// The keys, in the order in which they are reported, of shape and coefficients.
    pub to_keys: fn(&[f64], &[f64]) -> Vec<KeyValue>,
}

/// A key's number.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyValue {
    pub key: &'static str,
    pub value: f64,
    /// Its derivatives by shape, then coefficients.
    pub slopes: Vec<f64>,
}

impl Law {
    /// A law without shape, at every place of its entry, on any data.
    pub(super) const fn linear(
        entry: &'static Entry,
        linear: &'static [&'static str],
        columns: Columns,
    ) -> Self {
        Law {
            entry,
            fits: |_, _, _| true,
            shape: &[],
            linear,
            starts: |_, _| Ok(vec![Vec::new()]),
            limits: |_, _, _| Vec::new(),
            columns,
            memory: None,
            direction: None,
            varied: None,
            signal_unit: None,
            slope_step: 1e-4,
            formula: None,
            code: None,
            property: |_, _, _| None,
            reparametrised: None,
        }
    }

    /// Where on this robot it can sit.
    pub fn places(&self, robot: &Robot, laws: &[JointFriction]) -> Vec<EffectPlace> {
        let mut places = self.entry.places.on(robot);
        let fits = |place: EffectPlace| match self.formula {
            Some(formula) => formula.fits(place),
            None => (self.fits)(robot, laws, place),
        };
        places.retain(|place| fits(*place));
        places
    }

    /// Its numbers by the entry's keys.
    pub(crate) fn keys(&self, shape: &[f64], linear: &[f64]) -> Vec<KeyValue> {
        if let Some(with) = &self.reparametrised {
            return (with.to_keys)(shape, linear);
        }
        let keys = self.shape.iter().chain(self.linear);
        let values = shape.iter().chain(linear).enumerate();
        let count = shape.len() + linear.len();
        keys.zip(values)
            .map(|(key, (i, value))| KeyValue::plain(key, *value, i, count))
            .collect()
    }

    /// Shape and coefficients of numbers in a file.
    pub(super) fn of_keys(&self, values: &EffectValues) -> Result<[Vec<f64>; 2], EffectError> {
        if let Some(with) = &self.reparametrised {
            return (with.of_keys)(values);
        }
        let value = |key: &&str| match self.entry.key(key).is_some_and(|key| key.optional) {
            true => values.get_or(key, 0.0),
            false => values.get(key),
        };
        let [shape, linear]: [Result<_, _>; 2] =
            [self.shape, self.linear].map(|keys| keys.iter().map(value).collect());
        Ok([shape?, linear?])
    }

    /// Names of its keys in files.
    pub fn key_names(&self) -> Vec<&'static str> {
        match self.reparametrised {
            None => self.shape.iter().chain(self.linear).copied().collect(),
            Some(_) => self.entry.keys.iter().map(|key| key.name).collect(),
        }
    }
}

/// Whether a joint's declared friction jumps at rest, or there is none: a smooth law has a fall at low speed of its own.
pub(super) fn jumps_or_is_none(_: &Robot, laws: &[JointFriction], place: EffectPlace) -> bool {
    let law = place.joint().map(|j| laws[j]);
    !matches!(law, Some(JointFriction::DoubleTanh(_)))
}

impl KeyValue {
    /// That of parameter `i` itself, of `count` parameters.
    pub fn plain(key: &'static str, value: f64, i: usize, count: usize) -> Self {
        let mut slopes = vec![0.0; count];
        slopes[i] = 1.0;
        KeyValue { key, value, slopes }
    }
}

impl std::fmt::Debug for Law {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.entry.name)
    }
}
