//! What `diagnose` found, as a document holds it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::diagnose::{DataFault, Diagnosed};
use super::logged_robot::LoggedRobot;
use super::separate::separating_command;
use crate::setup::Finding;
use cft_ident_core::diagnose::{
    AcceptedEffect, Candidate, Dependence, Errors, JointChange, LogRole, Signal, SplitErrors,
    StepStatus, Turn,
};
use cft_ident_core::effect::disturbance;
use cft_ident_core::motion::Summary;

/// A diagnosis, or the fault of the data that comes before any physics.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DiagnosisResult {
    pub verdict: DiagnosisVerdict,
    /// Effects in the order in which they were added.
    pub steps: Vec<DiagnosisStep>,
    /// How the search came to them, turn by turn: what was added, dropped, or put in the place of others.
    pub path: Vec<SearchTurn>,
    /// Errors of the model as it was given.
    pub before: Option<ErrorsBySide>,
    /// Errors of the refined model.
    pub after: Option<ErrorsBySide>,
    pub unexplained: Vec<UnexplainedResult>,
    /// Signals that the residual of a joint with structure depends on, the strongest of each joint first.
    pub dependence: Vec<ResidualDependence>,
    /// Candidates that were added, then those of the last round.
    pub candidates: Vec<CandidateResult>,
    /// Blocks of the logs that were not fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set_aside: Option<Vec<BlockAside>>,
    /// Disturbances that were cut out of the logs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episodes: Option<Vec<EpisodeResult>>,
    pub processing: Option<Summary>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<DataFault>,
    /// What the check of the set-up found.
    pub setup: Vec<Finding>,
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
    /// How firm its name is.
    pub status: StepStatus,
    /// Whether the status is `assured`.
    pub assured: bool,
    /// A command whose motion would separate it from its alternatives.
    pub separate_command: Option<String>,
    /// What would separate it, in words.
    pub separate_by: Option<&'static str>,
    /// Share of its torque that no declared term can take.
    pub unique_share: Option<f64>,
    /// Positive is an improvement.
    pub delta_bic: Option<f64>,
    /// Fraction of the cross-validated squared error that it removes.
    pub cv_gain: Option<f64>,
    pub effective_samples: Option<f64>,
    /// Chance that a model which lacks nothing, measured and processed as these logs were, shows a candidate as good
    /// as this one or better, among all candidates: by placebos.
    pub p_value: Option<f64>,
    /// Mean relative error on held-out data, before the step.
    pub holdout_before: Option<f64>,
    /// The same after it.
    pub holdout_after: Option<f64>,
    /// The mean over the joints rises, or the error of a joint by its whole interval.
    pub holdout_worsened: bool,
    /// Errors on held-out data, joint by joint.
    pub joints: Vec<JointChange>,
}

/// One turn of the search.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SearchTurn {
    pub action: TurnAction,
    /// Effects that came, each with its place.
    pub come: Vec<String>,
    /// Effects that went.
    pub gone: Vec<String>,
}

/// What a turn of the search does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TurnAction {
    Added,
    /// It does not stand beside the others, or its numbers do not hold with them.
    Dropped,
    /// Others say the same with fewer numbers, or say more.
    Replaced,
}

impl From<&Turn> for SearchTurn {
    fn from(turn: &Turn) -> Self {
        let (action, come, gone) = match turn.clone() {
            Turn::Added(effect) => (TurnAction::Added, vec![effect], Vec::new()),
            Turn::Dropped(effect) => (TurnAction::Dropped, Vec::new(), vec![effect]),
            Turn::Replaced { gone, come } => (TurnAction::Replaced, come, gone),
        };
        SearchTurn { action, come, gone }
    }
}

/// One number of an effect.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EffectValueFound {
    pub value: f64,
    pub std: Option<f64>,
    pub unit: String,
    /// It is held at a bound, for these data do not tell it.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub bound: bool,
}

/// Errors on the logs that were fitted and on held-out data.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ErrorsBySide {
    pub train: Errors,
    pub holdout: Option<Errors>,
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
    /// Fraction of the cross-validated squared error that it would remove.
    pub score: Option<f64>,
    pub unique_share: Option<f64>,
    pub delta_bic: Option<f64>,
    pub p_value: Option<f64>,
    pub accepted: bool,
    /// Whether the data tell it from chance.
    pub significant: bool,
    /// Why not; empty where accepted.
    pub reason: String,
}

/// A block of a log that was not fitted.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct BlockAside {
    pub log: String,
    #[serde(rename = "use")]
    #[schemars(extend("enum" = ["veto", "holdout"]))]
    pub role: &'static str,
    /// By the log's own clock \[s\].
    pub from_s: f64,
    pub to_s: f64,
}

/// A disturbance that was cut out.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EpisodeResult {
    pub effect: &'static str,
    pub family: &'static str,
    /// The joint on which it stands out most.
    pub joint: String,
    pub log: String,
    /// By the log's own clock \[s\].
    pub from_s: f64,
    pub to_s: f64,
    /// Squared residual over the usual one.
    pub over: f64,
}

