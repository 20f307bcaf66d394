//! Colour of verdicts, for a terminal that takes it; the words say the same without.

use std::io::IsTerminal;

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

/// Whether standard output takes colour: a terminal that is not dumb, without NO_COLOR; or CLICOLOR_FORCE.
pub(super) fn wanted() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let forced = std::env::var_os("CLICOLOR_FORCE").is_some_and(|value| value != "0");
    let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    !set("NO_COLOR") && (forced || !dumb && std::io::stdout().is_terminal())
}

/// A text with its first paragraph in bold, red where a limit is missed, and the words of verdicts in their colours.
pub(super) fn coloured(text: &str, met: bool) -> String {
    let (first, rest) = match text.find("\n\n") {
        Some(end) => text.split_at(end),
        None => ("", text),
    };
    let mut out = String::with_capacity(2 * text.len());
    let style = match met {
        true => BOLD.to_owned(),
        false => format!("{BOLD};{RED}"),
    };
    for line in first.lines() {
        out += &format!("\u{1b}[{style}m{line}\u{1b}[0m\n");
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
}
