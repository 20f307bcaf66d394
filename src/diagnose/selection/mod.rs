//! Which candidate is added, and which effect goes again: all tests must agree.

pub mod accept;
pub mod choose;
pub mod reconsider;
pub mod removal;
