//! The HTML reports: what each section says, and which sections each command has. The verdict comes
//! first, in words and one table; what it stands on follows; where it came from ends the page.

mod compare;
mod diagnose;
mod identify;

pub(super) use compare::{Compare, compare};
pub(super) use diagnose::{Diagnose, data_fault, diagnose, figure as diagnose_figure};
pub(super) use identify::{Identify, identify};
