//! Numbers, files and lengths that nobody should give: every command ends with a status, a message and
//! bounded memory, and leaves no half file. Data are generated and seeded.
#![cfg(unix)]

mod bench;
mod causes;
mod every_command;
mod extremes;
mod faulty_logs;
mod lost_parts;
#[path = "../program/measured_support/mod.rs"]
mod measured_support;
mod metamorphic;
mod numbers;
mod outputs;
#[path = "../../crates/logs/tests/logs/log_support/recording.rs"]
mod recording;
mod repeated;
mod sizes;
