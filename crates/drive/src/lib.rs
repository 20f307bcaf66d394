//! Drives from command and encoder.
#![forbid(unsafe_code)]

pub mod drive;
