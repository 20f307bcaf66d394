//! Faults of the data that come before any physics: torque channels that are not what they say, and disturbances.

pub mod channels;
pub mod disturbance;
