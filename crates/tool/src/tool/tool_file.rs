//! TOOL.toml: what hangs on a sensor, for `export` and for people.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::ToolError;
use super::result::{ToolNumber, ToolResult, ToolStep};
use super::wrench_log::{OrientationIs, WrenchFrame};
use cft_ident_logs::log::Provenance;

/// A parameter in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolParameter {
    pub name: String,
    /// Absent where the poses did not determine it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_95: Option<[f64; 2]>,
    /// SI unit.
    pub unit: String,
}

/// `[tool]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolSection {
    /// Frame along whose axes wrenches are logged.
    pub frame: WrenchFrame,
    /// What the logged orientation is.
    pub orientation: OrientationIs,
    /// Wrenches are those of the sensor on the tool.
    pub reaction: bool,
    /// Free fall along -z of the base \[m/s^2\].
    pub gravity: f64,
    /// Mean norm of the force error on poses left out \[N\].
    pub force_error: f64,
}

/// An effect that was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolEffect {
    pub name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degree: Option<usize>,
    /// Values by key, in the units of `unit`.
    pub parameters: BTreeMap<String, f64>,
}

/// Where the file came from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolProvenance {
    pub version: String,
    pub command: String,
    #[serde(default)]
    pub inputs: Vec<Provenance>,
}

/// The file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolFile {
    pub tool: ToolSection,
    pub parameter: Vec<ToolParameter>,
    /// Bias at the end of the log \[N, Nm\]: what a sensor has that drifts.
    pub last_bias: [f64; 6],
    #[serde(default)]
    pub effect: Vec<ToolEffect>,
    #[serde(default)]
    pub provenance: ToolProvenance,
}

impl ToolFile {
    /// The file of a result.
    pub fn of(result: &ToolResult, command: &str, inputs: &[Provenance]) -> Self {
        let parameter = |p: &ToolNumber| ToolParameter {
            name: p.name.clone(),
            value: p.value,
            std: p.std,
            interval_95: p.interval_95,
            unit: p.unit.clone(),
        };
        let stands = result
            .steps
            .iter()
            .filter(|step| step.status == "confirmed");
        let effect = |step: &ToolStep| ToolEffect {
            name: step.effect.clone(),
            degree: step.degree,
            parameters: step
                .parameters
                .iter()
                .filter_map(|p| Some((p.name.clone(), p.value?)))
                .collect(),
        };
        Self {
            tool: ToolSection {
                frame: result.reading.frame,
                orientation: result.reading.orientation,
                reaction: result.reaction,
                gravity: super::GRAVITY,
                force_error: result.after.holdout.force_error,
            },
            parameter: result.parameters.iter().map(parameter).collect(),
            last_bias: result.last_bias,
            effect: stands.map(effect).collect(),
            provenance: ToolProvenance {
                version: env!("CARGO_PKG_VERSION").to_owned(),
                command: command.to_owned(),
                inputs: inputs.to_vec(),
            },
        }
    }

    /// Its text.
    pub fn to_toml(&self) -> Result<String, ToolError> {
        const HEAD: &str = "# What hangs on a wrist sensor: mass, centre of gravity (along the sensor's axes, from its origin), bias.\n\n";
        let failed = |e: toml::ser::Error| ToolError::File {
            what: "a tool".to_owned(),
            problem: e.to_string(),
        };
        Ok(HEAD.to_owned() + &toml::to_string(self).map_err(failed)?)
    }

    /// Reads a text.
    pub fn parse(file: &str, text: &str) -> Result<Self, ToolError> {
        toml::from_str(text).map_err(|e| ToolError::File {
            what: file.to_owned(),
            problem: e.to_string(),
        })
    }

    /// Whether a text is that of a tool and not of a robot's model.
    pub fn is_one(text: &str) -> bool {
        text.lines().any(|line| line.trim() == "[tool]")
    }

    /// A number by its name.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.parameter.iter().find(|p| p.name == name)?.value
    }

    /// Mass and centre, where the poses determined both.
    pub fn body(&self) -> Option<(f64, [f64; 3])> {
        let centre = [self.number("cx")?, self.number("cy")?, self.number("cz")?];
        Some((self.number("mass")?, centre))
    }

    /// Inertia about the centre: Ixx Ixy Ixz Iyy Iyz Izz, where it was determined and can be one.
    pub fn inertia(&self) -> Option<[f64; 6]> {
        let (m, c) = self.body()?;
        let names = ["Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];
        let mut about = [0.0; 6];
        for (x, name) in about.iter_mut().zip(names) {
            *x = self.number(name)?;
        }
        // Steiner, back from the sensor's origin
        let square: f64 = c.iter().map(|x| x * x).sum();
        let places = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        for (x, (i, j)) in about.iter_mut().zip(places) {
            *x -= m * (if i == j { square } else { 0.0 } - c[i] * c[j]);
        }
        (about[0] > 0.0 && about[3] > 0.0 && about[5] > 0.0).then_some(about)
    }
}
