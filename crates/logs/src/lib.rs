//! Logs of robots: reading, inspecting, mapping and writing.

#![forbid(unsafe_code)]

pub mod inspect;
pub mod log;
pub mod mapping;
pub mod output;
