//! Models for other programs: C, Rust, URDF and simulator files.

#![forbid(unsafe_code)]

pub mod export;
