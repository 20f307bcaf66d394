//! A motion before it is run: positions, speeds and volts over time, with their limits.

use super::axis;
use super::colour;
use super::decimate::decimated;
use super::legend::{self, Key};
use super::panel::PlotPanel;
use super::svg::{LineStroke, SvgPicture, fitted, width_of};
use crate::report::words::listed;
use cft_ident_core::number;

/// One quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionPanel {
    /// `position`, `speed`, `volts`.
    pub quantity: String,
    pub unit: String,
    /// One value per time of the figure.
    pub values: Vec<f64>,
    /// Lower and upper limit, where there is one.
    pub limits: Option<[f64; 2]>,
    /// Share of the limit in use, where there is one.
    pub used: Option<f64>,
}

/// A row of panels per coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionFigure {
    /// Heading, the trajectory's name for instance.
    pub title: String,
    /// Time [s].
    pub t: Vec<f64>,
    /// Name of each coordinate with its panels, as many for each.
    pub rows: Vec<(String, Vec<MotionPanel>)>,
}

const WIDTH: f64 = 860.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 10.0;
const HEAD: f64 = 58.0;
const NAME: f64 = 20.0;
const PLOT: f64 = 120.0;
const NUMBERS: f64 = 28.0;
const FOOT: f64 = 18.0;
/// Points of a line.
const POINTS: usize = 900;
/// Use of a limit from which on the panel shows it; below it the motion itself fills the panel.
const LIMIT_SHOWN_FROM: f64 = 0.45;

const MOTION: LineStroke = LineStroke::solid(colour::BLUE, 1.3);
const LIMIT: LineStroke = LineStroke::dashed(colour::VERMILLION, 1.2, "6 3");

impl MotionFigure {
    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let row = NAME + PLOT + NUMBERS;
        let height = HEAD + row * self.rows.len() as f64 + FOOT;
        let description = format!(
            "Positions, speeds and volts over time with their limits, coordinates {}",
            listed(self.rows.iter().map(|(name, _)| &**name))
        );
        let entries = [(Key::Line(MOTION), "motion"), (Key::Line(LIMIT), "limit")];
        let titles = [&*self.title, &description];
        let mut svg = legend::headed([WIDTH, height], [LEFT, RIGHT], titles, &entries);
        let clock = axis::interval(self.t.iter().copied(), 0.0);
        for (k, (name, panels)) in self.rows.iter().enumerate() {
            let top = HEAD + row * k as f64;
            let column = WIDTH / panels.len().max(1) as f64;
            for (c, panel) in panels.iter().enumerate() {
                let left = column * c as f64 + LEFT;
                let frame = [left, top + NAME, column - LEFT - RIGHT, PLOT];
                let drawn = panel.draw(&mut svg, frame, name, (&self.t, clock));
                if let Some(panel) = drawn.filter(|_| k + 1 == self.rows.len()) {
                    panel.x_title(&mut svg, ["time", "s"]);
                }
            }
        }
        svg.finish()
    }
}

impl MotionPanel {
    fn draw(
        &self,
        svg: &mut SvgPicture,
        frame: [f64; 4],
        name: &str,
        (t, clock): (&[f64], Option<[f64; 2]>),
    ) -> Option<PlotPanel> {
        let [left, top, width, _] = frame;
        let used = self.used.map_or(String::new(), |used| {
            format!(", {} of its limit", number::percent(used))
        });
        let rest = format!("\u{2003}{}{used}", self.quantity);
        let rest = fitted(&rest, 11.5, width - width_of(name, 12.5));
        svg.heading([left, top - 6.0], name, &rest);
        let near = self.used.is_some_and(|used| used >= LIMIT_SHOWN_FROM);
        let shown = self.limits.filter(|_| near);
        let values = self.values.iter().copied();
        let both = values.chain(shown.into_iter().flatten());
        let (Some(clock), Some(range)) = (clock, axis::interval(both, 0.06)) else {
            PlotPanel::empty(svg, frame, "no samples");
            return None;
        };
        let panel = PlotPanel::new(frame, clock, range, [5, 5]);
        panel.grid(svg);
        svg.clip(frame);
        svg.curve(&panel.place(decimated(t, &self.values, POINTS)), MOTION);
        for limit in shown.into_iter().flatten() {
            let y = panel.y.px(limit);
            svg.line([left, y], [left + width, y], LIMIT);
        }
        svg.end_clip();
        panel.outline(svg);
        panel.y_title(svg, 48.0, [&self.quantity, &self.unit]);
        panel.x_numbers(svg);
        Some(panel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure() -> MotionFigure {
        let t: Vec<f64> = (0..5000).map(|k| f64::from(k) * 1e-3).collect();
        let panel = |quantity: &str, used| MotionPanel {
            quantity: quantity.into(),
            unit: "m".into(),
            values: t.iter().map(|t| (3.0 * t).sin()).collect(),
            limits: Some([-1.25, 1.25]),
            used: Some(used),
        };
        MotionFigure {
            title: "design.toml".into(),
            rows: vec![(
                "x_c1".into(),
                vec![panel("position", 0.8), panel("volts", 0.1)],
            )],
            t,
        }
    }

    #[test]
    fn limits_are_drawn_where_the_motion_comes_near_them() {
        let svg = figure().svg();
        // in the legend, and two in the first panel
        assert_eq!(svg.matches("stroke-dasharray").count(), 3);
        assert!(svg.contains("position, 80.0 % of its limit"));
        assert!(svg.contains("position [m]") && svg.contains("volts [m]"));
        assert_eq!(svg, figure().svg());
    }

    #[test]
    fn a_motion_without_samples_has_empty_panels() {
        let mut empty = figure();
        empty.t.clear();
        let svg = empty.svg();
        assert!(svg.contains("no samples") && !svg.contains("NaN"));
    }
}
