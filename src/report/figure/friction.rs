//! Friction over velocity, joint by joint: the curve with its band, the speeds that the data cover,
//! and the mean torque of plateaus as an independent check (eq. (29) of the report).

use super::axis;
use super::colour;
use super::joint_grid::{self, Heading};
use super::legend::Key;
use super::panel::Panel;
use super::svg::{Anchor, Stroke, Svg, Type, fitted, width_of};
use crate::friction::estimate::FrictionCurvePoint;

/// Half a 95 % interval in standard deviations.
const WITHIN_95: f64 = 1.959_964;

/// The friction of one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionPanel {
    /// Name of the joint.
    pub joint: String,
    /// What the reader should know at once (`not converged`, ...); may be empty.
    pub note: String,
    /// `m/s` or `rad/s`.
    pub speed_unit: String,
    /// `N` or `Nm`.
    pub torque_unit: String,
    /// The curve in order of `v`; a point that is not finite splits it (at 0 for a law that jumps).
    /// Outside `covered` it is drawn dashed.
    pub curve: Vec<FrictionCurvePoint>,
    /// Intervals of velocity that the data cover, from the lower to the upper end.
    pub covered: Vec<[f64; 2]>,
    /// Mean torque at constant speed.
    pub plateaus: Vec<FrictionCurvePoint>,
    /// The true curve in order of `v`, where it is known; else empty.
    pub truth: Vec<[f64; 2]>,
}

/// A figure of one panel per joint, two beside each other.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionFigure {
    /// Heading.
    pub title: String,
    /// The joints in reading order.
    pub panels: Vec<FrictionPanel>,
}

/// Radius of a plateau's dot [px].
const DOT: f64 = 2.3;

const CURVE: Stroke = Stroke::solid(colour::BLUE, 1.8);
const BEYOND: Stroke = Stroke::dashed(colour::BLUE, 1.2, "3 3");
const TRUTH: Stroke = Stroke::dashed(colour::VERMILLION, 1.3, "7 2.5 1.5 2.5");

impl FrictionFigure {
    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let names: Vec<&str> = self
            .panels
            .iter()
            .map(|panel| panel.joint.as_str())
            .collect();
        let description = format!(
            "Friction torque over velocity with its 95 % band, joints {}",
            names.join(", ")
        );
        let heading = Heading {
            title: &self.title,
            description: &description,
            legend: &self.entries(),
        };
        joint_grid::draw(&heading, &self.panels, FrictionPanel::draw)
    }

    /// Only what is drawn is in the legend.
    fn entries(&self) -> Vec<(Key, &'static str)> {
        let any = |has: fn(&FrictionPanel) -> bool| self.panels.iter().any(has);
        let mut entries = vec![(Key::Band(CURVE), "estimated, 95 % band")];
        let beyond =
            |panel: &FrictionPanel| !lines(&panel.curve, |a, b| !panel.covers(a.v, b.v)).is_empty();
        if self.panels.iter().any(beyond) {
            entries.push((Key::Line(BEYOND), "beyond the data"));
        }
        if any(|panel| !panel.plateaus.is_empty()) {
            entries.push((Key::Dot(colour::INK), "plateaus, 95 %"));
        }
        if any(|panel| !panel.truth.is_empty()) {
            entries.push((Key::Line(TRUTH), "truth"));
        }
        if any(|panel| !panel.covered.is_empty()) {
            entries.push((Key::Patch(colour::COVERED), "speeds covered"));
        }
        entries
    }
}

impl FrictionPanel {
    /// Whether one of the intervals covered holds both velocities.
    fn covers(&self, a: f64, b: f64) -> bool {
        self.covered.iter().any(|[from, to]| {
            let slack = 1e-9 * (to - from);
            let inside = |v: f64| (from - slack..=to + slack).contains(&v);
            inside(a) && inside(b)
        })
    }

