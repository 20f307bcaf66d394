//! Which part of which file: `FILE`, `FILE@0..70%`, `FILE@15.2..23s`.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::LogError;
use super::names::escape_whole;
use super::source::file_name;

/// The part of a log that is used.
///
/// Both kinds are half open, so that `0..70%` and `70..100%` share no sample; an end at or beyond
/// the log's own end includes the last sample. Seconds count from the log's first sample.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Span {
    /// The whole log.
    #[default]
    Whole,
    /// From and to, in percent of the log's duration.
    Percent {
        /// First percent, 0..100.
        from: f64,
        /// End, 0..100, greater than `from`.
        to: f64,
    },
    /// From and to, in seconds after the log's first sample.
    Seconds {
        /// First second.
        from: f64,
        /// End, greater than `from`; infinite where it was left out.
        to: f64,
    },
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Span::Whole => Ok(()),
            Span::Percent { from, to } => write!(f, "{from}..{to}%"),
            Span::Seconds { from, to } if to.is_infinite() => write!(f, "{from}..s"),
            Span::Seconds { from, to } => write!(f, "{from}..{to}s"),
        }
    }
}

impl Span {
    /// The text that goes into outputs; `None` for the whole log.
    pub fn label(&self) -> Option<String> {
        match self {
            Span::Whole => None,
            span => Some(span.to_string()),
        }
    }

    /// Reads `0..70%` or `15.2..23s`; either number may be left out.
    fn parse(text: &str) -> Result<Self, &'static str> {
        let (body, percent) = if let Some(body) = text.strip_suffix('%') {
            (body, true)
        } else if let Some(body) = text.strip_suffix('s') {
            (body, false)
        } else {
            return Err("it ends neither in % nor in s");
        };
        let Some((from, to)) = body.split_once("..") else {
            return Err("it has no `..` between its two numbers");
        };
        let number = |text: &str, default: f64| -> Result<f64, &'static str> {
            let text = text.trim();
            if text.is_empty() {
                return Ok(default);
            }
            match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err("it holds something that is no number"),
            }
        };
        let from = number(from, 0.0)?;
        let to = number(to, if percent { 100.0 } else { f64::INFINITY })?;
        if from < 0.0 {
            return Err("it begins before the log does");
        }
        if from >= to {
            return Err("its end does not lie after its beginning");
        }
        if percent && to > 100.0 {
            return Err("it goes beyond 100 %");
        }
        Ok(if percent {
            Span::Percent { from, to }
        } else {
            Span::Seconds { from, to }
        })
    }
}

/// A log file and the part of it that is used.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSpec {
    /// Path as the user wrote it, without the span.
    pub path: PathBuf,
    /// The part that is used.
    pub span: Span,
}

impl LogSpec {
    /// The whole of one file.
    pub fn whole(path: impl Into<PathBuf>) -> Self {
        Self {
            path: path.into(),
            span: Span::Whole,
        }
    }

    /// File name without folders: the only form in which a path enters an output.
    pub fn name(&self) -> String {
        file_name(&self.path)
    }
}

impl fmt::Display for LogSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        match self.span.label() {
            Some(span) => write!(f, "@{span}"),
            None => Ok(()),
        }
    }
}

impl FromStr for LogSpec {
    type Err = LogError;

    fn from_str(text: &str) -> Result<Self, LogError> {
        let Some((path, tail)) = text.rsplit_once('@') else {
            return Ok(Self::whole(text));
        };
        // A file whose own name holds an @ is still a file.
        let looks_like_span = tail.contains("..")
            || tail.ends_with('%')
            || tail
                .strip_suffix('s')
                .is_some_and(|n| n.parse::<f64>().is_ok());
        if !looks_like_span || path.is_empty() || Path::new(text).exists() {
            return Ok(Self::whole(text));
        }
        match Span::parse(tail.trim()) {
            Ok(span) => Ok(Self {
                path: PathBuf::from(path),
                span,
            }),
            Err(reason) => Err(LogError::Span {
                spec: escape_whole(text),
                reason,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> LogSpec {
        text.parse().unwrap()
    }

    #[test]
    fn a_plain_path_is_the_whole_log() {
        assert_eq!(parse("runs/a.csv"), LogSpec::whole("runs/a.csv"));
        assert_eq!(parse("user@host.csv"), LogSpec::whole("user@host.csv"));
    }

    #[test]
    fn percent_and_second_spans_are_read_and_printed_back() {
        for text in [
            "a.csv@0..70%",
            "a@b.csv@15.2..23s",
            "a.csv@70..100%",
            "a.csv@3..s",
        ] {
            assert_eq!(parse(text).to_string(), text);
        }
        let spec = parse("a.csv@..70%");
        assert_eq!(
            spec.span,
            Span::Percent {
                from: 0.0,
                to: 70.0
            }
        );
        assert_eq!(spec.path, PathBuf::from("a.csv"));
    }

    #[test]
    fn a_span_that_makes_no_sense_is_refused_with_the_reason() {
        for (text, word) in [
            ("a.csv@70..10%", "after its beginning"),
            ("a.csv@0..170%", "beyond 100"),
            ("a.csv@x..3s", "no number"),
            ("a.csv@1..2", "neither"),
            ("a.csv@50%", "`..`"),
            ("a.csv@-3..2s", "before the log"),
            ("a.csv@nan..2s", "no number"),
        ] {
            let message = text.parse::<LogSpec>().unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
        }
    }

    #[test]
    fn only_the_file_name_is_given_out() {
        assert_eq!(parse("/home/someone/logs/a.csv@0..5s").name(), "a.csv");
    }
}
