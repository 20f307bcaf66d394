//! Room `friction`.
