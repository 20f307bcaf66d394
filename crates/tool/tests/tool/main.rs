//! What hangs on a sensor, and gravity from held poses: against simulated truth, measured logs, and bad input.

mod bad_input;
mod coverage;
mod effects;
mod gravity;
mod measured;
mod sensor;
