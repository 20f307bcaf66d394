//! The SVG text itself: shapes with two decimals, escaped words, nothing else.

use std::fmt::Write;

use super::colour;
use cft_ident_logs::log::is_hidden;

/// Fonts that are likely to be there; all measures leave room for the widest of them.
const FONTS: &str = "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif";

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    pub colour: &'static str,
    pub width: f64,
    /// Lengths of dash and gap as SVG wants them; empty for a solid line.
    pub dash: &'static str,
}

impl Stroke {
    pub(crate) const fn solid(colour: &'static str, width: f64) -> Self {
        Stroke {
            colour,
            width,
            dash: "",
        }
    }

    pub(crate) const fn dashed(colour: &'static str, width: f64, dash: &'static str) -> Self {
        Stroke {
            colour,
            width,
            dash,
        }
    }
}

/// Where a text is anchored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// How a text is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Type {
    pub size: f64,
    pub bold: bool,
    pub colour: &'static str,
    pub anchor: Anchor,
}

impl Type {
    pub const fn new(size: f64, anchor: Anchor) -> Self {
        Type {
            size,
            bold: false,
            colour: colour::INK,
            anchor,
        }
    }

    pub(crate) const fn bold(mut self) -> Self {
        self.bold = true;
        self
    }

    pub(crate) const fn muted(mut self) -> Self {
        self.colour = colour::MUTED;
        self
    }
}

/// A picture under construction; y grows downwards, units are px.
#[derive(Debug)]
pub(super) struct Svg {
    width: f64,
    height: f64,
    title: String,
    description: String,
    body: String,
}

impl Svg {
    /// `title` and `description` are what a screen reader says.
    pub fn new(width: f64, height: f64, title: &str, description: &str) -> Self {
        Svg {
            width,
            height,
            title: escaped(title),
            description: escaped(description),
            body: String::new(),
        }
    }

    pub(crate) fn rect(
        &mut self,
        [x, y, width, height]: [f64; 4],
        fill: &str,
        stroke: Option<Stroke>,
    ) {
        let _ = write!(
            self.body,
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{fill}\"",
            px(x),
            px(y),
            px(width),
            px(height)
        );
        if let Some(stroke) = stroke {
            self.stroke(stroke);
        }
        self.body.push_str("/>\n");
    }

    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], stroke: Stroke) {
        let _ = write!(
            self.body,
            "<path d=\"M{} {}L{} {}\" fill=\"none\"",
            px(x1),
            px(y1),
            px(x2),
            px(y2)
        );
        self.stroke(stroke);
        self.body.push_str("/>\n");
    }

    /// Several runs of points as one path, so that one dash pattern and one colour hold for them.
    pub fn curve(&mut self, runs: &[Vec<[f64; 2]>], stroke: Stroke) {
        if runs.iter().all(|run| run.len() < 2) {
            return;
        }
        self.body.push_str("<path d=\"");
        for run in runs.iter().filter(|run| run.len() > 1) {
            self.steps(run);
        }
        self.body
            .push_str("\" fill=\"none\" stroke-linejoin=\"round\"");
        self.stroke(stroke);
        self.body.push_str("/>\n");
    }

    /// A filled shape, `opacity` 0..1.
    pub(crate) fn area(&mut self, outline: &[[f64; 2]], fill: &str, opacity: f64) {
        if outline.len() < 3 {
            return;
        }
        self.body.push_str("<path d=\"");
        self.steps(outline);
        let _ = writeln!(
            self.body,
            "Z\" fill=\"{fill}\" fill-opacity=\"{}\"/>",
            px(opacity)
        );
    }

    pub fn dot(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str) {
        let _ = writeln!(
            self.body,
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{fill}\"/>",
            px(x),
            px(y),
            px(radius)
        );
    }

    /// A dot with a ring around it.
    pub(crate) fn ringed(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str, ring: Stroke) {
        let (x, y, radius) = (px(x), px(y), px(radius));
        let _ = write!(
            self.body,
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{fill}\""
        );
        self.stroke(ring);
        self.body.push_str("/>\n");
    }

    pub fn text(&mut self, [x, y]: [f64; 2], text: &str, style: Type) {
        let _ = write!(self.body, "<text x=\"{}\" y=\"{}\"", px(x), px(y));
        self.set("", text, style);
    }

    /// A line that begins with a bold name.
    pub fn heading(&mut self, [x, y]: [f64; 2], name: &str, rest: &str, style: Type) {
        let _ = write!(self.body, "<text x=\"{}\" y=\"{}\"", px(x), px(y));
        self.set(name, rest, style);
    }

    /// Text that reads upwards, anchored at its middle.
    pub fn upright(&mut self, [x, y]: [f64; 2], text: &str, style: Type) {
        let _ = write!(
            self.body,
            "<text transform=\"translate({} {}) rotate(-90)\"",
            px(x),
            px(y)
        );
        self.set("", text, style);
    }

    /// Begins a group that is cut at a rectangle; end it with [`Svg::end_clip`]. A nested picture
    /// does it without an id, so that several figures may stand in one page.
    pub(crate) fn clip(&mut self, [x, y, width, height]: [f64; 4]) {
        let (x, y, width, height) = (px(x), px(y), px(width), px(height));
        let _ = writeln!(
            self.body,
            "<svg x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"{x} {y} {width} {height}\">"
        );
    }

    pub(crate) fn end_clip(&mut self) {
        self.body.push_str("</svg>\n");
    }

    /// The whole document.
    pub fn finish(self) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
             role=\"img\" font-family=\"{FONTS}\">\n<title>{2}</title>\n<desc>{3}</desc>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"{4}\"/>\n{5}</svg>\n",
            px(self.width),
            px(self.height),
            self.title,
            self.description,
            colour::PAPER,
            self.body
        )
    }

    fn steps(&mut self, points: &[[f64; 2]]) {
        for (k, [x, y]) in points.iter().enumerate() {
            let step = if k == 0 { 'M' } else { 'L' };
            let _ = write!(self.body, "{step}{} {}", px(*x), px(*y));
        }
    }

    fn stroke(&mut self, stroke: Stroke) {
        let Stroke {
            colour,
            width,
            dash,
        } = stroke;
        let _ = write!(
            self.body,
            " stroke=\"{colour}\" stroke-width=\"{}\"",
            px(width)
        );
        if !dash.is_empty() {
            let _ = write!(self.body, " stroke-dasharray=\"{dash}\"");
        }
    }

    fn set(&mut self, bold: &str, text: &str, style: Type) {
        let anchor = match style.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let weight = if style.bold {
            " font-weight=\"bold\""
        } else {
            ""
        };
        let _ = write!(
            self.body,
            " font-size=\"{}\" fill=\"{}\" text-anchor=\"{anchor}\"{weight}>",
            px(style.size),
            style.colour
        );
        if !bold.is_empty() {
            let _ = write!(
                self.body,
                "<tspan font-weight=\"bold\">{}</tspan>",
                escaped(bold)
            );
        }
        let _ = writeln!(self.body, "{}</text>", escaped(text));
    }
}

