//! From a residual to the effect that the model lacks.
//!
//! ```text
//! logs -> stretches -> data split (fit, folds, veto, holdout)
//!      fit -> orders -> search (candidates) -> accept, placebo, choose, add -> removal -> fit ..
//!          -> reconsider -> search ..  -> errors
//! ```
//!
//! Every candidate is tested beside everything that is declared, with its columns projected off it:
//! a share of its own, an F test that correlated residuals do not break, a criterion with the
//! effective sample size, cross-validation over blocks with gaps, and data set aside that may
//! veto. All must agree. Held-out data are evaluated once, at the end.
//!
//! | room | what |
//! |---|---|
//! | `problem` | which rows do what, the unknowns, and their joint fit |
//! | `faults` | torque channels and disturbances, before any physics |
//! | `candidates` | every effect at every place, its shape and its significance |
//! | `placebo` | what chance makes of a model that lacks nothing |
//! | `selection` | which one is added, and which one goes again |
//! | `unexplained` | errors, the noise floor, and what is above it |
//! | `uncertainty` | covariance, bias, and the profile of shapes |
//! | `run` | the loop over all of these |

mod candidates;
mod error;
mod faults;
mod outcome;
mod placebo;
mod prepare;
mod problem;
mod run;
mod selection;
mod uncertainty;
mod unexplained;
mod watch;

pub use candidates::candidate::Candidate;
pub use candidates::score::CandidateScore;
pub use error::DiagnoseError;
pub use faults::channels::Suspicion;
pub use faults::disturbance::CutDisturbance;
pub use outcome::{AcceptedEffect, Diagnosis, SplitErrors, StepStatus, Turn};
pub use placebo::blocks::DRAWS as PLACEBOS;
pub use problem::case::{Case, SelectionLimits};
pub use problem::data_split::{LogRole, SetAside};
pub use problem::prior::ParameterPrior;
pub use problem::unknowns::{FreeParameters, Unknown};
pub use problem::wide_motion::{TIMES as WIDE_TIMES, WideMotion};
pub use run::diagnose;
pub use unexplained::dependence::Dependence;
pub use unexplained::errors::{Errors, JointChange, JointErrors, OverallErrors};
pub use unexplained::evidence::{JointEvidence, evidence, one_after_the_other};
pub use unexplained::map::ResidualMap;
pub use unexplained::signal::Signal;
pub use unexplained::{STRUCTURED, Unexplained};
pub use watch::{Heard, UNWATCHED, Watch};
