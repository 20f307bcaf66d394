//! Links as a tree (a chain is one), the regressor of their parameters, and its base parameters.

pub mod base;
pub mod capsule;
pub mod enclosing;
pub mod links;
pub mod newton_euler;
pub mod parameters;
pub mod pose;
pub mod space;

pub use base::ParameterGroup;
pub use links::{
    Coordinate, DependentCoordinate, Link, MOST_JOINTS, MOST_LINKS, SineTerm, Tree, TreeError,
};
pub use parameters::{JointCoupling, Parameters};
