//! One effect over the signal on which it depends: the residual without it as a cloud, and the torque
//! that it adds.

use super::axis;
use super::colour;
use super::legend::{self, Key};
use super::panel::Panel;
use super::svg::{Anchor, Svg, Type, fitted};

/// A cloud of rows, and what the effect gives at each.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectFigure {
    pub title: String,
    /// The finding in a sentence, for those who do not see the picture.
    pub told: String,
    /// Name and unit of the signal below.
    pub over: (String, String),
    /// Unit of the torque.
    pub unit: String,
    /// Signal, residual without the effect, torque of the effect.
    pub rows: Vec<[f64; 3]>,
}

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 290.0;
const FRAME: [f64; 4] = [66.0, 58.0, 480.0, 186.0];
/// Most rows that are drawn.
const ROWS: usize = 800;

impl EffectFigure {
    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let mut svg = Svg::new(WIDTH, HEIGHT, &self.title, &self.told);
        let title = fitted(&self.title, 14.0, WIDTH - 28.0);
        svg.text([14.0, 22.0], &title, Type::new(14.0, Anchor::Start).bold());
        let keys = [
            (Key::Dot(colour::VERMILLION), "residual without the effect"),
            (Key::Dot(colour::BLUE), "torque of the effect, as fitted"),
        ];
        legend::draw(&mut svg, [14.0, 44.0], &keys);
        let finite = |row: &&[f64; 3]| row.iter().all(|x| x.is_finite());
        let known: Vec<&[f64; 3]> = self.rows.iter().filter(finite).collect();
        let every = known.len().div_ceil(ROWS).max(1);
        let drawn: Vec<&[f64; 3]> = known.into_iter().step_by(every).collect();
        let signals = axis::interval(drawn.iter().map(|row| row[0]), 0.03);
        let torques = axis::interval(drawn.iter().flat_map(|row| [row[1], row[2]]), 0.06);
        let (Some(signals), Some(torques)) = (signals, torques) else {
            Panel::empty(&mut svg, FRAME, "no rows");
            return svg.finish();
        };
        let panel = Panel::new(FRAME, signals, torques, [6, 6]);
        panel.grid(&mut svg);
        svg.clip(FRAME);
        let clouds = [(1, colour::VERMILLION, 1.2), (2, colour::BLUE, 1.7)];
        for (column, fill, radius) in clouds {
            for row in &drawn {
                let at = [panel.x.px(row[0]), panel.y.px(row[column])];
                svg.dot(at, radius, fill);
            }
        }
        svg.end_clip();
        panel.outline(&mut svg);
        panel.x_numbers(&mut svg);
        panel.x_title(&mut svg, &self.over.0, &self.over.1);
        panel.y_title(&mut svg, 46.0, "torque", &self.unit);
        svg.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cloud_and_shape_are_drawn_and_the_finding_is_told() {
        let row = |k: i32| [f64::from(k), f64::from(k % 7), f64::NAN];
        let mut figure = EffectFigure {
            title: "ripple of q1".into(),
            told: "the residual falls from 3 N to 1 N".into(),
            over: ("position".into(), "m".into()),
            unit: "N".into(),
            rows: (0..5000).map(row).collect(),
        };
        assert!(figure.svg().contains("no rows"));
        figure.rows.iter_mut().for_each(|row| row[2] = 0.5 * row[1]);
        let svg = figure.svg();
        assert!(svg.contains("<desc>the residual falls"), "{svg}");
        assert!(svg.matches("<circle").count() <= 2 * ROWS + 2);
        assert!(svg.contains(colour::BLUE) && !svg.contains("NaN"));
    }
}
