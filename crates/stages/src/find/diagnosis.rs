//! What `diagnose` found, as a document holds it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::diagnose::{DataFault, Diagnosed};
use super::formulas::{
    EffectValueFound, FormulaResult, JointGain, by_key, formula_result, gain_of_each, numbers_of,
    values_found,
};
use super::next_motion::separating_command;
use super::prediction_only::PredictionOnly;
use crate::input::robot_setup::RobotSetup;
use crate::open_loop::FreeRun;
use crate::setup::{Finding, SetupReport};
use cft_ident_core::diagnose::{
    AcceptedEffect, ChangedTorque, FoundEffect, JointChange, LeftCandidate, NotWritten, Signal,
    SignalDependence, SplitErrors, StepStatus, TorqueChange,
};
use cft_ident_core::effect::ModelEffect;
use cft_ident_core::motion::Summary;
use cft_ident_core::robot::Robot;

/// A diagnosis, or the fault of the data that comes before any physics.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DiagnosisResult {
    pub verdict: DiagnosisVerdict,
    /// The errors that count: null where the data are at fault.
    pub headline: Option<HeadlineErrors>,
    /// Effects that gain on blocks left out, in the order in which they were found.
    pub steps: Vec<DiagnosisStep>,
    /// Terms that are written because they predict, none of them sure by itself.
    pub prediction_only: Vec<PredictionOnly>,
    /// Errors of the model as it was given.
    pub before: Option<SplitErrors>,
    /// Errors of the declared model refitted to these logs, with nothing added.
    pub refitted: Option<SplitErrors>,
    /// Errors of the model with what is named alone.
    pub named: Option<SplitErrors>,
    /// Errors of the model that is written; optimistic where held-out data had a say.
    pub after: Option<SplitErrors>,
    /// Whether held-out data took an effect out of what is written.
    pub holdout_had_a_say: bool,
    /// What the parts of the data are.
    pub blocks: Option<BlocksResult>,
    /// The motion that the models make of the measured torques in windows; null where the logs do not allow it.
    pub free_run: Option<FreeRun>,
    /// Friction that changes from a time on.
    pub changes: Vec<ChangeResult>,
    pub unexplained: Vec<UnexplainedResult>,
    /// Signals that the residual of a joint with structure depends on, the strongest of each joint first.
    pub dependence: Vec<ResidualDependence>,
    /// Formulas of what is left, where they were looked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formulas: Option<Vec<FormulaResult>>,
    /// Candidates that were added, then those of the last round.
    pub candidates: Vec<CandidateResult>,
    /// Blocks of the logs that were not fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set_aside: Option<Vec<BlockAside>>,
    pub processing: Option<Summary>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<DataFault>,
    /// What the check of the set-up found.
    pub setup: Vec<Finding>,
}

/// Root mean square over the joints of their relative errors while they move: on held-out data where there are any.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct HeadlineErrors {
    /// By the given model.
    pub before: f64,
    /// By the model that is written.
    pub after: f64,
    pub held_out: bool,
    /// Rows at rest are not counted.
    pub moving: bool,
}

/// What a diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DiagnosisVerdict {
    EffectsFound,
    NothingMissing,
    UnexplainedResidual,
    DataFault,
}

