//! Positions over time: command, measured, and rolled out by a model without and with its effects.

use super::axis;
use super::colour;
use super::decimate::decimated;
use super::legend::{self, Key};
use super::panel::PlotPanel;
use super::svg::{LineStroke, SvgPicture};
use crate::report::words::listed;

/// One joint over time [rad].
#[derive(Debug, Clone, PartialEq)]
pub struct PositionPanel {
    pub joint: String,
    /// Time [s].
    pub t: Vec<f64>,
    pub command: Vec<f64>,
    pub measured: Vec<f64>,
    /// Without effects.
    pub given: Vec<f64>,
    /// With them.
    pub refined: Vec<f64>,
}

/// A figure of one panel per joint.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionFigure {
    pub title: String,
    pub panels: Vec<PositionPanel>,
}

const WIDTH: f64 = 860.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 10.0;
const HEAD: f64 = 58.0;
const NAME: f64 = 20.0;
const PLOT: f64 = 190.0;
const NUMBERS: f64 = 28.0;
const FOOT: f64 = 18.0;
/// Points of a line.
const POINTS: usize = 900;

const COMMAND: LineStroke = LineStroke::dashed(colour::MUTED, 1.1, "2 3");
const MEASURED: LineStroke = LineStroke::solid(colour::INK, 1.6);
const GIVEN: LineStroke = LineStroke::dashed(colour::VERMILLION, 1.3, "6 3");
const REFINED: LineStroke = LineStroke::solid(colour::SKY, 1.4);

impl PositionFigure {
    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let row = NAME + PLOT + NUMBERS;
        let height = HEAD + row * self.panels.len() as f64 + FOOT;
        let description = format!(
            "Positions over time, commanded, measured and rolled out, joints {}",
            listed(self.panels.iter().map(|panel| &*panel.joint))
        );
        let entries = [
            (Key::Line(COMMAND), "command"),
            (Key::Line(MEASURED), "measured"),
            (Key::Line(GIVEN), "without effects"),
            (Key::Line(REFINED), "refined"),
        ];
        let titles = [&*self.title, &description];
        let mut svg = legend::headed([WIDTH, height], [LEFT, RIGHT], titles, &entries);
        for (k, panel) in self.panels.iter().enumerate() {
            let top = HEAD + row * k as f64;
            let frame = [LEFT, top + NAME, WIDTH - LEFT - RIGHT, PLOT];
            panel.draw(&mut svg, frame, k + 1 == self.panels.len());
        }
        svg.finish()
    }
}

impl PositionPanel {
    fn draw(&self, svg: &mut SvgPicture, frame: [f64; 4], last: bool) {
        let [left, top, ..] = frame;
        svg.heading([left, top - 6.0], &self.joint, "");
        let lines = [
            (&self.command, COMMAND),
            (&self.measured, MEASURED),
            (&self.given, GIVEN),
            (&self.refined, REFINED),
        ];
        // a roll-out that is lost does not squeeze the others
        let near = self.command.iter().chain(&self.measured).copied();
        let clock = axis::interval(self.t.iter().copied(), 0.0);
        let (Some(clock), Some(range)) = (clock, axis::interval(near, 0.25)) else {
            PlotPanel::empty(svg, frame, "no samples");
            return;
        };
        let panel = PlotPanel::new(frame, clock, range, [8, 6]);
        panel.grid(svg);
        svg.clip(frame);
        for (values, stroke) in lines {
            svg.curve(&panel.place(decimated(&self.t, values, POINTS)), stroke);
        }
        svg.end_clip();
        panel.outline(svg);
        panel.y_title(svg, 48.0, ["position", "rad"]);
        panel.x_numbers(svg);
        if last {
            panel.x_title(svg, ["time", "s"]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_four_positions_are_drawn_and_named() {
        let panel = PositionPanel {
            joint: "servo".into(),
            t: vec![0.0, 1.0, 2.0],
            command: vec![0.0, 1.0, 1.0],
            measured: vec![0.0, 0.5, 1.0],
            given: vec![0.0, 0.8, 1e9],
            refined: vec![0.0, 0.6, f64::NAN],
        };
        let figure = PositionFigure {
            title: "a".into(),
            panels: vec![panel],
        };
        let svg = figure.svg();
        for word in ["command", "measured", "without effects", "refined", "servo"] {
            assert!(svg.contains(word), "{word}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}
