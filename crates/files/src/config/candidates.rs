//! Effects of a user's own: formulas that `diagnose` tries beside those that it knows (`--candidates FILE.toml`). A
//! model file keeps those that its effects are of.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::document::TomlDocument;
use cft_ident_core::robot::FormulaSignal;

/// Most effects of one file.
const MAX_EFFECTS: usize = 100;
/// Most columns of one effect, and most shapes.
const MOST_COLUMNS: usize = 12;
const MOST_SHAPES: usize = 3;
const MAX_FORMULA_CHARACTERS: usize = 400;

/// An effect of a user's own: a torque linear in some coefficients, each with a formula in the motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CandidateSection {
    /// Name in results and model files; no effect that the tool knows has it.
    pub name: String,
    /// Joints whose torque it may be, each by itself; all of them where it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<Vec<String>>,
    /// Formula of each coefficient, by its name, in q, v, a, load, direction and temperature of the joint itself, the same of others as
    /// `q_NAME` (in braces where the name has more than letters, digits and underscores: `{q_arm 2}`), the time t since the begin of the log and
    /// the shapes. SI units and radians.
    pub formulas: BTreeMap<String, String>,
    /// Unit of each coefficient, for files and tables.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub units: BTreeMap<String, String>,
    /// Numbers that shape the formulas, searched within their ranges.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub shapes: BTreeMap<String, ShapeRange>,
    /// Whether it is friction, which takes power with all other friction of its joint.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub friction: bool,
    /// Whether its torque is the same while the joint rests, as that of a spring.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub at_rest: bool,
    /// What it is, in words.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub meaning: String,
}

/// Values that a shape may have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeRange {
    /// Least value.
    pub from: f64,
    /// Largest value.
    pub to: f64,
    /// Its unit, for files and tables.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub unit: String,
}

fn one() -> String {
    "1".to_owned()
}

fn is_one(unit: &String) -> bool {
    unit == "1"
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CandidatesToml {
    candidate: Vec<CandidateSection>,
}

/// Reads a file of candidates from its text; `file` names it in errors.
///
/// # Errors
/// What the file has wrong, with its line. Formulas are read where their robot is known.
pub fn parse(file: &str, text: &str) -> Result<Vec<CandidateSection>, ConfigError> {
    let document = TomlDocument::new(file, text);
    let raw: CandidatesToml = document.read()?;
    check(&raw.candidate, &document)?;
    Ok(raw.candidate)
}

/// The text of a file of candidates.
///
/// # Errors
/// [`toml::ser::Error`] for what TOML cannot hold.
pub fn to_toml(candidates: &[CandidateSection]) -> Result<String, toml::ser::Error> {
    toml::to_string(&CandidatesToml {
        candidate: candidates.to_vec(),
    })
}

/// Checks what needs no robot.
pub(super) fn check(
    candidates: &[CandidateSection],
    document: &TomlDocument,
) -> Result<(), ConfigError> {
    if candidates.len() > MAX_EFFECTS {
        let problem = format!("has {} tables", candidates.len());
        return Err(document.value(&["candidate"], &problem, "give at most 100"));
    }
    for (index, candidate) in candidates.iter().enumerate() {
        let index_text = index.to_string();
        let wrong = |at: &[&str], problem: &str, remedy: &str| {
            let at = [&["candidate", index_text.as_str()], at].concat();
            Err(document.value(&at, problem, remedy))
        };
        if !is_name(&candidate.name) {
            let remedy = "give letters, digits, `-` and `_`, beginning with a letter";
            return wrong(&["name"], "is no name for an effect", remedy);
        }
        if candidates[..index].iter().any(|c| c.name == candidate.name) {
            return wrong(&["name"], "is there twice", "give each its own name");
        }
        let columns = candidate.formulas.len();
        if columns == 0 || columns > MOST_COLUMNS {
            let remedy =
                "give one formula for each coefficient, 1 to 12: formulas = { c = \"cos(q) * v\" }";
            return wrong(&["formulas"], &format!("has {columns} entries"), remedy);
        }
        let shapes = candidate.shapes.len();
        if shapes > MOST_SHAPES {
            let problem = format!("has {shapes} entries");
            return wrong(&["shapes"], &problem, "search at most three shapes");
        }
        for (name, formula) in &candidate.formulas {
            let at = ["formulas", name];
            if formula.len() > MAX_FORMULA_CHARACTERS {
                return wrong(&at, "is too long", "give at most 400 characters");
            }
            if !is_key(name) || candidate.shapes.contains_key(name) {
                let remedy = "give letters, digits and underscores, another name than the signals and shapes have";
                return wrong(&at, "has no name for a coefficient", remedy);
            }
        }
        let has = |unit: &&String| candidate.formulas.contains_key(*unit);
        if let Some(unit) = candidate.units.keys().find(|unit| !has(unit)) {
            let remedy = "name a coefficient of `formulas`";
            return wrong(&["units", unit], "is the unit of no coefficient", remedy);
        }
        for (name, range) in &candidate.shapes {
            let at = ["shapes", name];
            if !is_key(name) {
                let remedy =
                    "give letters, digits and underscores, another name than the signals have";
                return wrong(&at, "has no name for a shape", remedy);
            }
            if range.from >= range.to {
                let problem = format!("goes from {} to {}", range.from, range.to);
                return wrong(&at, &problem, "give `from` below `to`");
            }
        }
    }
    Ok(())
}

/// Whether a text can be the name of an effect.
fn is_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.len() <= 64
        && (name.chars()).all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'))
}

/// Whether a text can be the name of a number in a formula.
fn is_key(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.len() <= 64
        && !FormulaSignal::has_name(name)
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "[[candidate]]\nname = \"drag\"\njoints = [\"q2\"]\n\
        formulas = { c = \"cos(q_q2 + q_q3) * tanh(w * v)\" }\nshapes = { w = { from = 1.0, to = 9.0 } }\n";

    #[test]
    fn a_candidate_is_read_and_what_it_has_wrong_is_reported_with_its_line() {
        let found = parse("own.toml", GOOD).unwrap();
        assert_eq!(found[0].name, "drag");
        assert_eq!(found[0].shapes["w"].unit, "1");
        for (from, to, says) in [
            ("\"drag\"", "\"a drag\"", "no name for an effect"),
            ("to = 9.0", "to = 1.0", "from` below `to"),
            ("{ c =", "{ v =", "no name for a coefficient"),
            ("{ c =", "{ w =", "no name for a coefficient"),
            ("shapes = { w", "shapes = { q_a", "no name for a shape"),
            ("joints", "joint", "joint"),
        ] {
            let error = parse("own.toml", &GOOD.replace(from, to)).unwrap_err();
            let shown = error.to_string();
            assert!(
                shown.contains("own.toml") && shown.contains(says),
                "{shown}"
            );
        }
    }
}
