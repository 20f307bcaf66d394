//! Small pictures of one panel each, of which a page sets as many beside each other as its width holds: all of
//! them are seen on a phone.

use super::legend::{self, Key};
use super::svg::Svg;

/// Width of one picture [px].
pub(super) const WIDTH: f64 = 380.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
/// Room above a panel for its name, and below it for numbers and the name of its axis [px].
const NAME: f64 = 24.0;
const BELOW: f64 = 40.0;

/// Pictures that belong together, with what is said of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cells {
    pub title: String,
    /// What the colours mean, an SVG document; may be empty.
    pub key: String,
    /// SVG documents.
    pub pictures: Vec<String>,
    /// Sentences below.
    pub words: Vec<String>,
}

/// One picture with a panel of a height [px]; `title` and `told` are what a screen reader says, `draw` is given
/// the panel's frame: left, top, width, height [px].
pub(super) fn cell(
    title: &str,
    told: &str,
    height: f64,
    draw: impl FnOnce(&mut Svg, [f64; 4]),
) -> String {
    let mut svg = Svg::new(WIDTH, NAME + height + BELOW, title, told);
    draw(&mut svg, [LEFT, NAME, WIDTH - LEFT - RIGHT, height]);
    svg.finish()
}

/// The legend of all pictures, by itself.
pub(super) fn key(entries: &[(Key, &str)]) -> String {
    legend::alone(entries, WIDTH)
}
