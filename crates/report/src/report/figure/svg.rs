//! The SVG text itself: shapes with two decimals, escaped words, nothing else.

use std::fmt::Write;

use super::colour;
use crate::report::encode::without_markup;
use cft_ident_logs::log::is_hidden;

/// Fonts that are likely to be there; all measures leave room for the widest of them.
const FONTS: &str = "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif";

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LineStroke {
    pub colour: &'static str,
    pub width: f64,
    /// Lengths of dash and gap as SVG wants them; empty for a solid line.
    pub dash: &'static str,
}

impl LineStroke {
    pub(crate) const fn solid(colour: &'static str, width: f64) -> Self {
        LineStroke::dashed(colour, width, "")
    }

    pub(crate) const fn dashed(colour: &'static str, width: f64, dash: &'static str) -> Self {
        LineStroke {
            colour,
            width,
            dash,
        }
    }
}

/// Where a text is anchored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TextAnchor {
    Start,
    Middle,
    End,
}

/// How a text is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TextStyle {
    pub size: f64,
    pub bold: bool,
    pub colour: &'static str,
    pub anchor: TextAnchor,
}

impl TextStyle {
    pub const fn new(size: f64, anchor: TextAnchor) -> Self {
        TextStyle {
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
pub(super) struct SvgPicture {
    width: f64,
    height: f64,
    title: String,
    description: String,
    body: String,
}

impl SvgPicture {
    /// A screen reader says `title` and `description`.
    pub fn new(width: f64, height: f64, title: &str, description: &str) -> Self {
        SvgPicture {
            width,
            height,
            title: escaped(title),
            description: escaped(description),
            body: String::new(),
        }
    }

    pub(crate) fn rect(&mut self, frame: [f64; 4], fill: &str, stroke: Option<LineStroke>) {
        let [x, y, width, height] = frame.map(px);
        let rect = format!("rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"");
        self.shape(&format!("{rect} fill=\"{fill}\""), stroke);
    }

    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: LineStroke) {
        let path = steps(&[from, to]);
        self.shape(&format!("path d=\"{path}\" fill=\"none\""), Some(stroke));
    }

    /// Several runs of points as one path, so that one dash pattern and one colour hold for them.
    pub fn curve(&mut self, runs: &[Vec<[f64; 2]>], stroke: LineStroke) {
        let runs = runs.iter().filter(|run| run.len() > 1);
        let path: String = runs.map(|run| steps(run)).collect();
        if !path.is_empty() {
            let path = format!("path d=\"{path}\" fill=\"none\" stroke-linejoin=\"round\"");
            self.shape(&path, Some(stroke));
        }
    }

    /// A filled shape, `opacity` 0..1.
    pub(crate) fn area(&mut self, outline: &[[f64; 2]], fill: &str, opacity: f64) {
        if outline.len() > 2 {
            let (path, opacity) = (steps(outline), px(opacity));
            let path = format!("path d=\"{path}Z\" fill=\"{fill}\" fill-opacity=\"{opacity}\"");
            self.shape(&path, None);
        }
    }

    pub fn dot(&mut self, at: [f64; 2], radius: f64, fill: &str) {
        self.circle(at, radius, fill, None);
    }

    /// A dot with a ring around it.
    pub(crate) fn ringed(&mut self, at: [f64; 2], radius: f64, fill: &str, ring: LineStroke) {
        self.circle(at, radius, fill, Some(ring));
    }

    fn circle(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str, ring: Option<LineStroke>) {
        let [x, y, radius] = [x, y, radius].map(px);
        let circle = format!("circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{fill}\"");
        self.shape(&circle, ring);
    }

    pub fn text(&mut self, [x, y]: [f64; 2], text: &str, style: TextStyle) {
        self.set(&format!("x=\"{}\" y=\"{}\"", px(x), px(y)), "", text, style);
    }

    /// The line above a panel: a bold name, and more about it.
    pub fn heading(&mut self, [x, y]: [f64; 2], name: &str, rest: &str) {
        let place = format!("x=\"{}\" y=\"{}\"", px(x), px(y));
        self.set(&place, name, rest, TextStyle::new(11.5, TextAnchor::Start));
    }

    /// Text that reads upwards, anchored at its middle.
    pub fn upright(&mut self, [x, y]: [f64; 2], text: &str, style: TextStyle) {
        let place = format!("transform=\"translate({} {}) rotate(-90)\"", px(x), px(y));
        self.set(&place, "", text, style);
    }

    /// Begins a group that is cut at a rectangle, until [`SvgPicture::end_clip`]; a nested picture needs no id in the page.
    pub(crate) fn clip(&mut self, frame: [f64; 4]) {
        let [x, y, width, height] = frame.map(px);
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

    /// An element by its name and attributes.
    fn shape(&mut self, element: &str, stroke: Option<LineStroke>) {
        let _ = write!(self.body, "<{element}");
        if let Some(LineStroke {
            colour,
            width,
            dash,
        }) = stroke
        {
            let width = px(width);
            let _ = write!(self.body, " stroke=\"{colour}\" stroke-width=\"{width}\"");
            if !dash.is_empty() {
                let _ = write!(self.body, " stroke-dasharray=\"{dash}\"");
            }
        }
        self.body.push_str("/>\n");
    }

    fn set(&mut self, place: &str, bold: &str, text: &str, style: TextStyle) {
        let anchor = match style.anchor {
            TextAnchor::Start => "start",
            TextAnchor::Middle => "middle",
            TextAnchor::End => "end",
        };
        let weight = if style.bold {
            " font-weight=\"bold\""
        } else {
            ""
        };
        let bold = match bold {
            "" => String::new(),
            bold => format!("<tspan font-weight=\"bold\">{}</tspan>", escaped(bold)),
        };
        let _ = writeln!(
            self.body,
            "<text {place} font-size=\"{}\" fill=\"{}\" text-anchor=\"{anchor}\"{weight}>{bold}{}</text>",
            px(style.size),
            style.colour,
            escaped(text)
        );
    }
}

/// A path from point to point.
fn steps(points: &[[f64; 2]]) -> String {
    let step = |(k, [x, y]): (usize, &[f64; 2])| {
        let step = if k == 0 { 'M' } else { 'L' };
        format!("{step}{} {}", px(*x), px(*y))
    };
    points.iter().enumerate().map(step).collect()
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

/// A coordinate with at most two decimals; clamped to values that a screen has.
fn px(value: f64) -> String {
    let value = if value.is_nan() { 0.0 } else { value };
    let rounded = (value.clamp(-1e6, 1e6) * 100.0).round() / 100.0;
    // Adding 0 turns -0 into 0; the shortest text that reads back has no trailing zeros.
    format!("{}", rounded + 0.0)
}

/// Text inside an element, without control characters (which XML forbids) and those that forge text.
fn escaped(text: &str) -> String {
    let shown = |c: &char| !is_hidden(*c) && !matches!(c, '\u{fffe}' | '\u{ffff}');
    without_markup(text.chars().filter(shown))
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
        let mut svg = SvgPicture::new(10.0, 10.0, "a & b", "");
        svg.text(
            [1.0, 2.0],
            "<script>\u{7}",
            TextStyle::new(10.0, TextAnchor::Start),
        );
        let text = svg.finish();
        assert!(text.contains("<title>a &amp; b</title>"));
        assert!(text.contains("&lt;script&gt;</text>"));
    }
}
