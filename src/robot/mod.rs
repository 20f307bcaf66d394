//! Room `robot`.
