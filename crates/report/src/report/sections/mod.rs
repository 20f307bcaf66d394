//! What several reports say alike, section by section.

pub mod effects;
pub mod fit;
pub mod free_run;
pub mod friction;
pub mod parameters;
pub mod provenance;
pub mod quality;
pub mod residual;
pub mod sketch;
pub mod torque;

/// The first few of many names.
fn first_of(names: &[String]) -> String {
    const MAX_NAMES: usize = 3;
    match names.len() > MAX_NAMES {
        true => format!(
            "{} and {} more",
            names[..MAX_NAMES].join(", "),
            names.len() - MAX_NAMES
        ),
        false => names.join(", "),
    }
}
