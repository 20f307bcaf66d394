//! Every stage of an identification as a function of logs and a request.

#![forbid(unsafe_code)]

pub mod band;
pub mod compare;
pub mod identify;
pub mod observe;
pub mod open_loop;
pub mod replay;
pub mod setup;
