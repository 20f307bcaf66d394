//! A plant to test against, and motions within limits. The estimators never import this crate.

#![forbid(unsafe_code)]

pub mod excite;
pub mod simulate;
