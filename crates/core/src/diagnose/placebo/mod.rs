//! What chance and processing make of a model that lacks nothing.
//!
//! The null hypothesis is the model as it stands, measured and processed as these logs were. Its residual comes in
//! blocks at their own place with random signs: the noise keeps its tie to the motion and its spectrum, and loses
//! what it has in common from block to block (the wild cluster bootstrap of scores: Kline and Santos 2012; Cameron,
//! Gelbach and Miller 2008). The declared parameters are refitted with each draw by the factors that stand, with
//! their prior's values drawn from its covariance, and every candidate is tried on it with all its shapes. A
//! candidate is as good as its place among the best of each draw (Westfall and Young 1993).

pub mod blocks;
pub mod draws;
pub mod processing;
pub mod scores;
