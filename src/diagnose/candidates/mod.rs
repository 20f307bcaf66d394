//! What may be missing: every effect at every place, its shape searched, its significance.

pub mod orders;
pub mod score;
pub mod search;
