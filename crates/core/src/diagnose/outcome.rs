//! What a diagnosis finds.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Serialize;

use super::problem::data_split::SetAside;
use super::problem::unknowns::Unknown;
use super::unexplained::UnexplainedResidual;
use super::unexplained::dependence::SignalDependence;
use super::unexplained::errors::{JointChange, UseErrors};
use super::unexplained::signal::Signal;
use crate::effect::formula::FormulaDefinition;
use crate::effect::{AugmentedModel, EffectPlace, Law, ModelEffect};
use crate::judge::ErrorGain;
use crate::robot::FormulaSignal;

/// How firm an effect is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StepStatus {
    /// Its amplitude is eleven of its deviations or more off zero, and it is written.
    Confirmed,
    /// Five deviations or more: it is written in part.
    Indicated,
    /// It gains on blocks left out, and is not written.
    Seen,
}

/// Why an effect is not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotWritten {
    /// Its amplitude is too uncertain, or it can be measured and is not sure enough.
    Unsure,
    /// Beside the others a bound takes all of it, or what it cannot be without; or its shape is at an end of its range,
    /// beyond which another law begins.
    Bound,
    /// It takes off no joint's error what one would notice.
    Small,
    /// Held-out data are worse with it.
    HeldOut,
}

/// One effect that gained on blocks left out.
#[derive(Debug, Clone)]
pub struct FoundEffect {
    /// With the amplitude of the joint fit of all effects that stand; of one that does not, of the fit of these and it.
    pub estimate: ModelEffect,
    /// Covariance of its (shape, linear), row-major; a shape that is not free has none.
    pub covariance: Vec<f64>,
    /// Its place in the effects of the model that is written.
    pub written: Option<usize>,
    pub status: StepStatus,
    /// Why it is not written, where it is not.
    pub left: Option<NotWritten>,
    /// Factor of its amplitude in predictions, 0..1.
    pub shrinkage: f64,
    /// How many deviations one number would have to be off zero to be as sure.
    pub deviations: f64,
    /// Root mean square of its torque at the joint where it is strongest, and the standard deviation [N or Nm].
    pub torque: [f64; 2],
    /// Number of blocks that hold the information on it.
    pub blocks: f64,
    /// Amplitudes of its coefficients by block of the data.
    pub parts: Vec<Vec<f64>>,
    /// Gain on blocks left out, beside all that stand.
    pub gain: ErrorGain,
    /// Part of the squared error of these blocks that it takes off.
    pub share: f64,
    /// Effects that these data do not separate from it, best first.
    pub alternatives: Vec<ModelEffect>,
    /// Mean relative error on held-out data without and with it.
    pub holdout: Option<[f64; 2]>,
    /// The same joint by joint.
    pub joints: Vec<JointChange>,
    /// The user wants it whatever the judge says.
    pub accepted_by_user: bool,
    /// The written model without it, all else fitted anew by the judge's sums; none of one that is not written.
    pub without: Option<AugmentedModel>,
}

impl FoundEffect {
    /// Whether held-out data took it out.
    pub fn vetoed(&self) -> bool {
        self.left == Some(NotWritten::HeldOut)
    }
}

/// A term that is written because it predicts, shrunk by what of it may be chance; it is no statement on the machine.
#[derive(Debug, Clone)]
pub struct PredictingTerm {
    /// With the amplitude of the fit of all that is written.
    pub estimate: ModelEffect,
    /// Its place in the effects of the model that is written.
    pub written: usize,
    /// Part of the amplitude that is written, 0..1.
    pub shrinkage: f64,
    /// How many deviations one number would have to be off zero to be as sure.
    pub deviations: f64,
    /// Root mean square of its torque at the joint where it is strongest, and the standard deviation [N or Nm].
    pub torque: [f64; 2],
    /// Gain on blocks left out, beside all that stand.
    pub gain: ErrorGain,
    /// Root mean square of its joint's torque error on held-out rows without and with it, the others refitted [N or Nm];
    /// none where nothing is held out or it acts on several joints.
    pub held_out: Option<[f64; 2]>,
}

