//! Errors of the library as exceptions: the text says file, line or channel, and what to do.

use cft_ident::cli::{CliError, Exit};
use cft_ident::identify::{ErrorKind, IdentifyError};
use pyo3::exceptions::{PyException, PyKeyboardInterrupt};
use pyo3::prelude::*;

pyo3::create_exception!(
    cft_ident,
    CftIdentError,
    PyException,
    "What went wrong, and what to do."
);
pyo3::create_exception!(
    cft_ident,
    UsageError,
    CftIdentError,
    "Arguments that contradict each other."
);
pyo3::create_exception!(
    cft_ident,
    InputError,
    CftIdentError,
    "A file or value that cannot be used."
);
pyo3::create_exception!(
    cft_ident,
    UndeterminedError,
    CftIdentError,
    "The data determine nothing that was asked."
);

/// An error of a stage.
pub fn of_stage(error: impl Into<IdentifyError>) -> PyErr {
    let error = error.into();
    let text = error.to_string();
    match error.kind() {
        ErrorKind::Interrupted => PyKeyboardInterrupt::new_err(()),
        ErrorKind::Usage => UsageError::new_err(text),
        ErrorKind::Input => InputError::new_err(text),
        ErrorKind::Undetermined => UndeterminedError::new_err(text),
    }
}

/// An error of a command.
pub fn of_command(error: &CliError) -> PyErr {
    let text = error.to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text).to_owned();
    match error.exit() {
        Exit::Interrupted => PyKeyboardInterrupt::new_err(()),
        Exit::Usage => UsageError::new_err(text),
        Exit::Undetermined => UndeterminedError::new_err(text),
        Exit::BadInput => InputError::new_err(text),
        _ => CftIdentError::new_err(text),
    }
}

/// Anything else that an input has wrong.
pub fn of_input(error: impl std::fmt::Display) -> PyErr {
    InputError::new_err(error.to_string())
}