/// One effect that was added.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DiagnosisStep {
    pub effect: &'static str,
    pub family: &'static str,
    /// Null for what concerns all joints.
    pub joint: Option<String>,
    /// Its numbers in the final model, by key.
    #[serde(serialize_with = "by_key")]
    #[schemars(with = "BTreeMap<String, EffectValueFound>")]
    pub parameters: Vec<(String, EffectValueFound)>,
    /// Candidates that these data do not separate from it, best first.
    #[schemars(length(max = 3))]
    pub alternatives: Vec<&'static str>,
    /// How firm it is.
    pub status: StepStatus,
    /// Whether it stands in the model that is written.
    pub written: bool,
    /// What writes it whatever the judge says, as an option of `diagnose`.
    pub accept: String,
    /// How many deviations one number would have to be off zero to be as sure; from 5 on it is written.
    pub deviations: f64,
    /// Factor of its amplitude in predictions, 0..1.
    pub shrinkage: f64,
    /// Root mean square of its torque at the joint where it is strongest.
    pub torque: EffectValueFound,
    /// Amplitude by block of the data, for pictures: of its largest coefficient.
    pub parts: Vec<f64>,
    /// Gain on blocks left out, joint by joint: squared error in units of the joint's residual variance.
    pub gain: Vec<JointGain>,
    pub accepted_by_user: bool,
    /// A command whose motion would separate it from its alternatives.
    pub separate_command: Option<String>,
    /// What would separate it, in words.
    pub separate_by: Option<&'static str>,
    /// Fraction of the squared error of blocks left out that it removes.
    pub share: f64,
    /// Mean relative error on held-out data without it, the others kept and refitted.
    pub holdout_before: Option<f64>,
    /// The same with it.
    pub holdout_after: Option<f64>,
    /// The mean over the joints rises, or the error of a joint by its whole interval.
    pub holdout_worsened: bool,
    /// Errors on held-out data, joint by joint.
    pub joints: Vec<JointChange>,
}

/// How the data were divided.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct BlocksResult {
    pub count: usize,
    /// With fewer, nothing is written.
    pub least: usize,
    /// Least length of a block \[s\].
    pub block_s: f64,
}

/// Torque of a joint that changes from a time on.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ChangeResult {
    pub joint: String,
    pub log: String,
    /// By the log's own clock \[s\].
    pub at_s: f64,
    /// What of it changes.
    pub of: ChangedTorque,
    /// Change, of friction at the joint's rms speed, in the unit of its torque.
    pub by: f64,
    /// Gain on blocks left out over its standard error.
    pub certainty: f64,
}

/// What is left of a joint's torque.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct UnexplainedResult {
    pub joint: String,
    /// Fraction of the torque's power that is residual above the noise floor.
    pub share: f64,
    /// Power of the residual over that of the floor; null where nothing shows the noise.
    pub over_floor: Option<f64>,
}

/// A dependence of what is left of a joint's torque.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ResidualDependence {
    pub joint: String,
    /// One signal, or two together; of the joint itself where no other is named.
    pub signals: Vec<String>,
    /// Fraction of the residual's square that means over them take up, beyond what chance takes up.
    pub share: f64,
    /// Chance of a dependence as large among all signals where the residual depends on none of them.
    pub p_value: f64,
}

/// A candidate with what became of it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CandidateResult {
    pub effect: &'static str,
    pub joint: Option<String>,
    pub family: &'static str,
    /// Fraction of the squared error of blocks left out that it would remove.
    pub score: Option<f64>,
    /// Whether it stands in the model that is written.
    pub accepted: bool,
    /// Why not; empty where accepted.
    pub reason: String,
}

/// A block of a log that was not fitted.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct BlockAside {
    pub log: String,
    #[serde(rename = "use")]
    #[schemars(extend("enum" = ["holdout"]))]
    pub role: &'static str,
    /// By the log's own clock \[s\].
    pub from_s: f64,
    pub to_s: f64,
}

impl DiagnosisResult {
    /// The same with what the check of the set-up found; a finding for which fits refuse it is a fault of the data.
    pub fn with_setup(self, report: SetupReport) -> Self {
        let fault = report.refusals().next().map(DataFault::of_setup);
        let fault = fault.filter(|_| self.faults.is_empty());
        Self {
            verdict: match fault {
                Some(_) => DiagnosisVerdict::DataFault,
                None => self.verdict,
            },
            faults: self.faults.into_iter().chain(fault).collect(),
            setup: report.findings,
            ..self
        }
    }
}

