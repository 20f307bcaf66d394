//! What keeps a simulation from starting or ending.

use cft_ident_core::explain::{ErrorText, Explain};
use cft_ident_core::robot::RobotError;
use cft_ident_files::config::ConfigError;
use cft_ident_logs::log::did_you_mean;

/// Why no simulation came out. Each message says what to change.
#[derive(Debug, Explain, thiserror::Error)]
pub enum SimulateError {
    #[explain(
        "the simulated motion diverges at t = {t:.6} s",
        "check gains, parameters and initial speeds, or lower the slopes of the friction law"
    )]
    Diverged { t: f64 },
    #[explain(_0.explanation())]
    Robot(#[from] RobotError),
    #[explain(_0.explanation())]
    Config(#[from] ConfigError),
    #[explain(what.clone().of("this robot cannot be simulated"))]
    Unsupported { what: ErrorText },
    #[explain("this robot has {joints} joints and the simulator has room for {most}")]
    TooManyJoints { joints: usize, most: usize },
    #[explain(
        "{coordinate} = {value:.5} at the start lies outside its limits [{lower}, {upper}]",
        "begin inside them (the set-ups TUeDACS and dSPACE differ in x_c4)"
    )]
    LimitAtStart {
        coordinate: String,
        value: f64,
        lower: f64,
        upper: f64,
    },
    #[explain(what.clone().of("the reference cannot be used"))]
    Reference { what: ErrorText },
    #[explain("{name} is {value}, but {rule}")]
    Parameter {
        name: &'static str,
        value: f64,
        rule: &'static str,
    },
    #[explain(
        "the inertia matrix is not positive definite at the pose {x:.4?}",
        "no physical robot has these inertial parameters, so take others: a fit with --unconstrained can be so, a fit without it is not"
    )]
    NotPositiveDefinite { x: Vec<f64> },
    #[explain(what.clone().of("the volts cannot be played back"))]
    Volts { what: ErrorText },
    #[explain(
        "effect `{text}`: cannot read `{part}`",
        "write NAME, NAME:JOINT or NAME:JOINT:key=value,key=value"
    )]
    EffectSyntax { text: String, part: String },
    #[explain(
        "there is no effect `{name}` in the simulator",
        format!("{}it has {known}", did_you_mean(name, known))
    )]
    UnknownEffect { name: String, known: String },
    #[explain(
        "effect `{effect}` has no key `{key}`",
        format!("{}its keys are {known}", did_you_mean(key, known))
    )]
    UnknownKey {
        effect: String,
        key: String,
        known: String,
    },
    #[explain(
        "effect `{effect}`: `{key}` has no number",
        "give each by `--effect {effect}:JOINT:{key}=..`"
    )]
    MissingKey { effect: String, key: String },
    #[explain("candidate `{name}`: {what}", "correct its [[candidate]] table")]
    Candidate { name: String, what: String },
    #[explain(
        "the robot has no joint `{name}`",
        format!("{}its joints are {known}", did_you_mean(name, known))
    )]
    UnknownJoint { name: String, known: String },
    #[explain(why.clone().of(format!("effect `{effect}` has no place at {place}")))]
    EffectPlace {
        effect: String,
        place: String,
        why: ErrorText,
    },
    #[explain("effect `{effect}`: {key} is {value}, but {rule}")]
    EffectNumber {
        effect: String,
        key: String,
        value: f64,
        rule: String,
    },
    #[explain(
        source.explanation().of(format!("{file}, [[effect]] {number} (`{name}`)")),
        "correct that table, or leave it out to simulate without it"
    )]
    ModelEffect {
        file: String,
        /// Counted from one.
        number: usize,
        name: String,
        source: Box<SimulateError>,
    },
    #[explain(
        "{seconds:?} s at {rate_hz:?} Hz are more than the {most} rows that are simulated at once",
        "give at most --seconds {most_s:.0}, and several runs with seeds of their own for more"
    )]
    TooLong {
        seconds: f64,
        rate_hz: f64,
        most: usize,
        most_s: f64,
    },
    #[explain(
        "the rows of a long run cannot wait in the system's temporary folder: {_0}",
        "make room there, or name another folder in TMPDIR"
    )]
    Waiting(#[from] std::io::Error),
    #[explain("the simulation was stopped")]
    Stopped,
    #[explain(
        "the effects need {states} states of their own and at most {most} are possible",
        "use fewer effects"
    )]
    TooManyStates { states: usize, most: usize },
}

impl SimulateError {
    /// Refuses a number that is not `good`.
    pub(super) fn require(
        good: bool,
        name: &'static str,
        value: f64,
        rule: &'static str,
    ) -> Result<(), Self> {
        match good {
            true => Ok(()),
            false => Err(Self::Parameter { name, value, rule }),
        }
    }

    /// An effect cannot have that number.
    pub(super) fn number(effect: &str, key: &str, value: f64, rule: impl Into<String>) -> Self {
        Self::EffectNumber {
            effect: effect.to_owned(),
            key: key.to_owned(),
            value,
            rule: rule.into(),
        }
    }

    /// Where a name stands among those of joints.
    pub(super) fn place_of(known: &[String], name: &str) -> Result<usize, Self> {
        let unknown = || Self::unknown_joint(name, known);
        known.iter().position(|n| n == name).ok_or_else(unknown)
    }

    /// No joint of that name.
    pub(super) fn unknown_joint(name: impl Into<String>, known: &[String]) -> Self {
        Self::UnknownJoint {
            name: name.into(),
            known: known.join(", "),
        }
    }

    /// A reference that cannot be followed.
    pub(super) fn reference(what: impl Into<ErrorText>) -> Self {
        Self::Reference { what: what.into() }
    }
}