    fn draw(&self, svg: &mut Svg, frame: [f64; 4]) {
        let [left, top, width, height] = frame;
        let note = match self.note.as_str() {
            "" => String::new(),
            note => format!("\u{2003}{note}"),
        };
        let style = Type::new(11.5, Anchor::Start);
        let note = fitted(&note, 11.5, width - width_of(&self.joint, 12.5));
        svg.heading([left, top - 7.0], &self.joint, &note, style);
        let (Some(speeds), Some(torques)) = (self.speeds(), self.torques()) else {
            Panel::empty(svg, frame, "no friction found");
            return;
        };
        let panel = Panel::new(frame, speeds, torques, [4, 6]);
        for [from, to] in &self.covered {
            let from = panel.x.px(from.max(speeds[0]));
            let to = panel.x.px(to.min(speeds[1]));
            if to > from {
                svg.rect([from, top, to - from, height], colour::COVERED, None);
            }
        }
        panel.grid(svg);
        svg.clip(frame);
        for run in runs(&self.curve, |point| point.std.is_finite()) {
            svg.area(&band(&panel, &run), CURVE.colour, 0.22);
        }
        let curve = |inside: bool| {
            let parts = lines(&self.curve, |a, b| self.covers(a.v, b.v) == inside);
            panel.place(parts)
        };
        svg.curve(&curve(false), BEYOND);
        svg.curve(&curve(true), CURVE);
        svg.curve(&panel.place(vec![self.truth.clone()]), TRUTH);
        for point in &self.plateaus {
            plateau(svg, &panel, point);
        }
        svg.end_clip();
        panel.outline(svg);
        panel.x_numbers(svg);
        panel.x_title(svg, "velocity", &self.speed_unit);
        panel.y_title(svg, 46.0, "friction", &self.torque_unit);
    }

    fn speeds(&self) -> Option<[f64; 2]> {
        let points = self.curve.iter().chain(&self.plateaus).map(|point| point.v);
        let truth = self.truth.iter().map(|[v, _]| *v);
        let covered = self.covered.iter().flatten().copied();
        axis::interval(points.chain(truth).chain(covered), 0.03)
    }

    /// The band counts inside the speeds covered only: outside it may grow without bound.
    fn torques(&self) -> Option<[f64; 2]> {
        let curve = self.curve.iter().flat_map(|point| {
            let half = match point.std.is_finite() && self.covers(point.v, point.v) {
                true => WITHIN_95 * point.std,
                false => 0.0,
            };
            [point.torque - half, point.torque + half]
        });
        let plateaus = self.plateaus.iter().map(|point| point.torque);
        let truth = self.truth.iter().map(|[_, torque]| *torque);
        axis::interval(curve.chain(plateaus).chain(truth), 0.06)
    }
}

fn finite(point: &FrictionCurvePoint) -> bool {
    point.v.is_finite() && point.torque.is_finite()
}

/// Stretches of consecutive finite points that `wanted` accepts.
pub(super) fn runs(
    curve: &[FrictionCurvePoint],
    wanted: impl Fn(&FrictionCurvePoint) -> bool,
) -> Vec<Vec<FrictionCurvePoint>> {
    curve
        .split(|point| !finite(point) || !wanted(point))
        .filter(|run| run.len() > 1)
        .map(<[FrictionCurvePoint]>::to_vec)
        .collect()
}

/// Lines between consecutive finite points that `wanted` accepts in pairs.
pub(super) fn lines(
    curve: &[FrictionCurvePoint],
    wanted: impl Fn(&FrictionCurvePoint, &FrictionCurvePoint) -> bool,
) -> Vec<Vec<[f64; 2]>> {
    let mut lines: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut open = false;
    for pair in curve.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let draw = finite(a) && finite(b) && wanted(a, b);
        if draw {
            match lines.last_mut() {
                Some(line) if open => line.push([b.v, b.torque]),
                _ => lines.push(vec![[a.v, a.torque], [b.v, b.torque]]),
            }
        }
        open = draw;
    }
    lines
}

/// Ends of the 95 % band of a point [torque unit]; the torque alone where the band is unknown.
pub(super) fn spread(point: &FrictionCurvePoint) -> [f64; 2] {
    let half = match point.std.is_finite() {
        true => WITHIN_95 * point.std,
        false => 0.0,
    };
    [point.torque - half, point.torque + half]
}

