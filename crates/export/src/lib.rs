//! Models for other programs: C, Rust, URDF and simulator files.
//!
//! [`export::Program`] is a model as code sees it; [`export::module`] writes it as Rust, [`export::arm`] and
//! [`export::urdf`], [`export::mjcf`], [`export::sdf`], [`export::usd`] the arm for simulators.
//!
//! ```
//! use cft_ident_core::robot::model::{JointFriction, Model};
//! use cft_ident_core::robot::{JointKind, Robot};
//! use cft_ident_export::export::{Note, Program, module};
//!
//! let model = Model {
//!     robot: Robot::single_joint("wheel", JointKind::Revolute),
//!     theta: vec![0.2],
//!     friction: vec![JointFriction::None],
//!     offset: vec![0.0],
//! };
//! let text = module::module(&Program::of(&model), &Note::default());
//! assert!(text.contains("pub fn gravity"));
//! ```

#![forbid(unsafe_code)]

pub mod export;
pub mod read_back;
