//! What a residual depends on, before and after: over position, velocity, load and time, forward and
//! backward apart, and its spectra over order and frequency.

use super::axis;
use super::colour;
use super::decimate::decimated;
use super::legend::{self, Key};
use super::panel::Panel;
use super::svg::{Anchor, Stroke, Svg, Type, fitted};

/// One panel: a quantity below, and lines before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualPanel {
    /// What stands below, and its unit.
    pub over: (String, String),
    /// What stands at the left, and its unit.
    pub of: (String, String),
    /// Lines of (x, y); a y that is not finite parts a line.
    pub lines: Vec<(When, Vec<[f64; 2]>)>,
}

/// Which line it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    Before,
    /// Before, of backward motion.
    BeforeBackward,
    After,
    /// After, of backward motion.
    AfterBackward,
}

/// Panels of every joint, three in a row.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualFigure {
    pub title: String,
    pub joints: Vec<(String, Vec<ResidualPanel>)>,
}

const WIDTH: f64 = 860.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 10.0;
const HEAD: f64 = 58.0;
const NAME: f64 = 22.0;
const PLOT: f64 = 118.0;
const NUMBERS: f64 = 42.0;
const COLUMNS: usize = 3;
const POINTS: usize = 500;

impl When {
    fn stroke(self) -> Stroke {
        match self {
            When::Before => Stroke::solid(colour::VERMILLION, 1.1),
            When::BeforeBackward => Stroke::dashed(colour::VERMILLION, 1.1, "4 3"),
            When::After => Stroke::solid(colour::BLUE, 1.4),
            When::AfterBackward => Stroke::dashed(colour::BLUE, 1.4, "4 3"),
        }
    }
}

impl ResidualFigure {
    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let rows = |panels: usize| panels.div_ceil(COLUMNS) as f64;
        let height: f64 = HEAD
            + self
                .joints
                .iter()
                .map(|(_, p)| NAME + rows(p.len()) * (PLOT + NUMBERS))
                .sum::<f64>();
        let names: Vec<&str> = self.joints.iter().map(|(name, _)| name.as_str()).collect();
        let description = format!(
            "Torque residual over position, velocity, load, time, order and frequency, joints {}",
            names.join(", ")
        );
        let mut svg = Svg::new(WIDTH, height, &self.title, &description);
        svg.text(
            [LEFT, 22.0],
            &fitted(&self.title, 15.0, WIDTH - LEFT - RIGHT),
            Type::new(14.0, Anchor::Start).bold(),
        );
        let entries = self.entries();
        legend::draw(&mut svg, [LEFT, 44.0], &entries);
        let column = WIDTH / COLUMNS as f64;
        let mut top = HEAD;
        for (name, panels) in &self.joints {
            svg.heading([LEFT, top + 13.0], name, "", Type::new(11.5, Anchor::Start));
            for (i, panel) in panels.iter().enumerate() {
                let (row, at) = (i / COLUMNS, i % COLUMNS);
                let frame = [
                    column * at as f64 + LEFT,
                    top + NAME + row as f64 * (PLOT + NUMBERS),
                    column - LEFT - RIGHT,
                    PLOT,
                ];
                panel.draw(&mut svg, frame);
            }
            top += NAME + rows(panels.len()) * (PLOT + NUMBERS);
        }
        svg.finish()
    }

    /// Only what is drawn is in the legend; a residual that nothing came after is not `before`.
    fn entries(&self) -> Vec<(Key, &'static str)> {
        let drawn = |when: When| {
            let mut panels = self.joints.iter().flat_map(|(_, panels)| panels);
            panels.any(|panel| panel.lines.iter().any(|(w, _)| *w == when))
        };
        let alone = !drawn(When::After) && !drawn(When::AfterBackward);
        let names = [
            (When::Before, ["before", "residual"]),
            (
                When::BeforeBackward,
                ["before, backward", "residual, backward"],
            ),
            (When::After, ["after", ""]),
            (When::AfterBackward, ["after, backward", ""]),
        ];
        let there = names.into_iter().filter(|(when, _)| drawn(*when));
        there
            .map(|(when, names)| (Key::Line(when.stroke()), names[usize::from(alone)]))
            .collect()
    }
}

impl ResidualPanel {
    fn draw(&self, svg: &mut Svg, frame: [f64; 4]) {
        let points = || self.lines.iter().flat_map(|(_, line)| line);
        let finite = |v: &f64| v.is_finite();
        let x = axis::interval(points().map(|p| p[0]).filter(finite), 0.0);
        let y = axis::interval(points().map(|p| p[1]).filter(finite), 0.06);
        let (Some(x), Some(y)) = (x, y) else {
            Panel::empty(svg, frame, "not enough motion");
            return;
        };
        let panel = Panel::new(frame, x, y, [4, 4]);
        panel.grid(svg);
        svg.clip(frame);
        for (when, line) in &self.lines {
            let (x, y): (Vec<f64>, Vec<f64>) = line.iter().map(|p| (p[0], p[1])).unzip();
            svg.curve(&panel.place(decimated(&x, &y, POINTS)), when.stroke());
        }
        svg.end_clip();
        panel.outline(svg);
        panel.y_title(svg, 46.0, &self.of.0, &self.of.1);
        panel.x_numbers(svg);
        panel.x_title(svg, &self.over.0, &self.over.1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_both_kinds_are_drawn_and_an_empty_panel_says_so() {
        let panel = |line: Vec<[f64; 2]>| ResidualPanel {
            over: ("velocity".into(), "rad/s".into()),
            of: ("residual".into(), "Nm".into()),
            lines: vec![(When::Before, line.clone()), (When::AfterBackward, line)],
        };
        let figure = ResidualFigure {
            title: "a<b".into(),
            joints: vec![(
                "q<1".into(),
                vec![
                    panel(vec![[0.0, 1.0], [1.0, 2.0], [2.0, 1.5]]),
                    panel(vec![]),
                ],
            )],
        };
        let svg = figure.svg();
        assert!(svg.contains("velocity [rad/s]") && svg.contains("residual [Nm]"));
        assert!(svg.contains("not enough motion"));
        assert!(svg.contains("q&lt;1") && !svg.contains("NaN"));
    }
}
