//! Parameters over time, and robots of a fleet compared.

#![forbid(unsafe_code)]

pub mod track;
