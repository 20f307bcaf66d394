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

mod accept;
mod candidate;
mod covariance;
mod episode;
mod evidence;
mod fit;
mod floor;
mod left;
mod measure;
mod moved;
mod orders;
mod period;
mod plan;
mod profile;
mod rows;
mod run;
mod search;
mod suspect;
mod unknowns;

pub use accept::{Candidate, Limits};
pub use candidate::Score;
pub use episode::Episode;
pub use evidence::{JointEvidence, evidence};
pub use fit::Prior;
pub use left::{Left, STRUCTURED};
pub use measure::{Errors, JointErrors, OverallErrors};
pub use plan::{LogRole, SetAside};
pub use run::{Case, DiagnoseError, Diagnosis, Pair, Step, diagnose};
pub use suspect::Suspicion;
pub use unknowns::{Open, Unknown};
