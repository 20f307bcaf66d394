//! Parameters over time: estimates of single logs, the smoothed course with its band, and changes.

use super::axis;
use super::cell::{self, PictureGroup};
use super::colour;
use super::legend::Key;
use super::panel::PlotPanel;
use super::svg::{LineStroke, SvgPicture, fitted};
use cft_ident_core::number;

/// One parameter over time.
#[derive(Clone)]
pub(crate) struct CoursePanel {
    /// Name of the parameter, with its joint.
    pub name: String,
    pub unit: String,
    /// Times \[`time_unit`\].
    pub times: Vec<f64>,
    /// Estimates of the logs by themselves; none where a log says nothing.
    pub estimates: Vec<Option<f64>>,
    /// Smoothed value and standard deviation.
    pub course: Vec<Option<[f64; 2]>>,
    /// Times of changes.
    pub changes: Vec<f64>,
}

/// A figure of one panel per parameter.
pub(crate) struct CourseFigure {
    pub title: String,
    /// `s`, `h`, `d`, or nothing where logs are counted.
    pub time_unit: String,
    /// What the dots are, and the line.
    pub key: [&'static str; 2],
    pub panels: Vec<CoursePanel>,
}

const COURSE: LineStroke = LineStroke::solid(colour::BLUE, 1.8);
const CHANGE: LineStroke = LineStroke::dashed(colour::VERMILLION, 1.4, "5 3");
/// Height of a panel [px].
const HEIGHT: f64 = 150.0;
/// Half width of the band of 95 % in standard deviations.
const BAND: f64 = 1.96;

impl CourseFigure {
    /// The panels as pictures of their own.
    pub fn cells(&self) -> PictureGroup {
        let [dots, line] = self.key;
        let has_band = self.panels.iter().any(|panel| {
            let known = panel.course.iter().flatten();
            known.into_iter().any(|[_, std]| *std > 0.0)
        });
        let course = if has_band { Key::Band } else { Key::Line };
        let mut key = vec![(Key::Spot(colour::MUTED), dots), (course(COURSE), line)];
        if self.panels.iter().any(|panel| !panel.changes.is_empty()) {
            key.push((Key::Line(CHANGE), "change"));
        }
        let picture = |panel: &CoursePanel| {
            cell::cell(&panel.name, &panel.words(), HEIGHT, |svg, frame| {
                panel.draw(svg, frame, &self.time_unit)
            })
        };
        PictureGroup {
            apart: true,
            ..PictureGroup::new(&self.title, &key, self.panels.iter().map(picture))
        }
    }
}

impl CoursePanel {
    /// The ends of the course and its changes, for a screen reader.
    fn words(&self) -> String {
        let known: Vec<[f64; 2]> = self.course.iter().flatten().copied().collect();
        let (Some(first), Some(last)) = (known.first(), known.last()) else {
            return format!("no log determines {}", self.name);
        };
        let of = |[value, std]: [f64; 2]| {
            let (value, std) = number::value_and_std(value, std);
            format!("{value} ± {std} {}", self.unit)
        };
        let changes = match self.changes.len() {
            0 => "no change".to_owned(),
            1 => "one change".to_owned(),
            many => format!("{many} changes"),
        };
        let (first, last) = (of(*first), of(*last));
        format!("{}: {first} at first, {last} at last; {changes}", self.name)
    }

    fn draw(&self, svg: &mut SvgPicture, frame: [f64; 4], time_unit: &str) {
        let [left, top, width, height] = frame;
        let name = fitted(&self.name, 11.5, width);
        svg.heading([left, top - 7.0], &name, "");
        let ends = self.course.iter().flatten();
        let ends = ends.flat_map(|[x, std]| [x - BAND * std, x + BAND * std]);
        let values = self.estimates.iter().flatten().copied().chain(ends);
        let values = axis::interval(values, 0.06);
        let times = axis::interval(self.times.iter().copied(), 0.03);
        let (Some(times), Some(values)) = (times, values) else {
            PlotPanel::empty(svg, frame, "no log determines it");
            return;
        };
        let panel = PlotPanel::new(frame, times, values, [4, 5]);
        panel.grid(svg);
        svg.clip(frame);
        let place = |t: f64, x: f64| [panel.x.px(t), panel.y.px(x)];
        let rows = self.times.iter().zip(&self.course);
        let known = rows.filter_map(|(t, c)| c.map(|[x, std]| [*t, x, BAND * std]));
        svg.area(&panel.band(known.clone()), COURSE.colour, 0.18);
        svg.curve(&[known.map(|[t, x, _]| place(t, x)).collect()], COURSE);
        for (t, x) in self.times.iter().zip(&self.estimates) {
            if let Some(x) = x {
                svg.dot(place(*t, *x), 2.0, colour::MUTED);
            }
        }
        for t in &self.changes {
            let at = panel.x.px(*t);
            svg.line([at, top], [at, top + height], CHANGE);
        }
        svg.end_clip();
        let below = match time_unit {
            "" => ["log", "number"],
            unit => ["time", unit],
        };
        panel.axes(svg, 46.0, below, ["value", &self.unit]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_is_drawn_and_what_is_not_known_never_reaches_the_picture() {
        let mut panel = CoursePanel {
            name: "coulomb of q2".into(),
            unit: "Nm".into(),
            times: vec![0.0, 1.0, 2.0],
            estimates: vec![Some(1.0), None, Some(1.5)],
            course: vec![Some([1.0, 0.1]), Some([1.2, 0.2]), Some([1.5, 0.1])],
            changes: vec![1.0],
        };
        let figure = |panel: &CoursePanel| CourseFigure {
            title: "arm".into(),
            time_unit: "d".into(),
            key: ["estimate of one log", "smoothed, 95 %"],
            panels: vec![panel.clone()],
        };
        let cells = figure(&panel).cells();
        let svg = &cells.pictures[0];
        assert!(svg.contains("coulomb of q2") && svg.contains(CHANGE.colour));
        assert!(svg.contains("1.50 ± 0.10 Nm at last; one change"), "{svg}");
        assert_eq!(cells.key.len(), 3);
        panel.course = vec![None; 3];
        panel.estimates = vec![None; 3];
        let none = &figure(&panel).cells().pictures[0];
        assert!(none.contains("no log determines it") && !none.contains("NaN"));
    }
}
