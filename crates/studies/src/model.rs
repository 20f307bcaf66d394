//! What a model file says, read as any program could read it.

use std::path::Path;

use serde::Deserialize;

use crate::study::StudyError;

#[derive(Debug, Deserialize)]
pub struct Model {
    #[serde(default)]
    pub parameter: Vec<Parameter>,
    pub covariance: Option<Covariance>,
    #[serde(default)]
    pub effect: Vec<toml::Value>,
}

#[derive(Debug, Deserialize)]
pub struct Parameter {
    pub name: String,
    pub joint: Option<String>,
    pub value: Option<f64>,
    pub verdict: Option<String>,
}

#[derive(Debug, Deserialize)]
pub struct Covariance {
    pub names: Vec<String>,
    pub matrix: Vec<Vec<f64>>,
}

impl Model {
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let text = crate::files::read(path)?;
        toml::from_str(&text).map_err(|error| StudyError::Line {
            path: path.to_owned(),
            line: 0,
            message: error.to_string(),
        })
    }

    fn of(&self, name: &str, joint: &str) -> Option<(f64, bool)> {
        let own = |p: &&Parameter| p.name == name && p.joint.as_deref() == Some(joint);
        let found = self.parameter.iter().find(own)?;
        Some((found.value?, found.verdict.as_deref() == Some("identified")))
    }

    fn covariance(&self, a: &str, b: &str) -> Option<f64> {
        let covariance = self.covariance.as_ref()?;
        let at = |name: &str| covariance.names.iter().position(|n| n == name);
        covariance.matrix.get(at(a)?)?.get(at(b)?).copied()
    }

    /// Friction at a speed with its deviation, where both of its numbers are identified.
    pub fn friction(&self, joint: &str, speed: f64) -> Option<(f64, f64)> {
        let (viscous, one) = self.of("viscous", joint)?;
        let (coulomb, two) = self.of("coulomb", joint)?;
        if !(one && two) {
            return None;
        }
        let (v, c) = (format!("viscous:{joint}"), format!("coulomb:{joint}"));
        let (d, s) = (speed, speed.signum());
        let variance = d * d * self.covariance(&v, &v)?
            + 2.0 * d * s * self.covariance(&v, &c)?
            + self.covariance(&c, &c)?;
        Some((viscous * d + coulomb * s, variance.max(0.0).sqrt()))
    }
}
