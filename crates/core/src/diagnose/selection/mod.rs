//! Which candidate is added, and which effect goes again: all tests must agree.

pub mod accept;
pub mod choose;
mod dissipation;
pub mod physics;
pub mod reconsider;
pub mod removal;
pub mod stand_in;
