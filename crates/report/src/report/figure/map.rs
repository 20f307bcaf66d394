//! A residual over two signals: means over cells as a map, and over the first of them as a curve with its 95 % band.

use super::axis;
use super::cell::{self, PictureGroup};
use super::colour;
use super::legend::Key;
use super::panel::PlotPanel;
use super::svg::{LineStroke, SvgPicture, TextAnchor, TextStyle};
use cft_ident_core::number;

/// Means of a residual.
#[derive(Debug, Clone, PartialEq)]
pub struct MapFigure {
    pub title: String,
    /// The finding in a sentence, for those who do not see the picture.
    pub description: String,
    /// Name and unit of the signals: below, and at the left of the map.
    pub over: [(String, String); 2],
    /// Unit of the residual.
    pub unit: String,
    /// Ends of the two signals.
    pub ends: [[f64; 2]; 2],
    /// Mean residual of each cell, `[second][first]`; none where too few rows are.
    pub cells: Vec<Vec<Option<f64>>>,
    /// Signal, mean and its standard error.
    pub curve: Vec<[f64; 3]>,
}

/// Height of a panel \[px\].
const HEIGHT: f64 = 220.0;
const CURVE: LineStroke = LineStroke::solid(colour::INK, 1.8);
/// Half width of the band of 95 % in standard errors.
const BAND: f64 = 1.96;
/// Distance of the lines that stand for too few rows \[px\].
const HATCH: f64 = 7.0;
/// Room of the bar of shades with its numbers, and its width \[px\].
const BAR: f64 = 58.0;
const BAR_WIDTH: f64 = 12.0;
/// Shades of a mean: so many on each side of none.
const SHADES: f64 = 8.0;

impl MapFigure {
    /// Map and curve; `words` stand below.
    pub fn cells(&self, words: Vec<String>) -> PictureGroup {
        let means = || self.cells.iter().flatten().flatten();
        let most = means().fold(0.0, |most: f64, mean| most.max(mean.abs()));
        let end = number::significant(most, 2);
        let [above, below] = [
            format!("up to {end} {} above the model", self.unit),
            format!("up to {end} {} below", self.unit),
        ];
        let ([first, second], finding) = (self.over.each_ref().map(|o| &o.0), &self.description);
        let both = format!("mean over {first} and {second}. {finding}");
        let one = format!("mean over {first}. {finding}");
        let map = |svg: &mut SvgPicture, frame| self.map(svg, frame, most);
        let map = cell::cell(&self.title, &both, HEIGHT, map);
        let curve = |svg: &mut SvgPicture, frame| self.line(svg, frame);
        let curve = cell::cell(&self.title, &one, HEIGHT, curve);
        let key = [
            (Key::Spot(colour::VERMILLION), &*above),
            (Key::Spot(colour::BLUE), &below),
            (Key::Hatch, "too few rows"),
            (Key::Band(CURVE), "mean, 95 %"),
        ];
        PictureGroup {
            words,
            ..PictureGroup::new(&self.title, &key, [map, curve])
        }
    }

    fn map(&self, svg: &mut SvgPicture, frame: [f64; 4], most: f64) {
        cell::name(svg, frame, "over both");
        if most <= 0.0 {
            PlotPanel::empty(svg, frame, "no rows");
            return;
        }
        let bar = [frame[0] + frame[2] - BAR, frame[1], BAR_WIDTH, frame[3]];
        let frame = [frame[0], frame[1], frame[2] - BAR - 10.0, frame[3]];
        let panel = PlotPanel::new(frame, self.ends[0], self.ends[1], [5, 6]);
        svg.clip(frame);
        hatch(svg, frame);
        for (y, line) in self.cells.iter().enumerate() {
            for (x, mean) in line.iter().enumerate() {
                let Some(mean) = mean else { continue };
                let shade = (SHADES * mean.abs() / most).ceil() / SHADES;
                let fill = match *mean > 0.0 {
                    true => colour::VERMILLION,
                    false => colour::BLUE,
                };
                let at = |s: usize, k: usize, of: usize| {
                    let [from, to] = self.ends[s];
                    from + (to - from) * k as f64 / of as f64
                };
                let [left, right] = [x, x + 1].map(|k| panel.x.px(at(0, k, line.len())));
                let [low, high] = [y, y + 1].map(|k| panel.y.px(at(1, k, self.cells.len())));
                let cell = [[left, low], [right, low], [right, high], [left, high]];
                svg.rect([left, high, right - left, low - high], colour::PAPER, None);
                svg.area(&cell, fill, shade);
            }
        }
        svg.end_clip();
        self.bar(svg, bar, most);
        let [below, at_left] = self.over.each_ref().map(|(name, unit)| [&**name, unit]);
        panel.axes(svg, 44.0, below, at_left);
    }

