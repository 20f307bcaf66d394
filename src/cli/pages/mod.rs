//! The HTML reports: what each section says, and which sections each command has. The verdict comes
//! first, in words and one table; what it stands on follows; where it came from ends the page.

mod compare;
mod diagnose;
mod fit;
mod friction;
mod friction_fit;
mod identify;
mod look;
mod lsq;
mod parameters;
mod quality;
mod residual;
mod torque;
mod validate;

pub(super) use compare::{Compare, compare};
pub(super) use diagnose::{Diagnose, data_fault, diagnose, figure as diagnose_figure};
pub(super) use friction::{curve, speeds};
pub(super) use friction_fit::{FrictionFit, friction_fit};
pub(super) use identify::{Identify, identify};
pub(super) use look::{Look, held_for_pictures};
pub(super) use lsq::{Lsq, lsq};
pub(super) use validate::{Validate, validate};
