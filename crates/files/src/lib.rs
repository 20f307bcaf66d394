//! Robot, model, trajectory and campaign files.

#![forbid(unsafe_code)]

pub mod config;
