//! Errors joint by joint as bars: before and after, each with its 95 % confidence interval.

use super::colour;
use super::legend::{self, Key};
use super::svg::{LineStroke, SvgPicture, TextAnchor, TextStyle, fitted, width_of};
use crate::report::usual::UsualErrors;
use cft_ident_core::number;

/// An error and its 95 % confidence interval where that is known, as fractions.
#[derive(Clone, Copy)]
pub(crate) struct ErrorBar {
    pub error: f64,
    pub interval_95: Option<[f64; 2]>,
}

impl From<f64> for ErrorBar {
    fn from(error: f64) -> Self {
        let interval_95 = None;
        ErrorBar { error, interval_95 }
    }
}

/// The error of one joint, and another that it is compared with.
pub(crate) struct JointBars {
    pub joint: String,
    pub before: Option<ErrorBar>,
    pub after: ErrorBar,
}

impl JointBars {
    fn all(&self) -> impl Iterator<Item = ErrorBar> {
        self.before.into_iter().chain([self.after])
    }
}

/// A figure of a row per joint.
pub(crate) struct ErrorFigure {
    pub title: String,
    /// Names of the two bars of a joint: of models, or of data.
    pub names: [String; 2],
    pub joints: Vec<JointBars>,
    /// Largest error that is wanted, as a fraction.
    pub limit: Option<f64>,
    /// Errors that are usual.
    pub usual: Option<UsualErrors>,
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
        let mut svg = SvgPicture::new(WIDTH, height, &self.title, &self.words());
        let heading = TextStyle::new(14.0, TextAnchor::Start).bold();
        svg.text([14.0, 22.0], &self.title, heading);
        let [before, after] = [colour::VERMILLION, colour::BLUE].map(Key::Patch);
        let mut keys = match compared {
            true => vec![(before, &*self.names[0]), (after, &*self.names[1])],
            false => vec![(after, "error")],
        };
        let whisker = LineStroke::solid(colour::INK, 1.2);
        if self.bars().any(|bar| bar.interval_95.is_some()) {
            keys.push((Key::Line(whisker), "95 % confidence interval"));
        }
        let wanted = LineStroke::dashed(colour::INK, 1.2, "6 3");
        keys.extend(self.limit.map(|_| (Key::Line(wanted), "limit")));
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
            let grid = LineStroke::solid(colour::GRID, 1.0);
            svg.line([x(error), top - 4.0], [x(error), bottom], grid);
            let style = TextStyle::new(10.5, TextAnchor::Middle).muted();
            svg.text([x(error), bottom + 15.0], &text, style);
        }
        for (k, joint) in self.joints.iter().enumerate() {
            let row_top = top + pitch * k as f64;
            let name = fitted(&joint.joint, SIZE, left - 26.0);
            let middle = row_top + 0.5 * rows * BAR + 4.0;
            svg.text(
                [left - 10.0, middle],
                &name,
                TextStyle::new(SIZE, TextAnchor::End),
            );
            let fills = [colour::VERMILLION, colour::BLUE];
            let fills = fills.into_iter().skip(usize::from(joint.before.is_none()));
            for (row, (bar, fill)) in joint.all().zip(fills).enumerate() {
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
                let room = at - 4.0..at + width_of(&words, 10.5);
                if let Some(line) = self.limit.map(x).filter(|x| room.contains(x)) {
                    at = line + 6.0;
                }
                svg.text(
                    [at, y + 10.0],
                    &words,
                    TextStyle::new(10.5, TextAnchor::Start),
                );
            }
        }
        if let Some(limit) = self.limit {
            svg.line([x(limit), top - 4.0], [x(limit), bottom], wanted);
        }
        let axis = LineStroke::solid(colour::FRAME, 1.0);
        svg.line([left, top - 4.0], [left, bottom], axis);
        svg.finish()
    }

    fn bars(&self) -> impl Iterator<Item = ErrorBar> {
        self.joints.iter().flat_map(JointBars::all)
    }

    /// The largest number of the axis.
    fn most(&self) -> f64 {
        let high = |bar: ErrorBar| bar.interval_95.map(|[_, high]| high);
        let ends = self.bars().flat_map(|bar| [Some(bar.error), high(bar)]);
        let usual = self.usual.as_ref().map(|usual| usual.band[1]);
        let all = ends.flatten().chain(self.limit).chain(usual);
        let most = all.filter(|x| x.is_finite()).fold(0.0, f64::max);
        if most > 0.0 { 1.02 * most } else { 1.0 }
    }

    /// All of it for a screen reader.
    fn words(&self) -> String {
        let [name_before, name_after] = &self.names;
        let joint = |of: &JointBars| {
            let (joint, after) = (&of.joint, in_words(of.after));
            let before = of.before.map(|before| number::percent(before.error));
            before.map_or(format!("{joint} {after}"), |before| {
                format!("{joint} {before} {name_before}, {after} {name_after}")
            })
        };
        let mut words: Vec<String> = self.joints.iter().map(joint).collect();
        let limit = self.limit.map(number::percent);
        words.extend(limit.map(|limit| format!("limit {limit}")));
        words.extend(self.usual.iter().map(|usual| usual.words.clone()));
        format!("Relative torque error: {}", words.join("; "))
    }
}

/// `5.17 % (4.25..6.11)`.
fn in_words(bar: ErrorBar) -> String {
    let error = number::percent(bar.error);
    match bar.interval_95 {
        Some(ends) => format!("{error} ({})", ends.map(number::hundredths).join("..")),
        None => error,
    }
}

/// A few round errors from 0 to the largest, and their texts.
fn ticks(most: f64) -> Vec<(f64, String)> {
    let rough = most / 4.0;
    let power = 10f64.powf(rough.log10().floor());
    let mut steps = [1.0, 2.0, 5.0, 10.0].into_iter().map(|x| x * power);
    let step = steps.find(|step| *step >= rough).unwrap_or(rough);
    let errors = (0..=8).map(|k| f64::from(k) * step);
    let errors = errors.take_while(|error| *error <= most);
    errors
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
            usual: Some(UsualErrors {
                band: [0.031, 0.129],
                words: "usual: 3.1 to 13 %".to_owned(),
            }),
        }
    }

    #[test]
    fn errors_before_and_after_are_drawn_and_named_with_their_intervals() {
        let svg = figure(0.05).svg();
        let words = ["held-out error", "q1", "14.6 %", "5.00 % (4.00..6.00)"];
        let beside = [
            "limit 10",
            "usual: 3.1 to 13 %",
            colour::VERMILLION,
            colour::BLUE,
        ];
        for part in words.into_iter().chain(beside) {
            assert!(svg.contains(part), "{part}: {svg}");
        }
    }

    #[test]
    fn an_error_that_is_no_number_never_reaches_the_picture() {
        let svg = figure(f64::NAN).svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}
