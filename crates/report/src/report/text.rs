//! A report as a terminal shows it: tables and paragraphs as wide as the window, without colour.

use super::table::{hanging_in, joined};
use super::value::{
    FigureTone, FoundLine, PartVisibility, Report, ReportDetail, ReportPart, TerminalScreen,
    VerdictHeadline,
};

impl Report {
    /// All that a terminal can show of the report, ending in a line end.
    pub fn text(&self) -> String {
        self.text_for(TerminalScreen::of(ReportDetail::Full))
    }

    /// The report for a terminal, ending in a line end.
    pub fn text_for(&self, TerminalScreen { detail, width }: TerminalScreen) -> String {
        let shown = |part| shown(part, width);
        if detail == ReportDetail::Full {
            let parts = self.parts(&[PartVisibility::Terminal, PartVisibility::Detail]);
            return parts.map(shown).collect();
        }
        let verdicts = self.parts(&[PartVisibility::Terminal, PartVisibility::Brief]);
        let verdicts = verdicts.filter(|part| part.is_verdict());
        let brief: String = verdicts.map(shown).collect();
        if detail == ReportDetail::Brief && !brief.is_empty() {
            return brief;
        }
        let parts = self.parts(&[PartVisibility::Terminal, PartVisibility::Usual]);
        let mut text: String = parts.map(shown).collect();
        if self.parts(&[PartVisibility::Detail]).count() > self.parts(&[]).count() {
            text += "--verbose shows more\n";
        }
        text
    }
}

fn shown(part: &ReportPart, width: usize) -> String {
    let hanging = |head: &str, text: &str, indent| hanging_in(width, head, text, indent);
    match part {
        ReportPart::Headline(headline) => figures(headline, width),
        ReportPart::Found(findings) => {
            let grades = findings.iter().map(|f| f.grade.chars().count());
            let margin = grades.max().unwrap_or(0) + GAP;
            // beside a narrow column of words a window of a phone has no room
            let beside = width >= NARROW;
            let line = |f: &FoundLine| match beside {
                true => hanging(&format!("  {:<margin$}", f.grade), &f.text, margin + 2),
                false => hanging("", &format!("{}: {}", f.grade, f.text), 2),
            };
            findings.iter().map(line).collect()
        }
        ReportPart::Next { text, command } => {
            let command = command.as_ref().map(|c| command_lines(c, width));
            hanging("", text, 2) + &command.unwrap_or_default()
        }
        ReportPart::Verdict { text, .. } => hanging("", text, 0),
        ReportPart::Heading(text) | ReportPart::Line(text) => format!("{text}\n"),
        ReportPart::Paragraph(text) => hanging("", text, 2),
        ReportPart::Note { head, text, margin } => hanging(head, text, *margin),
        ReportPart::List(items) => items.iter().map(|item| hanging("  ", item, 4)).collect(),
        ReportPart::Table(table) => format!("{table:width$}"),
        ReportPart::Code(command) => command_lines(command, width),
        // pictures, and text that a page folds away
        _ => String::new(),
    }
}

/// Columns between a grade and what was found.
const GAP: usize = 2;
/// Width from which on grades stand in a column of their own.
const NARROW: usize = 60;
/// Between two figures of a verdict.
pub const BETWEEN: &str = "  |  ";

/// The figures in one line where they fit, and of what they are.
fn figures(headline: &VerdictHeadline, width: usize) -> String {
    let each = headline.figures.iter().map(|f| match f.tone {
        FigureTone::Plain => format!("{} {}", f.label, f.value),
        tone => format!("{} {} ({})", f.label, f.value, tone.word()),
    });
    let each: Vec<String> = each.collect();
    let line = each.join(BETWEEN);
    let line = match line.chars().count() <= width {
        true => line,
        false => each.join("\n"),
    };
    format!("{line}\n{}", hanging_in(width, "", &headline.of, 2))
}

/// Columns before a command.
const CODE: usize = 7;

/// A command in lines that a shell takes as one; none begins with the value of an option.
fn command_lines(command: &str, width: usize) -> String {
    let parts = joined(command.split(' ').map(str::to_owned), |part, word| {
        part.starts_with('-') && !part.contains(' ') && !word.starts_with('-')
    });
    // room for the mark that the command goes on
    let room = width.saturating_sub(2);
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
    use super::super::table::WIDTH;
    use super::super::value::VerdictFigure;
    use super::*;

    #[test]
    fn a_long_command_is_folded_between_its_options() {
        let lines = command_lines(
            "cft-ident simulate -r ROBOT.toml -m MODEL.toml --move q1 --seconds 60 -o separate.csv",
            WIDTH,
        );
        assert_eq!(
            lines,
            "       cft-ident simulate -r ROBOT.toml -m MODEL.toml --move q1 --seconds 60 \\\n         \
             -o separate.csv\n"
        );
        assert!(lines.lines().all(|line| line.len() <= WIDTH));
        assert_eq!(
            command_lines("cft-ident new", WIDTH),
            "       cft-ident new\n"
        );
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
        assert_eq!(
            report.text_for(TerminalScreen::of(ReportDetail::Brief)),
            "it holds\n"
        );
        assert_eq!(
            report.text_for(TerminalScreen::of(ReportDetail::Usual)),
            "it holds\nsix of them\nwritten: a.toml\n--verbose shows more\n"
        );
        assert_eq!(
            report.text_for(TerminalScreen::of(ReportDetail::Full)),
            "it holds\nall 58 parameters\nwritten: a.toml\n"
        );
        report.brief().verdict("in short", true);
        assert_eq!(
            report.text_for(TerminalScreen::of(ReportDetail::Brief)),
            "it holds\nin short\n"
        );
        assert!(!report.text().contains("in short"));
        let mut plain = Report::new("title");
        plain.terminal().line("no verdict");
        assert_eq!(
            plain.text_for(TerminalScreen::of(ReportDetail::Brief)),
            "no verdict\n"
        );
    }

    #[test]
    fn a_verdict_is_figures_then_what_was_found_then_the_next_step() {
        let figure = |label, value: &str, tone| VerdictFigure {
            label,
            value: value.to_owned(),
            tone,
        };
        let mut report = Report::new("title");
        let mut all = report.everywhere();
        all.headline(VerdictHeadline {
            figures: vec![
                figure("before", "10.3 %", FigureTone::Plain),
                figure("after", "8.52 %", FigureTone::Better),
                figure("usual", "3.1 to 13 %", FigureTone::Plain),
            ],
            of: "torque error on held-out data".to_owned(),
        });
        let text = "play in the gear of q1".to_owned();
        let grade = "indicated";
        all.found(vec![FoundLine { grade, text }]);
        all.next("Next: log more.", None);
        let narrow = |width| {
            report.text_for(TerminalScreen {
                detail: ReportDetail::Usual,
                width,
            })
        };
        assert_eq!(
            narrow(80),
            "before 10.3 %  |  after 8.52 % (better)  |  usual 3.1 to 13 %\ntorque error on held-out data\n  \
             indicated  play in the gear of q1\nNext: log more.\n"
        );
        assert!(narrow(40).starts_with("before 10.3 %\nafter 8.52 % (better)\nusual"));
        assert_eq!(
            narrow(80),
            report.text_for(TerminalScreen::of(ReportDetail::Brief))
        );
    }
}
