//! One self-contained page: headings, paragraphs, tables and figures in one HTML file that opens
//! from disk, on paper and on a phone, in light and in dark, without a network.
//!
//! Pictures are SVG and are seen without a script. Where a script runs, [`ReportPart::Traces`] take the place
//! of their still picture and can be zoomed. The page's policy allows that one script, by its checksum,
//! and nothing from anywhere else.

use super::encode;
use super::figure::PictureGroup;
use super::table::Table;
use super::value::{
    FigureTone, FoundLine, PartVisibility, Report, ReportPart, VerdictFigure, VerdictHeadline,
};
use cft_ident_logs::log::{Provenance, is_hidden};

const STYLE: &str = include_str!("style.css");
const VIEWER: &str = include_str!("viewer.js");

impl Report {
    /// The report as a file. Every text in it is escaped.
    pub fn html(&self) -> String {
        let (mut opening, mut sections) = (String::new(), Vec::<(String, String)>::new());
        let mut scripted = false;
        for part in self.parts(&[PartVisibility::Page]) {
            if let ReportPart::Heading(text) = part {
                sections.push((escaped(text), String::new()));
                continue;
            }
            scripted |= matches!(part, ReportPart::Traces { .. });
            let body = sections.last_mut().map_or(&mut opening, |(_, body)| body);
            body.push_str(&shown(part));
        }
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
             style-src 'unsafe-inline'; script-src '{}'\">\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
             <title>{title}</title><style>\n{STYLE}</style></head><body>\n<h1>{title}</h1>\n{opening}",
            fingerprint(),
            title = escaped(&self.title),
        );
        let numbered = || (1..).zip(&sections);
        if sections.len() > 2 {
            let link = |(k, (heading, _)): (u32, &(String, _))| {
                format!("<a href=\"#s{k}\">{heading}</a> ")
            };
            let links: String = numbered().map(link).collect();
            out += &format!("<nav aria-label=\"sections\">{links}</nav>\n");
        }
        for (k, (heading, body)) in numbered() {
            out += &format!("<section><h2 id=\"s{k}\">{heading}</h2>\n{body}</section>\n");
        }
        if scripted {
            out += &format!("<script>{VIEWER}</script>\n");
        }
        out + "</body></html>\n"
    }
}

/// A part as markup, with a line end.
fn shown(part: &ReportPart) -> String {
    match part {
        ReportPart::Headline(headline) => headline_of(headline),
        ReportPart::Found(findings) => {
            let item = |f: &FoundLine| {
                let class = f.grade.split(' ').next().unwrap_or_default();
                format!(
                    "<li><b class=\"grade {}\">{}</b> {}</li>\n",
                    escaped(class),
                    escaped(f.grade),
                    prose(&f.text)
                )
            };
            let items: String = findings.iter().map(item).collect();
            format!("<ul class=\"found\">\n{items}</ul>\n")
        }
        ReportPart::Next { text, command } => {
            let command = command
                .as_ref()
                .map(|c| format!("<pre>{}</pre>\n", whole_words(c)));
            format!(
                "<p class=\"next\">{}</p>\n{}",
                prose(text),
                command.unwrap_or_default()
            )
        }
        ReportPart::Verdict { text, good } => {
            let class = if *good { "verdict" } else { "verdict bad" };
            format!("<p class=\"{class}\">{}</p>\n", prose(text))
        }
        ReportPart::Heading(_) => String::new(),
        ReportPart::Paragraph(text) | ReportPart::Line(text) => format!("<p>{}</p>\n", prose(text)),
        ReportPart::Note { head, text, .. } => {
            format!("<p>{}{}</p>\n", escaped(head.trim_start()), prose(text))
        }
        ReportPart::List(items) => {
            let item = |item: &String| format!("<li>{}</li>\n", prose(item));
            let items: String = items.iter().map(item).collect();
            format!("<ul>\n{items}</ul>\n")
        }
        ReportPart::Table(table) => table_of(table),
        ReportPart::Figure(svg) => {
            let svg = inline(svg);
            format!("<figure><div class=\"still\">{svg}</div></figure>\n")
        }
        ReportPart::Figures(cells) => figures(cells),
        ReportPart::Folded { summary, cells } => format!(
            "<details class=\"table\"><summary>{}</summary>{}</details>\n",
            escaped(summary),
            figures(cells)
        ),
        ReportPart::Traces { data, still } => format!(
            "<figure class=\"series\"><div class=\"still\">{}</div>\
             <script type=\"application/json\" class=\"traces\">{data}</script></figure>\n",
            inline(still)
        ),
        ReportPart::Code(text) => format!("<pre>{}</pre>\n", whole_words(text)),
        ReportPart::Details { summary, text } => format!(
            "<details><summary>{}</summary><pre>{}</pre></details>\n",
            escaped(summary),
            escaped(text)
        ),
    }
}