/// A candidate that was not chosen.
#[derive(Debug, Clone)]
pub struct LeftCandidate {
    pub law: &'static Law,
    pub place: EffectPlace,
    /// In its best shape; none where it was not tried.
    pub effect: Option<ModelEffect>,
    /// Part of the squared error of blocks left out that it would take off.
    pub score: Option<f64>,
    pub reason: String,
}

/// Errors on the logs that were fitted and on held-out data.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SplitErrors {
    pub train: UseErrors,
    pub holdout: Option<UseErrors>,
}

/// What of a joint's torque changes from a time on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChangedTorque {
    /// Its friction.
    Friction,
    /// A constant torque: the zero of the channel.
    Offset,
}

/// Change of a joint's torque from a time on.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueChange {
    pub joint: usize,
    pub log: usize,
    /// By the log's own clock \[s\].
    pub at_s: f64,
    pub of: ChangedTorque,
    /// Change of the constant torque, or of the friction at the joint's rms speed [N or Nm].
    pub by: f64,
    /// Gain on blocks left out over its standard error.
    pub certainty: f64,
}

/// What becomes of a formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FormulaEnd {
    /// It gains on blocks left out, its amplitude is sure, no joint gets worse, and chance makes none as good.
    Found,
    /// Searches where whole parts have another sign find as much.
    Chance,
    /// Its amplitude is too uncertain, or it gains too little beside the rest.
    Unsure,
    /// A joint gets worse by it on data set aside.
    Worse,
}

/// The formula of a joint.
#[derive(Debug, Clone)]
pub struct FoundFormula {
    pub joint: usize,
    pub end: FormulaEnd,
    /// As an effect of the user's own.
    pub definition: FormulaDefinition,
    /// Its numbers, with what the judge says of it.
    pub step: FoundEffect,
    /// Chance of a gain as large where whole parts of the residual have another sign.
    pub p_value: f64,
    /// Part of the squared error of blocks left out that it takes off.
    pub share: f64,
    pub symmetry: FormulaSymmetry,
    /// What its terms are functions of.
    pub signals: Vec<(FormulaSignal, usize)>,
    /// None where it is not sure enough, or nothing is held out.
    pub picture: Option<FormulaPicture>,
    /// Root mean square of the residual without and with it within 0.1 s of a reversal, on the same data.
    pub at_reversals: Option<[f64; 2]>,
    /// Effects of the catalogue at the joint in whose place it stands.
    pub in_place_of: Vec<ModelEffect>,
}

/// Parts of what a formula adds, by its terms' squares.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Symmetry")]
pub struct FormulaSymmetry {
    /// It flips where the motion is reversed: friction.
    pub odd: f64,
    /// It goes round with the joint's position: a transmission.
    pub periodic: f64,
    /// It goes by an acceleration: an inertia.
    pub inertial: f64,
    /// It takes a signal of another joint: a coupling.
    pub coupled: f64,
}

/// What a formula is drawn over.
#[derive(Debug, Clone, PartialEq)]
pub struct FormulaPicture {
    pub over: Signal,
    /// Signal, residual without the formula, torque of the formula.
    pub rows: Vec<[f64; 3]>,
}

/// What a model leaves of the torques.
#[derive(Debug, Clone)]
pub struct WhatIsLeft {
    pub unexplained: Vec<UnexplainedResidual>,
    /// What the residuals of joints with structure depend on, the strongest of each joint first.
    pub dependence: Vec<SignalDependence>,
    /// Part of the structure of each joint's residual that is unexplained on the fitted logs.
    pub part_unexplained: Vec<f64>,
}