/// The outline of curve plus and minus its 95 % [px].
pub(super) fn band(panel: &Panel, run: &[FrictionCurvePoint]) -> Vec<[f64; 2]> {
    let edge = |point: &FrictionCurvePoint, side: f64| {
        let torque = point.torque + side * WITHIN_95 * point.std;
        [panel.x.px(point.v), panel.y.px(torque)]
    };
    let upper = run.iter().map(|point| edge(point, 1.0));
    let lower = run.iter().rev().map(|point| edge(point, -1.0));
    upper.chain(lower).collect()
}

/// A dot with its 95 % bar, capped.
fn plateau(svg: &mut Svg, panel: &Panel, point: &FrictionCurvePoint) {
    if !finite(point) {
        return;
    }
    let at = panel.x.px(point.v);
    let [low, high] =
        [-1.0, 1.0].map(|side| panel.y.px(point.torque + side * WITHIN_95 * point.std));
    // A bar that the dot hides would only make the dot ragged.
    if point.std.is_finite() && low - high > 2.0 * DOT + 5.0 {
        let bar = Stroke::solid(colour::INK, 0.9);
        svg.line([at, low], [at, high], bar);
        svg.line([at - 2.5, low], [at + 2.5, low], bar);
        svg.line([at - 2.5, high], [at + 2.5, high], bar);
    }
    svg.dot([at, panel.y.px(point.torque)], DOT, colour::INK);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel() -> FrictionPanel {
        let point = |v: f64| FrictionCurvePoint {
            v,
            torque: v + v.signum(),
            std: 0.1,
        };
        FrictionPanel {
            joint: "q1".into(),
            note: String::new(),
            speed_unit: "m/s".into(),
            torque_unit: "N".into(),
            curve: [-2.0, -1.0, -0.5, 0.5, 1.0, 2.0].map(point).to_vec(),
            covered: vec![[-1.0, -0.5], [0.5, 1.0]],
            plateaus: Vec::new(),
            truth: Vec::new(),
        }
    }

    #[test]
    fn the_curve_is_solid_only_where_the_data_reach() {
        let panel = panel();
        let solid = lines(&panel.curve, |a, b| panel.covers(a.v, b.v));
        assert_eq!(
            solid,
            [[[-1.0, -2.0], [-0.5, -1.5]], [[0.5, 1.5], [1.0, 2.0]]]
        );
        let dashed = lines(&panel.curve, |a, b| !panel.covers(a.v, b.v));
        assert_eq!(dashed.len(), 3);
    }

    #[test]
    fn the_legend_names_what_is_drawn_and_nothing_else() {
        let mut figure = FrictionFigure {
            title: "t".into(),
            panels: vec![panel()],
        };
        let names = |figure: &FrictionFigure| -> Vec<&str> {
            figure.entries().iter().map(|(_, name)| *name).collect()
        };
        assert_eq!(
            names(&figure),
            ["estimated, 95 % band", "beyond the data", "speeds covered"]
        );
        figure.panels[0].truth = vec![[0.0, 0.0], [1.0, 2.0]];
        figure.panels[0].plateaus = vec![figure.panels[0].curve[3]];
        assert_eq!(names(&figure)[2..4], ["plateaus, 95 %", "truth"]);
    }

    #[test]
    fn numbers_that_are_not_finite_never_reach_the_picture() {
        let mut odd = panel();
        odd.curve[2].torque = f64::NAN;
        odd.curve[4].std = f64::INFINITY;
        odd.plateaus = vec![FrictionCurvePoint {
            v: f64::NAN,
            torque: 1.0,
            std: f64::NAN,
        }];
        let nothing = FrictionPanel {
            curve: Vec::new(),
            covered: Vec::new(),
            ..panel()
        };
        let figure = FrictionFigure {
            title: "t".into(),
            panels: vec![odd, nothing],
        };
        let svg = figure.svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert!(svg.contains("no friction found"));
        assert_eq!(svg, figure.svg());
    }
}
