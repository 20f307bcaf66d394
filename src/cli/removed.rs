//! Commands and options that an older version had, and what stands for each.

use std::ffi::OsString;
use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};

use super::CliError;

const COMMANDS: [(&str, &str); 4] = [
    ("schema", "write `cft-ident generate schema KIND`"),
    (
        "completions",
        "write `cft-ident generate completions SHELL`",
    ),
    ("man", "write `cft-ident generate man DIR`"),
    (
        "diff",
        "documents are plain JSON: `jq` or `diff` compares two; `cft-ident compare A.toml B.toml` compares two models",
    ),
];

/// Options by their command.
const OPTIONS: [(&[&str], &str, &str); 8] = [
    (
        &["lsq", "fit"],
        "--feasible",
        "leave it out: physically consistent parameters are always there (`--unconstrained`: not)",
    ),
    (
        &["friction"],
        "--seed",
        "leave it out: the search begins at the same points each time",
    ),
    (
        &["diagnose"],
        "--veto",
        "give the log as --holdout: it is never fitted, and judges what is added",
    ),
    (
        &["diagnose"],
        "--cautious",
        "leave it out: an effect is written as far as its amplitude is sure",
    ),
    (
        &["excite"],
        "--offsets",
        "leave it out: the search chooses the offsets; a trajectory file may be edited, and --check judges it",
    ),
    (
        &["excite"],
        "--starts",
        "leave it out: the search takes as many as it needs, and Ctrl-C keeps the best motion so far",
    ),
    (
        &["excite"],
        "--evaluations",
        "leave it out: the search takes as many as it needs, and Ctrl-C keeps the best motion so far",
    ),
    (
        &["excite"],
        "--trajectory-message",
        "--samples FILE.csv or FILE.mcap writes positions, speeds and accelerations at --rate, to be sent from there",
    ),
];

/// The error of a line that names one of them.
pub(super) fn named(answer: &clap::Error, arguments: &[OsString]) -> Option<CliError> {
    let text = |kind| match answer.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    if let Some(name) = text(ContextKind::InvalidSubcommand) {
        let (name, now) = COMMANDS.iter().find(|(old, _)| *old == name)?;
        let error = CliError::usage(format!("there is no command `{name}` any more"));
        return Some(error.hint(*now));
    }
    let option = text(ContextKind::InvalidArg)?;
    if answer.kind() == ErrorKind::ValueValidation && option.starts_with("--plot") {
        let file = text(ContextKind::InvalidValue)?;
        let picture = Path::new(file);
        let png = picture.extension()?.eq_ignore_ascii_case("png");
        let error = || CliError::usage(format!("{file}: figures are not written as PNG any more"));
        let svg = picture.with_extension("svg");
        return png.then(|| {
            error().hint(format!(
                "--plot {}; a browser opens it, and Inkscape makes a PNG of it",
                svg.display()
            ))
        });
    }
    let typed = |command: &&str| arguments.iter().any(|word| word == *command);
    let of =
        |(commands, old, _): &&(&[&str], &str, &str)| *old == option && commands.iter().any(typed);
    let (_, option, now) = OPTIONS.iter().find(of)?;
    let error = CliError::usage(format!("there is no option {option} any more"));
    Some(error.hint(*now))
}
