//! What keeps a simulation from starting or ending.

use cft_ident_core::explain::{ErrorText, Explain};
use cft_ident_core::robot::RobotError;
use cft_ident_files::config::ConfigError;
use cft_ident_logs::log::did_you_mean;

/// Errors of the room `simulate`.
#[derive(Debug, Explain, thiserror::Error)]
pub enum SimulateError {
    /// The state is no longer finite, or no step is short enough.
    #[explain(
        "the simulated motion diverges at t = {t:.6} s",
        "check gains, parameters and initial speeds, or lower the slopes of the friction law"
    )]
    Diverged { t: f64 },
    /// A pose that the mechanism cannot take.
    #[explain(_0.explanation())]
    Robot(#[from] RobotError),
    /// A model that does not hold what the plant needs.
    #[explain(_0.explanation())]
    Config(#[from] ConfigError),
    /// A robot that the simulator cannot build.
    #[explain(what.clone().of("this robot cannot be simulated"))]
    Unsupported { what: ErrorText },
    /// More joints than the simulator is compiled for.
    #[explain("this robot has {joints} joints and the simulator has room for {most}")]
    TooManyJoints { joints: usize, most: usize },
    /// A start outside the limits.
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
    /// A reference that cannot be followed as it is written.
    #[explain(what.clone().of("the reference cannot be used"))]
    Reference { what: ErrorText },
    /// A number that a plant, controller or sensor cannot have.
    #[explain("{name} is {value}, but {rule}")]
    Parameter {
        name: &'static str,
        value: f64,
        rule: &'static str,
    },
    /// Parameters of no physical robot.
    #[explain(
        "the inertia matrix is not positive definite at the pose {x:.4?}",
        "no physical robot has these inertial parameters, so take others: a fit with --unconstrained can be so, a fit without it is not"
    )]
    NotPositiveDefinite { x: Vec<f64> },
    /// Volts to play back that are no series.
    #[explain(what.clone().of("the volts cannot be played back"))]
    Volts { what: ErrorText },
    /// An effect that cannot be read.
    #[explain(
        "effect `{text}`: cannot read `{part}`",
        "write NAME, NAME:JOINT or NAME:JOINT:key=value,key=value"
    )]
    EffectSyntax { text: String, part: String },
    /// An effect that is not known.
    #[explain(
        "there is no effect `{name}` in the simulator",
        format!("{}it has {known}", did_you_mean(name, known))
    )]
    UnknownEffect { name: String, known: String },
    /// A key that the effect does not have.
    #[explain(
        "effect `{effect}` has no key `{key}`",
        format!("{}its keys are {known}", did_you_mean(key, known))
    )]
    UnknownKey {
        effect: String,
        key: String,
        known: String,
    },
    /// An effect of the user's own without one of its numbers.
    #[explain(
        "effect `{effect}`: `{key}` has no number",
        "give each by `--effect {effect}:JOINT:{key}=..`"
    )]
    MissingKey { effect: String, key: String },
    /// An effect of the user's own that is none on this robot.
    #[explain("candidate `{name}`: {what}", "correct its [[candidate]] table")]
    Candidate { name: String, what: String },
    /// A joint that the robot does not have.
    #[explain(
        "the robot has no joint `{name}`",
        format!("{}its joints are {known}", did_you_mean(name, known))
    )]
    UnknownJoint { name: String, known: String },
    /// An effect that has nothing to sit on.
    #[explain(why.clone().of(format!("effect `{effect}` has no place at {place}")))]
    EffectPlace {
        effect: String,
        place: String,
        why: ErrorText,
    },
    /// A number that the effect cannot have.
    #[explain("effect `{effect}`: {key} is {value}, but {rule}")]
    EffectNumber {
        effect: String,
        key: String,
        value: f64,
        rule: String,
    },
    /// An effect of a model file that cannot be run.
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
    /// A log that is too long, for memory where all of it is wanted at once.
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
    /// Rows that wait for their noise need a temporary file.
    #[explain(
        "the rows of a long run cannot wait in the system's temporary folder: {_0}",
        "make room there, or name another folder in TMPDIR"
    )]
    Waiting(#[from] std::io::Error),
    /// Whoever takes the rows wants no more of them.
    #[explain("the simulation was stopped")]
    Stopped,
    /// More extra states than the integrator is compiled for.
    #[explain(
        "the effects need {states} states of their own and at most {most} are possible",
        "use fewer effects"
    )]
    TooManyStates { states: usize, most: usize },
}