/// The figures of a verdict beside each other, and of what they are.
fn headline_of(headline: &VerdictHeadline) -> String {
    let figure = |f: &VerdictFigure| {
        let word = match f.tone {
            FigureTone::Plain => String::new(),
            tone => format!(" <em>{}</em>", tone.word()),
        };
        format!(
            "<div class=\"{}\"><span>{}</span><b>{}</b>{word}</div>",
            f.tone.word(),
            escaped(f.label),
            bound(&escaped(&f.value)),
        )
    };
    let figures: String = headline.figures.iter().map(figure).collect();
    format!(
        "<div class=\"headline\">{figures}</div>\n<p class=\"of\">{}</p>\n",
        prose(&headline.of)
    )
}

/// Small pictures beside each other, with their title, their legend and the sentences below them.
fn figures(cells: &PictureGroup) -> String {
    let class = match (cells.apart, cells.pictures.len() > 2) {
        (true, _) => "card apart",
        (false, true) => "card many",
        (false, false) => "card",
    };
    let inline = |all: &[String]| all.iter().map(|svg| inline(svg)).collect::<String>();
    let words = cells.words.iter();
    let words: String = words
        .map(|words| format!("<p>{}</p>", prose(words)))
        .collect();
    format!(
        "<figure class=\"{class}\"><figcaption>{}</figcaption><div class=\"legend\">{}</div>\
         <div class=\"still cells\">{}</div>{words}</figure>\n",
        escaped(&capital(&cells.title)),
        inline(&cells.key),
        inline(&cells.pictures)
    )
}

/// A title with a capital letter, unless its first word is no plain one.
fn capital(title: &str) -> String {
    let first = title.split(' ').next().unwrap_or("");
    if !first.chars().all(char::is_alphabetic) {
        return title.to_owned();
    }
    let mut chars = title.chars();
    let initial = chars.next().map(char::to_uppercase).into_iter().flatten();
    initial.chain(chars).collect()
}

/// A command, whose words a line end does not part where a line holds them.
fn whole_words(text: &str) -> String {
    let word = |word: &str| format!("<span>{}</span>", escaped(word));
    let line = |line: &str| line.split(' ').map(word).collect::<Vec<_>>().join(" ");
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// A table; the first column holds names. A column of words is set to the left.
fn table_of(table: &Table) -> String {
    let (caption, _, rows) = table.parts();
    if rows.len() <= FOLDED_FROM_ROWS {
        return open_table(table);
    }
    format!(
        "<details class=\"table\"><summary>{} ({} rows)</summary>{}</details>\n",
        escaped(if caption.is_empty() { "table" } else { caption }),
        rows.len(),
        open_table(table)
    )
}

/// Rows from which on a table is folded.
const FOLDED_FROM_ROWS: usize = 24;

fn open_table(table: &Table) -> String {
    let (caption, head, rows) = table.parts();
    let class = |c: usize| class(c, rows.iter().map(|row| &row[c]));
    let classes: Vec<&str> = (0..head.len()).map(class).collect();
    let cards = needs(&head, rows) > PHONE;
    let columns = || head.iter().zip(&classes);
    let heads =
        columns().map(|(name, class)| format!("<th scope=\"col\"{class}>{}</th>", escaped(name)));
    let row = |row: &Vec<String>| {
        let cells = row.iter().zip(columns()).enumerate();
        let cells = cells.map(|(c, (cell, (name, class)))| {
            let name = match cards && c > 0 {
                true => format!(" data-of=\"{}\"", bound(&escaped(name))),
                false => String::new(),
            };
            format!("<td{class}{name}>{}</td>", bound(&escaped(cell)))
        });
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    format!(
        "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"{0}\"><table{1}>\
         <caption>{0}</caption><thead><tr>{2}</tr></thead><tbody>\n{3}</tbody></table></div>\n",
        escaped(caption),
        if cards { " class=\"cards\"" } else { "" },
        heads.collect::<String>(),
        rows.iter().map(row).collect::<String>()
    )
}

/// Characters beside each other that a phone has room for.
const PHONE: usize = 34;

/// Characters that the rows of a table need beside each other, with a gap of two between columns.
fn needs(head: &[&str], rows: &[Vec<String>]) -> usize {
    let width = |text: &str| text.chars().count();
    let column = |c: usize| {
        let cells = rows.iter().map(|row| width(&row[c]));
        let name = head[c].split(' ').map(width).max();
        cells.chain(name).max().unwrap_or(0) + 2
    };
    (0..head.len()).map(column).sum()
}

/// Longest cell that stays on one line.
const MAX_CELL_CHARACTERS: usize = 28;

/// The class of a column: checksums break anywhere, long sentences into lines; words, and numbers.
fn class<'a>(c: usize, mut cells: impl Iterator<Item = &'a String> + Clone) -> &'static str {
    let checksum = |cell: &String| cell.len() == 64 && !cell.contains(' ');
    let long = |cell: &String| cell.chars().count() > MAX_CELL_CHARACTERS;
    // a cell of words, and not a number with its unit
    let wordy = |cell: &String| cell.starts_with(|c: char| c.is_alphabetic());
    match c {
        _ if cells.clone().any(checksum) => " class=\"code\"",
        _ if cells.clone().any(long) => " class=\"long\"",
        0 => " class=\"text\"",
        _ if cells.any(wordy) => " class=\"text\"",
        _ => "",
    }
}

