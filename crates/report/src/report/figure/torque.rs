//! Measured and reconstructed torque over time, joint by joint, the residual below each (Figures 7
//! and 8 of the report).

use super::axis;
use super::colour;
use super::decimate::{POINTS, decimated};
use super::legend::{self, Key};
use super::panel::PlotPanel;
use super::svg::{LineStroke, SvgPicture};
use crate::report::words::{listed, torque_or_force};
use cft_ident_core::number;

/// The torque of one joint over time. A row that is not finite splits the lines: put one between
/// logs and across gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct JointTorque {
    pub joint: String,
    /// Unit of its torque, `N` or `Nm`.
    pub unit: String,
    /// Time [s].
    pub t: Vec<f64>,
    /// Measured torque [unit], one per time.
    pub measured: Vec<f64>,
    /// Reconstructed torque [unit], one per time.
    pub reconstructed: Vec<f64>,
    /// norm(measured - reconstructed) / norm(measured), a fraction; not finite where unknown.
    pub relative_error: f64,
    /// Root mean square of the residual [unit]; not finite where unknown.
    pub rmse: f64,
}

/// Values with one that is not finite before each break, to part the lines there.
pub(crate) fn parted(values: impl IntoIterator<Item = f64>, breaks: &[usize]) -> Vec<f64> {
    let gap = |k: usize| (k > 0 && breaks.contains(&k)).then_some(f64::NAN);
    let values = values.into_iter().enumerate();
    values
        .flat_map(|(k, value)| gap(k).into_iter().chain([value]))
        .collect()
}

/// A figure of two panels per joint, the joints below each other.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueFigure {
    /// Heading, the log's name for instance.
    pub title: String,
    /// The joints, top down.
    pub joints: Vec<JointTorque>,
}

const WIDTH: f64 = 760.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = 16.0;
const HEAD: f64 = 58.0;
const NAME: f64 = 20.0;
const TORQUE: f64 = 136.0;
const BETWEEN: f64 = 9.0;
const RESIDUAL: f64 = 68.0;
const NUMBERS: f64 = 30.0;
const FOOT: f64 = 16.0;

const MEASURED: LineStroke = LineStroke::dashed(colour::INK, 1.0, "5 4");
const RECONSTRUCTED: LineStroke = LineStroke::solid(colour::SKY, 2.4);
const DIFFERENCE: LineStroke = LineStroke::solid(colour::VERMILLION, 0.9);

impl TorqueFigure {
    /// A picture for each joint, one SVG document after the other: paper parts them where it must.
    pub fn by_joint(&self) -> String {
        let of_joint = |joint: &JointTorque| TorqueFigure {
            title: self.title.clone(),
            joints: vec![joint.clone()],
        };
        self.joints.iter().map(|j| of_joint(j).svg()).collect()
    }

    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let group = NAME + TORQUE + BETWEEN + RESIDUAL + NUMBERS;
        let height = HEAD + group * self.joints.len() as f64 + FOOT;
        let shown = |joint: &JointTorque| format!("{}{}", joint.joint, joint.figures());
        let shown: Vec<String> = self.joints.iter().map(shown).collect();
        let description = format!(
            "Measured and reconstructed torque over time and their difference: {}",
            shown.join("; ")
        );
        let entries = [
            (MEASURED, "measured"),
            (RECONSTRUCTED, "reconstructed"),
            (DIFFERENCE, "residual (measured \u{2212} reconstructed)"),
        ];
        let entries = entries.map(|(stroke, name)| (Key::Line(stroke), name));
        let titles = [&*self.title, &description];
        let mut svg = legend::headed([WIDTH, height], [LEFT, RIGHT], titles, &entries);
        let clock = TimeAxis::of(&self.joints);
        for (k, joint) in self.joints.iter().enumerate() {
            let top = HEAD + group * k as f64;
            joint.draw(&mut svg, top, clock.as_ref(), k + 1 == self.joints.len());
        }
        svg.finish()
    }
}

/// The axis of time that the joints share.
struct TimeAxis {
    /// From and to, after `start` [s].
    interval: [f64; 2],
    /// 0, or a whole second where the log's clock does not begin near 0 [s].
    start: f64,
}

impl TimeAxis {
    fn of(joints: &[JointTorque]) -> Option<Self> {
        let times = joints.iter().flat_map(|joint| joint.t.iter().copied());
        let [from, to] = axis::interval(times, 0.0)?;
        let late = from.abs() > 100.0 * (to - from);
        let start = if late { from.floor() } else { 0.0 };
        Some(TimeAxis {
            interval: [from - start, to - start],
            start,
        })
    }

    fn name(&self) -> String {
        match self.start {
            0.0 => "time".into(),
            start => format!("time after {start} s"),
        }
    }
}

