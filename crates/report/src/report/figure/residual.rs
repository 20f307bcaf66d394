//! A residual before and after: over position, velocity, load and time, forward and backward apart, and its spectra
//! over order and frequency.

use super::axis;
use super::cell::{self, PictureGroup};
use super::colour;
use super::decimate::decimated;
use super::legend::{self, Key};
use super::panel::PlotPanel;
use super::svg::{LineStroke, SvgPicture, TextAnchor, TextStyle, width_of};
use crate::report::words::listed;
use cft_ident_core::number;

/// One panel: a quantity below, and lines before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualPanel {
    /// Name and unit of the quantity below.
    pub over: (String, String),
    /// Name and unit of the quantity at the left.
    pub of: (String, String),
    /// Lines of (x, y); a y that is not finite parts a line.
    pub lines: Vec<(ResidualLine, Vec<[f64; 2]>)>,
    /// Places below that are marked, with their names.
    pub marks: Vec<(f64, String)>,
}

/// Which line it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResidualLine {
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

impl ResidualLine {
    fn stroke(self) -> LineStroke {
        match self {
            ResidualLine::Before => LineStroke::solid(colour::VERMILLION, 1.1),
            ResidualLine::BeforeBackward => LineStroke::dashed(colour::VERMILLION, 1.1, "4 3"),
            ResidualLine::After => LineStroke::solid(colour::BLUE, 1.4),
            ResidualLine::AfterBackward => LineStroke::dashed(colour::BLUE, 1.4, "4 3"),
        }
    }
}

impl ResidualFigure {
    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let room = |panels: &[ResidualPanel]| {
            NAME + panels.len().div_ceil(COLUMNS) as f64 * (PLOT + NUMBERS)
        };
        let height = HEAD + self.joints.iter().map(|(_, p)| room(p)).sum::<f64>();
        let description = format!(
            "Torque residual over position, velocity, load, time, order and frequency, joints {}",
            listed(self.joints.iter().map(|(name, _)| &**name))
        );
        let titles = [&*self.title, &description];
        let mut svg = legend::headed([WIDTH, height], [LEFT, RIGHT], titles, &self.entries());
        let column = WIDTH / COLUMNS as f64;
        let mut top = HEAD;
        for (name, panels) in &self.joints {
            svg.heading([LEFT, top + 13.0], name, "");
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
            top += room(panels);
        }
        svg.finish()
    }

    /// The panels as pictures of their own, joint by joint.
    pub fn cells(&self) -> Vec<PictureGroup> {
        let entries = self.entries();
        let of_joint = |(name, panels): &(String, Vec<ResidualPanel>)| {
            let picture = |panel: &ResidualPanel| {
                let title = format!("residual of {name} over {}", panel.over.0);
                let titles = [&*title, &panel.words(name)];
                cell::below(cell::MARKS, titles, PLOT, |svg, frame| {
                    panel.draw(svg, frame)
                })
            };
            let title = format!("{}, {name}", self.title);
            PictureGroup::new(&title, &entries, panels.iter().map(picture))
        };
        self.joints.iter().map(of_joint).collect()
    }

    /// The legend of all that is drawn; a residual that nothing came after is not `before`.
    fn entries(&self) -> Vec<(Key, &'static str)> {
        let drawn = |when: ResidualLine| {
            let mut panels = self.joints.iter().flat_map(|(_, panels)| panels);
            panels.any(|panel| panel.lines.iter().any(|(w, _)| *w == when))
        };
        let alone = !drawn(ResidualLine::After) && !drawn(ResidualLine::AfterBackward);
        let [before, backward] = match alone {
            true => ["residual", "residual, backward"],
            false => ["before", "before, backward"],
        };
        let names = [
            (ResidualLine::Before, before),
            (ResidualLine::BeforeBackward, backward),
            (ResidualLine::After, "after"),
            (ResidualLine::AfterBackward, "after, backward"),
        ];
        let there = names.into_iter().filter(|(when, _)| drawn(*when));
        let entries = there.map(|(when, name)| (Key::Line(when.stroke()), name));
        entries.collect()
    }
}

