//! Static figures as SVG: measured and reconstructed torque, friction curves, and designed motions.
//!
//! A small writer of our own instead of a plot library: panels of unequal height, dashes, bands and
//! a legend outside the data are what these figures consist of, and the same data must give the same
//! bytes.

mod axis;
mod cell;
mod course;
mod decimate;
mod effect;
mod errors;
mod friction;
mod heat;
mod interval;
mod joint_grid;
mod legend;
mod map;
mod motion;
mod overlay;
mod panel;
mod position;
mod rate;
mod residual;
mod sketch;
mod svg;
mod torque;

pub use cell::PictureGroup;
pub(crate) use course::{CourseFigure, CoursePanel};
pub(crate) use effect::EffectFigure;
pub(crate) use errors::{ErrorBar, ErrorFigure, JointBars};
pub use friction::{FrictionFigure, FrictionPanel};
pub use heat::HeatFigure;
pub use interval::{IntervalFigure, IntervalRow};
pub use map::MapFigure;
pub use motion::{MotionFigure, MotionPanel};
pub use overlay::{OverlayFigure, OverlayPanel};
pub use position::{PositionFigure, PositionPanel};
pub use rate::{RateFigure, RatePanel};
pub use residual::{ResidualFigure, ResidualLine, ResidualPanel};
pub(crate) use sketch::{PoseSketch, SketchJoint};
pub(crate) use torque::parted;
pub use torque::{JointTorque, TorqueFigure};

/// Colours that stay apart for colour-blind readers and in grey print (Okabe and Ito 2008).
mod colour {
    pub(crate) const INK: &str = "#222222";
    pub(crate) const MUTED: &str = "#666666";
    pub(crate) const FRAME: &str = "#9a9a9a";
    pub(crate) const GRID: &str = "#e7e7e7";
    pub const ZERO: &str = "#bdbdbd";
    pub(crate) const PAPER: &str = "#ffffff";
    pub(crate) const BLUE: &str = "#0072b2";
    pub(crate) const SKY: &str = "#56b4e9";
    pub(crate) const VERMILLION: &str = "#d55e00";
    pub(crate) const YELLOW: &str = "#e69f00";
    pub(crate) const PURPLE: &str = "#882255";
    pub(crate) const COVERED: &str = "#f0f4e8";
}

/// All of them, for a page that shows figures in the dark.
#[cfg(test)]
pub(crate) const PALETTE: [&str; 12] = [
    colour::INK,
    colour::MUTED,
    colour::FRAME,
    colour::GRID,
    colour::ZERO,
    colour::PAPER,
    colour::BLUE,
    colour::SKY,
    colour::VERMILLION,
    colour::YELLOW,
    colour::PURPLE,
    colour::COVERED,
];
