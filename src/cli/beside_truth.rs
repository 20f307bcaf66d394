//! Parameters of simulated logs against their truth.

use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use super::error::CliError;
use cft_ident_files::config::model_file::Parameter;
use cft_ident_files::config::{self, ModelFile};
use cft_ident_plant::simulate::TruthFile;
use cft_ident_plant::simulate::effects::EffectValue;

/// Parameters against their truth.
#[derive(Debug, Serialize, JsonSchema)]
pub struct BesideTruth {
    parameters: Vec<TrueParameter>,
    /// Effects that the simulated robot has.
    effects: Vec<EffectValue>,
}

/// One parameter against its truth.
#[derive(Debug, Serialize, JsonSchema)]
struct TrueParameter {
    name: String,
    joint: Option<String>,
    theta: Option<u32>,
    value: f64,
    std: Option<f64>,
    truth: f64,
    standard_deviations_off: Option<f64>,
}

impl BesideTruth {
    pub fn of(model: &ModelFile, truth: &TruthFile) -> Self {
        let parameter = |p: &Parameter| {
            let true_value = true_value(Some(truth), p)?;
            Some(TrueParameter {
                name: p.name.clone(),
                joint: p.joint.clone(),
                theta: p.theta,
                value: p.value,
                std: p.std,
                truth: true_value,
                standard_deviations_off: p.std.map(|std| (p.value - true_value) / std),
            })
        };
        BesideTruth {
            parameters: model.parameters.iter().filter_map(parameter).collect(),
            effects: truth.effects.clone(),
        }
    }
}

pub fn load_truth(path: &Path) -> Result<TruthFile, CliError> {
    let unusable = |e: &dyn std::fmt::Display| {
        CliError::input(format!("{}: {e}", path.display())).hint(
            "leave `truth` out of the campaign file, or name a .truth.toml that simulate wrote",
        )
    };
    let text = config::text(path).map_err(|e| unusable(&e))?;
    TruthFile::parse(&text).map_err(|e| unusable(&e.message()))
}

/// The truth of a parameter, where it is known.
pub fn true_value(truth: Option<&TruthFile>, parameter: &Parameter) -> Option<f64> {
    let mut known = truth?.parameters.iter();
    let found = known.find(|p| p.name == parameter.name && p.joint == parameter.joint);
    found.map(|p| p.value)
}
