//! Sections that several reports share.

pub(crate) mod effects;
pub(crate) mod fit;
pub(crate) mod free_run;
pub(crate) mod friction;
pub(crate) mod parameters;
pub mod provenance;
pub mod quality;
pub mod residual;
pub(crate) mod sketch;
pub(crate) mod torque;