/// Width that a text of `size` px takes in the widest of the fonts (DejaVu Sans), about [px].
pub(super) fn width_of(text: &str, size: f64) -> f64 {
    let ems = text.chars().map(|c| match c {
        'f' | 'i' | 'j' | 'l' | 'r' | 't' | ' ' | '.' | ',' | ':' | '(' | ')' | '[' | ']' => 0.37,
        'm' | 'w' | 'M' | 'W' | '%' => 0.95,
        c if c.is_uppercase() => 0.72,
        _ => 0.62,
    });
    size * ems.sum::<f64>()
}

/// `text` cut to a width [px], an ellipsis where something is missing.
pub(super) fn fitted(text: &str, size: f64, width: f64) -> String {
    if width_of(text, size) <= width {
        return text.to_owned();
    }
    let mut cut = String::new();
    for c in text.chars() {
        cut.push(c);
        if width_of(&cut, size) > width - size {
            cut.pop();
            break;
        }
    }
    cut.push('\u{2026}');
    cut
}

/// A coordinate with at most two decimals. Values that no screen has are clamped to its edge, and a
/// number that is none at 0: the callers split their data before.
fn px(value: f64) -> String {
    let value = if value.is_nan() { 0.0 } else { value };
    let rounded = (value.clamp(-1e6, 1e6) * 100.0).round() / 100.0;
    // Adding 0 turns -0 into 0; the shortest text that reads back has no trailing zeros.
    format!("{}", rounded + 0.0)
}

/// Text inside an element: markup is escaped, control characters (which XML forbids) and what forges text are dropped.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if is_hidden(c) || matches!(c, '\u{fffe}' | '\u{ffff}') => {}
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_short_and_never_not_a_number() {
        assert_eq!(px(12.0), "12");
        assert_eq!(px(-0.001), "0");
        assert_eq!(px(1.0 / 3.0), "0.33");
        assert_eq!(px(f64::NAN), "0");
        assert_eq!(px(f64::INFINITY), "1000000");
    }

    #[test]
    fn a_long_text_is_cut_with_an_ellipsis() {
        assert_eq!(fitted("short", 10.0, 100.0), "short");
        let cut = fitted(&"long ".repeat(50), 10.0, 100.0);
        assert!(cut.ends_with('\u{2026}') && width_of(&cut, 10.0) <= 100.0);
    }

    #[test]
    fn names_from_a_file_cannot_write_markup() {
        let mut svg = Svg::new(10.0, 10.0, "a & b", "");
        svg.text([1.0, 2.0], "<script>\u{7}", Type::new(10.0, Anchor::Start));
        let text = svg.finish();
        assert!(text.contains("<title>a &amp; b</title>"));
        assert!(text.contains("&lt;script&gt;</text>"));
    }
}
