//! What keeps a simulation from starting or ending.

use cft_ident_core::problem::{Explain, Problem};
use cft_ident_core::robot::RobotError;
use cft_ident_files::config::ConfigError;
use cft_ident_logs::log::did_you_mean;

/// Errors of the room `simulate`.
#[derive(Debug, Explain, thiserror::Error)]
pub enum SimulateError {
    /// The state is no longer finite, or no step is short enough.
    #[problem(
        "the simulated motion diverges at t = {t:.6} s",
        "check gains, parameters and initial speeds, or lower the slopes of the friction law"
    )]
    Diverged { t: f64 },
    /// A pose that the mechanism cannot take.
    #[problem(_0.problem())]
    Robot(#[from] RobotError),
    /// A model that does not hold what the plant needs.
    #[problem(_0.problem())]
    Config(#[from] ConfigError),
    /// A robot that the simulator cannot build.
    #[problem(what.clone().of("this robot cannot be simulated"))]
    Unsupported { what: Problem },
    /// More joints than the simulator is compiled for.
    #[problem("this robot has {joints} joints and the simulator has room for {most}")]
    TooManyJoints { joints: usize, most: usize },
    /// A start outside the limits.
    #[problem(
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
    #[problem(what.clone().of("the reference cannot be used"))]
    Reference { what: Problem },
    /// A number that a plant, controller or sensor cannot have.
    #[problem("{name} is {value}, but {rule}")]
    Parameter {
        name: &'static str,
        value: f64,
        rule: &'static str,
    },
    /// Parameters of no physical robot.
    #[problem(
        "the inertia matrix is not positive definite at the pose {x:.4?}",
        "no physical robot has these inertial parameters, so take others: a fit with --unconstrained can be so, a fit without it is not"
    )]
    NotPositiveDefinite { x: Vec<f64> },
    /// Volts to play back that are no series.
    #[problem(what.clone().of("the volts cannot be played back"))]
    Volts { what: Problem },
    /// An effect that cannot be read.
    #[problem(
        "effect `{text}`: cannot read `{part}`",
        "write NAME, NAME:JOINT or NAME:JOINT:key=value,key=value"
    )]
    EffectSyntax { text: String, part: String },
    /// An effect that is not known.
    #[problem(
        "there is no effect `{name}` in the simulator",
        format!("{}it has {known}", did_you_mean(name, known))
    )]
    UnknownEffect { name: String, known: String },
    /// A key that the effect does not have.
    #[problem(
        "effect `{effect}` has no key `{key}`",
        format!("{}its keys are {known}", did_you_mean(key, known))
    )]
    UnknownKey {
        effect: String,
        key: String,
        known: String,
    },
    /// An effect of the user's own without one of its numbers.
    #[problem(
        "effect `{effect}`: `{key}` has no number",
        "give each by `--effect {effect}:JOINT:{key}=..`"
    )]
    MissingKey { effect: String, key: String },
    /// An effect of the user's own that is none on this robot.
    #[problem("candidate `{name}`: {what}", "correct its [[candidate]] table")]
    Candidate { name: String, what: String },
    /// A joint that the robot does not have.
    #[problem(
        "the robot has no joint `{name}`",
        format!("{}its joints are {known}", did_you_mean(name, known))
    )]
    UnknownJoint { name: String, known: String },
    /// An effect that has nothing to sit on.
    #[problem(why.clone().of(format!("effect `{effect}` has no place at {place}")))]
    EffectPlace {
        effect: String,
        place: String,
        why: Problem,
    },
    /// A number that the effect cannot have.
    #[problem("effect `{effect}`: {key} is {value}, but {rule}")]
    EffectNumber {
        effect: String,
        key: String,
        value: f64,
        rule: String,
    },
    /// An effect of a model file that cannot be run.
    #[problem(
        source.problem().of(format!("{file}, [[effect]] {number} (`{name}`)")),
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
    #[problem(
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
    #[problem(
        "the rows of a long run cannot wait in the system's temporary folder: {_0}",
        "make room there, or name another folder in TMPDIR"
    )]
    Waiting(#[from] std::io::Error),
    /// Whoever takes the rows wants no more of them.
    #[problem("the simulation was stopped")]
    Stopped,
    /// More extra states than the integrator is compiled for.
    #[problem(
        "the effects need {states} states of their own and at most {most} are possible",
        "use fewer effects"
    )]
    TooManyStates { states: usize, most: usize },
}
