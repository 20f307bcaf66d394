//! How a finished command is reported: tables or the JSON document on standard output, warnings and
//! missed limits on standard error. Commands return an [`Outcome`] and print nothing themselves, so
//! `--json -` cannot be spoilt by one of them.

use std::io::{self, Write};
use std::path::Path;

use super::error::{CliError, indented, to_stderr};
use super::exit::Exit;
use super::{DocumentDestination, colour};
use cft_ident_logs::log::is_hidden;
use cft_ident_logs::output::FileBatch;
use cft_ident_report::report::ReportDetail;
use cft_ident_report::report::json::JsonDocument;

/// What a command hands back.
#[derive(Debug)]
pub struct Outcome {
    /// Tables for a person, ending in a line end.
    pub text: String,
    /// The same for a script; its warnings are shown on standard error too.
    pub document: JsonDocument,
    /// Limits that the user set and the result misses, one sentence each; they make exit status 1.
    pub missed: Vec<String>,
    /// Warnings of the document that do not touch what was asked for.
    pub(super) asides: Vec<String>,
}

impl Outcome {
    /// A result that misses no limit.
    pub(super) fn new(text: String, document: JsonDocument) -> Self {
        Outcome {
            text,
            document,
            missed: Vec::new(),
            asides: Vec::new(),
        }
    }

    /// Names the page that was written, where the text does not yet.
    pub(super) fn says_where(&mut self, page: &Path, detail: ReportDetail) {
        let page = page.display().to_string();
        if detail != ReportDetail::Brief && !self.text.contains(&page) {
            self.text += &format!("report: {page}\n");
        }
    }
}

/// Warnings that are shown below a result.
const MAX_WARNINGS: usize = 8;
/// Those of them about one log or joint.
const ABOUT_ONE: usize = 2;

/// Shows an outcome; its status. Files get their names after all else, so that a failure leaves none.
pub(super) fn show(
    outcome: &Outcome,
    json: Option<&DocumentDestination>,
    (files, detail): (&FileBatch, ReportDetail),
    stdout: &mut dyn Write,
    stderr: &mut dyn Write,
) -> Result<Exit, CliError> {
    match json {
        Some(DocumentDestination::Stdout) => {
            write(stdout, &outcome.document.text()).map_err(|error| no_standard_output(&error))?;
        }
        Some(DocumentDestination::File(path)) => {
            files.write(path, outcome.document.text().as_bytes())?;
            write_for_a_person(stdout, outcome)?;
        }
        None => write_for_a_person(stdout, outcome)?,
    }
    files.commit()?;
    warn(outcome, detail, stderr);
    for limit in &outcome.missed {
        to_stderr(stderr, &format!("limit missed: {}", indented(limit)));
    }
    Ok(match outcome.missed.is_empty() {
        true => Exit::Success,
        false => Exit::LimitMissed,
    })
}

/// Shows the warnings, after the result: they explain it.
fn warn(outcome: &Outcome, detail: ReportDetail, stderr: &mut dyn Write) {
    let aside = |warning: &&str| outcome.asides.iter().any(|text| text == warning);
    let all = outcome.document.warnings();
    let all: Vec<&str> = match detail {
        ReportDetail::Full => all.collect(),
        _ => all.filter(|warning| !aside(warning)).collect(),
    };
    let most = match detail {
        ReportDetail::Full => usize::MAX,
        _ => MAX_WARNINGS,
    };
    let (shown, more) = grouped(&all, detail);
    for warning in shown.iter().take(most) {
        to_stderr(stderr, &format!("warning: {}", indented(warning)));
    }
    let more = more + shown.len().saturating_sub(most);
    if more > 0 {
        to_stderr(
            stderr,
            &format!("warning: {more} more; --verbose shows them, --json holds them"),
        );
    }
}

/// The warnings that are shown, and how many are not: of several about one log or joint the first two.
fn grouped<'a>(all: &[&'a str], detail: ReportDetail) -> (Vec<&'a str>, usize) {
    // `log.csv: what is wrong with it`
    let about = |warning: &'a str| {
        let (name, _) = warning.split_once(": ")?;
        (!name.contains(' ')).then_some(name)
    };
    let before = |k: usize| {
        let name = about(all[k]);
        let same = |warning: &&'a str| about(warning) == name;
        name.map_or(0, |_| all[..k].iter().copied().filter(same).count())
    };
    let kept = |k: &usize| detail == ReportDetail::Full || before(*k) < ABOUT_ONE;
    let shown: Vec<&str> = (0..all.len()).filter(kept).map(|k| all[k]).collect();
    let more = all.len() - shown.len();
    (shown, more)
}

fn write(stdout: &mut dyn Write, text: &str) -> io::Result<()> {
    stdout.write_all(text.as_bytes())?;
    stdout.flush()
}

