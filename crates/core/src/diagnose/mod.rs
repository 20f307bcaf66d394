//! From a residual to the effect that the model lacks.
//!
//! ```text
//! logs -> stretches -> data split -> fit of what is declared -> blocks and parts
//!      -> one pass over the rows: sums of products of every candidate per block and joint
//!      -> search (friction laws, then all else) -> parts -> two tables -> held-out data
//! ```
//!
//! What decides is the [judge](crate::judge): blocks of time left out screen, the agreement of an amplitude between
//! parts of the data tests and shrinks it. What fits best and is not confirmed is reported, and nothing weaker is put in
//! its place. Held-out data are looked at once, at the end.
//!
//! | room | does |
//! |---|---|
//! | `problem` | which rows do what, the unknowns, the pass over the rows, the fit of what is declared |
//! | `memory`, `orders` | how long the residual remembers, and which waves over the position it has |
//! | `candidates` | every effect at every place in every shape |
//! | `search` | the greatest gain on blocks left out, again and again |
//! | `steps`, `tables`, `held_out` | the parts' verdict, estimates and predictions, held-out data |
//! | `change` | friction that changes from a time on |
//! | `unexplained` | errors, the noise floor, and what is above it |
//! | `prepared` | the declared model fitted, and the data divided |
//! | `searched`, `polish` | what is chosen of the candidates, in its best shape |
//! | `formula` | a formula of what is left, where the user asks for it |
//! | `run` | the loop over all of these |

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
mod run;
mod search;
mod searched;
mod steps;
mod tables;
mod unexplained;
mod watch;

pub use error::DiagnoseError;
pub use outcome::{
    Diagnosis, FormulaEnd, FormulaPicture, FoundEffect, FoundFormula, FrictionChange,
    LeftCandidate, SplitErrors, StepStatus, Symmetry,
};
pub use problem::case::{Case, Wishes};
pub use problem::data_split::{LogRole, SetAside};
pub use problem::formula_numbers::{FORMULA_NUMBERS, FormulaNumbers};
pub use problem::prior::ParameterPrior;
pub use problem::unknowns::{FreeParameters, Unknown};
pub use run::{diagnose, errors_of};
pub use unexplained::dependence::Dependence;
pub use unexplained::errors::{Errors, JointChange, JointErrors, OverallErrors};
pub use unexplained::evidence::{JointEvidence, evidence, one_after_the_other};
pub use unexplained::map::ResidualMap;
pub use unexplained::signal::Signal;
pub use unexplained::{STRUCTURED, Unexplained};
pub use watch::{Heard, UNWATCHED, Watch};
