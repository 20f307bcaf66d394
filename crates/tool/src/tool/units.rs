//! Units of forces, moments, lengths and angles as headers and options state them.

use std::str::FromStr;

/// Newton in a kilogram of force: the standard one.
const KGF: f64 = 9.806_65;
/// Newton in a pound of force.
const LBF: f64 = 4.448_221_615;
/// Metre in an inch.
const INCH: f64 = 0.0254;

/// Units of forces, for errors.
pub(super) const FORCES: &str = "N, kN, kgf or lbf";
/// Units of moments.
pub(super) const MOMENTS: &str = "Nm, Nmm, kgfm or lbfin";

/// A unit without spaces, dots and stars.
fn plain(unit: &str) -> String {
    let kept = unit.chars().filter(|c| !" .*·_-".contains(*c));
    kept.collect::<String>().to_lowercase()
}

/// N in a unit of force.
pub(super) fn force(unit: &str) -> Option<f64> {
    Some(match plain(unit).as_str() {
        "n" => 1.0,
        "kn" => 1e3,
        "mn" => 1e-3,
        "kgf" | "kg" | "kp" => KGF,
        "gf" | "g" => 1e-3 * KGF,
        "lbf" | "lb" => LBF,
        _ => return None,
    })
}

/// Nm in a unit of moment.
pub(super) fn moment(unit: &str) -> Option<f64> {
    Some(match plain(unit).as_str() {
        "nm" => 1.0,
        "nmm" | "mnm" => 1e-3,
        "ncm" => 1e-2,
        "kgfm" | "kgm" => KGF,
        "kgfcm" | "kgcm" => 1e-2 * KGF,
        "lbfin" | "lbin" => LBF * INCH,
        "lbfft" | "lbft" => LBF * 12.0 * INCH,
        _ => return None,
    })
}

/// m in a unit of length.
pub(super) fn length(unit: &str) -> Option<f64> {
    Some(match plain(unit).as_str() {
        "m" => 1.0,
        "mm" => 1e-3,
        "cm" => 1e-2,
        _ => return None,
    })
}

/// rad in a unit of angle.
pub(super) fn angle(unit: &str) -> Option<f64> {
    Some(match plain(unit).as_str() {
        "rad" => 1.0,
        "deg" | "°" => std::f64::consts::PI / 180.0,
        _ => return None,
    })
}

/// Unit of the forces, the moments being in it times a metre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceUnit {
    /// N in it.
    pub(super) newton: f64,
}

impl FromStr for ForceUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let newton = force(text).ok_or_else(|| format!("is none of {FORCES}"))?;
        Ok(Self { newton })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tool::GRAVITY;

    #[test]
    fn a_kilogram_of_force_is_about_free_fall_times_a_kilogram() {
        assert!((force("kgf").unwrap() - GRAVITY).abs() < 0.01);
        assert_eq!(moment("N m"), Some(1.0));
        assert_eq!(moment("N·m"), Some(1.0));
        assert!(force("stone").is_none() && "A".parse::<ForceUnit>().is_err());
    }
}
