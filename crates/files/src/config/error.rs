//! What can be wrong with a configuration file, and the way out.

use cft_ident_core::explain::{ErrorText, Explain};
use thiserror::Error;

/// An error in a robot, model, trajectory or campaign file. Lines count from 1.
#[derive(Debug, Explain, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[explain("{file}: cannot be read: {source}", remedy)]
    Read {
        /// File as the user named it.
        file: String,
        /// What the system said.
        source: std::io::Error,
        /// What to do.
        remedy: String,
    },
    /// A file of another kind.
    #[explain("{file}: is {found}, not {wanted}", remedy)]
    Kind {
        /// File as the user named it.
        file: String,
        /// What it is.
        found: &'static str,
        /// What is wanted.
        wanted: &'static str,
        /// What to do.
        remedy: String,
    },
    /// The text is no TOML, or a value has the wrong type.
    #[explain(problem.clone().of(format!("{file}:{line}")))]
    Syntax {
        /// File as the user named it.
        file: String,
        /// Line.
        line: usize,
        problem: ErrorText,
    },
    /// A key that the file may not have.
    #[explain("{file}:{line}: unknown key `{key}`", remedy)]
    UnknownKey {
        /// File as the user named it.
        file: String,
        /// Line.
        line: usize,
        /// The key.
        key: String,
        /// The nearest known key, or all of them.
        remedy: String,
    },
    /// A key that the file must have.
    #[explain("{file}:{line}: `{key}` is missing", "add {remedy}")]
    MissingKey {
        /// File as the user named it.
        file: String,
        /// Line of the table that lacks it.
        line: usize,
        /// The key, with its table.
        key: String,
        /// What to write.
        remedy: String,
    },
    /// A key with a value that cannot be.
    #[explain("{file}:{line}: `{key}` {problem}", remedy)]
    Value {
        /// File as the user named it.
        file: String,
        /// Line.
        line: usize,
        /// The key, with its table.
        key: String,
        /// What is wrong with it.
        problem: String,
        /// What to do.
        remedy: String,
    },
    /// A model file that belongs to another robot.
    #[explain("{file}: the model is of another robot: {difference}", remedy)]
    OtherRobot {
        /// The model file.
        file: String,
        /// What differs: model, set-up, parameters or joints, theirs and ours.
        difference: String,
        /// What to do.
        remedy: String,
    },
    /// A model file without a parameter that its robot needs.
    #[explain("{file}: parameter `{name}` is missing", remedy)]
    MissingParameter {
        /// The model file.
        file: String,
        /// The parameter, `name` or `name:joint`.
        name: String,
        /// What to do.
        remedy: String,
    },
}
