//! What a mathematician reads: the physics of a robot, the estimators, and the diagnosis of what a model lacks.
//!
//! tau = Y(q, v, a) theta + F(v): a regressor Y that is linear in the inertial parameters, and a friction law F
//! per joint (eq. (60) and (18) of Rodriguez-Angeles et al. 2002). Nothing here opens a file.
//!
//! [`robot::Robot`] holds the physics, [`robot::model::Model`] is a robot with its numbers, and
//! [`effect::AugmentedModel`] a model with what a rigid one leaves out. [`inertia::solve::fit`] and
//! [`friction::estimate::estimate`] find the numbers, [`diagnose::diagnose`] the effects, by the judge in [`judge`].
//!
//! ```
//! use cft_ident_core::robot::cft::{LaboratorySetup, ParameterStructure};
//! use cft_ident_core::robot::friction::ViscousCoulomb;
//! use cft_ident_core::robot::model::{JointFriction, Model};
//! use cft_ident_core::robot::{JointKind, Robot};
//!
//! let friction = ViscousCoulomb { viscous: 0.8, coulomb: 1.5 };
//! let model = Model {
//!     robot: Robot::single_joint("wheel", JointKind::Revolute),
//!     theta: vec![0.2], // inertia [kg m2]
//!     friction: vec![JointFriction::ViscousCoulomb(friction)],
//!     offset: vec![0.0],
//! };
//! let mut tau = [0.0];
//! model.torque(&[0.0], &[2.0], &[5.0], &mut tau); // q [rad], v [rad/s], a [rad/s2]
//! assert!((tau[0] - (0.2 * 5.0 + 0.8 * 2.0 + 1.5)).abs() < 1e-12);
//!
//! // the CFT robot: torques are linear in its twelve inertial parameters
//! let cft = Robot::cft(LaboratorySetup::default(), ParameterStructure::default());
//! let mut y = vec![0.0; cft.joints() * cft.parameters().len()];
//! cft.regressor(&[0.1; 4], &[0.2; 4], &[0.3; 4], &mut y);
//! assert_eq!(y.len(), 4 * 12);
//! ```

#![forbid(unsafe_code)]

// `cft-ident-derive` names this crate
extern crate self as cft_ident_core;

pub mod block;
pub mod explain;
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
