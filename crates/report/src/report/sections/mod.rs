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
    const MOST: usize = 3;
    match names.len() > MOST {
        true => format!(
            "{} and {} more",
            names[..MOST].join(", "),
            names.len() - MOST
        ),
        false => names.join(", "),
    }
}
