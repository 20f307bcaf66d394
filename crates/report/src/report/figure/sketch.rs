//! A robot in motion, from the side and from above: its joints on the chain, coloured by their errors.

use super::axis::AxisScale;
use super::cell::{self, PictureGroup};
use super::colour;
use super::legend::Key;
use super::svg::{LineStroke, SvgPicture, TextAnchor, TextStyle, fitted};
use cft_ident_core::number;

/// One joint of the sketch.
pub(crate) struct SketchJoint {
    pub name: String,
    /// Relative torque error, a fraction; not a number where it is not known.
    pub error: f64,
    /// Place of the joint among the points of a pose.
    pub point: usize,
}

/// Poses of a tree of links, in a frame whose third axis points upwards.
pub(crate) struct PoseSketch {
    pub title: String,
    pub joints: Vec<SketchJoint>,
    /// Points that each point of a pose is joined with; none for the base.
    pub parents: Vec<Option<usize>>,
    /// Points [m], pose by pose; the last is drawn in full.
    pub poses: Vec<Vec<[f64; 3]>>,
    /// Way of the tip [m].
    pub way: Vec<[f64; 3]>,
}

/// Height of a picture [px], and room for the names beside it.
const HEIGHT: f64 = 230.0;
const NAMES: f64 = 96.0;
/// Distance of two names [px].
const NAME_DISTANCE_PX: f64 = 14.0;
const LINK: LineStroke = LineStroke::solid(colour::INK, 3.0);
const EARLIER: LineStroke = LineStroke::solid(colour::ZERO, 1.4);
const WAY: LineStroke = LineStroke::dashed(colour::MUTED, 0.9, "3 2");
const LEADER: LineStroke = LineStroke::solid(colour::FRAME, 0.6);

/// Classes of errors, the same on every page: below which error, colour, and name.
const CLASSES: [(f64, &str, &str); 5] = [
    (0.02, colour::SKY, "error below 2 %"),
    (0.05, colour::BLUE, "2 to 5 %"),
    (0.10, colour::YELLOW, "5 to 10 %"),
    (0.30, colour::VERMILLION, "10 to 30 %"),
    (f64::INFINITY, colour::PURPLE, "above 30 %"),
];

impl PoseSketch {
    /// From the side and from above, to one scale.
    pub fn cells(&self) -> PictureGroup {
        let views = [("side view", [0, 2]), ("top view", [0, 1])];
        let picture = |(name, axes): (&str, [usize; 2])| {
            cell::cell(name, &self.words(), HEIGHT, |svg, frame| {
                cell::name(svg, frame, name);
                self.draw(svg, frame, axes);
            })
        };
        let classes = CLASSES.map(|(_, fill, name)| (Key::Spot(fill), name));
        let lines = [
            (Key::Line(EARLIER), "other poses"),
            (Key::Line(WAY), "path of the last joint"),
        ];
        let key: Vec<(Key, &str)> = classes.into_iter().chain(lines).collect();
        PictureGroup::new(&self.title, &key, views.into_iter().map(picture))
    }

    /// The joint of the largest error, for a screen reader.
    fn words(&self) -> String {
        let known = self.joints.iter().filter(|joint| joint.error.is_finite());
        let worst = known.max_by(|a, b| a.error.total_cmp(&b.error));
        let worst = worst.map(|worst| {
            let error = number::percent(worst.error);
            format!(
                "; the largest relative torque error is that of {}, {error}",
                worst.name
            )
        });
        format!("The robot along its motion{}", worst.unwrap_or_default())
    }

    fn draw(&self, svg: &mut SvgPicture, [left, top, width, height]: [f64; 4], axes: [usize; 2]) {
        let flat = |point: &[f64; 3]| [point[axes[0]], point[axes[1]]];
        let all = || self.poses.iter().flatten().chain(&self.way).map(flat);
        let room = [width - NAMES, height];
        // the base stands at the origin
        let bounds = |axis: usize| {
            let along = all().map(|p| p[axis]);
            along.fold([0.0f64; 2], |[a, b], x| [a.min(x), b.max(x)])
        };
        let (across, up) = (bounds(0), bounds(1));
        let spans = [across[1] - across[0], up[1] - up[0]];
        let metres = (spans[0] / room[0]).max(spans[1] / room[1]) * 1.12;
        if metres <= 0.0 || !metres.is_finite() {
            return;
        }
        let around = |[from, to]: [f64; 2], room: f64| {
            let (middle, half) = (0.5 * (from + to), 0.5 * metres * room);
            [middle - half, middle + half]
        };
        let x = AxisScale::new(around(across, room[0]), left, left + room[0]);
        let y = AxisScale::new(around(up, room[1]), top + height, top);
        let px = |point: &[f64; 3]| {
            let [a, b] = flat(point);
            [x.px(a), y.px(b)]
        };
        let base = px(&[0.0; 3]);
        svg.curve(&[self.way.iter().map(px).collect()], WAY);
        let Some((last, earlier)) = self.poses.split_last() else {
            return;
        };
        for (pose, stroke) in earlier.iter().map(|p| (p, EARLIER)).chain([(last, LINK)]) {
            for (point, parent) in pose.iter().zip(&self.parents) {
                let from = parent.map_or(base, |parent| px(&pose[parent]));
                svg.line(from, px(point), stroke);
            }
        }
        let foot = [base[0] - 9.0, base[1] - 3.0, 18.0, 6.0];
        svg.rect(foot, colour::MUTED, None);
        self.named(svg, &px, last, [left + room[0] + 12.0, top, height]);
        scale_bar(svg, [left, top + height + 16.0], metres, room[0]);
    }

