//! One frame with grid, ticks and axis titles; the figures put their data into it.

use super::axis::{AxisScale, AxisTicks};
use super::colour;
use super::svg::{LineStroke, SvgPicture, TextAnchor, TextStyle};

const TICK: f64 = 10.0;
const LABEL: f64 = 11.0;

/// A frame and its two scales.
#[derive(Debug)]
pub(super) struct PlotPanel {
    /// x, y, width, height [px].
    pub frame: [f64; 4],
    pub x: AxisScale,
    pub y: AxisScale,
    x_ticks: AxisTicks,
    y_ticks: AxisTicks,
}

impl PlotPanel {
    /// A frame for these intervals of data, with about so many numbers at each axis.
    pub fn new(frame: [f64; 4], x: [f64; 2], y: [f64; 2], wanted: [usize; 2]) -> Self {
        let [left, top, width, height] = frame;
        PlotPanel {
            frame,
            x: AxisScale::new(x, left, left + width),
            y: AxisScale::new(y, top + height, top),
            x_ticks: AxisTicks::new(x, wanted[0]),
            y_ticks: AxisTicks::new(y, wanted[1]),
        }
    }

    /// Data in px, run by run.
    pub fn place(&self, runs: Vec<Vec<[f64; 2]>>) -> Vec<Vec<[f64; 2]>> {
        let mut runs = runs;
        for point in runs.iter_mut().flatten() {
            *point = [self.x.px(point[0]), self.y.px(point[1])];
        }
        runs
    }

    /// The outline \[px\] of a band around a line, of rows of x, y and half the width of the band.
    pub fn band(&self, rows: impl DoubleEndedIterator<Item = [f64; 3]> + Clone) -> Vec<[f64; 2]> {
        let upper = rows
            .clone()
            .map(|[x, y, half]| [self.x.px(x), self.y.px(y + half)]);
        let lower = rows
            .rev()
            .map(|[x, y, half]| [self.x.px(x), self.y.px(y - half)]);
        upper.chain(lower).collect()
    }

    /// Grid lines; the lines of 0 are darker.
    pub fn grid(&self, svg: &mut SvgPicture) {
        let [left, top, width, height] = self.frame;
        let stroke = |value: f64| {
            let colour = if value == 0.0 {
                colour::ZERO
            } else {
                colour::GRID
            };
            LineStroke::solid(colour, 0.8)
        };
        for &value in &self.x_ticks.values {
            let at = self.x.px(value);
            svg.line([at, top], [at, top + height], stroke(value));
        }
        for &value in &self.y_ticks.values {
            let at = self.y.px(value);
            svg.line([left, at], [left + width, at], stroke(value));
        }
    }

    /// The frame itself, and numbers and title of the lower and of the left axis: their names and units.
    pub fn axes(&self, svg: &mut SvgPicture, offset: f64, below: [&str; 2], at_left: [&str; 2]) {
        self.outline(svg);
        self.x_numbers(svg);
        self.x_title(svg, below);
        self.y_title(svg, offset, at_left);
    }

    /// The frame itself and the numbers at the left side.
    pub(crate) fn outline(&self, svg: &mut SvgPicture) {
        let [left, ..] = self.frame;
        svg.rect(
            self.frame,
            "none",
            Some(LineStroke::solid(colour::FRAME, 0.9)),
        );
        for (&value, text) in self.y_ticks.values.iter().zip(&self.y_ticks.texts) {
            let at = self.y.px(value);
            let mark = LineStroke::solid(colour::FRAME, 0.9);
            svg.line([left - 4.0, at], [left, at], mark);
            let style = TextStyle::new(TICK, TextAnchor::End);
            svg.text([left - 7.0, at + 0.35 * TICK], text, style);
        }
    }

    /// The numbers below.
    pub(crate) fn x_numbers(&self, svg: &mut SvgPicture) {
        let [_, top, _, height] = self.frame;
        for (&value, text) in self.x_ticks.values.iter().zip(&self.x_ticks.texts) {
            let at = self.x.px(value);
            let bottom = top + height;
            let mark = LineStroke::solid(colour::FRAME, 0.9);
            svg.line([at, bottom], [at, bottom + 4.0], mark);
            svg.text(
                [at, bottom + 15.0],
                text,
                TextStyle::new(TICK, TextAnchor::Middle),
            );
        }
    }

    /// The title of the lower axis, `name [unit]`.
    pub(crate) fn x_title(&self, svg: &mut SvgPicture, [name, unit]: [&str; 2]) {
        let [left, top, width, height] = self.frame;
        let title = format!("{name} [{}]", self.x_ticks.unit(unit));
        let at = [left + 0.5 * width, top + height + 31.0];
        svg.text(at, &title, TextStyle::new(LABEL, TextAnchor::Middle));
    }

    /// The title of the left axis, `name [unit]`, `offset` px left of the frame.
    pub(crate) fn y_title(&self, svg: &mut SvgPicture, offset: f64, [name, unit]: [&str; 2]) {
        let [left, top, _, height] = self.frame;
        let title = format!("{name} [{}]", self.y_ticks.unit(unit));
        let at = [left - offset, top + 0.5 * height];
        svg.upright(at, &title, TextStyle::new(LABEL, TextAnchor::Middle));
    }

    /// An empty frame that says why it is empty.
    pub fn empty(svg: &mut SvgPicture, frame: [f64; 4], reason: &str) {
        let [left, top, width, height] = frame;
        svg.rect(frame, "none", Some(LineStroke::solid(colour::FRAME, 0.9)));
        let middle = [left + 0.5 * width, top + 0.5 * height + 4.0];
        svg.text(
            middle,
            reason,
            TextStyle::new(LABEL, TextAnchor::Middle).muted(),
        );
    }
}
