//! What is reported of a set-up: the entries of the key `setup` in the documents of the commands.

use schemars::JsonSchema;
use serde::Serialize;

use super::condition::DecidedBy;

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FindingKind {
    /// A channel has the other sign.
    Sign,
    /// Channels have changed places.
    Order,
    /// A channel has another unit or gear ratio.
    Scale,
    /// A joint's zero is elsewhere.
    Zero,
    /// Gravity has another direction.
    Gravity,
    /// Currents whose torque per ampere is not given.
    Gains,
    /// Torques lag behind positions.
    Delay,
    /// Geometry that was rounded or misread.
    Geometry,
    /// A joint that misses much, where no mistake repairs it.
    Undecided,
}

impl FindingKind {
    /// As it is written.
    pub fn word(self) -> &'static str {
        match self {
            Self::Sign => "sign",
            Self::Order => "order",
            Self::Scale => "scale",
            Self::Zero => "zero",
            Self::Gravity => "gravity",
            Self::Gains => "gains",
            Self::Delay => "delay",
            Self::Geometry => "geometry",
            Self::Undecided => "undecided",
        }
    }
}

/// What becomes of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "SetupSeverity")]
pub enum FindingSeverity {
    /// The evidence is overwhelming: a fit refuses the logs.
    Error,
    /// Likely, and the set-up as declared is possible too.
    Warning,
    /// An estimate or a word on these data, and no fault.
    Hint,
}

impl FindingSeverity {
    /// As it is written.
    pub fn word(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Hint => "hint",
        }
    }
}

/// Which channel of a joint it is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelKind {
    Torque,
    Position,
    Both,
}

/// A value of the robot file: as it is declared, or as it should be.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Setting {
    /// A sign, a factor, an angle \[rad or m\].
    Number(f64),
    /// A direction \[m/s^2\].
    Vector([f64; 3]),
    /// Names of columns or joints.
    Names(Vec<String>),
}

/// Another reading that the data do not distinguish from this one.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Alternative {
    pub kind: FindingKind,
    pub channel: Option<ChannelKind>,
    /// Null for what concerns all joints.
    pub joint: Option<String>,
    /// The other joint of an exchange.
    pub with: Option<String>,
    pub found: Setting,
    pub remedy: String,
}

/// Errors of a joint on held-out data: fractions of its torque.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SetupErrors {
    pub joint: String,
    /// As the set-up is declared; null where its positions belong to no pose.
    pub before: Option<f64>,
    pub after: f64,
}

/// One entry of the key `setup`: what the robot file declares and what the torques say.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Finding {
    pub kind: FindingKind,
    pub channel: Option<ChannelKind>,
    /// Null for what concerns all joints.
    pub joint: Option<String>,
    /// The other joint of an exchange.
    pub with: Option<String>,
    pub declared: Setting,
    pub found: Setting,
    /// Standard deviation of `found`, where it is a number that was fitted.
    pub found_std: Option<f64>,
    /// Mean relative error over the joints as the set-up is declared: a fraction.
    pub error_before: Option<f64>,
    /// The same with this put right.
    pub error_after: Option<f64>,
    /// What to write into the robot file; nothing where it is no fault.
    pub remedy: String,
    pub severity: FindingSeverity,
    /// Whether the evidence is overwhelming: a fit refuses the log then.
    pub sure: bool,
    /// Errors of every joint that moves, before and after; none is larger after.
    pub joints: Vec<SetupErrors>,
    /// Other readings that fit as well.
    pub tied_with: Vec<Alternative>,
    /// The conditions that decide whether it is sure: all of them hold then. Empty where another check found it.
    pub decided_by: Vec<DecidedBy>,
    /// What is wrong, as a sentence.
    pub meaning: String,
}

impl Finding {
    /// A finding of another check than the search, with what the file declares and what it should say.
    pub fn new(
        kind: FindingKind,
        joint: Option<String>,
        [declared, found]: [Setting; 2],
        meaning: String,
        remedy: String,
        sure: bool,
    ) -> Self {
        Self {
            kind,
            channel: None,
            joint,
            with: None,
            declared,
            found,
            found_std: None,
            error_before: None,
            error_after: None,
            remedy,
            severity: match sure {
                true => FindingSeverity::Error,
                false => FindingSeverity::Warning,
            },
            sure,
            joints: Vec::new(),
            tied_with: Vec::new(),
            decided_by: Vec::new(),
            meaning,
        }
    }

    /// The numbers that decide, in words; nothing where there are none.
    pub fn decided(&self) -> Option<String> {
        let each: Vec<&str> = self.decided_by.iter().map(|c| c.text.as_str()).collect();
        (!each.is_empty()).then(|| each.join(", "))
    }

    /// As it is reported: what is wrong, what to write, and what these data say as well.
    pub fn in_words(&self) -> String {
        let mut out = self.meaning.clone();
        if !self.remedy.is_empty() {
            out += &format!("; write {}", self.remedy);
        }
        let ties = self.tied_with.iter().filter(|tie| !tie.remedy.is_empty());
        for tie in ties.take(2) {
            out += &format!("; these data say as well: {}", tie.remedy);
        }
        out
    }
}

/// Power that the friction of a joint takes, where it is negative by more than two deviations.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FrictionPower {
    pub joint: String,
    /// Mean power of all friction terms over the speeds of the logs \[unit\].
    pub power: f64,
    pub std: f64,
    /// W, or that of a current times a speed.
    pub unit: String,
    /// Its likeliest cause, as a sentence.
    pub cause: String,
}

/// A torque that the drive of a joint does not exceed, whatever it is asked for.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FoundTorqueLimit {
    pub joint: String,
    /// \[unit\]
    pub limit: f64,
    /// N or Nm, or that of a current.
    pub unit: String,
    /// Share of the rows in which it is asked for more.
    pub share: f64,
    /// Relative error of the torque with these rows and without.
    pub errors: [f64; 2],
}

/// What the check of a set-up found.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SetupReport {
    /// Nothing where the set-up is right.
    pub findings: Vec<Finding>,
    /// Joints whose friction drives them.
    pub friction_power: Vec<FrictionPower>,
    /// Joints whose torque was asked for and not delivered.
    pub torque_limits: Vec<FoundTorqueLimit>,
}

impl SetupReport {
    /// What a fit refuses the logs for.
    pub fn refusals(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| finding.sure)
    }
}
