//! One self-contained page: headings, paragraphs, tables and figures in one HTML file that opens
//! from disk, on paper and on a phone, in light and in dark, without a network.
//!
//! Pictures are SVG and are seen without a script. Where a script runs, [`Part::Traces`] take the place
//! of their still picture and can be zoomed. The page's policy allows that one script, by its checksum,
//! and nothing from anywhere else.

use std::fmt::Write;

use super::encode;
use super::figure::Cells;
use super::table::Table;
use super::value::{Part, Report, Shown};
use cft_ident_logs::log::{Provenance, is_hidden};

const STYLE: &str = include_str!("style.css");
const VIEWER: &str = include_str!("viewer.js");

impl Report {
    /// The report as a file. Every text in it is escaped.
    pub fn html(&self) -> String {
        let (mut opening, mut sections) = (String::new(), Vec::<(String, String)>::new());
        let mut scripted = false;
        for part in self.parts(&[Shown::Page]) {
            if let Part::Heading(text) = part {
                sections.push((escaped(text), String::new()));
                continue;
            }
            scripted |= matches!(part, Part::Traces { .. });
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
            title = escaped(self.title()),
        );
        if sections.len() > 2 {
            out.push_str("<nav aria-label=\"sections\">");
            for (k, (heading, _)) in sections.iter().enumerate() {
                let _ = write!(out, "<a href=\"#s{}\">{heading}</a> ", k + 1);
            }
            out.push_str("</nav>\n");
        }
        for (k, (heading, body)) in sections.iter().enumerate() {
            let _ = write!(
                out,
                "<section><h2 id=\"s{}\">{heading}</h2>\n{body}</section>\n",
                k + 1
            );
        }
        if scripted {
            let _ = writeln!(out, "<script>{VIEWER}</script>");
        }
        out.push_str("</body></html>\n");
        out
    }
}

/// A part as markup, with a line end.
fn shown(part: &Part) -> String {
    match part {
        Part::Verdict { text, good } => {
            let class = if *good { "verdict" } else { "verdict bad" };
            format!("<p class=\"{class}\">{}</p>\n", prose(text))
        }
        Part::Heading(_) => String::new(),
        Part::Paragraph(text) | Part::Line(text) => format!("<p>{}</p>\n", prose(text)),
        Part::Note { head, text, .. } => {
            format!("<p>{}{}</p>\n", escaped(head.trim_start()), prose(text))
        }
        Part::List(items) => {
            let item = |item: &String| format!("<li>{}</li>\n", prose(item));
            let items: String = items.iter().map(item).collect();
            format!("<ul>\n{items}</ul>\n")
        }
        Part::Table(table) => table_of(table),
        Part::Figure(svg) => {
            let svg = inline(svg);
            format!("<figure><div class=\"still\">{svg}</div></figure>\n")
        }
        Part::Figures(cells) => figures(cells),
        Part::Folded { summary, cells } => format!(
            "<details class=\"table\"><summary>{}</summary>{}</details>\n",
            escaped(summary),
            figures(cells)
        ),
        Part::Traces { data, still } => format!(
            "<figure class=\"series\"><div class=\"still\">{}</div>\
             <script type=\"application/json\" class=\"traces\">{data}</script></figure>\n",
            inline(still)
        ),
        Part::Code(text) => format!("<pre>{}</pre>\n", whole_words(text)),
        Part::Details { summary, text } => format!(
            "<details><summary>{}</summary><pre>{}</pre></details>\n",
            escaped(summary),
            escaped(text)
        ),
    }
}

/// Small pictures beside each other, with their title, what the colours mean, and what is said of them.
fn figures(cells: &Cells) -> String {
    let mut out = format!(
        "<figure class=\"{}\"><figcaption>{}</figcaption>",
        match (cells.apart, cells.pictures.len() > 2) {
            (true, _) => "card apart",
            (false, true) => "card many",
            (false, false) => "card",
        },
        escaped(&capital(&cells.title))
    );
    if !cells.key.is_empty() {
        out.push_str("<div class=\"legend\">");
        for entry in &cells.key {
            out.push_str(inline(entry));
        }
        out.push_str("</div>");
    }
    out.push_str("<div class=\"still cells\">");
    for picture in &cells.pictures {
        out.push_str(inline(picture));
    }
    out.push_str("</div>");
    for words in &cells.words {
        let _ = write!(out, "<p>{}</p>", prose(words));
    }
    out.push_str("</figure>\n");
    out
}

/// A title with a capital letter, unless its first word is no plain one.
fn capital(title: &str) -> String {
    let first = title.split(' ').next().unwrap_or("");
    match first.chars().all(char::is_alphabetic) {
        true => {
            let mut chars = title.chars();
            let initial = chars.next().map(char::to_uppercase).into_iter().flatten();
            initial.chain(chars).collect()
        }
        false => title.to_owned(),
    }
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
    match rows.len() > FOLDED_FROM_ROWS {
        true => format!(
            "<details class=\"table\"><summary>{} ({} rows)</summary>{}</details>\n",
            escaped(if caption.is_empty() { "table" } else { caption }),
            rows.len(),
            open_table(table)
        ),
        false => open_table(table),
    }
}

/// Rows from which on a table is folded.
const FOLDED_FROM_ROWS: usize = 24;