impl DataFault {
    /// The result of a diagnosis that ends with it.
    pub fn result(&self) -> DiagnosisResult {
        DiagnosisResult {
            verdict: DiagnosisVerdict::DataFault,
            headline: None,
            steps: Vec::new(),
            prediction_only: Vec::new(),
            before: None,
            refitted: None,
            named: None,
            after: None,
            holdout_had_a_say: false,
            blocks: None,
            free_run: None,
            changes: Vec::new(),
            unexplained: Vec::new(),
            dependence: Vec::new(),
            formulas: None,
            candidates: Vec::new(),
            set_aside: None,
            processing: None,
            faults: vec![self.clone()],
            setup: Vec::new(),
        }
    }
}

impl Diagnosed {
    /// Whether there is a verdict of effects, of nothing, or of structure without a name.
    pub fn verdict(&self) -> DiagnosisVerdict {
        let diagnosis = &self.diagnosis;
        if diagnosis.written().next().is_some() {
            DiagnosisVerdict::EffectsFound
        } else if diagnosis.incomplete() || !diagnosis.determined || !diagnosis.long_enough() {
            DiagnosisVerdict::UnexplainedResidual
        } else {
            DiagnosisVerdict::NothingMissing
        }
    }

    /// The errors that count.
    fn headline(&self) -> HeadlineErrors {
        let (before, after) = (&self.diagnosis.before, &self.diagnosis.after);
        let of = |errors: &SplitErrors| {
            let counted = errors.holdout.as_ref().unwrap_or(&errors.train);
            counted.overall.mean_relative_error_moving
        };
        HeadlineErrors {
            before: of(before),
            after: of(after),
            held_out: after.holdout.is_some(),
            moving: true,
        }
    }

    /// The diagnosis as a document holds it.
    pub fn result(&self, setup: &RobotSetup) -> DiagnosisResult {
        let d = &self.diagnosis;
        let names = setup.robot.joint_names();
        let unexplained = &d.left.unexplained;
        let left = unexplained
            .iter()
            .zip(names)
            .map(|(left, joint)| UnexplainedResult {
                joint: joint.clone(),
                share: left.share,
                over_floor: left.over_floor,
            });
        let aside = d.set_aside.iter().map(|a| BlockAside {
            log: self.logs[a.log].clone(),
            role: "holdout",
            from_s: a.from_s,
            to_s: a.to_s,
        });
        let change = |c: &TorqueChange| ChangeResult {
            joint: names[c.joint].clone(),
            log: self.logs[c.log].clone(),
            at_s: c.at_s,
            of: c.of,
            by: c.by,
            certainty: c.certainty,
        };
        let found = d.steps.iter().map(|s| found_candidate(setup, s));
        let others = d.candidates.iter().map(|c| candidate(setup, c));
        DiagnosisResult {
            verdict: self.verdict(),
            headline: Some(self.headline()),
            steps: d.steps.iter().map(|s| self.step(setup, s)).collect(),
            prediction_only: self.prediction_only(setup),
            before: Some(d.before.clone()),
            refitted: Some(d.refitted.clone()),
            named: Some(d.named.clone()),
            after: Some(d.after.clone()),
            holdout_had_a_say: d.holdout_had_a_say(),
            blocks: Some(BlocksResult {
                count: d.blocks,
                least: d.least_blocks,
                block_s: d.block_s,
            }),
            free_run: self.free_run.clone(),
            changes: d.changes.iter().map(change).collect(),
            unexplained: left.collect(),
            dependence: d
                .left
                .dependence
                .iter()
                .map(|d| dependence(names, d))
                .collect(),
            formulas: self.searched.then(|| {
                let all = d.formulas.iter();
                all.map(|f| formula_result(setup, f)).collect()
            }),
            candidates: found.chain(others).collect(),
            set_aside: Some(aside.collect()),
            processing: Some(self.in_memory.summary.clone()),
            faults: Vec::new(),
            setup: Vec::new(),
        }
    }

