//! Identification of robot dynamics from logged joint positions and torques.
//!
//! The model is `tau = Y(q, v, a) theta + F(v)`: a regressor `Y` that is linear in the inertial
//! parameters, and a friction law `F` per joint (eq. (60) and (18) of Rodriguez-Angeles et al. 2002).
//!
//! | room | input | output | source |
//! |---|---|---|---|
//! | [`log`] | CSV file | blocks of t, q, tau | |
//! | [`motion`] | blocks | filtered, decimated rows of q, v, a, tau | |
//! | [`friction`] | one-joint logs | theta 13..32 with covariance | eq. (30)-(38) |
//! | [`inertia`] | rows, friction | theta 1..12 with covariance | eq. (39)-(42) |
//! | [`diagnose`] | model, logs | effects that the model lacks, refined model | |
//! | [`validate`] | a log that was not used, model | torque errors | Figures 7 and 8 |
//! | [`compare`] | two models, logs | differences of parameters and errors | Kuensch 1989 |
//! | [`report`] | results | tables, figures | |
//! | [`export`] | model | C header, Rust module, URDF | |
//!
//! [`robot`] holds the physics, [`math`] what is small and general, [`config`] the files,
//! [`simulate`] a plant to test against.

pub mod math;
pub mod number;
pub mod robot;
pub mod verdict;

pub mod log;

pub mod motion;

pub mod effect;
pub mod inspect;

pub mod friction;
pub mod inertia;

pub mod diagnose;
pub mod validate;

pub mod simulate;

pub mod excite;

pub mod report;

pub mod config;
pub mod export;
pub mod output;

pub mod compare;

pub mod identify;

pub mod cli;
