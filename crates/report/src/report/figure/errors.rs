//! Errors joint by joint as bars: before and after, each with its 95 % confidence interval.

use super::colour;
use super::legend::{self, Key};
use super::svg::{Anchor, Stroke, Svg, Type, fitted, width_of};
use crate::report::usual::Usual;
use cft_ident_core::number;

/// An error and its 95 % confidence interval, as fractions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBar {
    pub error: f64,
    /// None where it is not known.
    pub interval_95: Option<[f64; 2]>,
}

/// The errors of one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointBars {
    pub joint: String,
    /// What the error is compared with, where there is anything.
    pub before: Option<ErrorBar>,
    pub after: ErrorBar,
}

/// A figure of a row per joint.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorFigure {
    /// Heading: what the errors are of.
    pub title: String,
    /// Names of the two bars of a joint: of models, or of data.
    pub names: [String; 2],
    pub joints: Vec<JointBars>,
    /// Largest error that is wanted, as a fraction.
    pub limit: Option<f64>,
    /// Errors that are usual.
    pub usual: Option<Usual>,
}

const WIDTH: f64 = 440.0;
const TOP: f64 = 62.0;
/// Room for a second line of the legend [px].
const LINE: f64 = 18.0;
/// Height of one bar, and of the room below a joint's bars [px].
const BAR: f64 = 13.0;
const ROOM_BELOW_PX: f64 = 12.0;
/// Room at the right for the numbers [px].
const NUMBERS: f64 = 142.0;
const SIZE: f64 = 12.0;

impl ErrorFigure {
    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let compared = self.joints.iter().any(|joint| joint.before.is_some());
        let rows = if compared { 2.0 } else { 1.0 };
        let pitch = rows * BAR + ROOM_BELOW_PX;
        let top = TOP + if self.usual.is_some() { LINE } else { 0.0 };
        let bottom = top + pitch * self.joints.len() as f64;
        let height = bottom + 34.0;
        let mut svg = Svg::new(WIDTH, height, &self.title, &self.words());
        svg.text(
            [14.0, 22.0],
            &self.title,
            Type::new(14.0, Anchor::Start).bold(),
        );
        let mut keys = Vec::new();
        if compared {
            keys.push((Key::Patch(colour::VERMILLION), self.names[0].as_str()));
            keys.push((Key::Patch(colour::BLUE), self.names[1].as_str()));
        } else {
            keys.push((Key::Patch(colour::BLUE), "error"));
        }
        let whisker = Stroke::solid(colour::INK, 1.2);
        let bars = self.joints.iter();
        let mut bars = bars.flat_map(|joint| joint.before.into_iter().chain([joint.after]));
        if bars.any(|bar| bar.interval_95.is_some()) {
            keys.push((Key::Line(whisker), "95 % confidence interval"));
        }
        let wanted = Stroke::dashed(colour::INK, 1.2, "6 3");
        if self.limit.is_some() {
            keys.push((Key::Line(wanted), "limit"));
        }
        legend::draw(&mut svg, [14.0, 44.0], &keys);