/// The outcome.
pub struct Diagnosis {
    /// The model that is written, with the declared numbers by the judge's sums: the given one where nothing is.
    pub model: AugmentedModel,
    /// What torques are computed with.
    pub in_use: AugmentedModel,
    /// Unknowns of the declared model, and their covariance with every effect of the estimates, by the block jackknife.
    pub unknowns: Vec<Unknown>,
    pub covariance: DMatrix<f64>,
    /// What the uncertainty of the effects' amplitudes adds to the covariance of the unknowns beside them.
    pub by_effects: DMatrix<f64>,
    /// How far the unknowns beside the whole effects are from those beside the parts that predict.
    pub to_estimate: DVector<f64>,
    /// The declared parameters of the joint fit with every effect that stands, unshrunk.
    pub estimates: AugmentedModel,
    pub steps: Vec<FoundEffect>,
    /// Terms that are written because they predict, and not because any of them is sure.
    pub predicting: Vec<PredictingTerm>,
    /// Number of independent stretches of motion, where they are too few for that.
    pub too_few_stretches: Option<usize>,
    pub candidates: Vec<LeftCandidate>,
    pub before: SplitErrors,
    /// The declared model refitted to these logs, with nothing added.
    pub refitted: SplitErrors,
    /// By the model with what is named alone.
    pub named: SplitErrors,
    /// By the model that is written.
    pub after: SplitErrors,
    /// What the model that is written leaves.
    pub left: WhatIsLeft,
    /// The same of the declared model alone, where something was added to it.
    pub left_alone: Option<WhatIsLeft>,
    pub set_aside: Vec<SetAside>,
    pub changes: Vec<TorqueChange>,
    /// Root mean square of the filtered residual per joint.
    pub residual_std: Vec<f64>,
    /// Logs that were fitted: the first ones.
    pub fitted_logs: usize,
    /// Neighbouring pieces of the rows that intervals of errors draw together.
    pub together: usize,
    /// Blocks of the data, and the least length of one \[s\].
    pub blocks: usize,
    pub block_s: f64,
    /// With fewer blocks nothing is written.
    pub least_blocks: usize,
    /// Whether the declared model explains more of blocks left out than no torque does.
    pub determined: bool,
    /// Formulas of what is left, where they were looked for.
    pub formulas: Vec<FoundFormula>,
}

impl Diagnosis {
    /// Whether something is missing yet: more than a little is left above the noise, or a torque changes from a time on.
    pub fn incomplete(&self) -> bool {
        self.left
            .unexplained
            .iter()
            .any(UnexplainedResidual::matters)
            || !self.changes.is_empty()
    }

    /// Joints whose residual still holds structure.
    pub fn structured_joints(&self) -> impl Iterator<Item = usize> {
        let left = &self.left.unexplained;
        (0..left.len()).filter(|j| left[*j].is_structure())
    }

    /// Effects of the written model, with what is known of them.
    pub fn written(&self) -> impl Iterator<Item = &FoundEffect> {
        self.steps.iter().filter(|step| step.written.is_some())
    }

    /// Whether held-out data took an effect out of what is written.
    pub fn holdout_had_a_say(&self) -> bool {
        self.steps.iter().any(FoundEffect::vetoed)
    }

    /// Whether the model that is written is another than the given one.
    pub fn changes_model(&self) -> bool {
        self.written().next().is_some() || !self.predicting.is_empty()
    }

    /// Whether there is data enough for anything to be written.
    pub fn long_enough(&self) -> bool {
        self.blocks >= self.least_blocks
    }
}

/// What is made of the effects that were chosen.
#[derive(Clone)]
pub struct JudgedEffects {
    pub steps: Vec<FoundEffect>,
    /// With the declared numbers by the judge's sums; the given model where nothing is written.
    pub proposed: AugmentedModel,
    /// With what is named alone, as torques are computed; the given model where nothing is.
    pub named: AugmentedModel,
    /// The same with what is written for prediction alone.
    pub written: AugmentedModel,
    /// What is written for prediction alone.
    pub predicting: Vec<PredictingTerm>,
    /// Number of independent stretches of motion, where they are too few for anything to be written for prediction alone.
    pub too_few_stretches: Option<usize>,
    /// The joint fit with every effect that stands.
    pub estimates: AugmentedModel,
    pub covariance: DMatrix<f64>,
    /// What the effects' amplitudes add to the covariance of the unknowns.
    pub by_effects: DMatrix<f64>,
    /// From the unknowns beside the parts of effects that predict to those beside whole ones.
    pub to_estimate: DVector<f64>,
}
