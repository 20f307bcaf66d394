//! What may be missing: every effect at every place, its shape searched, its significance.

pub mod baseline;
pub mod candidate;
pub mod columns;
pub mod orders;
pub mod score;
pub mod search;