    fn step(&self, setup: &RobotSetup, step: &FoundEffect) -> DiagnosisStep {
        let robot = &setup.robot;
        let effect = &step.estimate;
        let alternatives: Vec<&str> = step.alternatives.iter().map(|c| c.name()).collect();
        let alike = !alternatives.is_empty();
        // the coefficient that says most
        let size = |k: &usize| effect.linear[*k].abs();
        let largest = (0..effect.linear.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
        let part = |p: &Vec<f64>| p.get(largest?).copied();
        DiagnosisStep {
            effect: effect.name(),
            family: effect.family().name(),
            joint: effect.place.name(robot),
            parameters: values_found(numbers_of(setup, step)).collect(),
            alternatives,
            status: step.status,
            written: step.written.is_some(),
            accept: accept_option(effect, robot),
            deviations: step.deviations,
            shrinkage: step.shrinkage,
            torque: EffectValueFound::of_torque(step.torque, setup.torque_unit_at(effect.place)),
            parts: step.parts.iter().filter_map(part).collect(),
            gain: gain_of_each(robot.joint_names(), &step.gain),
            accepted_by_user: step.accepted_by_user,
            separate_command: alike
                .then(|| separating_command(effect, robot, "MODEL.toml"))
                .flatten(),
            separate_by: alike.then_some(effect.law.entry.separate_by),
            share: step.share,
            holdout_before: step.holdout.map(|h| h[0]),
            holdout_after: step.holdout.map(|h| h[1]),
            holdout_worsened: step.joints.iter().any(|j| j.worsened),
            joints: step.joints.clone(),
        }
    }
}

fn dependence(names: &[String], found: &SignalDependence) -> ResidualDependence {
    let signals = found.signals.iter();
    ResidualDependence {
        joint: names[found.joint].clone(),
        signals: signals
            .map(|s| signal_words(names, found.joint, *s))
            .collect(),
        share: found.share,
        p_value: found.p_value,
    }
}

/// A signal in words; of another joint than `own` with its name.
pub fn signal_words(names: &[String], own: usize, signal: Signal) -> String {
    let of = |what: &str, j: usize| match j == own {
        true => what.to_owned(),
        false => format!("{what} of {}", names[j]),
    };
    match signal {
        Signal::Position(j) => of("position", j),
        Signal::Speed(j) => of("speed", j),
        Signal::Acceleration => "acceleration".to_owned(),
        Signal::Load => "load".to_owned(),
        Signal::Direction => "direction".to_owned(),
        Signal::SinceReversal => "time since reversal".to_owned(),
        Signal::Temperature(j) => of("temperature", j),
        Signal::Time => "time".to_owned(),
    }
}

fn found_candidate(setup: &RobotSetup, step: &FoundEffect) -> CandidateResult {
    let reason = match step.left {
        None => "",
        Some(NotWritten::HeldOut) => "held-out data are worse with it",
        Some(NotWritten::Bound) => "a bound of its numbers takes all of it beside the others",
        Some(NotWritten::Small) => "it changes no error that one would notice",
        Some(NotWritten::Unsure) => "its amplitude is too uncertain",
    };
    CandidateResult {
        effect: step.estimate.name(),
        joint: step.estimate.place.name(&setup.robot),
        family: step.estimate.family().name(),
        score: Some(step.share),
        accepted: step.written.is_some(),
        reason: reason.to_owned(),
    }
}

/// The option of `diagnose` that writes an effect.
pub fn accept_option(effect: &ModelEffect, robot: &Robot) -> String {
    format!("--accept {}", AcceptedEffect::of(effect, robot))
}

fn candidate(setup: &RobotSetup, c: &LeftCandidate) -> CandidateResult {
    let family = c
        .effect
        .as_ref()
        .map_or(c.law.entry.family(), |e| e.family());
    CandidateResult {
        effect: c.law.entry.name,
        joint: c.place.name(&setup.robot),
        family: family.name(),
        score: c.score,
        accepted: false,
        reason: c.reason.clone(),
    }
}
