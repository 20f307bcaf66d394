//! What can be wrong with a configuration file, and the way out.

use cft_ident_core::explain::{ErrorText, Explain};
use thiserror::Error;

/// An error in a robot, model, trajectory or campaign file, which is named as the user named it. Lines count from 1; keys
/// come with their tables.
#[derive(Debug, Explain, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[explain("{file}: cannot be read: {source}", remedy)]
    Read {
        file: String,
        source: std::io::Error,
        remedy: String,
    },
    /// A file of another kind.
    #[explain("{file}: is {found}, not {wanted}", remedy)]
    Kind {
        file: String,
        found: &'static str,
        wanted: &'static str,
        remedy: String,
    },
    /// The text is no TOML, or a value has the wrong type.
    #[explain(problem.clone().of(format!("{file}:{line}")))]
    Syntax {
        file: String,
        line: usize,
        problem: ErrorText,
    },
    /// A key that the file may not have.
    #[explain("{file}:{line}: unknown key `{key}`", remedy)]
    UnknownKey {
        file: String,
        line: usize,
        key: String,
        remedy: String,
    },
    /// A key that the file must have.
    #[explain("{file}:{line}: `{key}` is missing", "add {remedy}")]
    MissingKey {
        file: String,
        line: usize,
        key: String,
        remedy: String,
    },
    /// A key with a value that cannot be.
    #[explain("{file}:{line}: `{key}` {problem}", remedy)]
    Value {
        file: String,
        line: usize,
        key: String,
        problem: String,
        remedy: String,
    },
    /// A model file that belongs to another robot.
    #[explain("{file}: the model is of another robot: {difference}", remedy)]
    OtherRobot {
        file: String,
        difference: String,
        remedy: String,
    },
    /// A model file without a parameter that its robot needs.
    #[explain("{file}: parameter `{name}` is missing", remedy)]
    MissingParameter {
        file: String,
        name: String,
        remedy: String,
    },
}