    /// The shades and the means that they stand for.
    fn bar(&self, svg: &mut SvgPicture, [left, top, width, height]: [f64; 4], most: f64) {
        let step = 0.5 * height / SHADES;
        svg.rect([left, top, width, height], colour::PAPER, None);
        let middle = top + 0.5 * height;
        for k in 0..SHADES as usize {
            let shade = (k + 1) as f64 / SHADES;
            let above = middle - (k + 1) as f64 * step;
            let below = middle + k as f64 * step;
            for (fill, from) in [(colour::VERMILLION, above), (colour::BLUE, below)] {
                let (right, to) = (left + width, from + step);
                let patch = [[left, from], [right, from], [right, to], [left, to]];
                svg.area(&patch, fill, shade);
            }
        }
        let style = TextStyle::new(10.0, TextAnchor::Start);
        let end = number::significant(most, 2);
        for (y, text) in [
            (top + 7.0, format!("+{end}")),
            (middle + 3.5, "0".to_owned()),
            (top + height, format!("\u{2212}{end}")),
        ] {
            svg.text([left + width + 4.0, y], &text, style);
        }
        svg.text([left, top - 6.0], &self.unit, style.muted());
    }

    fn line(&self, svg: &mut SvgPicture, frame: [f64; 4]) {
        cell::name(svg, frame, &format!("over {}", self.over[0].0));
        let ends = |[_, mean, std]: &[f64; 3]| [mean - BAND * std, mean + BAND * std];
        let torques = axis::interval(self.curve.iter().flat_map(ends).chain([0.0]), 0.06);
        let Some(torques) = torques.filter(|_| self.curve.len() > 1) else {
            PlotPanel::empty(svg, frame, "no rows");
            return;
        };
        let panel = PlotPanel::new(frame, self.ends[0], torques, [5, 6]);
        panel.grid(svg);
        svg.clip(frame);
        let rows = self.curve.iter();
        let band = rows.map(|[x, mean, std]| [*x, *mean, BAND * std]);
        svg.area(&panel.band(band), CURVE.colour, 0.18);
        let curve = self.curve.iter().map(|[x, mean, _]| [*x, *mean]);
        svg.curve(&panel.place(vec![curve.collect()]), CURVE);
        svg.end_clip();
        let (name, unit) = &self.over[0];
        panel.axes(svg, 44.0, [name, unit], ["mean residual", &self.unit]);
    }
}

/// Lines across a frame: where no cell is.
fn hatch(svg: &mut SvgPicture, [left, top, width, height]: [f64; 4]) {
    let lines = ((width + height) / HATCH) as usize;
    for k in 0..=lines {
        let x = left - height + HATCH * k as f64;
        let stroke = LineStroke::solid(colour::ZERO, 0.8);
        svg.line([x, top + height], [x + height, top], stroke);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_shaded_by_their_mean_and_those_without_rows_stay_empty() {
        let mut figure = MapFigure {
            title: "what is left of q1".into(),
            description: "it depends on position with speed".into(),
            over: [
                ("position".into(), "rad".into()),
                ("speed".into(), "rad/s".into()),
            ],
            unit: "Nm".into(),
            ends: [[-1.0, 1.0], [0.0, 2.0]],
            cells: vec![vec![Some(2.0), Some(-0.5)], vec![None, Some(-2.0)]],
            curve: vec![[-0.9, 1.0, 0.1], [0.9, -1.0, 0.1]],
        };
        let cells = figure.cells(Vec::new());
        let [map, curve] = cells.pictures.as_slice() else {
            panic!("{} pictures", cells.pictures.len())
        };
        let count = |shade: &str| map.matches(shade).count();
        let full = |colour: &str| count(&format!("fill=\"{colour}\" fill-opacity=\"1\""));
        assert_eq!(
            (full(colour::VERMILLION), full(colour::BLUE)),
            (2, 2),
            "{map}"
        );
        // three cells, and the bar
        assert_eq!(count("fill-opacity"), 3 + 16, "{map}");
        assert!(map.contains("<desc>mean over position and speed. it depends"));
        assert!(curve.contains("mean residual [Nm]") && !curve.contains("NaN"));
        figure.cells = vec![vec![None]];
        figure.curve.clear();
        let empty = figure.cells(Vec::new());
        assert!(empty.pictures.iter().all(|svg| svg.contains("no rows")));
    }
}
