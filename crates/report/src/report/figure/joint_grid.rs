//! The frame that figures of friction share: a heading, a legend, and one panel per joint, two
//! beside each other.

use super::legend::{self, Key};
use super::svg::{Anchor, Svg, Type, fitted};

const WIDTH: f64 = 760.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 14.0;
const HEAD: f64 = 66.0;
const NAME: f64 = 20.0;
const PLOT: f64 = 206.0;
const BELOW: f64 = 50.0;

/// What stands above the panels.
pub(super) struct Heading<'a> {
    pub title: &'a str,
    /// For those who cannot see the picture.
    pub description: &'a str,
    pub legend: &'a [(Key, &'a str)],
}

/// The SVG document; `draw` puts a panel into its frame: left, top, width, height \[px\].
pub(super) fn draw<P>(
    heading: &Heading,
    panels: &[P],
    draw: impl Fn(&P, &mut Svg, [f64; 4]),
) -> String {
    let columns = panels.len().clamp(1, 2);
    let row = NAME + PLOT + BELOW;
    let height = HEAD + row * panels.len().div_ceil(columns) as f64;
    let mut svg = Svg::new(WIDTH, height, heading.title, heading.description);
    svg.text(
        [LEFT, 22.0],
        &fitted(heading.title, 15.0, WIDTH - LEFT - RIGHT),
        Type::new(14.0, Anchor::Start).bold(),
    );
    legend::draw(&mut svg, [LEFT, 44.0], heading.legend);
    let column = WIDTH / columns as f64;
    for (k, panel) in panels.iter().enumerate() {
        let left = column * (k % columns) as f64;
        let top = HEAD + row * (k / columns) as f64;
        let frame = [left + LEFT, top + NAME, column - LEFT - RIGHT, PLOT];
        draw(panel, &mut svg, frame);
    }
    svg.finish()
}
