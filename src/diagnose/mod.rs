//! From a residual to the effect that the model lacks.
//!
//! ```text
//! logs -> stretches -> plan (fit, folds, veto, holdout)
//!      fit -> orders -> search (candidates) -> choose -> add -> fit ..  -> removal -> measure
//! ```
//!
//! Every candidate is tested beside everything that is declared, with its columns projected off it:
//! a share of its own, an F test that correlated residuals do not break, a criterion with the
//! effective number of rows, cross-validation over blocks with gaps, and data set aside that may
//! veto. All must agree. The holdout decides nothing.

mod candidates;
mod faults;
mod problem;
mod run;
mod selection;
mod uncertainty;
mod unexplained;

pub use candidates::score::Score;
pub use faults::channels::Suspicion;
pub use faults::episode::Episode;
pub use problem::fit::Prior;
pub use problem::plan::{LogRole, SetAside};
pub use problem::unknowns::{Open, Unknown};
pub use run::{Case, DiagnoseError, Diagnosis, Pair, Step, diagnose};
pub use selection::accept::{Candidate, Limits};
pub use unexplained::errors::{Errors, JointErrors, OverallErrors};
pub use unexplained::evidence::{JointEvidence, evidence};
pub use unexplained::{Left, STRUCTURED};
