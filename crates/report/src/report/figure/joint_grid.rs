//! The frame that figures of friction share: a heading, a legend, and one panel per joint, two
//! beside each other.

use super::legend::{self, Key};
use super::svg::SvgPicture;

const WIDTH: f64 = 760.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 14.0;
const HEAD: f64 = 66.0;
const NAME: f64 = 20.0;
const PLOT: f64 = 206.0;
const BELOW: f64 = 50.0;

/// The SVG document with its title and description; `draw` puts a panel into its frame: left, top, width, height \[px\].
pub(super) fn draw<P>(
    titles: [&str; 2],
    entries: &[(Key, &str)],
    panels: &[P],
    draw: impl Fn(&P, &mut SvgPicture, [f64; 4]),
) -> String {
    let columns = panels.len().clamp(1, 2);
    let row = NAME + PLOT + BELOW;
    let height = HEAD + row * panels.len().div_ceil(columns) as f64;
    let mut svg = legend::headed([WIDTH, height], [LEFT, RIGHT], titles, entries);
    let column = WIDTH / columns as f64;
    for (k, panel) in panels.iter().enumerate() {
        let left = column * (k % columns) as f64;
        let top = HEAD + row * (k / columns) as f64;
        let frame = [left + LEFT, top + NAME, column - LEFT - RIGHT, PLOT];
        draw(panel, &mut svg, frame);
    }
    svg.finish()
}
