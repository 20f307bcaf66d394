//! What a mathematician reads: the physics of a robot, the estimators, and the diagnosis of what a model lacks.
//!
//! tau = Y(q, v, a) theta + F(v): a regressor Y that is linear in the inertial parameters, and a friction law F
//! per joint (eq. (60) and (18) of Rodriguez-Angeles et al. 2002). Nothing here opens a file.

#![forbid(unsafe_code)]

pub mod block;
pub mod math;
pub mod number;
pub mod robot;
pub mod verdict;

pub mod motion;

pub mod effect;

pub mod friction;
pub mod inertia;

pub mod diagnose;
pub mod judge;
pub mod validate;