    /// The joints and their names, each joined with its own.
    fn named(
        &self,
        svg: &mut SvgPicture,
        px: &dyn Fn(&[f64; 3]) -> [f64; 2],
        pose: &[[f64; 3]],
        [left, top, height]: [f64; 3],
    ) {
        let joints = self.joints.iter();
        let places = joints.filter_map(|joint| Some((joint, px(pose.get(joint.point)?))));
        let mut places: Vec<(&SketchJoint, [f64; 2])> = places.collect();
        places.sort_by(|a, b| a.1[1].total_cmp(&b.1[1]));
        let mut next = top + 8.0;
        let mut lines: Vec<f64> = Vec::new();
        for (k, (_, at)) in places.iter().enumerate() {
            let behind = (places.len() - k - 1) as f64;
            let lowest = top + height - NAME_DISTANCE_PX * behind;
            let line = at[1].max(next).min(lowest.max(next));
            lines.push(line);
            next = line + NAME_DISTANCE_PX;
            svg.line(*at, [left - 3.0, line - 3.5], LEADER);
        }
        for (joint, at) in &places {
            let ring = LineStroke::solid(colour::PAPER, 1.2);
            svg.ringed(*at, 5.0, fill(joint.error), ring);
        }
        for ((joint, _), line) in places.iter().zip(&lines) {
            let text = match joint.error.is_finite() {
                true => format!("{} {}", joint.name, number::percent(joint.error)),
                false => joint.name.clone(),
            };
            let text = fitted(&text, 10.5, NAMES - 12.0);
            svg.text(
                [left, *line],
                &text,
                TextStyle::new(10.5, TextAnchor::Start),
            );
        }
    }
}

/// Colour of an error.
fn fill(error: f64) -> &'static str {
    let class = CLASSES.iter().find(|(below, _, _)| error < *below);
    class.map_or(colour::FRAME, |(_, fill, _)| fill)
}

/// A round length below the picture.
fn scale_bar(svg: &mut SvgPicture, [left, top]: [f64; 2], metres: f64, width: f64) {
    let most = 0.4 * width * metres;
    let decade = 10f64.powf(most.log10().floor());
    let fits = |x: &f64| x * decade <= most;
    let factor = [5.0, 2.0, 1.0].into_iter().find(fits).unwrap_or(1.0);
    let length = factor * decade;
    let end = left + length / metres;
    let bar = LineStroke::solid(colour::INK, 1.4);
    svg.line([left, top], [end, top], bar);
    for x in [left, end] {
        svg.line([x, top - 3.0], [x, top + 3.0], bar);
    }
    let text = format!("{} m", number::significant(length, 1));
    let style = TextStyle::new(10.5, TextAnchor::Start);
    svg.text([end + 6.0, top + 3.5], &text, style);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sketch(errors: [f64; 3]) -> PoseSketch {
        let joint = |(point, error): (usize, f64)| SketchJoint {
            name: format!("q{}", point + 1),
            error,
            point,
        };
        PoseSketch {
            title: "the robot".into(),
            joints: errors.into_iter().enumerate().map(joint).collect(),
            parents: vec![None, Some(0), Some(1)],
            poses: vec![
                vec![[0.0, 0.0, 0.1], [0.0, 0.0, 0.5], [0.4, 0.0, 0.5]],
                vec![[0.0, 0.0, 0.1], [0.0, 0.0, 0.5], [0.3, 0.2, 0.8]],
            ],
            way: vec![[0.4, 0.0, 0.5], [0.3, 0.2, 0.8]],
        }
    }

    #[test]
    fn joints_are_coloured_by_their_errors_and_the_worst_is_named() {
        let cells = sketch([0.01, 0.03, 0.12]).cells();
        assert_eq!(cells.pictures.len(), 2);
        for (picture, view) in cells.pictures.iter().zip(["side view", "top view"]) {
            assert!(picture.contains(view));
            for fill in [colour::SKY, colour::BLUE, colour::VERMILLION] {
                assert!(picture.contains(&format!("fill=\"{fill}\"")), "{fill}");
            }
            assert!(picture.contains("that of q3, 12.0 %"), "{picture}");
            assert!(picture.contains(">q1 1.00 %<"), "{picture}");
        }
        assert!(cells.key.concat().contains("5 to 10 %"), "{:?}", cells.key);
        // classes do not depend on the worst joint of the page
        let small = sketch([0.001, 0.0005, 0.0015]).cells().pictures.concat();
        assert!(!small.contains(&format!("fill=\"{}\"", colour::VERMILLION)));
    }

    #[test]
    fn a_robot_without_extent_or_with_an_error_that_is_no_number_is_no_broken_picture() {
        let mut odd = sketch([f64::NAN; 3]);
        assert!(!odd.cells().pictures.concat().contains("NaN"));
        odd.poses.iter_mut().flatten().for_each(|p| *p = [0.0; 3]);
        odd.way.clear();
        assert!(!odd.cells().pictures.concat().contains("NaN"));
    }
}
