//! Parameters of two models side by side.
//!
//! A difference d = b - a of two independent estimates has the variance s_a^2 + s_b^2; what is reported
//! is d over the root of it. Estimates from the same logs are not independent: the caller says so.

use schemars::JsonSchema;
use serde::Serialize;

use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Parameter;

/// One model's estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct ParameterEstimate {
    /// Value [unit of the pair].
    pub value: f64,
    /// Standard deviation; none where the data say nothing.
    pub std: Option<f64>,
    /// What the data said about it.
    pub verdict: Option<Verdict>,
}

/// A parameter that both models have.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ParameterPair {
    /// Name; `effect.key` for a number of an effect.
    pub name: String,
    /// Joint; none for what concerns all of them.
    pub joint: Option<String>,
    /// Number in the report's Table 4, where it has one.
    pub theta: Option<u32>,
    /// Unit of values and deviations.
    pub unit: String,
    pub a: ParameterEstimate,
    pub b: ParameterEstimate,
    /// b - a [unit].
    pub difference: f64,
    /// Root of the summed variances [unit]; none where one of them is unknown, where both are 0, and
    /// where a value is a bound or not determined.
    pub difference_std: Option<f64>,
    /// `difference` over `difference_std`.
    pub deviation: Option<f64>,
}

/// Why a parameter has no partner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Reason")]
pub enum UnpairedReason {
    /// The other model has none of this name.
    Absent,
    /// The other model has one in another unit.
    OtherUnit,
    /// The other model's structure gives the name another meaning.
    OtherMeaning,
}

/// A parameter that one model has alone.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Apart")]
pub struct UnpairedParameter {
    pub name: String,
    pub joint: Option<String>,
    pub value: f64,
    pub std: Option<f64>,
    pub unit: String,
    pub reason: UnpairedReason,
}

/// All parameters of two models.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct SideBySide {
    /// What both have, in the order of the first.
    pub parameters: Vec<ParameterPair>,
    pub only_in_a: Vec<UnpairedParameter>,
    pub only_in_b: Vec<UnpairedParameter>,
}

/// A parameter, or a number of an effect.
pub(super) struct ParameterEntry {
    pub(super) name: String,
    pub(super) joint: Option<String>,
    pub(super) theta: Option<u32>,
    pub(super) unit: String,
    /// What the robot's structure means by it; empty where the name says all.
    pub(super) meaning: String,
    pub(super) estimate: ParameterEstimate,
}

/// Pairs the parameters of two models.
pub fn side_by_side(a: &ModelFile, b: &ModelFile) -> SideBySide {
    paired(&entries(a), &entries(b))
}

/// Pairs entries by name, joint, unit and meaning.
pub(super) fn paired(ours: &[ParameterEntry], theirs: &[ParameterEntry]) -> SideBySide {
    let mut out = SideBySide::default();
    for entry in ours {
        match partner(entry, theirs) {
            Ok(other) => out.parameters.push(pair(entry, other)),
            Err(reason) => out.only_in_a.push(apart(entry, reason)),
        }
    }
    for entry in theirs {
        if let Err(reason) = partner(entry, ours) {
            out.only_in_b.push(apart(entry, reason));
        }
    }
    out
}

fn partner<'a>(
    entry: &ParameterEntry,
    among: &'a [ParameterEntry],
) -> Result<&'a ParameterEntry, UnpairedReason> {
    let mut same = among.iter();
    let found = same.find(|other| other.name == entry.name && other.joint == entry.joint);
    let other = found.ok_or(UnpairedReason::Absent)?;
    if other.unit != entry.unit {
        return Err(UnpairedReason::OtherUnit);
    }
    match other.meaning == entry.meaning {
        true => Ok(other),
        false => Err(UnpairedReason::OtherMeaning),
    }
}

fn pair(a: &ParameterEntry, b: &ParameterEntry) -> ParameterPair {
    let difference = b.estimate.value - a.estimate.value;
    let both = spread(&a.estimate).zip(spread(&b.estimate));
    let std = both.map(|(a, b)| a.hypot(b));
    let difference_std = std.filter(|std| *std > 0.0 && std.is_finite());
    ParameterPair {
        name: a.name.clone(),
        joint: a.joint.clone(),
        theta: a.theta,
        unit: a.unit.clone(),
        a: a.estimate,
        b: b.estimate,
        difference,
        difference_std,
        deviation: difference_std.map(|std| difference / std),
    }
}

/// Standard deviation of a value that is an estimate; a bound and a free choice have none.
fn spread(estimate: &ParameterEstimate) -> Option<f64> {
    match estimate.verdict {
        Some(Verdict::LowerBound | Verdict::NotIdentifiable) => None,
        _ => estimate.std,
    }
}

fn apart(entry: &ParameterEntry, reason: UnpairedReason) -> UnpairedParameter {
    UnpairedParameter {
        name: entry.name.clone(),
        joint: entry.joint.clone(),
        value: entry.estimate.value,
        std: entry.estimate.std,
        unit: entry.unit.clone(),
        reason,
    }
}

fn entries(model: &ModelFile) -> Vec<ParameterEntry> {
    let robot = model.robot.robot();
    let meaning = |p: &Parameter| {
        let mut known = robot.parameters().iter();
        let inertial = known.find(|info| p.joint.is_none() && info.name == p.name);
        inertial.map_or(String::new(), |info| info.meaning.to_string())
    };
    let own = model.parameters.iter().map(|p| ParameterEntry {
        name: p.name.clone(),
        joint: p.joint.clone(),
        theta: p.theta,
        unit: p.unit.clone(),
        meaning: meaning(p),
        estimate: ParameterEstimate {
            value: p.value,
            std: p.std,
            verdict: p.verdict,
        },
    });
    let mut out: Vec<ParameterEntry> = own.collect();
    for (at, effect) in model.effects.iter().enumerate() {
        // an effect may be there more than once, as two ripples of one joint are
        let before = model.effects[..at].iter();
        let twins = before.filter(|e| e.name == effect.name && e.joint == effect.joint);
        let name = match twins.count() {
            0 => effect.name.clone(),
            n => format!("{}#{}", effect.name, n + 1),
        };
        out.extend(effect.parameters.iter().map(|(key, p)| ParameterEntry {
            name: format!("{name}.{key}"),
            joint: effect.joint.clone(),
            theta: None,
            unit: p.unit.clone(),
            meaning: String::new(),
            estimate: ParameterEstimate {
                value: p.value,
                std: p.std,
                verdict: None,
            },
        }));
    }
    out
}
