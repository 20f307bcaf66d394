//! Loops over lanes, compiled for the widest vectors of the processor that runs them.

/// Calls `work`, whose loops are compiled for each width of vectors that a processor may have, with the code
/// for the widest that this one has.
///
/// Only what is inlined into `work` is compiled so. Numbers do not depend on the width: lanes are separate
/// sums, and no product is fused with a sum.
#[inline(always)]
pub fn widest<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}
