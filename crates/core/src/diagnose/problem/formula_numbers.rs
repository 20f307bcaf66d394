//! What decides on formulas of what is left.

/// The numbers that decide a search.
#[derive(Debug, Clone, Copy)]
pub struct FormulaNumbers {
    /// Most terms of a formula. Half: products of sums are missed; twice: the last ones fit what the first left.
    pub terms: usize,
    /// Most numbers that shape it. One: no hysteresis that falls with speed; twice: every curve is a formula.
    pub shapes: usize,
    /// A term takes at least this part off the squared error. Half: terms that no one can tell from noise; twice: a
    /// third of a friction that two signals set is left.
    pub least_share: f64,
    /// Part of a column's square beside the declared ones below which it has nothing of its own to say.
    pub own_share: f64,
    /// Terms that are looked at on blocks left out, the best on all blocks. Half: the same formulas in most cases.
    pub shortlist: usize,
    /// Rows of a joint that are searched, about: neighbours in the kept band repeat each other.
    pub rows: usize,
    /// Searches where whole parts have another sign. Half: no chance as small as `chance` can be shown.
    pub draws: usize,
    /// Chance above which a formula is not reported.
    pub chance: f64,
    /// Seed of the signs.
    pub seed: u64,
}

/// The numbers of `diagnose --search`.
pub const FORMULA_NUMBERS: FormulaNumbers = FormulaNumbers {
    terms: 4,
    shapes: 2,
    least_share: 0.02,
    own_share: 1e-3,
    shortlist: 16,
    rows: 4000,
    draws: 99,
    chance: 0.01,
    seed: 20_260_917,
};