/// Inside HTML the XML declaration is not wanted.
fn inline(svg: &str) -> &str {
    svg.find("<svg").map_or(svg, |start| &svg[start..])
}

/// The script's checksum as a content security policy names it.
fn fingerprint() -> String {
    let hex = Provenance::of_text("", VIEWER).sha256;
    let digit = |c: &u8| char::from(*c).to_digit(16).unwrap_or(0) as u8;
    let bytes = hex.as_bytes().chunks(2);
    let bytes = bytes.map(|pair| pair.iter().fold(0, |byte, c| byte << 4 | digit(c)));
    format!("sha256-{}", encode::base64(&bytes.collect::<Vec<u8>>()))
}

/// Sentences as HTML: text between two backticks is code, and no line ends between a number and its percent sign.
fn prose(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    let part = |(k, part): (usize, &&str)| match (k % 2 == 1, k + 1 < parts.len()) {
        (true, true) => format!("<code>{}</code>", escaped(part)),
        // a backtick without another
        (true, false) => format!("`{}", escaped(part)),
        (false, _) => bound(&escaped(part)),
    };
    parts.iter().enumerate().map(part).collect()
}

/// No line ends between a number and its percent sign.
fn bound(safe: &str) -> String {
    safe.replace(" %", "\u{a0}%")
}

/// Text as HTML may hold it.
fn escaped(text: &str) -> String {
    let shown = |c: char| match is_hidden(c) && c != '\n' {
        true => '\u{fffd}',
        false => c,
    };
    encode::without_markup(text.chars().map(shown)).replace('\'', "&#39;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::table::Columns;
    use crate::report::traces::FigureTraces;

    #[test]
    fn nothing_that_is_given_becomes_markup() {
        let evil = "</script><script>alert('x')</script>&\"";
        let mut report = Report::new(evil);
        let mut page = report.page();
        page.verdict(evil, true);
        for _ in 0..3 {
            page.heading(evil);
        }
        page.paragraph(evil);
        page.list([evil]);
        page.details(evil, evil);
        page.table(Columns::new(evil, [()]).words(evil, |()| evil));
        page.traces(&FigureTraces::sample(evil), "<svg></svg>".to_owned());
        let html = report.html();
        // the data of the traces and the viewer
        assert_eq!(html.matches("<script").count(), 2);
        assert_eq!(html.matches("</script>").count(), 2);
        assert!(html.matches("&lt;script&gt;").count() >= 16);
    }

    #[test]
    fn commands_in_a_sentence_are_code_and_percent_signs_stay_with_their_number() {
        assert_eq!(
            prose("4.5 % off: `lsq <LOG>` says so"),
            "4.5\u{a0}% off: <code>lsq &lt;LOG&gt;</code> says so"
        );
        assert_eq!(prose("one ` alone"), "one ` alone");
    }

    #[test]
    fn the_page_asks_for_nothing_from_anywhere() {
        let mut report = Report::new("t");
        let mut page = report.page();
        page.traces(&FigureTraces::sample("q1"), "<svg></svg>".to_owned());
        let html = report.html();
        for word in [
            "http:", "https:", "src=", "@import", "url(", "fetch(", "import(",
        ] {
            let found = html.replace("http://www.w3.org/2000/svg", "");
            assert!(!found.contains(word), "{word}");
        }
        assert!(html.contains("default-src 'none'"));
    }

    #[test]
    fn the_policy_names_the_script_by_its_checksum() {
        let fingerprint = fingerprint();
        assert_eq!(fingerprint.len(), "sha256-".len() + 44);
        assert!(Report::new("t").html().contains(&fingerprint));
    }

    #[test]
    fn every_colour_of_the_figures_has_its_place_in_the_dark() {
        for colour in crate::report::figure::PALETTE {
            let known = STYLE.contains(&format!("[fill=\"{colour}\"]"))
                || STYLE.contains(&format!("[stroke=\"{colour}\"]"))
                || STYLE.contains(&format!("--sky:{colour}"));
            assert!(known, "{colour}");
        }
    }

    #[test]
    fn a_long_table_is_folded_with_its_number_of_rows() {
        let table = |name: &str, rows: usize| {
            let columns = Columns::new(name, vec![(); rows]).words("a", |()| "cell");
            table_of(&columns.into())
        };
        let short = table("short", FOLDED_FROM_ROWS);
        assert!(!short.contains("<details"), "{short}");
        let long = table("long", 58);
        assert!(long.starts_with("<details"), "{long}");
        assert!(long.contains("<summary>long (58 rows)</summary>"), "{long}");
        assert_eq!(long.matches("<td").count(), 58);
    }

    #[test]
    fn columns_of_words_numbers_and_checksums_have_classes_of_their_own() {
        for (c, cells, expected) in [
            (1, ["1.2 N", "-"], ""),
            (1, ["-", "weak"], " class=\"text\""),
            (3, ["-", &*"0".repeat(64)], " class=\"code\""),
        ] {
            assert_eq!(class(c, cells.map(str::to_owned).iter()), expected);
        }
    }
}
