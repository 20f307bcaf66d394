//! The command line as a report says it: what was typed, without what belongs to one machine only.

use std::ffi::OsString;
use std::path::Path;

/// Options that name what is written.
const OUTPUTS: [&str; 6] = [
    "-o",
    "--output",
    "--plot",
    "--report",
    "--json",
    "--samples",
];

/// The line without folders from the root on and without what changes no result, so that it is the same everywhere.
pub(super) fn line(arguments: &[OsString]) -> String {
    let mut words = vec!["cft-ident".to_owned()];
    let mut rest = arguments.iter().skip(1).map(|a| a.to_string_lossy());
    while let Some(word) = rest.next() {
        if word == "--threads" {
            rest.next();
            continue;
        }
        if word.starts_with("--threads=")
            || ["-q", "--quiet", "-v", "--verbose", "--open"].contains(&&*word)
        {
            continue;
        }
        if OUTPUTS.contains(&&*word) {
            match rest.next() {
                Some(value) if Path::new(&*value).is_absolute() => {}
                value => words.extend([word].into_iter().chain(value).map(|w| quoted(&w))),
            }
            continue;
        }
        let glued = OUTPUTS.iter().find_map(|name| word.strip_prefix(name));
        let glued = glued.map(|value| value.strip_prefix('=').unwrap_or(value));
        if glued.is_some_and(|value| Path::new(value).is_absolute()) {
            continue;
        }
        words.push(quoted(&local(&word)));
    }
    words.join(" ")
}

/// Logs that a line has room for.
pub(super) const MAX_LOGS: usize = 3;

pub(super) fn logs(all: impl Iterator<Item = String>) -> String {
    all.map(|log| quoted(&log)).collect::<Vec<_>>().join(" ")
}

/// `--model=/a/b.toml` and `-m/a/b.toml` are `--model=b.toml` and `-mb.toml`; relative paths stay.
fn local(word: &str) -> String {
    let start = match word.strip_prefix("--") {
        Some(long) => long.find('=').map_or(word.len(), |at| at + 3),
        None if word.starts_with('-') => word.char_indices().nth(2).map_or(word.len(), |c| c.0),
        None => 0,
    };
    let (option, value) = word.split_at(start);
    let path = Path::new(value);
    match path.file_name() {
        Some(name) if path.is_absolute() => format!("{option}{}", name.to_string_lossy()),
        _ => word.to_owned(),
    }
}

/// As a shell takes it.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./@%,:=+~".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(words: &[&str]) -> String {
        let words: Vec<OsString> = words.iter().map(OsString::from).collect();
        line(&words)
    }

    #[test]
    fn what_belongs_to_one_machine_is_left_out() {
        let typed = of(&[
            "/usr/bin/cft-ident",
            "validate",
            "/data/my log.csv@0..70%",
            "-q",
            "--threads",
            "2",
            "-m",
            "runs/m.toml",
            "--holdout=/data/b.csv",
            "--plot=/tmp/a.svg",
            "-o/tmp/r.csv",
            "--report",
            "/tmp/r.html",
            "--json",
            "r.json",
        ]);
        assert_eq!(
            typed,
            "cft-ident validate 'my log.csv@0..70%' -m runs/m.toml --holdout=b.csv --json r.json"
        );
    }

    #[test]
    fn a_quote_inside_a_word_is_kept_apart() {
        assert_eq!(of(&["x", "it's"]), "cft-ident 'it'\\''s'");
    }
}
