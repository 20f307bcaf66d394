//! Links as a tree (a chain is one), the regressor of their parameters, and its base parameters.
//!
//! | file | what |
//! |---|---|
//! | [`space`] | vectors and rotations |
//! | [`links`] | links, joints, dependent coordinates |
//! | [`newton_euler`] | the regressor of the standard parameters, one recursion |
//! | [`base`] | which combinations of them torques can determine |
//! | [`pose`] | where the links are |
//! | [`capsule`] | how far their shapes are from each other |
//! | [`enclosing`] | a capsule about points |
//! | [`parameters`] | these, drive inertias and couplings as parameters with names |

pub mod base;
pub mod capsule;
pub mod enclosing;
pub mod links;
pub mod newton_euler;
pub mod parameters;
pub mod pose;
pub mod space;

pub use base::Grouping;
pub use links::{
    Coordinate, DependentCoordinate, Link, MOST_JOINTS, MOST_LINKS, Sine, Tree, TreeError,
};
pub use parameters::{Coupling, Parameters};
