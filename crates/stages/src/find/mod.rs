//! What is wrong with a robot file, and what its model lacks.

pub(crate) mod accepted_setup;
pub(crate) mod check_setup;
pub(crate) mod diagnose;
pub(crate) mod diagnosis;
pub(crate) mod formulas;
pub(crate) mod next_motion;
pub(crate) mod prediction_only;
pub(crate) mod refined_model;
pub(crate) mod setup_words;
