//! Why no diagnosis comes out.

use crate::effect::formula::FormulaError;
use crate::explain::{ErrorText, Explain};
use crate::motion::MotionError;

/// Why no diagnosis came out.
#[derive(Debug, Explain, thiserror::Error)]
pub enum DiagnoseError {
    #[explain(_0.explanation())]
    Motion(#[from] MotionError),
    #[explain(
        "{rows} rows are left to fit after filtering and what is set aside, too few for {unknowns} unknowns",
        "give a longer log, or logs of their own by --holdout"
    )]
    TooFewRows { rows: usize, unknowns: usize },
    #[explain(
        "these logs determine none of the {unknowns} unknowns of the model",
        "log a motion of every joint"
    )]
    NothingDetermined { unknowns: usize },
    #[explain("the torque of joint {joint} is zero throughout", "check its channel")]
    NoTorque { joint: String },
    #[explain(why.clone().of(format!("no effect {name} can be accepted")))]
    Accept { name: String, why: ErrorText },
    #[explain(
        "{first} and {second} say the same of one place, and a model has one of them",
        "accept one of the two"
    )]
    Exclusive { first: String, second: String },
    #[explain(_0.explanation())]
    Formula(Box<FormulaError>),
    #[explain("interrupted")]
    Interrupted,
    /// The fit beside the effects failed; who made it knows why.
    #[explain("the model cannot be fitted beside the effects that were found")]
    Refit,
}

impl From<FormulaError> for DiagnoseError {
    fn from(error: FormulaError) -> Self {
        Self::Formula(Box::new(error))
    }
}
