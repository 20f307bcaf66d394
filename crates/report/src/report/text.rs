//! A report as a terminal shows it: tables and paragraphs of 80 columns, without colour.

use super::table::{WIDTH, hanging, joined};
use super::value::{Detail, Part, Report, Shown};

impl Report {
    /// All that a terminal can show of the report, ending in a line end.
    pub fn text(&self) -> String {
        self.text_for(Detail::Full)
    }

    /// The report for a terminal, ending in a line end.
    pub fn text_for(&self, detail: Detail) -> String {
        if detail == Detail::Full {
            let parts = self.parts(&[Shown::Terminal, Shown::Detail]);
            return parts.map(shown).collect();
        }
        let verdicts = self.parts(&[Shown::Terminal, Shown::Brief]);
        let verdicts = verdicts.filter(|part| matches!(part, Part::Verdict { .. }));
        let brief: String = verdicts.map(shown).collect();
        if detail == Detail::Brief && !brief.is_empty() {
            return brief;
        }
        let parts = self.parts(&[Shown::Terminal, Shown::Usual]);
        let mut text: String = parts.map(shown).collect();
        if self.parts(&[Shown::Detail]).count() > self.parts(&[]).count() {
            text += "--verbose shows more\n";
        }
        text
    }
}

fn shown(part: &Part) -> String {
    match part {
        Part::Verdict { text, .. } => hanging("", text, 0),
        Part::Heading(text) | Part::Line(text) => format!("{text}\n"),
        Part::Paragraph(text) => hanging("", text, 2),
        Part::Note { head, text, margin } => hanging(head, text, *margin),
        Part::List(items) => items.iter().map(|item| hanging("  ", item, 4)).collect(),
        Part::Table(table) => table.to_string(),
        Part::Code(command) => command_lines(command),
        // pictures, and text that a page folds away
        _ => String::new(),
    }
}

/// Columns before a command.
const CODE: usize = 7;

/// A command in lines that a shell takes as one; none begins with the value of an option.
fn command_lines(command: &str) -> String {
    let parts = joined(command.split(' ').map(str::to_owned), |part, word| {
        part.starts_with('-') && !part.contains(' ') && !word.starts_with('-')
    });
    // room for the mark that the command goes on
    let room = WIDTH - 2;
    let mut parts = parts.into_iter();
    let mut lines = vec![" ".repeat(CODE) + &parts.next().unwrap_or_default()];
    for part in parts {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + part.chars().count() <= room => {
                *line += &format!(" {part}");
            }
            _ => lines.push(" ".repeat(CODE + 2) + &part),
        }
    }
    lines.join(" \\\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_command_is_folded_between_its_options() {
        let lines = command_lines(
            "cft-ident simulate -r ROBOT.toml -m MODEL.toml --move q1 --seconds 60 -o separate.csv",
        );
        assert_eq!(
            lines,
            "       cft-ident simulate -r ROBOT.toml -m MODEL.toml --move q1 --seconds 60 \\\n         \
             -o separate.csv\n"
        );
        assert!(lines.lines().all(|line| line.len() <= WIDTH));
        assert_eq!(command_lines("cft-ident new"), "       cft-ident new\n");
    }

    #[test]
    fn a_terminal_shows_its_parts_in_the_order_in_which_they_were_added() {
        let mut report = Report::new("title of the page");
        report.everywhere().verdict("all is well", true);
        report.page().paragraph("not here");
        report.terminal().line("written: a.toml");
        report.everywhere().list(["one", "two"]);
        report.everywhere().figure("<svg></svg>".to_owned());
        assert_eq!(
            report.text(),
            "all is well\nwritten: a.toml\n  one\n  two\n"
        );
    }

    #[test]
    fn a_quiet_terminal_shows_the_verdict_and_a_verbose_one_everything() {
        let mut report = Report::new("title");
        report.everywhere().verdict("it holds", true);
        report.detail().line("all 58 parameters");
        report.usual().line("six of them");
        report.terminal().line("written: a.toml");
        assert_eq!(report.text_for(Detail::Brief), "it holds\n");
        assert_eq!(
            report.text_for(Detail::Usual),
            "it holds\nsix of them\nwritten: a.toml\n--verbose shows more\n"
        );
        assert_eq!(
            report.text_for(Detail::Full),
            "it holds\nall 58 parameters\nwritten: a.toml\n"
        );
        report.brief().verdict("in short", true);
        assert_eq!(report.text_for(Detail::Brief), "it holds\nin short\n");
        assert!(!report.text().contains("in short"));
        let mut plain = Report::new("title");
        plain.terminal().line("no verdict");
        assert_eq!(plain.text_for(Detail::Brief), "no verdict\n");
    }
}
