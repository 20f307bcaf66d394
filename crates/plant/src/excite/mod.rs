//! Design of the motions of a campaign: trajectories that make the parameters as certain as the
//! machine allows, and are safe to run (sections 2.3.3 and 4.2.1 of the report).
//!
//! | file | what |
//! |---|---|
//! | [`series`], [`blend`] | finite Fourier series (43); rest at both ends |
//! | [`machine`], [`limits`] | coordinates to joints, torques and volts; what is bounded |
//! | [`foreseen`] | the numbers that torques are foreseen with |
//! | [`criterion`], [`information`] | J_k, J_d, traces, and their slopes |
//! | [`known`] | what a model knows already, and what is weak in it |
//! | [`search`] | many starts, an augmented Lagrangian around L-BFGS, repair |
//! | [`usage`], `peak` | how near each limit a motion comes, between samples too |
//! | [`space`] | points above a floor and in a box, links apart |
//! | [`judgement`] | the result: what a log of the motion will tell, and the limits along it |

pub mod blend;
pub mod criterion;
pub mod foresee;
pub mod foreseen;
mod from_files;
pub mod given;
pub mod held;
pub mod information;
pub mod judgement;
pub mod known;
pub mod ladder;
mod lagrangian;
pub mod limits;
pub mod machine;
pub mod motion;
mod objective;
mod peak;
mod repair;
pub mod search;
pub mod series;
pub mod space;
mod start;
pub mod strokes;
pub mod usage;
mod variables;

pub use criterion::Criterion;
pub use foreseen::TorqueSource;
pub use from_files::{machine, series_of, trajectory};
pub use given::GivenInformation;
pub use judgement::{LawForeseen, MotionJudgement, MotionJudgements, MotionTerms, judge, lifted};
pub use known::InformationBefore;
pub use motion::Motion;
pub use objective::{NoValue, PriorInformation};
pub use start::{usual_motion, usual_torque};

use crate::simulate::SimulateError;
use cft_ident_core::explain::Explain;
use cft_ident_core::number;
use cft_ident_files::config::{ConfigError, did_you_mean};

/// Why no motion came out. Each message says what to change.
#[derive(Debug, Explain, thiserror::Error)]
pub enum ExciteError {
    #[explain(
        "the travel of {coordinate} is not known",
        "write `[limits.{coordinate}] position = [low, high]` into the robot file"
    )]
    NoTravel { coordinate: String },
    #[explain(
        "nothing bounds the speed of {coordinate}",
        "write `[limits.{coordinate}] speed = ...` (or acceleration; or torque, and give a model with -m) into the robot file"
    )]
    NoSpeed { coordinate: String },
    #[explain(
        "the offset {offset} of {coordinate} lies outside [{lower}, {upper}], its limits less the reserve",
        "choose another offset or let the design choose it"
    )]
    OffsetOutside {
        coordinate: String,
        offset: f64,
        lower: f64,
        upper: f64,
    },
    #[explain(
        "{quantity} of {channel} would be {value} at rest already, outside [{lower}, {upper}]",
        "widen that limit or check the model"
    )]
    CannotRest {
        channel: String,
        quantity: &'static str,
        value: f64,
        lower: f64,
        upper: f64,
    },
    #[explain(
        "none of {starts} starts excites all {unknowns} unknowns within the limits",
        "give more harmonics, wider limits or fewer parameters"
    )]
    NothingExcited { unknowns: usize, starts: usize },
    #[explain(
        format!(
            "rest at the ends needs blends longer than {seconds:.1} s: with those the {what} is still {:.1} % of its limit",
            100.0 * share
        ),
        "widen that limit in the robot file (one that it does not state is what the model's logs reached), or keep more in reserve (--margin)"
    )]
    NoBlend {
        seconds: f64,
        what: String,
        share: f64,
    },
    #[explain(
        "the pose of --from breaks a limit itself: the {what} is {value:.4}",
        "give the pose in which the robot stands"
    )]
    BrokenPose { what: String, value: f64 },
    #[explain(
        "no straight way leads from the given pose into the motion within the limits: one of them breaks that on the {what} after {percent} % of the way",
        "give another pose with --from, or move the robot by hand and leave --from out"
    )]
    NoWay { what: String, percent: f64 },
    #[explain(
        "`[limits.{joint}] volts` cannot be kept: the motors of this robot act on x_c1..x_c4",
        "write the limit there, or limit the torque of {joint}"
    )]
    VoltsOfJoint { joint: String },
    #[explain(
        "the series is written in other coordinates than the design's",
        "write it in {wanted}"
    )]
    OtherCoordinates { wanted: String },
    #[explain(
        "the machine has no coordinate {name}",
        format!("{}its coordinates are {known}", did_you_mean(name, known))
    )]
    UnknownCoordinate { name: String, known: String },
    #[explain(
        "a blend of {blend_s:?} s is {periods:.3e} periods of {fundamental_hz:?} Hz, and at most {most} are judged",
        "give a lower `fundamental_hz` or a shorter `blend_s`"
    )]
    LongBlend {
        blend_s: f64,
        fundamental_hz: f64,
        periods: f64,
        most: f64,
    },
    #[explain(
        "the motion lasts {seconds:?} s, and at most {most:.0} s are judged",
        "give a shorter one"
    )]
    LongMotion { seconds: f64, most: f64 },
    #[explain(
        format!(
            "a ladder of {joint} alone, the other joints in the middle of their positions, takes {:.0} % of the limit of {drive} however short its strokes, and {:.0} % are left free",
            100.0 * used,
            100.0 * free
        ),
        "write `[limits.{drive}] torque = ...` as the drive has it, or positions in whose middle the arm hangs with less weight, into a robot file for -r"
    )]
    BeyondDrive {
        joint: String,
        drive: String,
        used: f64,
        free: f64,
    },
    #[explain(
        "joint {joint} has no friction in the model",
        "give one with -m that has"
    )]
    NoLaw { joint: String },
    #[explain(
        format!(
            "joint {joint} has room for strokes of {}, too little around a width of {}",
            number::significant(*room, 3),
            number::significant(*width, 3)
        ),
        "widen its position limits in [limits]"
    )]
    Narrow {
        joint: String,
        width: f64,
        room: f64,
    },
    #[explain(_0.explanation())]
    Config(#[from] ConfigError),
    #[explain(_0.explanation())]
    Reference(#[from] SimulateError),
    #[explain(_0.explanation())]
    NoValue(#[from] NoValue),
    #[explain(_0.explanation())]
    Robot(#[from] cft_ident_core::robot::RobotError),
    #[explain(_0.explanation())]
    Math(#[from] cft_ident_core::math::MathError),
}
