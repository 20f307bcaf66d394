//! Errors of a model on data that it was not fitted to: validation, bands of data set aside, two models beside each other.

pub(crate) mod compare;
pub(crate) mod hold_out;
pub(crate) mod open_loop;
pub(crate) mod residual;
pub(crate) mod torque;
pub(crate) mod validate;
