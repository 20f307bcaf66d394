//! How a model is fitted beside effects that are held: by whoever knows how the given model was fitted.

use nalgebra::DMatrix;

use super::error::DiagnoseError;
use crate::effect::{AugmentedModel, ModelEffect};

/// A model that would be written: effects with the amplitudes that predict, the declared numbers by the judge's sums.
pub struct ModelProposal<'a> {
    pub model: &'a AugmentedModel,
    /// Information matrix of the unknowns beside fixed effects, in independent rows.
    pub information: &'a DMatrix<f64>,
    /// The declared numbers stay those of the model with these effects alone: the given one, or one that was proposed before.
    pub numbers_of: Option<&'a [ModelEffect]>,
}

/// Fits the declared numbers beside the effects of a proposal, as the given model was fitted, and gives the model that
/// torques would be computed with.
pub type ModelRefit<'a> =
    dyn Fn(&ModelProposal) -> Result<AugmentedModel, DiagnoseError> + Sync + 'a;
