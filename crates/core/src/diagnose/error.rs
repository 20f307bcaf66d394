//! Why no diagnosis comes out.

use crate::effect::formula::FormulaError;
use crate::motion::MotionError;
use crate::problem::{Explain, Problem};

/// Why no diagnosis came out.
#[derive(Debug, Explain, thiserror::Error)]
pub enum DiagnoseError {
    #[problem(_0.problem())]
    Motion(#[from] MotionError),
    #[problem(
        "{rows} rows are left to fit after filtering and what is set aside, too few for {unknowns} unknowns",
        "give a longer log, or logs of their own by --holdout"
    )]
    TooFewRows { rows: usize, unknowns: usize },
    #[problem(
        "these logs determine none of the {unknowns} unknowns of the model",
        "log a motion of every joint"
    )]
    NothingDetermined { unknowns: usize },
    #[problem("the torque of joint {joint} is zero throughout", "check its channel")]
    NoTorque { joint: String },
    #[problem(why.clone().of(format!("no effect {name} can be accepted")))]
    Accept { name: String, why: Problem },
    #[problem(_0.problem())]
    Formula(Box<FormulaError>),
    #[problem("interrupted")]
    Interrupted,
}

impl From<FormulaError> for DiagnoseError {
    fn from(error: FormulaError) -> Self {
        Self::Formula(Box::new(error))
    }
}
