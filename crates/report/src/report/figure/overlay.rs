//! Friction curves of two models over each other, joint by joint.

use super::axis;
use super::cell::{self, PictureGroup};
use super::colour;
use super::friction::{band, lines, runs, spread};
use super::joint_grid;
use super::legend::Key;
use super::panel::PlotPanel;
use super::svg::{LineStroke, SvgPicture, fitted};
use crate::report::words::listed;
use cft_ident_core::friction::estimate::FrictionCurvePoint;

/// The friction of one joint by two models.
#[derive(Debug, Clone, PartialEq)]
pub struct OverlayPanel {
    pub joint: String,
    /// `m/s` or `rad/s`.
    pub speed_unit: String,
    /// `N` or `Nm`.
    pub torque_unit: String,
    /// Both curves in order of `v`; a point that is not finite splits one, and a model without
    /// friction there has none.
    pub curves: [Vec<FrictionCurvePoint>; 2],
    /// Velocity and friction along the logs, of a model whose effects make its friction differ from a
    /// curve over velocity; it has no curve then.
    pub clouds: [Vec<[f64; 2]>; 2],
}

/// A figure of one panel per joint.
#[derive(Debug, Clone, PartialEq)]
pub struct OverlayFigure {
    pub title: String,
    /// The two models in the legend.
    pub names: [String; 2],
    /// In reading order.
    pub panels: Vec<OverlayPanel>,
}

/// Room for one name in the legend [px].
const LABEL: f64 = 250.0;
/// Height of a panel by itself [px], and most rows of a cloud.
const PANEL_HEIGHT_PX: f64 = 180.0;
const ROWS: usize = 500;

/// Distinguished by dashes as well as by colour.
const STROKES: [LineStroke; 2] = [
    LineStroke::solid(colour::VERMILLION, 1.8),
    LineStroke::dashed(colour::BLUE, 1.6, "7 3"),
];

impl OverlayFigure {
    /// The panels as pictures of their own.
    pub fn cells(&self) -> PictureGroup {
        let picture = |panel: &OverlayPanel| {
            let title = format!("friction of {}", panel.joint);
            let described = format!("{title} by {} and {}", self.names[0], self.names[1]);
            cell::cell(&title, &described, PANEL_HEIGHT_PX, |svg, frame| {
                panel.draw(svg, frame)
            })
        };
        let keys = STROKES.iter().zip(&self.names);
        let keys: Vec<(Key, &str)> = keys
            .map(|(stroke, name)| (Key::Band(*stroke), name.as_str()))
            .collect();
        PictureGroup {
            apart: true,
            ..PictureGroup::new(&self.title, &keys, self.panels.iter().map(picture))
        }
    }

    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let description = format!(
            "Friction torque over velocity by two models with 95 % bands, joints {}",
            listed(self.panels.iter().map(|panel| &*panel.joint))
        );
        let [first, second] = self.names.each_ref().map(|name| fitted(name, 11.0, LABEL));
        let keys = STROKES.map(Key::Band);
        let entries = [(keys[0], &*first), (keys[1], &*second)];
        let titles = [&*self.title, &description];
        joint_grid::draw(titles, &entries, &self.panels, OverlayPanel::draw)
    }
}

impl OverlayPanel {
    fn draw(&self, svg: &mut SvgPicture, frame: [f64; 4]) {
        let [left, top, ..] = frame;
        svg.heading([left, top - 7.0], &self.joint, "");
        let points = || self.curves.iter().flatten();
        let rows = || self.clouds.iter().flatten();
        let speeds = axis::interval(points().map(|p| p.v).chain(rows().map(|r| r[0])), 0.03);
        let torques = points().flat_map(spread).chain(rows().map(|r| r[1]));
        let torques = axis::interval(torques, 0.06);
        let (Some(speeds), Some(torques)) = (speeds, torques) else {
            PlotPanel::empty(svg, frame, "no friction in either model");
            return;
        };
        let panel = PlotPanel::new(frame, speeds, torques, [4, 6]);
        panel.grid(svg);
        svg.clip(frame);
        for (curve, stroke) in self.curves.iter().zip(STROKES) {
            for run in runs(curve) {
                svg.area(&band(&panel, run), stroke.colour, 0.18);
            }
        }
        for (cloud, stroke) in self.clouds.iter().zip(STROKES) {
            let every = cloud.len().div_ceil(ROWS).max(1);
            let shown = cloud.iter().step_by(every);
            for [v, torque] in shown.filter(|row| row.iter().all(|x| x.is_finite())) {
                svg.dot([panel.x.px(*v), panel.y.px(*torque)], 1.3, stroke.colour);
            }
        }
        for (curve, stroke) in self.curves.iter().zip(STROKES) {
            svg.curve(&panel.place(lines(curve, |_, _| true)), stroke);
        }
        svg.end_clip();
        let torque = ["friction", &*self.torque_unit];
        panel.axes(svg, 46.0, ["velocity", &self.speed_unit], torque);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(height: f64, std: f64) -> Vec<FrictionCurvePoint> {
        let torque = |v: f64| height * v.signum();
        let point = |v| FrictionCurvePoint {
            v,
            torque: torque(v),
            std,
        };
        [-1.0, -0.5, 0.5, 1.0].map(point).to_vec()
    }

    fn figure(curves: [Vec<FrictionCurvePoint>; 2]) -> OverlayFigure {
        OverlayFigure {
            title: "t".into(),
            names: ["A: first.toml".into(), "B: second.toml".into()],
            panels: vec![OverlayPanel {
                joint: "q1".into(),
                speed_unit: "m/s".into(),
                torque_unit: "N".into(),
                curves,
                clouds: [Vec::new(), vec![[0.3, 1.5], [0.4, f64::NAN]]],
            }],
        }
    }

    #[test]
    fn both_curves_are_drawn_and_named() {
        let svg = figure([curve(1.0, 0.1), curve(2.0, 0.1)]).svg();
        let [first, second] = STROKES.map(|stroke| stroke.colour);
        for part in ["first.toml", "second.toml", first, second] {
            assert!(svg.contains(part), "{part}");
        }
        assert!(svg.contains("stroke-dasharray"));
    }

    #[test]
    fn numbers_that_are_not_finite_never_reach_the_picture() {
        let svg = figure([curve(f64::NAN, 0.1), curve(1.0, f64::NAN)]).svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        let cloud = figure([Vec::new(), Vec::new()]);
        assert_eq!(cloud.cells().pictures[0].matches("<circle").count(), 1);
        let mut none = cloud;
        none.panels[0].clouds[1].clear();
        let none = none.svg();
        assert!(none.contains("no friction in either model"));
    }
}
