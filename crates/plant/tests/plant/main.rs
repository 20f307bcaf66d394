//! Tests of the simulator and the design of motions.

mod excite_criterion;
mod excite_limits;
mod simulate_cft;
mod simulate_effects;
mod simulate_integration;
mod simulate_limits;
mod simulate_order;
mod simulate_sensors;
