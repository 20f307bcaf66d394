//! Campaign files: the robot and the logs by role, for `identify`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::document::TomlDocument;
use cft_ident_logs::log::LogSpec;

/// `[logs]`: log specifications by role, paths relative to the campaign file's folder.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CampaignLogs {
    /// One-joint logs for the friction filter; empty: friction is fitted with the inertias.
    #[serde(default)]
    pub friction: Vec<String>,
    /// Logs for the inertial parameters.
    #[serde(default)]
    pub identification: Vec<String>,
    /// Logs that are not used, only reconstructed.
    #[serde(default)]
    pub validation: Vec<String>,
    /// Logs that are never fitted and judge what a diagnosis adds.
    #[serde(default)]
    pub holdout: Vec<String>,
    /// How long the machine had run when a log began [s], by the log's name as it stands above, without a span: what
    /// warms up or drifts goes on from there.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub started: BTreeMap<String, f64>,
}

/// `[lsq] estimator`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorKind {
    /// Rows weighted by each joint's noise.
    #[default]
    Wls,
    /// Ordinary least squares, eq. (41).
    Ols,
    /// Iteratively reweighted.
    Irls,
    /// Instrumental variables.
    Iv,
    /// Output error.
    Oe,
}

impl EstimatorKind {
    /// As files and the command line spell it.
    pub fn name(self) -> &'static str {
        match self {
            EstimatorKind::Wls => "wls",
            EstimatorKind::Ols => "ols",
            EstimatorKind::Irls => "irls",
            EstimatorKind::Iv => "iv",
            EstimatorKind::Oe => "oe",
        }
    }
}

/// `[settings]`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CampaignSettings {
    /// Estimator of the inertial parameters.
    #[serde(default)]
    pub estimator: EstimatorKind,
    /// The parameters of the plain fit alone, without the physically consistent ones beside them.
    #[serde(default)]
    pub unconstrained: bool,
    /// Limit on every joint's relative validation error, a fraction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_relative_error: Option<f64>,
    /// Seed of everything in which chance plays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
}

/// A campaign file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Campaign")]
pub struct CampaignFile {
    /// Robot file, relative to the campaign file's folder, or one that comes with the tool.
    pub robot: String,
    /// Truth file of simulated logs, opened only after everything is decided.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<String>,
    /// The logs.
    #[serde(default)]
    pub logs: CampaignLogs,
    /// Settings.
    #[serde(default)]
    pub settings: CampaignSettings,
}

impl CampaignFile {
    /// Reads a campaign from TOML text; `file` names it in errors.
    pub fn parse(file: &str, text: &str) -> Result<Self, ConfigError> {
        let document = TomlDocument::new(file, text);
        let campaign: Self = document.read()?;
        if campaign.logs.identification.is_empty() {
            return Err(document.missing(
                &["logs", "identification"],
                "the logs that the inertial parameters are fitted to",
            ));
        }
        let logs = &campaign.logs;
        for (role, specs) in [
            ("friction", &logs.friction),
            ("identification", &logs.identification),
            ("validation", &logs.validation),
            ("holdout", &logs.holdout),
        ] {
            for spec in specs {
                if let Err(error) = spec.parse::<LogSpec>() {
                    let problem = "holds a log that cannot be used";
                    return Err(document.value(&["logs", role], problem, &error.to_string()));
                }
            }
        }
        for (log, seconds) in &logs.started {
            if !(*seconds >= 0.0 && seconds.is_finite()) {
                let at = ["logs", "started", log.as_str()];
                return Err(document.value(&at, "is no time", "give seconds, 0 or more"));
            }
        }
        let limit = campaign.settings.max_relative_error;
        document.positive(&["settings", "max_relative_error"], limit)?;
        Ok(campaign)
    }
}
