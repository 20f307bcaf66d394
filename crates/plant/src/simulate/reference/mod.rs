//! References that the controller follows: Fourier series (43), one-joint ladder, point list, hold.

mod blend;
mod fourier;
mod ladder;
mod points;
mod stroke;
mod travel;

pub use blend::TimeScaling;
pub use fourier::FourierReference;
pub use ladder::{LadderPlan, LadderReference, TURN};
pub use points::SplineReference;
pub use travel::{JointTravel, middle_part, travel};

use super::SimulateError;

/// Where a reference wants the robot to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target<const J: usize> {
    /// m or rad.
    pub position: [f64; J],
    /// m/s or rad/s.
    pub velocity: [f64; J],
}

impl<const J: usize> Target<J> {
    fn rest(position: [f64; J]) -> Self {
        let velocity = [0.0; J];
        Self { position, velocity }
    }
}

/// Coordinates that a reference is written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReferenceFrame {
    /// Joint coordinates (q1, q2, q4, q5).
    Joints,
    /// Motor coordinates (x_c1, x_c2, x_c3, x_c4).
    Motors,
}

/// Motion over time, in one of the two frames.
#[derive(Debug, Clone, PartialEq)]
pub enum Path<const J: usize> {
    /// One pose, stationary.
    Hold([f64; J]),
    /// Finite Fourier series, eq. (43).
    Fourier(FourierReference<J>),
    /// One coordinate runs a ladder of speeds, the others hold the pose.
    Ladder {
        moving: usize,
        pose: [f64; J],
        ladder: LadderReference,
    },
    /// Poses at times.
    Points(SplineReference<J>),
}

/// A path and the frame that it is written in.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference<const J: usize> {
    pub frame: ReferenceFrame,
    pub path: Path<J>,
}

impl<const J: usize> Path<J> {
    /// Position and velocity at time t \[s\], in the path's own frame.
    pub fn at(&self, t: f64) -> Target<J> {
        match self {
            Self::Hold(pose) => Target::rest(*pose),
            Self::Fourier(series) => series.at(t),
            Self::Points(points) => points.at(t),
            Self::Ladder {
                moving,
                pose,
                ladder,
            } => {
                let mut target = Target::rest(*pose);
                (target.position[*moving], target.velocity[*moving]) = ladder.at(t);
                target
            }
        }
    }

    /// Duration that the path itself sets \[s\]; `None` where it goes on for ever.
    pub fn seconds(&self) -> Option<f64> {
        match self {
            Self::Hold(_) => None,
            Self::Fourier(series) => series.seconds(),
            Self::Ladder { ladder, .. } => Some(ladder.seconds()),
            Self::Points(points) => Some(points.seconds()),
        }
    }

    /// # Errors
    /// [`SimulateError::Reference`] where the path is unusable.
    pub fn check(&self) -> Result<(), SimulateError> {
        match self {
            Self::Fourier(series) => series.check(),
            Self::Ladder { moving, .. } if *moving >= J => Err(SimulateError::reference(format!(
                "the ladder moves coordinate {moving} of {J}"
            ))),
            _ => Ok(()),
        }
    }
}
