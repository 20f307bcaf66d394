//! Loops over lanes, compiled for the widest vectors of the processor that runs them.

pub use pulp::Simd;

/// Loops over lanes.
pub trait LaneWork {
    type Output;

    /// Does it with the vectors of `simd`. To be marked `#[inline(always)]`, with all that it calls: only what is
    /// inlined here is compiled for wide vectors. That is why this is no closure, which the compiler may leave a
    /// function of its own.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Does `work` with the widest vectors that this processor has. Numbers do not depend on the width: lanes are separate
/// sums, and no product is fused with a sum.
#[inline(always)]
pub fn widest<W: LaneWork>(work: W) -> W::Output {
    pulp::Arch::new().dispatch(WideLanes(work))
}

/// Work over lanes, for `pulp` to give the widest vectors to.
struct WideLanes<W>(W);

impl<W: LaneWork> pulp::WithSimd for WideLanes<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> W::Output {
        self.0.run(simd)
    }
}
