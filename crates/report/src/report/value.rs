//! The result of a run as one value: verdict, tables, figures and notes in their order. A terminal
//! and a page are two renderings of it ([`super::text`], [`super::page`]); each part says where it is
//! shown, since a page has room for more.

use std::fmt::Display;

use super::figure::PictureGroup;
use super::table::{Table, WIDTH};
use super::traces::FigureTraces;

/// Where a part is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PartVisibility {
    Everywhere,
    Terminal,
    /// On a terminal that is to show little.
    Brief,
    /// On a terminal that is to show about a screen.
    Usual,
    /// On a terminal that is to show everything.
    Detail,
    Page,
}

/// How much of a report a terminal shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ReportDetail {
    /// The verdict; of a report without one what is usual.
    Brief,
    /// About a screen.
    #[default]
    Usual,
    /// Everything.
    Full,
}

/// What a figure of a verdict says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FigureTone {
    Plain,
    Better,
    Worse,
    /// Above what is usual.
    High,
}

impl FigureTone {
    /// The word that stands behind the figure; a terminal without colour has no other sign.
    pub fn word(self) -> &'static str {
        match self {
            FigureTone::Plain => "",
            FigureTone::Better => "better",
            FigureTone::Worse => "worse",
            FigureTone::High => "high",
        }
    }
}

/// A figure of a verdict with the word above it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VerdictFigure {
    pub label: &'static str,
    pub value: String,
    pub tone: FigureTone,
}

/// The figures of a verdict: few, and of what they are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VerdictHeadline {
    pub figures: Vec<VerdictFigure>,
    pub of: String,
}

/// One thing that was found, with a word for how firm it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundLine {
    pub grade: &'static str,
    pub text: String,
}

/// What a terminal shows of a report, and in how many columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TerminalScreen {
    pub detail: ReportDetail,
    pub width: usize,
}

impl TerminalScreen {
    /// A screen of the usual width.
    pub fn of(detail: ReportDetail) -> Self {
        let width = WIDTH;
        TerminalScreen { detail, width }
    }
}

/// One part of a report.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum ReportPart {
    /// The figures of the verdict.
    Headline(VerdictHeadline),
    /// What was found.
    Found(Vec<FoundLine>),
    /// The next step, and the command for it.
    Next {
        text: String,
        command: Option<String>,
    },
    /// The verdict in words; `good` where nothing calls for attention.
    Verdict {
        text: String,
        good: bool,
    },
    /// Begins a section.
    Heading(String),
    Paragraph(String),
    /// A paragraph that begins with `head`; on a terminal its further lines stand `margin` columns in.
    Note {
        head: String,
        text: String,
        margin: usize,
    },
    /// A line as it stands, of any length: a path, a command to type.
    Line(String),
    List(Vec<String>),
    Table(Table),
    /// An SVG document.
    Figure(String),
    /// Small pictures that belong together.
    Figures(PictureGroup),
    /// Small pictures that are folded away.
    Folded {
        summary: String,
        cells: PictureGroup,
    },
    /// Series over time as the page's viewer reads them, and the SVG document that is shown without a script.
    Traces {
        data: String,
        still: String,
    },
    /// A command line.
    Code(String),
    /// Text that is folded away, as it stands.
    Details {
        summary: String,
        text: String,
    },
}

impl ReportPart {
    /// Whether it belongs to the verdict, which a terminal shows even where little is asked for.
    pub(super) fn is_verdict(&self) -> bool {
        use ReportPart::{Found, Headline, Next, Verdict};
        matches!(self, Headline(_) | Found(_) | Next { .. } | Verdict { .. })
    }
}

/// A report under construction.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    pub(super) title: String,
    parts: Vec<(PartVisibility, ReportPart)>,
}

impl Report {
    /// An empty report; the title is that of its page.
    pub fn new(title: &str) -> Self {
        Report {
            title: title.to_owned(),
            parts: Vec::new(),
        }
    }

