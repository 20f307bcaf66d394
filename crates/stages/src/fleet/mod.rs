//! Logs reduced to small files, and what they say over time and of several robots.

pub(crate) mod one_log;
pub(crate) mod reduce;
pub(crate) mod track;
pub(crate) mod track_source;
