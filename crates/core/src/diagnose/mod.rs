//! From a residual to the effect that the model lacks.
//!
//! ```text
//! logs -> stretches -> data split -> fit of what is declared -> blocks
//!      -> one pass over the rows: sums of products of every candidate per block and joint
//!      -> search (friction laws, then all else) -> the set settles -> the model is fitted beside it -> held-out data
//! ```
//!
//! What decides is the [judge](crate::judge): blocks of time left out screen, and an amplitude over its deviation when
//! each block is left out tests and shrinks it. What is not sure is reported, and nothing weaker is put in its place.
//! Held-out data are looked at in the end.

mod accepted;
mod candidates;
mod change;
mod error;
mod formula;
mod held_out;
mod memory;
mod orders;
mod outcome;
mod polish;
mod prepared;
mod problem;
mod refit;
mod run;
mod search;
mod searched;
mod steps;
mod tables;
mod unexplained;
mod watch;

pub use error::DiagnoseError;
pub use outcome::{
    ChangedTorque, Diagnosis, FormulaEnd, FormulaPicture, FormulaSymmetry, FoundEffect,
    FoundFormula, LeftCandidate, NotWritten, PredictingTerm, SplitErrors, StepStatus, TorqueChange,
};
pub use problem::case::{AcceptedEffect, DiagnosisCase, DiagnosisOptions};
pub use problem::data_split::{LogRole, SetAside};
pub use problem::formula_numbers::{FORMULA_NUMBERS, FormulaNumbers};
pub use problem::prediction_numbers::{PREDICTION_NUMBERS, PredictionNumbers};
pub use problem::prior::ParameterPrior;
pub use problem::unknowns::{FreeParameters, Unknown, value_of};
pub use refit::{ModelProposal, ModelRefit};
pub use run::diagnose;
pub use unexplained::UnexplainedResidual;
pub use unexplained::dependence::SignalDependence;
pub use unexplained::errors::{JointChange, JointErrors, OverallErrors, UseErrors};
pub use unexplained::evidence::{JointEvidence, evidence, one_after_the_other};
pub use unexplained::map::ResidualMap;
pub use unexplained::signal::Signal;
pub use watch::{DiagnosisProgress, DiagnosisWatch};