/// Tables; a reader that has seen enough (`| head`) is no error.
fn write_for_a_person(stdout: &mut dyn Write, outcome: &Outcome) -> Result<(), CliError> {
    // Names come from files and folders.
    let mut shown = String::with_capacity(outcome.text.len());
    for c in outcome.text.chars() {
        match is_hidden(c) && !matches!(c, '\n' | '\t') {
            true => shown.extend(c.escape_default()),
            false => shown.push(c),
        }
    }
    if colour::wanted() {
        shown = colour::coloured(&shown, outcome.missed.is_empty());
    }
    match write(stdout, &shown) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(no_standard_output(&error)),
        _ => Ok(()),
    }
}

pub(super) fn no_standard_output(error: &io::Error) -> CliError {
    CliError::output(format!("cannot write to standard output: {error}"))
        .hint("look at where it leads: a full disk, a program that has ended")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn outcome(missed: &[&str]) -> Outcome {
        let warnings = ["gap of 0.4 s at 3.1 s".to_owned()];
        let body = json!({"joints": [{"joint": "q1", "rmse": f64::NAN}]});
        Outcome {
            text: "joint  rmse\n".into(),
            document: JsonDocument::new("validate", &[], &warnings, &body).unwrap(),
            missed: missed.iter().map(|limit| limit.to_string()).collect(),
            asides: Vec::new(),
        }
    }

    fn to(
        out: &mut dyn Write,
        outcome: &Outcome,
        json: Option<&DocumentDestination>,
        detail: ReportDetail,
    ) -> (Result<Exit, CliError>, String) {
        let mut err = Vec::new();
        let files = FileBatch::default();
        let exit = show(outcome, json, (&files, detail), out, &mut err);
        (exit, String::from_utf8(err).unwrap())
    }

    #[test]
    fn json_on_standard_output_is_one_document_and_nothing_else() {
        let (mut out, json) = (Vec::new(), Some(&DocumentDestination::Stdout));
        let (exit, err) = to(&mut out, &outcome(&[]), json, ReportDetail::Usual);
        assert_eq!(exit.unwrap(), Exit::Success);
        let document: Value = serde_json::from_slice(&out).unwrap();
        assert_eq!(document["schema"], "cft-ident/validate/1");
        assert_eq!(err, "warning: gap of 0.4 s at 3.1 s\n");
    }

    #[test]
    fn json_in_a_file_leaves_the_tables_on_standard_output() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.json");
        let (mut out, json) = (Vec::new(), DocumentDestination::File(path.clone()));
        let missed = outcome(&["q4 1.4 % > 1 %"]);
        let (exit, err) = to(&mut out, &missed, Some(&json), ReportDetail::Usual);
        assert_eq!(exit.unwrap(), Exit::LimitMissed);
        assert_eq!(out, b"joint  rmse\n");
        let document: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        assert_eq!(document["joints"][0]["rmse"], Value::Null);
        assert!(err.ends_with("limit missed: q4 1.4 % > 1 %\n"));
    }

    #[test]
    fn many_warnings_do_not_push_the_result_off_the_screen() {
        let warnings: Vec<String> = (0..40).map(|k| format!("gap at {k} s")).collect();
        let document = JsonDocument::new("validate", &[], &warnings, &json!({})).unwrap();
        let many = Outcome::new("joint  rmse\n".into(), document);
        for (detail, lines) in [
            (ReportDetail::Usual, MAX_WARNINGS + 1),
            (ReportDetail::Full, 40),
        ] {
            let (_, err) = to(&mut Vec::new(), &many, None, detail);
            assert_eq!(err.lines().count(), lines);
        }
    }

    #[test]
    fn of_several_warnings_about_one_log_the_first_two_are_shown() {
        let all = ["a.csv: 1", "b.csv: 1", "a.csv: 2", "a.csv: 3", "in all: 1"];
        let expected = vec!["a.csv: 1", "b.csv: 1", "a.csv: 2", "in all: 1"];
        assert_eq!(grouped(&all, ReportDetail::Usual), (expected, 1));
        assert_eq!(grouped(&all, ReportDetail::Full), (all.to_vec(), 0));
    }

    /// A standard output that fails with the given kind.
    struct Failing(io::ErrorKind);
    impl Write for Failing {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_closed_pipe_ends_the_tables_quietly_but_not_the_document() {
        use io::ErrorKind::{BrokenPipe, StorageFull};
        for (kind, json, expected) in [
            (BrokenPipe, None, Exit::Success),
            (
                BrokenPipe,
                Some(&DocumentDestination::Stdout),
                Exit::OutputFailed,
            ),
            (StorageFull, None, Exit::OutputFailed),
        ] {
            let (found, _) = to(&mut Failing(kind), &outcome(&[]), json, ReportDetail::Usual);
            assert_eq!(found.unwrap_or_else(|error| error.exit()), expected);
        }
    }
}
