//! Which part of which file: `FILE`, `FILE@0..70%`, `FILE@15.2..23s`.

use std::fmt;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::LogError;
use super::messages::FORMATS;
use super::names::escape_whole;
use super::source::{self, failed, file_name, shown};
use super::table::dataset;

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

/// Parts the span from the stretches that are left out, in outputs.
const WITHOUT: &str = " without ";

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

    /// The span that a label says; the whole log where it says none.
    pub(super) fn read(label: &str) -> Self {
        let span = label.split_once(WITHOUT).map_or(label, |(span, _)| span);
        Self::parse(span).unwrap_or_default()
    }

    /// Whether two spans of one log can have rows in common; those in other units can.
    pub(super) fn meets(self, other: Self) -> bool {
        match (self, other) {
            (Span::Percent { from: a, to: b }, Span::Percent { from: c, to: d })
            | (Span::Seconds { from: a, to: b }, Span::Seconds { from: c, to: d }) => {
                a.max(c) < b.min(d)
            }
            _ => true,
        }
    }

    /// Reads `0..70%` or `15.2..23s`; either number may be left out.
    fn parse(text: &str) -> Result<Self, &'static str> {
        let percent = text.ends_with('%');
        let body = text.strip_suffix(['%', 's']);
        let body = body.ok_or("it ends neither in % nor in s")?;
        let numbers = body.split_once("..");
        let (from, to) = numbers.ok_or("it has no `..` between its two numbers")?;
        let number = |text: &str, default: f64| match text.trim() {
            "" => Ok(default),
            text => {
                let number = text.parse::<f64>().ok().filter(|x| x.is_finite());
                number.ok_or("it holds something that is no number")
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
        Ok(match percent {
            true => Span::Percent { from, to },
            false => Span::Seconds { from, to },
        })
    }
}

/// A log file and the part of it that is used.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSpec {
    /// Path as the user wrote it, without the span: a file, a folder with the parts of one
    /// recording, or several files of one recording joined with `+`.
    pub path: PathBuf,
    /// The part that is used.
    pub span: Span,
    /// Stretches of it that are left out, in seconds after the log's first sample.
    pub leave_out: Vec<[f64; 2]>,
    /// How long the machine had run when the log began \[s\].
    pub started_s: f64,
}

impl LogSpec {
    /// The whole of one file.
    pub fn whole(path: impl Into<PathBuf>) -> Self {
        Self::new(path.into(), Span::Whole)
    }

    /// Another part of the same log.
    pub fn of_span(&self, span: Span) -> Self {
        Self {
            span,
            ..self.clone()
        }
    }

    fn new(path: PathBuf, span: Span) -> Self {
        Self {
            path,
            span,
            leave_out: Vec::new(),
            started_s: 0.0,
        }
    }

    /// What is read of the file, as it stands in outputs; `None` for the whole of it.
    pub fn part(&self) -> Option<String> {
        let without = self.leave_out.iter();
        let without: Vec<String> = without.map(|[from, to]| format!("{from}..{to}s")).collect();
        match without.is_empty() {
            true => self.span.label(),
            false => Some(format!("{}{WITHOUT}{}", self.span, without.join(", "))),
        }
    }

    /// Whether a row so many seconds after the log's first one is left out.
    pub(super) fn leaves_out(&self, since: f64) -> bool {
        let inside = |[from, to]: &[f64; 2]| *from <= since && since < *to;
        self.leave_out.iter().any(inside)
    }

    /// File name without folders: the only form in which a path enters an output.
    ///
    /// Files that are joined with `+` keep it between their names.
    pub fn name(&self) -> String {
        let parts = self.joined().unwrap_or_else(|| vec![self.path.clone()]);
        let names: Vec<String> = parts.iter().map(|part| file_name(part)).collect();
        names.join("+")
    }

    /// The bytes of its one file.
    ///
    /// # Errors
    /// A file that cannot be opened.
    pub fn stream(&self) -> Result<Box<dyn Read + Send>, LogError> {
        Ok(Box::new(source::open(&self.path)?))
    }

    /// The files of the log, in order: one file; the recordings in a folder; or `A+B`, joined.
    pub(crate) fn files(&self) -> Result<Vec<PathBuf>, LogError> {
        if self.path.is_dir() {
            let dataset = dataset(&self.path).map_err(|error| failed(&self.path, error))?;
            return dataset.map_or_else(|| recordings_in(&self.path), Ok);
        }
        Ok(self.joined().unwrap_or_else(|| vec![self.path.clone()]))
    }

    /// The parts of `A+B`, where there is no file of that name and there are files of theirs.
    fn joined(&self) -> Option<Vec<PathBuf>> {
        if self.path.exists() {
            return None;
        }
        let text = self.path.to_str()?;
        let parts: Vec<PathBuf> = text.split('+').map(PathBuf::from).collect();
        (parts.len() > 1 && parts.iter().all(|part| part.is_file())).then_some(parts)
    }
}

