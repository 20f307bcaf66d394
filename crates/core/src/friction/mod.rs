//! Friction parameters theta 13..32, joint by joint, by a continuous-discrete extended Kalman
//! filter (eq. (29)-(38)).
//!
//! `prepare` turns the motion of all joints into the one-joint problem, `inputs` smooths it anew,
//! `start` guesses from the log, `filter` is the filter, `score` the same filter at fixed parameters, `passes` the search,
//! `slope` the bounds of slopes that a log cannot determine, `propagate` the integrals that filter
//! and score share, `departure` how far the torque departs from the law, `thinned` the share of a long log that the search sees.

mod departure;
pub mod estimate;
pub mod excitation;
pub mod filter;
pub mod inputs;
pub mod joint_estimate;
pub mod motions;
pub mod passes;
pub mod plateau;
pub mod prepare;
pub mod problem;
mod propagate;
pub mod score;
mod slope;
mod smoothing;
mod start;
mod thinned;
#[cfg(test)]
mod trial;
