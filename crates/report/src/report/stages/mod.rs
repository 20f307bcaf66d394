//! The reports, one file per stage: the verdict comes first, in words and one table; its grounds follow, and the origin
//! of the page ends it.

pub mod compare;
pub mod diagnose;
mod diagnose_words;
pub mod drive;
pub mod excite;
mod first_screen;
mod formulas;
mod found_effects;
pub mod friction;
pub mod held;
pub mod identify;
pub mod inspect;
pub mod lsq;
mod quality_of_fit;
pub mod setup;
pub mod show;
mod step_words;
pub mod tool;
pub mod track;
pub mod validate;
mod what_is_left;