impl JointTorque {
    fn draw(&self, svg: &mut SvgPicture, top: f64, clock: Option<&TimeAxis>, last: bool) {
        svg.heading([LEFT, top + 13.0], &self.joint, &self.figures());
        let width = WIDTH - LEFT - RIGHT;
        let upper = [LEFT, top + NAME, width, TORQUE];
        let lower = [LEFT, top + NAME + TORQUE + BETWEEN, width, RESIDUAL];
        let both = self.measured.iter().chain(&self.reconstructed).copied();
        let pairs = self.measured.iter().zip(&self.reconstructed);
        let residual: Vec<f64> = pairs.map(|(measured, hat)| measured - hat).collect();
        let range = axis::interval(both, 0.06);
        let spread = axis::interval(residual.iter().flat_map(|&r| [r, -r]), 0.08);
        let (Some(clock), Some(range), Some(spread)) = (clock, range, spread) else {
            PlotPanel::empty(svg, upper, "no samples");
            PlotPanel::empty(svg, lower, "no samples");
            return;
        };
        let panel = PlotPanel::new(upper, clock.interval, range, [9, 5]);
        panel.grid(svg);
        svg.clip(upper);
        let t: Vec<f64> = self.t.iter().map(|t| t - clock.start).collect();
        let line = |y: &[f64]| decimated(&t, y, POINTS);
        svg.curve(&panel.place(line(&self.reconstructed)), RECONSTRUCTED);
        svg.curve(&panel.place(line(&self.measured)), MEASURED);
        svg.end_clip();
        panel.outline(svg);
        panel.y_title(svg, 52.0, [torque_or_force(&self.unit), &self.unit]);
        let panel = PlotPanel::new(lower, clock.interval, spread, [9, 3]);
        panel.grid(svg);
        svg.clip(lower);
        svg.curve(&panel.place(line(&residual)), DIFFERENCE);
        svg.end_clip();
        panel.outline(svg);
        panel.y_title(svg, 52.0, ["residual", &self.unit]);
        panel.x_numbers(svg);
        if last {
            panel.x_title(svg, [&clock.name(), "s"]);
        }
    }

    /// The errors that are known, to stand behind the joint's name.
    fn figures(&self) -> String {
        let relative = format!("relative error {}", number::percent(self.relative_error));
        let rms = format!("rms {} {}", number::significant(self.rmse, 3), self.unit);
        let both = [(self.relative_error, relative), (self.rmse, rms)];
        let known = both.into_iter().filter(|(error, _)| error.is_finite());
        let known = listed(known.map(|(_, words)| words));
        match known.is_empty() {
            true => known,
            false => format!("\u{2003}{known}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(samples: usize) -> TorqueFigure {
        let t: Vec<f64> = (0..samples).map(|k| k as f64 * 1e-3).collect();
        let measured: Vec<f64> = t.iter().map(|t| (3.0 * t).sin()).collect();
        let reconstructed = measured.iter().map(|tau| 0.99 * tau).collect();
        TorqueFigure {
            title: "a & b.csv".into(),
            joints: vec![JointTorque {
                joint: "q1".into(),
                unit: "N".into(),
                t,
                measured,
                reconstructed,
                relative_error: 0.01,
                rmse: 0.007,
            }],
        }
    }

    #[test]
    fn a_long_log_gives_a_small_picture_and_the_same_one_again() {
        let figure = figure(300_000);
        let svg = figure.svg();
        assert!(svg.len() < 120_000, "{}", svg.len());
        assert_eq!(svg, figure.svg());
    }

    #[test]
    fn the_heading_carries_error_and_unit() {
        let svg = figure(100).svg();
        assert!(svg.contains(">q1</tspan>\u{2003}relative error 1.00 %, rms 0.00700 N</text>"));
        assert!(svg.contains("force [N]") && svg.contains("residual [N]"));
        assert!(svg.contains("time [s]"));
    }

    #[test]
    fn numbers_that_are_not_finite_never_reach_the_picture() {
        let mut odd = figure(100);
        odd.joints[0].measured[10] = f64::NAN;
        odd.joints[0].t[20] = f64::NAN;
        odd.joints[0].reconstructed[30] = f64::INFINITY;
        odd.joints[0].rmse = f64::NAN;
        let mut empty = odd.joints[0].clone();
        empty.t.clear();
        empty.measured.fill(f64::NAN);
        odd.joints.push(empty);
        let svg = odd.svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert!(svg.contains("no samples"));
    }

    #[test]
    fn clock_time_is_counted_from_a_round_second() {
        let mut late = figure(1000);
        late.joints[0].t.iter_mut().for_each(|t| *t += 1.7e9);
        let svg = late.svg();
        assert!(svg.contains("time after 1700000000 s [s]"), "{svg}");
        assert!(svg.contains(">0.5</text>"));
    }
}
