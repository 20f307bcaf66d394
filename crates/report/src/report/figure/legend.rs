//! The legend: one line of samples and names, outside the data.

use super::colour;
use super::svg::{LineStroke, SvgPicture, TextAnchor, TextStyle, fitted, width_of};

/// The mark before a name.
#[derive(Debug, Clone, Copy)]
pub(super) enum Key {
    Line(LineStroke),
    /// A line on a band of its colour.
    Band(LineStroke),
    /// A dot with an error bar.
    Dot(&'static str),
    /// A dot of a cloud.
    Spot(&'static str),
    /// Lines across, as where nothing is known.
    Hatch,
    /// A tinted patch.
    Patch(&'static str),
}

const SIZE: f64 = 11.0;
const SAMPLE: f64 = 26.0;
/// Room between two entries, and height of a line.
const ROOM_BETWEEN_PX: f64 = 14.0;
const LINE: f64 = 18.0;

/// A figure with its title and its legend above the panels; beside them so much is free at the left and at the right.
pub(super) fn headed(
    [width, height]: [f64; 2],
    [left, right]: [f64; 2],
    [title, description]: [&str; 2],
    entries: &[(Key, &str)],
) -> SvgPicture {
    let mut svg = SvgPicture::new(width, height, title, description);
    let shown = fitted(title, 15.0, width - left - right);
    svg.text(
        [left, 22.0],
        &shown,
        TextStyle::new(14.0, TextAnchor::Start).bold(),
    );
    draw(&mut svg, [left, 44.0], entries);
    svg
}

/// One entry as a picture of its own: a page sets as many beside each other as its width takes.
pub(super) fn alone(entry: (Key, &str)) -> String {
    let (_, name) = entry;
    let width = SAMPLE + 6.0 + width_of(name, SIZE) + ROOM_BETWEEN_PX;
    let mut svg = SvgPicture::new(width, LINE, "legend", name);
    draw(&mut svg, [0.0, 0.72 * LINE], &[entry]);
    svg.finish()
}

/// Draws the legend from `x` rightwards, its baseline at `y`.
pub(super) fn draw(svg: &mut SvgPicture, [x, y]: [f64; 2], entries: &[(Key, &str)]) {
    let mut at = x;
    for (key, name) in entries {
        let width = SAMPLE + 6.0 + width_of(name, SIZE);
        let middle = y - 0.36 * SIZE;
        let sample = [at, middle];
        match *key {
            Key::Line(stroke) => svg.line(sample, [at + SAMPLE, middle], stroke),
            Key::Band(stroke) => {
                let (end, top, bottom) = (at + SAMPLE, middle - 5.0, middle + 5.0);
                let outline = [[at, top], [end, top], [end, bottom], [at, bottom]];
                svg.area(&outline, stroke.colour, 0.22);
                svg.line(sample, [at + SAMPLE, middle], stroke);
            }
            Key::Dot(fill) => {
                let centre = at + 0.5 * SAMPLE;
                let bar = LineStroke::solid(fill, 1.0);
                svg.line([centre, middle - 6.0], [centre, middle + 6.0], bar);
                svg.dot([centre, middle], 2.6, fill);
            }
            Key::Spot(fill) => svg.dot([at + 0.5 * SAMPLE, middle], 2.6, fill),
            Key::Hatch => {
                let line = LineStroke::solid(colour::ZERO, 0.9);
                for k in 0..4 {
                    let x = at + 6.0 * f64::from(k);
                    svg.line([x, middle + 5.0], [x + 8.0, middle - 5.0], line);
                }
            }
            Key::Patch(fill) => svg.rect(
                [at, middle - 5.0, SAMPLE, 10.0],
                fill,
                Some(LineStroke::solid(colour::GRID, 0.6)),
            ),
        }
        svg.text(
            [at + SAMPLE + 6.0, y],
            name,
            TextStyle::new(SIZE, TextAnchor::Start),
        );
        at += width + ROOM_BETWEEN_PX;
    }
}
