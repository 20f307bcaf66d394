//! What is fitted: which rows do what, the unknowns, their filtered columns, what is known of them, and the joint fit.

pub mod case;
pub mod cross_products;
pub mod data_split;
pub mod fit;
pub mod fit_problem;
pub mod normal_equations;
pub mod prior;
pub mod rests;
pub mod rows;
pub mod unknowns;
pub mod wide_motion;
