//! What is known of the unknowns: their covariance, their bias, and the profile of shapes.

mod bias;
pub mod covariance;
mod profile;