fn open_table(table: &Table) -> String {
    let (caption, head, rows) = table.parts();
    let columns: Vec<Column> = (0..head.len())
        .map(|c| Column::of(c, rows.iter().filter_map(|row| row.get(c))))
        .collect();
    let class = |c: usize| columns.get(c).map_or("", |column| column.class());
    let cards = needs(&head, rows) > PHONE;
    let mut out = String::from("<div class=\"wide\" tabindex=\"0\" role=\"region\"");
    let _ = write!(
        out,
        " aria-label=\"{0}\"><table{1}><caption>{0}</caption><thead><tr>",
        escaped(caption),
        if cards { " class=\"cards\"" } else { "" }
    );
    for (c, name) in head.iter().enumerate() {
        let _ = write!(out, "<th scope=\"col\"{}>{}</th>", class(c), escaped(name));
    }
    out.push_str("</tr></thead><tbody>\n");
    for row in rows {
        out.push_str("<tr>");
        for (c, cell) in row.iter().enumerate() {
            let name = head.get(c).filter(|_| cards && c > 0);
            let name = name.map_or(String::new(), |n| {
                format!(" data-of=\"{}\"", bound(&escaped(n)))
            });
            let cell = bound(&escaped(cell));
            let _ = write!(out, "<td{}{name}>{cell}</td>", class(c));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
    out
}

/// Characters beside each other that a phone has room for.
const PHONE: usize = 34;

/// Characters that the rows of a table need beside each other, with a gap of two between columns.
fn needs(head: &[&str], rows: &[Vec<String>]) -> usize {
    let width = |text: &str| text.chars().count();
    let column = |c: usize| {
        let cells = rows
            .iter()
            .filter_map(|row| row.get(c))
            .map(|cell| width(cell));
        let name = head[c].split(' ').map(width).max();
        cells.chain(name).max().unwrap_or(0) + 2
    };
    (0..head.len()).map(column).sum()
}

/// What a column of a table holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Column {
    Numbers,
    Words,
    /// Sentences, which are broken into lines.
    Long,
    /// Checksums, which break anywhere.
    Code,
}

/// Longest cell that stays on one line.
const MAX_CELL_CHARACTERS: usize = 28;

impl Column {
    fn of<'a>(c: usize, mut cells: impl Iterator<Item = &'a String> + Clone) -> Self {
        let checksum = |cell: &String| cell.len() == 64 && !cell.contains(' ');
        if cells.clone().any(checksum) {
            Column::Code
        } else if cells
            .clone()
            .any(|cell| cell.chars().count() > MAX_CELL_CHARACTERS)
        {
            Column::Long
        } else if c == 0 || cells.any(|cell| wordy(cell)) {
            Column::Words
        } else {
            Column::Numbers
        }
    }

    fn class(self) -> &'static str {
        match self {
            Column::Numbers => "",
            Column::Words => " class=\"text\"",
            Column::Long => " class=\"long\"",
            Column::Code => " class=\"code\"",
        }
    }
}

/// Whether a cell holds words and not a number with its unit.
fn wordy(cell: &str) -> bool {
    cell.starts_with(|c: char| c.is_alphabetic())
}

/// Inside HTML the XML declaration is not wanted.
fn inline(svg: &str) -> &str {
    svg.find("<svg").map_or(svg, |start| &svg[start..])
}

/// The script's checksum as a content security policy names it.
fn fingerprint() -> String {
    let hex = Provenance::of_text("", VIEWER).sha256;
    let digit = |c: u8| char::from(c).to_digit(16).unwrap_or(0) as u8;
    let bytes: Vec<u8> = hex
        .as_bytes()
        .chunks(2)
        .map(|pair| pair.iter().fold(0, |byte, c| byte << 4 | digit(*c)))
        .collect();
    format!("sha256-{}", encode::base64(&bytes))
}

/// Sentences as HTML: what stands between two backticks is code, and no line ends between a number and its percent sign.
fn prose(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let parts: Vec<&str> = text.split('`').collect();
    for (k, part) in parts.iter().enumerate() {
        let safe = escaped(part);
        match (k % 2 == 1, k + 1 < parts.len()) {
            (true, true) => {
                let _ = write!(out, "<code>{safe}</code>");
            }
            // a backtick without another
            (true, false) => {
                out.push('`');
                out.push_str(&safe);
            }
            (false, _) => out.push_str(&bound(&safe)),
        }
    }
    out
}

/// No line ends between a number and its percent sign.
fn bound(safe: &str) -> String {
    safe.replace(" %", "\u{a0}%")
}

/// Text as HTML may hold it.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if is_hidden(c) && c != '\n' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Traces;

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
        page.table(Table::of_words(evil, &[evil], vec![vec![evil.to_owned()]]));
        page.traces(&Traces::sample(evil), "<svg></svg>");
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
        page.traces(&Traces::sample("q1"), "<svg></svg>");
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
        // of an empty script, from the definition of SHA-256
        assert_eq!(encode::base64(&[0xe3, 0xb0, 0xc4, 0x42]), "47DEQg==");
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
        let rows = |n: usize| vec![vec!["cell".to_owned()]; n];
        let short = table_of(&Table::of_words("short", &["a"], rows(FOLDED_FROM_ROWS)));
        assert!(!short.contains("<details"), "{short}");
        let long = table_of(&Table::of_words("long", &["a"], rows(58)));
        assert!(long.starts_with("<details"), "{long}");
        assert!(long.contains("<summary>long (58 rows)</summary>"), "{long}");
        assert_eq!(long.matches("<td").count(), 58);
    }

    #[test]
    fn a_column_of_words_is_told_from_a_column_of_numbers() {
        let cells = |text: &[&str]| text.iter().map(|t| (*t).to_owned()).collect::<Vec<_>>();
        assert_eq!(
            Column::of(1, cells(&["1.2 N", "-"]).iter()),
            Column::Numbers
        );
        assert_eq!(Column::of(1, cells(&["-", "weak"]).iter()), Column::Words);
        assert_eq!(
            Column::of(3, cells(&[&"0".repeat(64)]).iter()),
            Column::Code
        );
    }
}
