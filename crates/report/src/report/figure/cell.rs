//! Small pictures of one panel each, of which a page sets as many beside each other as its width holds: all of
//! them are seen on a phone.

use super::legend::{self, Key};
use super::svg::{SvgPicture, TextAnchor, TextStyle};

/// Width of one picture [px].
const WIDTH: f64 = 380.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
/// Room above a panel for its name, or for marks alone, and below it for numbers and the name of its axis [px].
const NAME: f64 = 24.0;
pub(super) const MARKS: f64 = 14.0;
const BELOW: f64 = 40.0;

/// Pictures that belong together, with the sentences below them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PictureGroup {
    pub title: String,
    /// The entries of the legend, an SVG document each.
    pub key: Vec<String>,
    /// SVG documents.
    pub pictures: Vec<String>,
    /// Whether each picture is of something of its own, so that paper may have them on several sheets.
    pub apart: bool,
    /// Sentences below.
    pub words: Vec<String>,
}

impl PictureGroup {
    pub(super) fn new(
        title: &str,
        entries: &[(Key, &str)],
        pictures: impl IntoIterator<Item = String>,
    ) -> Self {
        PictureGroup {
            title: title.to_owned(),
            key: entries.iter().map(|entry| legend::alone(*entry)).collect(),
            pictures: pictures.into_iter().collect(),
            ..PictureGroup::default()
        }
    }
}

/// One picture with a panel of a height, which `draw` puts into its frame: left, top, width, height [px].
pub(super) fn cell(
    title: &str,
    description: &str,
    height: f64,
    draw: impl FnOnce(&mut SvgPicture, [f64; 4]),
) -> String {
    below(NAME, [title, description], height, draw)
}

/// The same with another room above.
pub(super) fn below(
    above: f64,
    [title, description]: [&str; 2],
    height: f64,
    draw: impl FnOnce(&mut SvgPicture, [f64; 4]),
) -> String {
    let mut svg = SvgPicture::new(WIDTH, above + height + BELOW, title, description);
    draw(&mut svg, [LEFT, above, WIDTH - LEFT - RIGHT, height]);
    svg.finish()
}

/// The name above a panel.
pub(super) fn name(svg: &mut SvgPicture, [left, top, ..]: [f64; 4], name: &str) {
    let style = TextStyle::new(11.5, TextAnchor::Start).bold();
    svg.text([left, top - 8.0], name, style);
}
