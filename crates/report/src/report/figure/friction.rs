//! Friction over velocity, joint by joint: the curve with its band, the speeds that the data cover,
//! and the mean torque of plateaus as an independent check (eq. (29) of the report).

use super::axis;
use super::cell::{self, PictureGroup};
use super::colour;
use super::joint_grid;
use super::legend::Key;
use super::panel::PlotPanel;
use super::svg::{LineStroke, SvgPicture, fitted, width_of};
use crate::report::words::listed;
use cft_ident_core::friction::estimate::FrictionCurvePoint;
use cft_ident_core::number;

/// Half a 95 % interval in standard deviations.
const WITHIN_95: f64 = 1.959_964;

/// The friction of one joint.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrictionPanel {
    pub joint: String,
    /// Words behind the name (`not converged`, ...); may be empty.
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
    /// Velocity, measured torque less all that is no friction, and the friction of the model with every effect.
    pub cloud: Vec<[f64; 3]>,
    /// Effects make the friction differ from the curve, which is not drawn: the model stands in the cloud.
    pub beyond_curve: bool,
    /// The true curve in order of `v`, where it is known; else empty.
    pub truth: Vec<[f64; 2]>,
}

/// A figure of one panel per joint, two beside each other.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionFigure {
    pub title: String,
    /// In reading order.
    pub panels: Vec<FrictionPanel>,
}

/// Radius of a plateau's dot [px].
const DOT: f64 = 2.3;
/// Height of a panel by itself [px], and most rows of a cloud.
const PANEL_HEIGHT_PX: f64 = 180.0;
const ROWS: usize = 500;

const CURVE: LineStroke = LineStroke::solid(colour::BLUE, 1.8);
const BEYOND: LineStroke = LineStroke::dashed(colour::BLUE, 1.2, "3 3");
const TRUTH: LineStroke = LineStroke::dashed(colour::VERMILLION, 1.3, "7 2.5 1.5 2.5");

