//! What hangs on a wrist force-torque sensor: bias, mass, centre of gravity, and what else the wrenches show.
//!
//! ```text
//! rows -> ways to read them (frame of the wrench, order of the quaternion), the best of which is named
//!      -> least squares of 10 unknowns where the sensor is held, 16 where it moves   (physics, fit)
//!      -> effects, each by the error on neighbours left out, then by its own deviation  (search)
//!      -> what the poses do not determine, and the pose that would   (next_pose)
//! ```

mod analysis;
mod channels;
mod code;
mod controller;
mod effect;
mod equations;
mod error;
mod fit;
mod joints;
mod motion;
mod next_pose;
mod orientation;
mod physics;
mod read;
mod result;
mod search;
mod table;
mod taring;
mod tool_file;
mod touch;
mod units;
mod words;
mod wrench_log;

pub use analysis::analyse;
pub use code::c_function;
pub use controller::{CarriedBody, RobotController};
pub use effect::WrenchEffect;
pub use error::ToolError;
pub use next_pose::NextPose;
pub use read::{WrenchRequest, read_wrenches};
pub use result::{
    ForceMoment, ToolErrors, ToolForecast, ToolNumber, ToolResult, ToolStep, ToolVerdict,
    TriedReading,
};
pub use tool_file::ToolFile;
pub use touch::ToolTouch;
pub use units::ForceUnit;
pub use words::{number_95, step_in_words, touch_in_words};
pub use wrench_log::{OrientationIs, WrenchFrame, WrenchLog, WrenchReading, WrenchSample};

/// Free fall \[m/s^2\], along -z of the base.
pub const GRAVITY: f64 = 9.81;

/// The numbers that decide.
#[derive(Debug, Clone, Copy)]
pub struct WrenchNumbers {
    /// Neighbouring poses that are left out together. Half: neighbours of one direction answer for each other and the
    /// error looks a third smaller than it is; twice: five blocks, of which one says nothing.
    pub neighbours: usize,
    /// Most blocks. Half: six numbers of an effect have no deviation; twice: shorter than the residual's memory.
    pub blocks: usize,
    /// Fewest blocks by which an effect is judged.
    pub fewest_blocks: usize,
    /// From this s = 1 - floor / F on an effect is confirmed and written: it is a thing that a person can measure.
    pub confirmed: f64,
    /// An effect must lower the error on rows left out by so many standard errors.
    pub screen: f64,
    /// And by this part of it.
    pub noticeable: f64,
    /// Most effects.
    pub effects: usize,
    /// Part of the greatest eigenvalue below which equations determine nothing.
    pub singular: f64,
    /// Most steps of what is not linear.
    pub rounds: usize,
    /// Least spread of the directions of gravity in the sensor's frame \[rad\]: below, a noise of a hundredth of the
    /// weight is a third of what the poses show.
    pub least_turn: f64,
    /// A quaternion's length may be off by so much: what four printed digits leave.
    pub quaternion: f64,
    /// Part of the change of the forces that a reading may leave; beyond it no weight explains them.
    pub explained: f64,
    /// Farthest centre of gravity from a sensor \[m\], where no unit of the forces is stated.
    pub farthest_m: f64,
    /// A sensor moves where gravity and acceleration differ by so much \[m/s^2\], half a hundredth of gravity: below,
    /// poses are held.
    pub motion: f64,
    /// Time over which a motion is smoothed \[s\].
    pub motion_window_s: f64,
    /// Rows that it needs.
    pub motion_rows: usize,
    /// Angular speed below which a sensor rests \[rad/s\]: a wrench that is 0.1 s late is then right to two thousandths.
    pub rest_speed: f64,
    /// Rows at rest from which only they are fitted.
    pub rest_rows: usize,
    /// Distance at which a turn counts as acceleration \[m\].
    pub lever_m: f64,
    /// Least spread of places for which a cable is asked for \[m\].
    pub cable_m: f64,
    /// Part of the rows that a forecast is made from.
    pub forecast: f64,
}

/// The numbers of `tool`.
pub const NUMBERS: WrenchNumbers = WrenchNumbers {
    neighbours: 10,
    blocks: 24,
    fewest_blocks: 8,
    confirmed: 0.8,
    screen: 2.0,
    noticeable: 0.02,
    effects: 6,
    singular: 1e-12,
    rounds: 12,
    least_turn: 0.05,
    quaternion: 1e-3,
    explained: 0.5,
    farthest_m: 0.5,
    motion: 0.05,
    motion_window_s: 0.2,
    motion_rows: 5,
    rest_speed: 0.02,
    rest_rows: 20,
    lever_m: 0.1,
    cable_m: 0.05,
    forecast: 0.7,
};
