//! What several reports say alike, section by section.

pub mod effects;
pub mod fit;
pub mod friction;
mod look;
pub mod parameters;
pub mod provenance;
pub mod quality;
pub mod residual;
pub mod sketch;
pub mod torque;

pub use look::Look;