        let names = self.joints.iter().map(|joint| width_of(&joint.joint, SIZE));
        let left = 26.0 + names.fold(40.0, f64::max).min(200.0);
        let room = WIDTH - left - NUMBERS;
        let most = self.most();
        let x = |error: f64| left + room * (error / most).clamp(0.0, 1.0);
        if let Some(usual) = &self.usual {
            let key = (Key::Patch(colour::COVERED), usual.words.as_str());
            legend::draw(&mut svg, [14.0, 44.0 + LINE], &[key]);
            let [from, to] = usual.band.map(x);
            let band = [from, top - 4.0, to - from, bottom - top + 4.0];
            svg.rect(band, colour::COVERED, None);
        }
        for (error, text) in ticks(most) {
            let grid = Stroke::solid(colour::GRID, 1.0);
            svg.line([x(error), top - 4.0], [x(error), bottom], grid);
            let style = Type::new(10.5, Anchor::Middle).muted();
            svg.text([x(error), bottom + 15.0], &text, style);
        }
        for (k, joint) in self.joints.iter().enumerate() {
            let row_top = top + pitch * k as f64;
            let name = fitted(&joint.joint, SIZE, left - 26.0);
            let middle = row_top + 0.5 * rows * BAR + 4.0;
            svg.text([left - 10.0, middle], &name, Type::new(SIZE, Anchor::End));
            let bars = [
                (joint.before, colour::VERMILLION),
                (Some(joint.after), colour::BLUE),
            ];
            let bars = bars
                .into_iter()
                .filter_map(|(bar, fill)| Some((bar?, fill)));
            for (row, (bar, fill)) in bars.enumerate() {
                let y = row_top + BAR * row as f64;
                svg.rect([left, y, x(bar.error) - left, BAR - 2.0], fill, None);
                let mut end = x(bar.error);
                if let Some([low, high]) = bar.interval_95 {
                    let level = y + 0.5 * BAR - 1.0;
                    svg.line([x(low), level], [x(high), level], whisker);
                    for error in [low, high] {
                        svg.line([x(error), level - 3.5], [x(error), level + 3.5], whisker);
                    }
                    end = end.max(x(high));
                }
                let (mut at, words) = (end + 6.0, in_words(bar));
                // no number stands on the line of the limit
                let limit = self.limit.map(x);
                if let Some(line) =
                    limit.filter(|x| (at - 4.0..at + width_of(&words, 10.5)).contains(x))
                {
                    at = line + 6.0;
                }
                svg.text([at, y + 10.0], &words, Type::new(10.5, Anchor::Start));
            }
        }
        if let Some(limit) = self.limit {
            svg.line([x(limit), top - 4.0], [x(limit), bottom], wanted);
        }
        let axis = Stroke::solid(colour::FRAME, 1.0);
        svg.line([left, top - 4.0], [left, bottom], axis);
        svg.finish()
    }

    /// The largest number of the axis.
    fn most(&self) -> f64 {
        let bars = self.joints.iter();
        let bars = bars.flat_map(|joint| joint.before.into_iter().chain([joint.after]));
        let ends = bars.flat_map(|bar| [Some(bar.error), bar.interval_95.map(|[_, high]| high)]);
        let usual = self.usual.as_ref().map(|usual| usual.band[1]);
        let all = ends.flatten().chain(self.limit).chain(usual);
        let most = all.filter(|x| x.is_finite()).fold(0.0, f64::max);
        if most > 0.0 { 1.02 * most } else { 1.0 }
    }

    /// What a screen reader says.
    fn words(&self) -> String {
        let joint = |joint: &JointBars| match joint.before {
            Some(before) => format!(
                "{} {} {}, {} {}",
                joint.joint,
                number::percent(before.error),
                self.names[0],
                in_words(joint.after),
                self.names[1]
            ),
            None => format!("{} {}", joint.joint, in_words(joint.after)),
        };
        let joints: Vec<String> = self.joints.iter().map(joint).collect();
        let limit = self.limit.map_or(String::new(), |limit| {
            format!("; limit {}", number::percent(limit))
        });
        let usual = self
            .usual
            .as_ref()
            .map(|usual| format!("; {}", usual.words));
        let usual = usual.unwrap_or_default();
        format!("Relative torque error: {}{limit}{usual}", joints.join("; "))
    }
}

/// `5.17 % (4.25..6.11)`.
fn in_words(bar: ErrorBar) -> String {
    match bar.interval_95 {
        Some([low, high]) => format!(
            "{} ({}..{})",
            number::percent(bar.error),
            number::hundredths(low),
            number::hundredths(high)
        ),
        None => number::percent(bar.error),
    }
}

/// A few round errors from 0 to the largest, and their texts.
fn ticks(most: f64) -> Vec<(f64, String)> {
    let rough = most / 4.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|x| x * power);
    let step = step
        .into_iter()
        .find(|step| *step >= rough)
        .unwrap_or(rough);
    (0..=8)
        .map(|k| f64::from(k) * step)
        .take_while(|error| *error <= most)
        .map(|error| (error, number::percent(error)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(after: f64) -> ErrorFigure {
        let bar = |error: f64| ErrorBar {
            error,
            interval_95: Some([0.8 * error, 1.2 * error]),
        };
        ErrorFigure {
            title: "held-out error".into(),
            names: ["before", "after"].map(str::to_owned),
            joints: vec![JointBars {
                joint: "q1".into(),
                before: Some(bar(0.146)),
                after: bar(after),
            }],
            limit: Some(0.1),
            usual: Some(Usual {
                band: [0.031, 0.129],
                words: "usual: 3.1 to 13 %".to_owned(),
            }),
        }
    }

    #[test]
    fn errors_before_and_after_are_drawn_and_told_with_their_intervals() {
        let svg = figure(0.05).svg();
        for part in [
            "held-out error",
            "q1",
            "14.6 %",
            "5.00 % (4.00..6.00)",
            "limit 10",
            "usual: 3.1 to 13 %",
        ] {
            assert!(svg.contains(part), "{part}: {svg}");
        }
        for colour in [colour::VERMILLION, colour::BLUE] {
            assert!(svg.contains(colour));
        }
    }

    #[test]
    fn an_error_that_is_no_number_never_reaches_the_picture() {
        let svg = figure(f64::NAN).svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}
