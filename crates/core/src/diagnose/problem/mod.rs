//! What a diagnosis works on: data and their use, the unknowns, the columns of all rows, and the fit of the declared
//! model.

pub mod case;
pub mod constant_columns;
pub mod data_split;
pub mod fit;
pub mod formula_numbers;
pub mod pass;
pub mod prediction_numbers;
pub mod prior;
pub(crate) mod rests;
pub mod unknowns;
