//! Values on the command line that several commands share, and their parsers.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use cft_ident_core::number::{LARGEST, SMALLEST, is_usable};
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_logs::log::LogSpec;
use cft_ident_logs::output::LogForm;

/// Where a document goes: `-` is standard output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DocumentDestination {
    Stdout,
    File(PathBuf),
}

impl DocumentDestination {
    pub fn file(&self) -> Option<&Path> {
        match self {
            DocumentDestination::Stdout => None,
            DocumentDestination::File(path) => Some(path),
        }
    }
}

impl FromStr for DocumentDestination {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "-" => DocumentDestination::Stdout,
            path => DocumentDestination::File(PathBuf::from(path)),
        })
    }
}

/// Stretches of the logs that a command fits or judges which are to be left out.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct LeaveOut {
    /// Leave out a stretch of every LOG, in seconds after its first row; may be given more than once
    #[arg(hide_short_help = true, long, value_name = "FROM..TOs", value_parser = stretch)]
    pub leave_out: Vec<[f64; 2]>,
}

impl LeaveOut {
    pub fn of(&self, logs: &[LogSpec]) -> Vec<LogSpec> {
        let mut logs = logs.to_vec();
        for log in &mut logs {
            log.leave_out.clone_from(&self.leave_out);
        }
        logs
    }
}

/// `8..10s`, or `8..10`.
fn stretch(text: &str) -> Result<[f64; 2], String> {
    let wrong = || "is no stretch in seconds, such as 8..10s".to_owned();
    let ends = text.trim_end_matches('s').split_once("..");
    let (from, to) = ends.ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    match (number(from), number(to)) {
        (Some(from), Some(to)) if 0.0 <= from && from < to => Ok([from, to]),
        _ => Err(wrong()),
    }
}

/// A number that `fits`, or what is wrong with it.
pub(super) fn number(text: &str, wrong: &str, fits: impl Fn(f64) -> bool) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if fits(value) => Ok(value),
        Ok(_) => Err(wrong.to_owned()),
        Err(_) => Err("is not a number".to_owned()),
    }
}

/// A finite number above zero (a duration, a limit).
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let wrong = format!("must be a number above 0, from {SMALLEST:e} to {LARGEST:e}");
    number(text, &wrong, |x| is_usable(x) && x >= SMALLEST)
}

/// A number that is 0 or above.
pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    let wrong = format!("must be a number from 0 to {LARGEST:e}");
    number(text, &wrong, |x| is_usable(x) && x >= 0.0)
}

/// A part of a whole: above 0, at most 1.
pub(super) fn part(text: &str) -> Result<f64, String> {
    let wrong = "must be above 0 and at most 1, the whole";
    number(text, wrong, |x| x > 0.0 && x <= 1.0)
}

/// A finite number (a position, a speed).
pub(super) fn finite(text: &str) -> Result<f64, String> {
    let wrong = format!("must be a number of at most {LARGEST:e}");
    number(text.trim(), &wrong, is_usable)
}

/// A log to be written: the ending chooses the format.
pub(super) fn log_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match LogForm::of(&path) {
        Some(_) => Ok(path),
        None => Err(format!("must end in {}", LogForm::ENDINGS)),
    }
}

/// A file to be written, whose name must have one of these endings.
pub(super) fn ends_in<const N: usize>(
    endings: [&'static str; N],
) -> impl Fn(&str) -> Result<PathBuf, String> + Clone {
    move |text| {
        let path = PathBuf::from(text);
        let found = path.extension().unwrap_or_default();
        match endings.iter().any(|e| found.eq_ignore_ascii_case(e)) {
            true => Ok(path),
            false => Err(format!("must end in .{}", endings.join(" or ."))),
        }
    }
}

/// The estimators by name, each with a line of help.
pub(super) fn estimator() -> impl TypedValueParser<Value = EstimatorKind> {
    let helped = ESTIMATORS.map(|(kind, help)| PossibleValue::new(kind.name()).help(help));
    PossibleValuesParser::new(helped).try_map(|name| {
        let found = ESTIMATORS.iter().find(|(kind, _)| kind.name() == name);
        found.map(|(kind, _)| *kind).ok_or("no such estimator")
    })
}

const ESTIMATORS: [(EstimatorKind, &str); 5] = {
    use EstimatorKind::{Irls, Iv, Oe, Ols, Wls};
    [
        (Wls, "Rows weighted by each joint's noise, in two steps"),
        (Ols, "All rows alike"),
        (
            Irls,
            "Rows with large residuals count less: Huber's loss, then Tukey's bisquare",
        ),
        (
            Iv,
            "Instrumental variables: the regressor along simulated positions, blind to their noise",
        ),
        (
            Oe,
            "All parameters at once, the slopes of the friction law among them",
        ),
    ]
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dash_is_standard_output_and_anything_else_a_file() {
        assert_eq!("-".parse(), Ok(DocumentDestination::Stdout));
        let file: DocumentDestination = "./-".parse().unwrap();
        assert_eq!(file.file(), Some(Path::new("./-")));
    }

    #[test]
    fn numbers_that_make_no_sense_are_refused_while_parsing() {
        assert_eq!(positive("0.5"), Ok(0.5));
        for wrong in ["0", "-1", "inf", "NaN", "ten", ""] {
            assert!(positive(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_ending_of_an_output_is_checked_while_parsing() {
        assert!(log_file("runs/a.CSV").is_ok());
        assert!(log_file("a.mcap").is_ok() && log_file("a.csv.zst").is_ok());
        let error = log_file("a.txt").unwrap_err();
        assert!(error.starts_with("must end in .csv or .mcap"), "{error}");
        let arm = ends_in(["urdf", "xml"]);
        assert!(arm("urdf").is_err() && arm("a.pdf").is_err());
        assert!(arm("a.urdf").is_ok() && arm("a.XML").is_ok());
    }
}