/// Recordings in the folder of a rosbag2 recording, which may be split: `bag_0.mcap`, `bag_1.mcap`.
fn recordings_in(folder: &Path) -> Result<Vec<PathBuf>, LogError> {
    let entries = std::fs::read_dir(folder).map_err(|error| failed(folder, error))?;
    let mut found: Vec<(&str, PathBuf)> = Vec::new();
    for entry in entries {
        let path = entry.map_err(|error| failed(folder, error))?.path();
        let name = file_name(&path).to_lowercase();
        let mut packed = [".zst", ".zstd", ".gz"].iter();
        let plain = packed
            .find_map(|end| name.strip_suffix(end))
            .unwrap_or(&name);
        let format = FORMATS.iter().find(|format| plain.ends_with(format.ending));
        found.extend(format.map(|format| (format.ending, path)));
    }
    found.sort_by_cached_key(|(_, path)| natural(&file_name(path)));
    let problem = match found.first() {
        None => "holds no .mcap, .db3 or .bag file, and no dataset of LeRobot",
        Some((first, _)) if found.iter().any(|(other, _)| other != first) => {
            "holds recordings of several formats"
        }
        Some(_) => return Ok(found.into_iter().map(|(_, path)| path).collect()),
    };
    Err(LogError::Folder {
        folder: shown(folder),
        problem,
    })
}

/// A key by which `bag_2` stands before `bag_10`: digits as numbers, by their length first.
fn natural(name: &str) -> Vec<(usize, String)> {
    let mut parts: Vec<(usize, String)> = Vec::new();
    let mut digits = false;
    for c in name.chars() {
        if parts.is_empty() || c.is_ascii_digit() != digits {
            digits = c.is_ascii_digit();
            parts.push((0, String::new()));
        }
        if let Some((length, part)) = parts.last_mut() {
            *length += usize::from(digits && !(part.is_empty() && c == '0'));
            part.push(c);
        }
    }
    parts
}

impl fmt::Display for LogSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        match self.part() {
            Some(part) => write!(f, "@{part}"),
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
        let seconds = tail.strip_suffix('s').map(str::parse::<f64>);
        let looks_like_span =
            tail.contains("..") || tail.ends_with('%') || matches!(seconds, Some(Ok(_)));
        if !looks_like_span || path.is_empty() || Path::new(text).exists() {
            return Ok(Self::whole(text));
        }
        let span = Span::parse(tail.trim()).map_err(|reason| LogError::Span {
            spec: escape_whole(text),
            reason,
        });
        Ok(Self::new(PathBuf::from(path), span?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> LogSpec {
        text.parse().unwrap()
    }

    #[test]
    fn stretches_that_are_left_out_stand_beside_the_span_and_hide_it_from_nobody() {
        let mut spec = parse("runs/a.csv@0..70%");
        assert_eq!(spec.part().as_deref(), Some("0..70%"));
        spec.leave_out = vec![[8.0, 10.5], [15.0, 16.0]];
        assert!(!spec.leaves_out(7.99) && spec.leaves_out(8.0) && !spec.leaves_out(10.5));
        let part = spec.part().unwrap();
        assert_eq!(part, "0..70% without 8..10.5s, 15..16s");
        assert_eq!(Span::read(&part), spec.span);
        spec.span = Span::Whole;
        assert_eq!(Span::read(&spec.part().unwrap()), Span::Whole);
    }

    #[test]
    fn a_plain_path_is_the_whole_log() {
        assert_eq!(parse("runs/a.csv"), LogSpec::whole("runs/a.csv"));
        assert_eq!(parse("user@host.csv"), LogSpec::whole("user@host.csv"));
    }

    #[test]
    fn percent_and_second_spans_are_read_and_printed_back() {
        let specs = "a.csv@0..70% a@b.csv@15.2..23s a.csv@70..100% a.csv@3..s";
        for text in specs.split(' ') {
            assert_eq!(parse(text).to_string(), text);
        }
        let spec = parse("a.csv@..70%");
        let (from, to) = (0.0, 70.0);
        assert_eq!(spec.span, Span::Percent { from, to });
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
    fn parts_of_a_split_recording_are_ordered_by_their_numbers() {
        let mut names = ["bag_10.mcap", "bag_9.mcap", "bag_010.mcap", "bag_1.mcap"];
        names.sort_by_cached_key(|name| natural(name));
        let sorted = ["bag_1.mcap", "bag_9.mcap", "bag_010.mcap", "bag_10.mcap"];
        assert_eq!(names, sorted);
    }

    #[test]
    fn files_that_are_joined_with_a_plus_are_one_log() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a.mcap", "b.mcap"].map(|name| folder.path().join(name));
        std::fs::write(&a, "").unwrap();
        std::fs::write(&b, "").unwrap();
        let spec = parse(&format!("{}+{}@0..5s", a.display(), b.display()));
        assert_eq!(spec.files().unwrap(), [a.clone(), b]);
        assert_eq!(spec.name(), "a.mcap+b.mcap");
        let missing = parse(&format!("{}+none.mcap", a.display()));
        assert_eq!(missing.files().unwrap(), [missing.path]);
    }

    #[test]
    fn only_the_file_name_is_given_out() {
        assert_eq!(parse("/home/someone/logs/a.csv@0..5s").name(), "a.csv");
    }
}
