//! Numbers of an effect by their keys, as a model file has them, and why they cannot be used.

use crate::explain::Explain;
use std::collections::BTreeMap;

/// Why an effect of a model file cannot be used.
#[derive(Debug, Clone, PartialEq, Explain, thiserror::Error)]
pub enum EffectError {
    #[explain("effect `{name}` is not known", "known are {known}")]
    Unknown { name: String, known: String },
    #[explain("effect `{name}`: this robot has no joint `{joint}`", "it has {known}")]
    Joint {
        name: String,
        joint: String,
        known: String,
    },
    #[explain("no code is known for the effect {effect}")]
    NoCode { effect: String },
    #[explain("effect `{name}` cannot sit there on this robot")]
    Place { name: String },
    #[explain("effect `{name}` lacks its parameter `{key}`", "it takes {known}")]
    Key {
        name: String,
        key: String,
        known: String,
    },
    #[explain("effect `{name}`: `{key}` = {value} is not a usable number")]
    Value {
        name: String,
        key: String,
        value: f64,
    },
}

/// What a file gives for the keys of an effect.
#[derive(Debug, Clone, Copy)]
pub struct EffectValues<'a> {
    /// The effect's name.
    pub effect: &'a str,
    /// The keys that it takes, as errors list them.
    pub known: &'a [&'a str],
    pub given: &'a BTreeMap<String, f64>,
}

impl EffectValues<'_> {
    /// The number of a key.
    ///
    /// # Errors
    /// [`EffectError::Key`] where it is not given, [`EffectError::Value`] where it is not finite.
    pub fn get(&self, key: &str) -> Result<f64, EffectError> {
        let value = *self.given.get(key).ok_or_else(|| EffectError::Key {
            name: self.effect.to_owned(),
            key: key.to_owned(),
            known: self.known.join(", "),
        })?;
        match value.is_finite() {
            true => Ok(value),
            false => Err(self.unusable(key, value)),
        }
    }

    /// The same of a key that may be left out.
    pub(crate) fn get_or(&self, key: &str, absent: f64) -> Result<f64, EffectError> {
        match self.given.contains_key(key) {
            true => self.get(key),
            false => Ok(absent),
        }
    }

    /// Refusal of a number.
    pub fn unusable(&self, key: &str, value: f64) -> EffectError {
        EffectError::Value {
            name: self.effect.to_owned(),
            key: key.to_owned(),
            value,
        }
    }
}