/// A list of keys and values as a map, in its order.
fn by_key<S: Serializer, T: Serialize>(
    list: &[(String, T)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(list.iter().map(|(key, value)| (key, value)))
}

impl From<&SplitErrors> for ErrorsBySide {
    fn from(pair: &SplitErrors) -> Self {
        ErrorsBySide {
            train: pair.train.clone(),
            holdout: pair.holdout.clone(),
        }
    }
}

impl DataFault {
    /// The result of a diagnosis that ends with it.
    pub fn result(&self) -> DiagnosisResult {
        DiagnosisResult {
            verdict: DiagnosisVerdict::DataFault,
            steps: Vec::new(),
            path: Vec::new(),
            before: None,
            after: None,
            unexplained: Vec::new(),
            dependence: Vec::new(),
            candidates: Vec::new(),
            set_aside: None,
            episodes: None,
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
        let named = |step| diagnosis.explained(step);
        if diagnosis.steps.iter().any(named) {
            DiagnosisVerdict::EffectsFound
        } else if diagnosis.structured() {
            DiagnosisVerdict::UnexplainedResidual
        } else {
            DiagnosisVerdict::NothingMissing
        }
    }

    /// The diagnosis as a document holds it.
    pub fn result(&self, machine: &LoggedRobot) -> DiagnosisResult {
        let d = &self.diagnosis;
        let names = machine.robot.joint_names();
        let added = d.steps.iter().map(|s| &s.candidate);
        let candidates = added.chain(&d.candidates);
        let left = d
            .unexplained
            .iter()
            .zip(names)
            .map(|(left, joint)| UnexplainedResult {
                joint: joint.clone(),
                share: left.share,
                over_floor: left.over_floor,
            });
        let aside = d.set_aside.iter().map(|a| BlockAside {
            log: self.logs[a.log].clone(),
            role: match a.role {
                LogRole::Veto => "veto",
                _ => "holdout",
            },
            from_s: a.from_s,
            to_s: a.to_s,
        });
        let episodes = d.disturbances.iter().map(|e| EpisodeResult {
            effect: disturbance::ENTRY.name,
            family: disturbance::ENTRY.family().name(),
            joint: names[e.joint].clone(),
            log: self.logs[e.log].clone(),
            from_s: e.from_s,
            to_s: e.to_s,
            over: e.over,
        });
        DiagnosisResult {
            verdict: self.verdict(),
            steps: d.steps.iter().map(|s| self.step(machine, s)).collect(),
            path: d.path.iter().map(SearchTurn::from).collect(),
            before: Some((&d.before).into()),
            after: Some((&d.after).into()),
            unexplained: left.collect(),
            dependence: d.dependence.iter().map(|d| dependence(names, d)).collect(),
            candidates: candidates.map(|c| candidate(machine, c)).collect(),
            set_aside: Some(aside.collect()),
            episodes: Some(episodes.collect()),
            processing: Some(self.in_memory.summary.clone()),
            faults: Vec::new(),
            setup: Vec::new(),
        }
    }

    fn step(&self, machine: &LoggedRobot, step: &AcceptedEffect) -> DiagnosisStep {
        let (d, robot) = (&self.diagnosis, &machine.robot);
        let effect = &d.model.effects[step.effect];
        let number = |t: cft_ident_core::effect::EffectNumber| {
            let found = EffectValueFound {
                value: t.value,
                std: t.std,
                unit: t.unit,
                bound: t.bound,
            };
            (t.key, found)
        };
        let parameters = self.told(machine, step.effect).into_iter().map(number);
        let alternatives: Vec<&str> = step.alternatives.iter().map(|c| c.effect.name()).collect();
        let alike = !alternatives.is_empty();
        let score = step.candidate.score.as_ref();
        DiagnosisStep {
            effect: effect.name(),
            family: effect.family().name(),
            joint: effect.place.name(robot),
            parameters: parameters.collect(),
            alternatives,
            status: d.status(step),
            assured: d.status(step) == StepStatus::Assured,
            separate_command: alike.then(|| separating_command(effect, robot)).flatten(),
            separate_by: alike.then_some(effect.law.entry.separate_by),
            unique_share: score.map(|s| s.unique_share),
            delta_bic: score.map(|s| s.delta_bic),
            cv_gain: score.map(|s| s.cv_gain),
            effective_samples: score.map(|s| s.effective_rows),
            p_value: step.candidate.placebo_p_value,
            holdout_before: step.holdout.map(|h| h[0]),
            holdout_after: step.holdout.map(|h| h[1]),
            holdout_worsened: step.worsens(),
            joints: step.joints.clone(),
        }
    }
}

fn dependence(names: &[String], found: &Dependence) -> ResidualDependence {
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

fn candidate(machine: &LoggedRobot, c: &Candidate) -> CandidateResult {
    let score = c.score.as_ref();
    CandidateResult {
        effect: c.effect.name(),
        joint: c.effect.place.name(&machine.robot),
        family: c.effect.family().name(),
        score: score.map(|s| s.cv_gain),
        unique_share: score.map(|s| s.unique_share),
        delta_bic: score.map(|s| s.delta_bic),
        p_value: score.map(|s| s.p_value),
        accepted: c.accepted,
        significant: c.significant,
        reason: c.reason.clone(),
    }
}
