//! Why no diagnosis comes out.

use crate::effect::formula::FormulaError;
use crate::motion::MotionError;

/// Why no diagnosis came out.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error(
        "{rows} rows are left to fit after filtering and what is set aside, too few for {unknowns} \
         unknowns; give a longer log, or logs of their own by --holdout"
    )]
    TooFewRows { rows: usize, unknowns: usize },
    #[error(
        "these logs determine none of the {unknowns} unknowns of the model; log a motion of every joint"
    )]
    NothingDetermined { unknowns: usize },
    #[error("the torque of joint {joint} is zero throughout; check its channel")]
    NoTorque { joint: String },
    #[error("no effect {name} can be accepted: {why}")]
    Accept { name: String, why: String },
    #[error(transparent)]
    Formula(Box<FormulaError>),
    #[error("interrupted")]
    Interrupted,
}

impl From<FormulaError> for DiagnoseError {
    fn from(error: FormulaError) -> Self {
        Self::Formula(Box::new(error))
    }
}
