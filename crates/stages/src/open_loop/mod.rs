//! The motion that a model makes of measured torques: forward dynamics in windows that begin at measured states,
//! and how far the positions are off.
//!
//! M(q) a = tau - C v - G - F(v) - effects. One step takes smooth friction implicitly (Rosenbrock's method with
//! dF/dv), and friction that jumps at rest as an impulse of at most Fc dt against the motion, joint after joint
//! until all agree (Moreau 1988): a joint that rests stays at rest, however long the step. A motion judges a model
//! where torques alone hardly do: errors of slow friction and of gravity add up.
//!
//! [`free_run`] says how the error grows in windows, and whether a changed model runs worse. [`fit_axis`] moves the
//! numbers of a single axis until its motion is that of the log.

mod abreast;
mod choose;
mod fit;
mod free_run;
mod numbers;
mod stepper;
mod windows;

pub use choose::{AxisError, AxisFit, BLOCKS, PositionErrors, TriedAxis, fit_axis};
pub use fit::RunSpan;
pub use free_run::{
    FREE_RUN_S, FreeRun, JointFreeRun, PositionError, PositionErrorChange, free_run,
};
pub use stepper::Stepper;
pub use windows::{JointDrift, OpenLoop, WindowLength, along};
