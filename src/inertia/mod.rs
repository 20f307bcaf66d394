//! Room `inertia`.
