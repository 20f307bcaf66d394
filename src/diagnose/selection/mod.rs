//! Which candidate is added: all tests must agree.

pub mod accept;