impl ResidualPanel {
    /// The greatest of each line, for a screen reader.
    fn words(&self, joint: &str) -> String {
        let most = |wanted: [ResidualLine; 2]| {
            let lines = self.lines.iter().filter(|(when, _)| wanted.contains(when));
            let values = lines.flat_map(|(_, line)| line.iter().map(|p| p[1].abs()));
            values.filter(|y| y.is_finite()).reduce(f64::max)
        };
        let shown = |x: f64| format!("{} {}", number::significant(x, 3), self.of.1);
        let before = most([ResidualLine::Before, ResidualLine::BeforeBackward]);
        let after = most([ResidualLine::After, ResidualLine::AfterBackward]);
        let (what, over) = (&self.of.0, &self.over.0);
        match (before, after) {
            (Some(before), Some(after)) => format!(
                "greatest {what} of {joint} over {over}: {} before, {} after",
                shown(before),
                shown(after)
            ),
            (Some(only), None) | (None, Some(only)) => {
                format!("greatest {what} of {joint} over {over}: {}", shown(only))
            }
            (None, None) => format!("not enough motion of {joint} to tell"),
        }
    }

    fn draw(&self, svg: &mut SvgPicture, frame: [f64; 4]) {
        let points = || self.lines.iter().flat_map(|(_, line)| line);
        let finite = |v: &f64| v.is_finite();
        let x = axis::interval(points().map(|p| p[0]).filter(finite), 0.0);
        let y = axis::interval(points().map(|p| p[1]).filter(finite), 0.06);
        let (Some(x), Some(y)) = (x, y) else {
            PlotPanel::empty(svg, frame, "not enough motion");
            return;
        };
        let panel = PlotPanel::new(frame, x, y, [4, 4]);
        panel.grid(svg);
        svg.clip(frame);
        for (when, line) in &self.lines {
            let (x, y): (Vec<f64>, Vec<f64>) = line.iter().map(|p| (p[0], p[1])).unzip();
            svg.curve(&panel.place(decimated(&x, &y, POINTS)), when.stroke());
        }
        svg.end_clip();
        self.mark(svg, &panel);
        panel.outline(svg);
        panel.y_title(svg, 46.0, [&self.of.0, &self.of.1]);
        panel.x_numbers(svg);
        panel.x_title(svg, [&self.over.0, &self.over.1]);
    }

    /// Marks, with their names above the frame where these do not meet.
    fn mark(&self, svg: &mut SvgPicture, panel: &PlotPanel) {
        let [_, top, _, height] = panel.frame;
        let mut marks: Vec<&(f64, String)> = self.marks.iter().collect();
        marks.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut free = f64::NEG_INFINITY;
        let [from, to] = panel.x.data;
        for (x, name) in marks.into_iter().filter(|(x, _)| (from..=to).contains(x)) {
            let at = panel.x.px(*x);
            let line = LineStroke::dashed(colour::INK, 0.9, "2 2");
            svg.line([at, top], [at, top + height], line);
            let half = 0.5 * width_of(name, 10.0) + 2.0;
            if at - half > free {
                svg.text(
                    [at, top - 3.0],
                    name,
                    TextStyle::new(10.0, TextAnchor::Middle),
                );
                free = at + half;
            }
        }
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
            lines: vec![
                (ResidualLine::Before, line.clone()),
                (ResidualLine::AfterBackward, line),
            ],
            marks: vec![(1.0, "1.00".into()), (9.0, "9.00".into())],
        };
        let panels = vec![
            panel(vec![[0.0, 1.0], [1.0, 2.0], [2.0, 1.5]]),
            panel(vec![]),
        ];
        let figure = ResidualFigure {
            title: "a<b".into(),
            joints: vec![("q<1".into(), panels)],
        };
        let svg = figure.svg();
        assert!(svg.contains("velocity [rad/s]") && svg.contains("residual [Nm]"));
        assert!(svg.contains("not enough motion"));
        assert!(svg.contains("q&lt;1") && !svg.contains("NaN"));
        // a mark beyond the axis is left out
        assert!(svg.contains(">1.00</text>") && !svg.contains(">9.00</text>"));
        let pictures = &figure.cells()[0].pictures;
        assert_eq!(pictures.len(), 2);
        let shown = "greatest residual of q&lt;1 over velocity: 2.00 Nm before, 2.00 Nm after";
        assert!(pictures[0].contains(shown), "{}", pictures[0]);
    }
}