impl FrictionFigure {
    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let description = format!(
            "Friction torque over velocity with its 95 % band, joints {}",
            listed(self.panels.iter().map(|panel| &*panel.joint))
        );
        let titles = [&*self.title, &description];
        joint_grid::draw(titles, &self.entries(), &self.panels, FrictionPanel::draw)
    }

    /// The panels as pictures of their own.
    pub fn cells(&self) -> PictureGroup {
        let cell = |panel: &FrictionPanel| {
            let title = format!("friction of {}", panel.joint);
            cell::cell(&title, &panel.words(), PANEL_HEIGHT_PX, |svg, frame| {
                panel.draw(svg, frame)
            })
        };
        PictureGroup {
            apart: true,
            ..PictureGroup::new(&self.title, &self.entries(), self.panels.iter().map(cell))
        }
    }

    /// The legend of all that is drawn.
    fn entries(&self) -> Vec<(Key, &'static str)> {
        let any = |has: fn(&FrictionPanel) -> bool| self.panels.iter().any(has);
        let beyond = |panel: &FrictionPanel| {
            !panel.beyond_curve && !lines(&panel.curve, |a, b| !panel.covers(a.v, b.v)).is_empty()
        };
        let beyond = self.panels.iter().any(beyond);
        let [curves, effects] = [any(|p| !p.beyond_curve), any(|p| p.beyond_curve)];
        let clouds = any(|p| !p.cloud.is_empty());
        let plateaus = any(|p| !p.plateaus.is_empty());
        let [truths, covered] = [any(|p| !p.truth.is_empty()), any(|p| !p.covered.is_empty())];
        let [red, blue] = [colour::VERMILLION, colour::BLUE].map(Key::Spot);
        let patch = Key::Patch(colour::COVERED);
        let entries = [
            (clouds, red, "measured, less all else"),
            (effects, blue, "model with every effect"),
            (curves, Key::Band(CURVE), "estimated, 95 % band"),
            (beyond, Key::Line(BEYOND), "beyond these logs"),
            (plateaus, Key::Dot(colour::INK), "plateaus, 95 %"),
            (truths, Key::Line(TRUTH), "truth"),
            (covered, patch, "speeds in these logs"),
        ];
        let drawn = entries.into_iter().filter(|(drawn, ..)| *drawn);
        drawn.map(|(_, key, name)| (key, name)).collect()
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

    fn draw(&self, svg: &mut SvgPicture, frame: [f64; 4]) {
        let [left, top, width, height] = frame;
        let note = match self.note.as_str() {
            "" => String::new(),
            note => format!("\u{2003}{note}"),
        };
        let note = fitted(&note, 11.5, width - width_of(&self.joint, 12.5));
        svg.heading([left, top - 7.0], &self.joint, &note);
        let (Some(speeds), Some(torques)) = (self.speeds(), self.torques()) else {
            PlotPanel::empty(svg, frame, "no friction found");
            return;
        };
        let panel = PlotPanel::new(frame, speeds, torques, [4, 6]);
        for [from, to] in &self.covered {
            let from = panel.x.px(from.max(speeds[0]));
            let to = panel.x.px(to.min(speeds[1]));
            if to > from {
                svg.rect([from, top, to - from, height], colour::COVERED, None);
            }
        }
        panel.grid(svg);
        svg.clip(frame);
        let every = self.cloud.len().div_ceil(ROWS).max(1);
        let finite = |row: &&[f64; 3]| row.iter().all(|x| x.is_finite());
        let cloud = self.cloud.iter().step_by(every).filter(finite);
        let place = |v: f64, torque: f64| [panel.x.px(v), panel.y.px(torque)];
        for [v, measured, _] in cloud.clone() {
            svg.dot(place(*v, *measured), 1.1, colour::VERMILLION);
        }
        if self.beyond_curve {
            for [v, _, model] in cloud {
                svg.dot(place(*v, *model), 1.5, colour::BLUE);
            }
        } else {
            for run in runs(&self.curve) {
                svg.area(&band(&panel, run), CURVE.colour, 0.22);
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
        }
        svg.end_clip();
        let torque = ["friction", &*self.torque_unit];
        panel.axes(svg, 46.0, ["velocity", &self.speed_unit], torque);
    }

    /// Friction at the lowest and at the highest speed that the data cover, for a screen reader.
    fn words(&self) -> String {
        let of_model = self.cloud.iter().map(|[v, _, model]| [*v, *model]);
        let of_curve = self.curve.iter().map(|point| [point.v, point.torque]);
        let points: Vec<[f64; 2]> = match self.beyond_curve {
            true => of_model.collect(),
            false => of_curve.collect(),
        };
        let forward = points.iter();
        let forward = forward.filter(|[v, torque]| *v > 0.0 && torque.is_finite());
        let by_speed = |a: &&[f64; 2], b: &&[f64; 2]| a[0].total_cmp(&b[0]);
        let slowest = forward.clone().min_by(by_speed);
        let Some(ends) = slowest.zip(forward.max_by(by_speed)) else {
            return format!("no friction of {} is known", self.joint);
        };
        let shown = |x: f64, unit: &str| format!("{} {unit}", number::significant(x, 3));
        let [slow, fast] = [ends.0, ends.1].map(|[v, torque]| {
            let torque = shown(*torque, &self.torque_unit);
            format!("{torque} at {}", shown(*v, &self.speed_unit))
        });
        format!("{}: {slow}, {fast}", self.joint)
    }

    fn speeds(&self) -> Option<[f64; 2]> {
        let points = self.curve.iter().chain(&self.plateaus).map(|point| point.v);
        let truth = self.truth.iter().map(|[v, _]| *v);
        let covered = self.covered.iter().flatten().copied();
        axis::interval(points.chain(truth).chain(covered), 0.03)
    }

    /// The band counts inside the speeds covered only: outside it may grow without bound.
    fn torques(&self) -> Option<[f64; 2]> {
        let curve = self.curve.iter().filter(|_| !self.beyond_curve);
        let curve = curve.flat_map(|point| match self.covers(point.v, point.v) {
            true => spread(point),
            false => [point.torque; 2],
        });
        let cloud = self.cloud.iter();
        let curve = curve.chain(cloud.flat_map(|[_, measured, model]| [*measured, *model]));
        let plateaus = self.plateaus.iter().map(|point| point.torque);
        let truth = self.truth.iter().map(|[_, torque]| *torque);
        axis::interval(curve.chain(plateaus).chain(truth), 0.06)
    }
}

fn finite(point: &FrictionCurvePoint) -> bool {
    point.v.is_finite() && point.torque.is_finite()
}

/// Stretches of consecutive points that are finite, and their deviations too.
pub(super) fn runs(curve: &[FrictionCurvePoint]) -> impl Iterator<Item = &[FrictionCurvePoint]> {
    let runs = curve.split(|point| !finite(point) || !point.std.is_finite());
    runs.filter(|run| run.len() > 1)
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
pub(super) fn band(panel: &PlotPanel, run: &[FrictionCurvePoint]) -> Vec<[f64; 2]> {
    let rows = run.iter();
    panel.band(rows.map(|point| [point.v, point.torque, WITHIN_95 * point.std]))
}

/// A dot with its 95 % bar, capped.
fn plateau(svg: &mut SvgPicture, panel: &PlotPanel, point: &FrictionCurvePoint) {
    if !finite(point) {
        return;
    }
    let at = panel.x.px(point.v);
    let [low, high] =
        [-1.0, 1.0].map(|side| panel.y.px(point.torque + side * WITHIN_95 * point.std));
    // A bar that the dot hides would only make the dot ragged.
    if point.std.is_finite() && low - high > 2.0 * DOT + 5.0 {
        let bar = LineStroke::solid(colour::INK, 0.9);
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
            speed_unit: "m/s".into(),
            torque_unit: "N".into(),
            curve: [-2.0, -1.0, -0.5, 0.5, 1.0, 2.0].map(point).to_vec(),
            covered: vec![[-1.0, -0.5], [0.5, 1.0]],
            ..FrictionPanel::default()
        }
    }

    fn figure(panels: Vec<FrictionPanel>) -> FrictionFigure {
        let title = "t".into();
        FrictionFigure { title, panels }
    }

    #[test]
    fn the_cloud_and_the_model_with_every_effect_stand_where_effects_are() {
        let mut figure = figure(vec![panel()]);
        figure.panels[0].cloud = vec![[0.5, 9.0, 7.0], [1.0, f64::NAN, 2.0]];
        let circles =
            |figure: &FrictionFigure| figure.cells().pictures[0].matches("<circle").count();
        assert_eq!(circles(&figure), 1);
        figure.panels[0].beyond_curve = true;
        let (cells, key) = (figure.cells(), figure.cells().key.concat());
        assert_eq!(circles(&figure), 2);
        assert!(key.contains("model with every effect"), "{key}");
        assert!(!key.contains("95 % band"));
        assert!(cells.pictures[0].contains("q1: 7.00 N at 0.500 m/s, 2.00 N at 1.00 m/s"));
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
        let mut figure = figure(vec![panel()]);
        let names = |figure: &FrictionFigure| -> Vec<&str> {
            figure.entries().iter().map(|(_, name)| *name).collect()
        };
        let expected = [
            "estimated, 95 % band",
            "beyond these logs",
            "speeds in these logs",
        ];
        assert_eq!(names(&figure), expected);
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
        let figure = figure(vec![odd, nothing]);
        let svg = figure.svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert!(svg.contains("no friction found"));
        assert_eq!(svg, figure.svg());
    }
}
