//! An error as its reader needs it: what is wrong, where, and what to do.

use std::fmt;

pub use cft_ident_derive::Explain;

/// What is wrong, where, and the ways out, the nearest first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ErrorText {
    pub what: String,
    /// `file:line`, or the name of a setting.
    pub places: Vec<String>,
    pub remedies: Vec<String>,
}

impl ErrorText {
    pub fn new(what: impl fmt::Display) -> Self {
        Self {
            what: what.to_string(),
            places: Vec::new(),
            remedies: Vec::new(),
        }
    }

    /// Adds a way out, or several, a line each.
    pub fn remedy(mut self, remedy: impl fmt::Display) -> Self {
        let remedy = remedy.to_string();
        self.remedies.extend(remedy.lines().map(str::to_owned));
        self
    }

    /// The same of something that has a name: `name: what`.
    pub fn of(self, name: impl fmt::Display) -> Self {
        Self {
            what: format!("{name}: {}", self.what),
            ..self
        }
    }
}

impl<E: Explain> From<E> for ErrorText {
    fn from(error: E) -> Self {
        error.explanation()
    }
}

impl From<String> for ErrorText {
    fn from(what: String) -> Self {
        Self::new(what)
    }
}

impl From<&str> for ErrorText {
    fn from(what: &str) -> Self {
        Self::new(what)
    }
}

impl fmt::Display for ErrorText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)?;
        let (mut places, mut remedies) = (self.places.iter(), self.remedies.iter());
        places.try_for_each(|place| write!(f, " ({place})"))?;
        remedies.try_for_each(|remedy| write!(f, "; {remedy}"))
    }
}

/// An error that says what is wrong and what to do. The derive makes it, and its `Display`, from the texts at the type:
///
/// ```
/// use cft_ident_core::explain::Explain;
///
/// #[derive(Debug, Explain, thiserror::Error)]
/// enum LogError {
///     #[explain("{file}: is empty", "record again")]
///     Empty { file: String },
/// }
///
/// let error = LogError::Empty { file: "my; log.csv".to_owned() };
/// assert_eq!(error.explanation().what, "my; log.csv: is empty");
/// assert_eq!(error.explanation().remedies, ["record again"]);
/// assert_eq!(error.to_string(), "my; log.csv: is empty; record again");
/// ```
pub trait Explain: std::error::Error {
    fn explanation(&self) -> ErrorText;
}