    /// The parts that are shown in one of these places or everywhere, in their order.
    pub(super) fn parts<'a>(
        &'a self,
        places: &'a [PartVisibility],
    ) -> impl Iterator<Item = &'a ReportPart> {
        let there =
            |shown: PartVisibility| shown == PartVisibility::Everywhere || places.contains(&shown);
        let parts = self.parts.iter().filter(move |(shown, _)| there(*shown));
        parts.map(|(_, part)| part)
    }

    /// Adds parts that are shown everywhere.
    pub fn everywhere(&mut self) -> Writer<'_> {
        self.shown(PartVisibility::Everywhere)
    }

    /// Adds parts that only a terminal shows.
    pub fn terminal(&mut self) -> Writer<'_> {
        self.shown(PartVisibility::Terminal)
    }

    /// Adds a verdict that a terminal shows where little is asked for, and others have said in more words.
    pub fn brief(&mut self) -> Writer<'_> {
        self.shown(PartVisibility::Brief)
    }

    /// Adds parts in short, which a terminal leaves out where it shows everything.
    pub fn usual(&mut self) -> Writer<'_> {
        self.shown(PartVisibility::Usual)
    }

    /// Adds parts that a terminal shows where everything is asked for.
    pub fn detail(&mut self) -> Writer<'_> {
        self.shown(PartVisibility::Detail)
    }

    /// Adds parts that only a page has room for.
    pub fn page(&mut self) -> Writer<'_> {
        self.shown(PartVisibility::Page)
    }

    fn shown(&mut self, shown: PartVisibility) -> Writer<'_> {
        let parts = &mut self.parts;
        Writer { parts, shown }
    }
}

/// Adds parts to a report that are shown in one place.
#[derive(Debug)]
pub struct Writer<'a> {
    parts: &'a mut Vec<(PartVisibility, ReportPart)>,
    shown: PartVisibility,
}

impl Writer<'_> {
    fn push(&mut self, part: ReportPart) {
        self.parts.push((self.shown, part));
    }

    pub fn verdict(&mut self, text: &str, good: bool) {
        let text = text.to_owned();
        self.push(ReportPart::Verdict { text, good });
    }

    /// The figures of the verdict.
    pub fn headline(&mut self, headline: VerdictHeadline) {
        self.push(ReportPart::Headline(headline));
    }

    /// What was found; nothing where there is none.
    pub fn found(&mut self, findings: Vec<FoundLine>) {
        if !findings.is_empty() {
            self.push(ReportPart::Found(findings));
        }
    }

    /// The next step.
    pub fn next(&mut self, text: &str, command: Option<String>) {
        let text = text.to_owned();
        self.push(ReportPart::Next { text, command });
    }

    pub fn heading(&mut self, text: &str) {
        self.push(ReportPart::Heading(text.to_owned()));
    }

    pub fn paragraph(&mut self, text: &str) {
        self.push(ReportPart::Paragraph(text.to_owned()));
    }

    pub fn note(&mut self, head: &str, text: &str, margin: usize) {
        self.push(ReportPart::Note {
            head: head.to_owned(),
            text: text.to_owned(),
            margin,
        });
    }

    pub fn line(&mut self, text: &str) {
        self.push(ReportPart::Line(text.to_owned()));
    }

    /// A list of sentences; nothing where there are none.
    pub fn list<S: Display>(&mut self, items: impl IntoIterator<Item = S>) {
        let items: Vec<String> = items.into_iter().map(|item| item.to_string()).collect();
        if !items.is_empty() {
            self.push(ReportPart::List(items));
        }
    }

    pub fn table(&mut self, table: impl Into<Table>) {
        self.push(ReportPart::Table(table.into()));
    }

    /// A table below an empty line.
    pub(super) fn table_apart(&mut self, table: impl Into<Table>) {
        self.line("");
        self.table(table);
    }

    /// A table; nothing where it has no row.
    pub(super) fn table_if_any(&mut self, table: impl Into<Table>) {
        let table = table.into();
        if !table.is_empty() {
            self.table(table);
        }
    }

    pub(super) fn figure(&mut self, svg: String) {
        self.push(ReportPart::Figure(svg));
    }

    /// Small pictures that belong together.
    pub(super) fn figures(&mut self, cells: PictureGroup) {
        self.push(ReportPart::Figures(cells));
    }

    /// Small pictures that are folded away.
    pub(super) fn folded(&mut self, summary: String, cells: PictureGroup) {
        self.push(ReportPart::Folded { summary, cells });
    }

    /// Series over time, and the still picture that is shown without a script.
    pub(super) fn traces(&mut self, traces: &FigureTraces, still: String) {
        let data = traces.data();
        self.push(ReportPart::Traces { data, still });
    }

    pub fn code(&mut self, text: &str) {
        self.push(ReportPart::Code(text.to_owned()));
    }

    pub(crate) fn details(&mut self, summary: &str, text: &str) {
        self.push(ReportPart::Details {
            summary: summary.to_owned(),
            text: text.to_owned(),
        });
    }
}
