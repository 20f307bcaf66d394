//! The motion that a model makes of measured torques: forward dynamics in windows that begin at measured states,
//! and how far the positions are off.
//!
//! M(q) a = tau - C v - G - F(v) - effects. One step takes smooth friction implicitly (Rosenbrock's method with
//! dF/dv), and friction that jumps at rest as an impulse of at most Fc dt against the motion, joint after joint
//! until all agree (Moreau 1988): a joint that rests stays at rest, however long the step. A motion judges a model
//! where torques alone hardly do: errors of slow friction and of gravity add up.
//!
//! [`FreeRun`] says how the error grows in windows, and whether a changed model runs worse. A fit moves the numbers of a
//! single axis until its motion is that of the log.

mod abreast;
mod choose;
mod fit;
mod free_run;
mod numbers;
mod stepper;
mod windows;

#[cfg(test)]
mod one_axis;

pub use choose::{AxisError, PositionErrors, TriedAxis};
pub(crate) use choose::{AxisFit, BLOCKS, fit_axis};
pub(crate) use fit::RunSpan;
pub(crate) use free_run::free_run;
pub use free_run::{FreeRun, JointFreeRun, PositionError, PositionErrorChange};
pub use windows::{JointDrift, OpenLoop};
pub(crate) use windows::{WindowLength, along};
