//! Colour of verdicts, for a terminal that takes it; the words say the same without.

use std::io::IsTerminal;

use cft_ident_report::report::FigureTone;
use cft_ident_report::report::text::BETWEEN;

const GREEN: &str = "32";
const YELLOW: &str = "33";
const RED: &str = "31";
const BOLD: &str = "1";

/// Words of verdicts as tables hold them, and their colour.
const WORDS: [(&str, &str); 7] = [
    ("identified", GREEN),
    ("negligible", GREEN),
    ("weak", YELLOW),
    ("lower-bound", YELLOW),
    ("indicated", YELLOW),
    ("not-identifiable", RED),
    ("worse", RED),
];

/// Words behind a figure of the verdict, and its colour.
const TONES: [(FigureTone, &str); 3] = [
    (FigureTone::Better, GREEN),
    (FigureTone::Worse, RED),
    (FigureTone::High, YELLOW),
];

/// Words at the beginning of a finding or of a message, and their colour.
const BEGINNINGS: [(&str, &str); 12] = [
    ("confirmed", GREEN),
    ("usable", GREEN),
    ("known", GREEN),
    ("limit kept", GREEN),
    ("indicated", YELLOW),
    ("too short", YELLOW),
    ("high", YELLOW),
    ("worse", RED),
    ("not ", RED),
    ("limit missed", RED),
    ("warning:", YELLOW),
    ("error:", RED),
];

fn is_wanted(terminal: bool) -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let forced = std::env::var_os("CLICOLOR_FORCE").is_some_and(|value| value != "0");
    let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    !set("NO_COLOR") && (forced || !dumb && terminal)
}

/// Whether standard output takes colour: a terminal that is not dumb, without NO_COLOR; or CLICOLOR_FORCE.
pub(super) fn wanted() -> bool {
    is_wanted(std::io::stdout().is_terminal())
}

fn painted(text: &str, colour: &str) -> String {
    format!("\u{1b}[{colour}m{text}\u{1b}[0m")
}

/// A text with the figures of its verdict, or its first paragraph, in bold, red where a limit is missed, and the words
/// of verdicts in their colours.
pub(super) fn coloured(text: &str, met: bool) -> String {
    let headline = text
        .lines()
        .next()
        .is_some_and(|line| line.contains(BETWEEN));
    let (first, rest) = match text.find("\n\n") {
        Some(end) => text.split_at(end),
        None => ("", text),
    };
    let mut out = String::with_capacity(2 * text.len());
    for (k, line) in first.lines().enumerate() {
        out += &match (headline, k, met) {
            (true, 0, _) => figures(line),
            (true, _, _) => beginning(line),
            (false, _, true) => painted(line, BOLD),
            (false, _, false) => painted(line, &format!("{BOLD};{RED}")),
        };
        out.push('\n');
    }
    // the line end is there already
    let rest = match first {
        "" => rest,
        _ => &rest[1..],
    };
    let mut in_table = false;
    for line in rest.split_inclusive('\n') {
        in_table = line.starts_with("--") || in_table && !line.trim().is_empty();
        match in_table {
            true => out += &words(line),
            false => out += line,
        }
    }
    out
}

/// The figures of a verdict, each in the colour of the word behind it.
fn figures(line: &str) -> String {
    let figure = |figure: &str| {
        let tone = TONES.iter().find(|(tone, _)| {
            let word = figure.strip_suffix(')').unwrap_or_default();
            word.ends_with(&format!("({}", tone.word()))
        });
        match tone {
            Some((_, colour)) => painted(figure, &format!("{BOLD};{colour}")),
            None => painted(figure, BOLD),
        }
    };
    line.split(BETWEEN)
        .map(figure)
        .collect::<Vec<_>>()
        .join(BETWEEN)
}

/// A line whose first words say how firm it is.
fn beginning(line: &str) -> String {
    let bare = line.trim_start();
    let margin = &line[..line.len() - bare.len()];
    match BEGINNINGS.iter().find(|(word, _)| bare.starts_with(word)) {
        Some((word, colour)) => {
            // up to the gap, or to the colon
            let end = bare.find("  ").unwrap_or(word.len());
            let (grade, rest) = bare.split_at(end);
            format!("{margin}{}{rest}", painted(grade, colour))
        }
        None => line.to_owned(),
    }
}

/// A message for standard error, whose first word has its colour where that leads to a terminal.
pub(super) fn message(text: &str) -> String {
    if !is_wanted(std::io::stderr().is_terminal()) {
        return text.to_owned();
    }
    let (first, rest) = text.split_once(':').unwrap_or((text, ""));
    match (BEGINNINGS.iter()).find(|(word, _)| word.strip_suffix(':') == Some(first)) {
        Some((word, colour)) => painted(word, &format!("{BOLD};{colour}")) + rest,
        None => text.to_owned(),
    }
}

/// A line of a table, whose last cell may be a verdict.
fn words(line: &str) -> String {
    let bare = line.trim_end();
    for (word, colour) in WORDS {
        let Some(before) = bare.strip_suffix(word) else {
            continue;
        };
        if before.ends_with(' ') {
            return format!(
                "{before}\u{1b}[{colour}m{word}\u{1b}[0m{}",
                &line[bare.len()..]
            );
        }
    }
    line.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_is_bold_and_the_verdicts_of_a_table_have_their_colours() {
        let text = "2 of 3 identified.\n\n-----\nq1 12 Nm identified\nq2 weak\n\nno weak\n";
        assert_eq!(
            coloured(text, true),
            "\u{1b}[1m2 of 3 identified.\u{1b}[0m\n\n-----\nq1 12 Nm \u{1b}[32midentified\u{1b}[0m\n\
             q2 \u{1b}[33mweak\u{1b}[0m\n\nno weak\n"
        );
        assert!(coloured(text, false).starts_with("\u{1b}[1;31m2 of 3"));
    }

    #[test]
    fn figures_and_findings_of_a_verdict_have_the_colours_of_their_words() {
        let text = "before 10 %  |  after 8 % (better)\ntorque error\n  confirmed  play of q1\n\n";
        assert_eq!(
            coloured(text, true),
            "\u{1b}[1mbefore 10 %\u{1b}[0m  |  \u{1b}[1;32mafter 8 % (better)\u{1b}[0m\ntorque error\n  \
             \u{1b}[32mconfirmed\u{1b}[0m  play of q1\n\n"
        );
    }
}
