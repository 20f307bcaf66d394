//! What hangs on a sensor: the result as data.

use schemars::JsonSchema;
use serde::Serialize;

use super::next_pose::NextPose;
use super::touch::ToolTouch;
use super::wrench_log::WrenchReading;

/// A number with its 95 % interval.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ToolNumber {
    /// `bias_fx`.. `bias_tz`, `mass`, `cx`.. `cz`, `Ixx`.. `Izz` about the sensor's origin; of an effect its key.
    pub name: String,
    /// Null where these data do not determine it.
    pub value: Option<f64>,
    /// Standard deviation by the jackknife over blocks of neighbours.
    pub std: Option<f64>,
    pub interval_95: Option<[f64; 2]>,
    /// SI unit.
    pub unit: String,
    /// `identified`, `weak` or `not-identifiable`.
    pub verdict: &'static str,
}

/// Mean norms of the error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct ForceMoment {
    /// \[N\]
    pub force_error: f64,
    /// \[Nm\]
    pub moment_error: f64,
}

impl ForceMoment {
    pub(super) fn of([force_error, moment_error]: [f64; 2]) -> Self {
        Self {
            force_error,
            moment_error,
        }
    }
}

/// Errors on the rows that were fitted and on rows that were not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct ToolErrors {
    pub train: ForceMoment,
    /// Of blocks of ten neighbouring poses, each left out; of the log that was set aside where one is given.
    pub holdout: ForceMoment,
}

/// An effect beside the weight.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ToolStep {
    /// `bias-drift`, `taring`, `leaning-base`, `turned-sensor`, `gains`, `cable-force`.
    pub effect: String,
    /// `confirmed` (it stands in the model), `indicated` or `seen`.
    pub status: &'static str,
    /// Degree of a drift; null of other effects.
    pub degree: Option<usize>,
    /// Deviations that one number as sure as these would stand at.
    pub deviations: f64,
    /// 1 - what chance reaches / what these data reach.
    pub shrinkage: f64,
    pub parameters: Vec<ToolNumber>,
    /// Errors on neighbours left out.
    pub before: ForceMoment,
    pub after: ForceMoment,
    /// When it begins, of a change at an instant: time \[s\], or number of the row from 0.
    pub begins: Option<f64>,
    /// Its size: the change of the bias \[N\], the angle \[rad\], the largest gain error, the stiffness \[N/m\].
    pub size: f64,
}

/// A way to understand the log, and what it leaves.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TriedReading {
    #[serde(flatten)]
    pub reading: WrenchReading,
    /// Mean norm of the force error on neighbours left out \[N\].
    pub force_error: f64,
}

/// Rows that come after those that were fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct ToolForecast {
    /// Part of the rows that was fitted.
    pub fitted: f64,
    /// Errors on the rest by the model without effects of time, and with them.
    pub without: ForceMoment,
    pub with: ForceMoment,
}

/// The result in one sentence.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ToolVerdict {
    /// `determined`, `partly-determined` or `bias-only`.
    pub kind: &'static str,
    pub text: String,
}

/// What hangs on a sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ToolResult {
    pub verdict: ToolVerdict,
    pub rows: usize,
    /// Whether the columns of a moving sensor were fitted.
    pub motion: bool,
    /// How the log is meant, by the data.
    #[serde(flatten)]
    pub reading: WrenchReading,
    /// Whether another way leaves as little.
    pub reading_is_open: bool,
    pub readings: Vec<TriedReading>,
    /// The log holds the force of the sensor on the tool: signs are those of the tool on the sensor.
    pub reaction: bool,
    pub parameters: Vec<ToolNumber>,
    /// Weight \[N\].
    pub weight: ToolNumber,
    /// Mass by differences of neighbours, which no slow drift reaches.
    pub mass_by_differences: ToolNumber,
    /// What these poses do not determine.
    pub undetermined: Vec<String>,
    pub next_pose: Option<NextPose>,
    pub steps: Vec<ToolStep>,
    pub before: ToolErrors,
    pub after: ToolErrors,
    /// Null where no effect of time was found.
    pub forecast: Option<ToolForecast>,
    /// Bias at the last row, where it drifts: force \[N\], then moment \[Nm\].
    pub last_bias: [f64; 6],
    /// Rows that are left out, for something pushed the tool there.
    pub touches: Vec<ToolTouch>,
    /// The parameters with them; none where there are none.
    pub with_touches: Vec<ToolNumber>,
    /// Blocks that intervals are made by.
    pub blocks: usize,
    /// What was left of each row, along the sensor's axes: time or number of the row, then six numbers before and
    /// six after the effects.
    #[serde(skip)]
    pub residuals: Vec<(f64, [f64; 6], [f64; 6])>,
    #[serde(skip)]
    pub has_clock: bool,
}

impl ToolResult {
    /// A parameter's value by its name.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|p| p.name == name)?.value
    }
}
