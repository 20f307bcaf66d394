//! What several reports say alike, section by section.

pub mod provenance;
