//! One effect over the signal on which it depends: the residual without it as a cloud with the torque that it adds
//! over it, and beside it the residual with it.

use super::axis;
use super::cell::{self, PictureGroup};
use super::colour;
use super::legend::Key;
use super::panel::PlotPanel;

/// A cloud of rows, and the torque of the effect at each.
pub(crate) struct EffectFigure {
    pub title: String,
    /// The finding in a sentence, for those who do not see the picture.
    pub description: String,
    /// Name and unit of the signal below.
    pub over: (String, String),
    /// Name and unit of the quantity at the left.
    pub of: (String, String),
    /// Signal, residual without the effect, torque of the effect.
    pub rows: Vec<[f64; 3]>,
}

/// Most rows that are drawn.
const ROWS: usize = 700;
/// Height of a panel [px].
const HEIGHT: f64 = 180.0;
const WITHOUT: &str = "residual without the effect";
const TORQUE: &str = "torque of the effect, as written";
const WITH: &str = "residual with it";

impl EffectFigure {
    /// Without the effect and with it, on the same axes; `words` stand below.
    pub fn cells(&self, words: Vec<String>) -> PictureGroup {
        let finite = |row: &&[f64; 3]| row.iter().all(|x| x.is_finite());
        let known: Vec<&[f64; 3]> = self.rows.iter().filter(finite).collect();
        let every = known.len().div_ceil(ROWS).max(1);
        let drawn: Vec<&[f64; 3]> = known.into_iter().step_by(every).collect();
        let signals = axis::interval(drawn.iter().map(|row| row[0]), 0.03);
        let left = |row: &[f64; 3]| row[1] - row[2];
        let shown = drawn.iter().flat_map(|row| [row[1], row[2], left(row)]);
        let torques = axis::interval(shown, 0.06);
        let clouds: [&[PointCloud]; 2] = [
            &[
                (&|row| row[1], colour::VERMILLION, 1.3),
                (&|row| row[2], colour::BLUE, 1.8),
            ],
            &[(&left, colour::INK, 1.3)],
        ];
        let picture = |(name, clouds): (&str, &[PointCloud])| {
            let description = format!("{name}. {}", self.description);
            cell::cell(&self.title, &description, HEIGHT, |svg, frame| {
                cell::name(svg, frame, name);
                let (Some(signals), Some(torques)) = (signals, torques) else {
                    PlotPanel::empty(svg, frame, "no rows");
                    return;
                };
                let panel = PlotPanel::new(frame, signals, torques, [5, 6]);
                panel.grid(svg);
                svg.clip(frame);
                for (of, fill, radius) in clouds {
                    for row in &drawn {
                        svg.dot([panel.x.px(row[0]), panel.y.px(of(row))], *radius, fill);
                    }
                }
                svg.end_clip();
                let [below, at_left] = [&self.over, &self.of].map(|(name, unit)| [&**name, unit]);
                panel.axes(svg, 44.0, below, at_left);
            })
        };
        let key = [
            (Key::Spot(colour::VERMILLION), WITHOUT),
            (Key::Spot(colour::BLUE), TORQUE),
            (Key::Spot(colour::INK), WITH),
        ];
        let pictures = ["without it", "with it"].into_iter().zip(clouds);
        PictureGroup {
            words,
            ..PictureGroup::new(&self.title, &key, pictures.map(picture))
        }
    }
}

/// The value of a row that is drawn, in which colour, and how large the dots are [px].
type PointCloud<'a> = (&'a dyn Fn(&[f64; 3]) -> f64, &'static str, f64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cloud_and_shape_are_drawn_beside_the_rest_and_the_finding_is_said() {
        let row = |k: i32| [f64::from(k), f64::from(k % 7), f64::NAN];
        let mut figure = EffectFigure {
            title: "ripple of q1, 2.5 mm pitch".into(),
            description: "the residual falls from 3 N to 1 N".into(),
            over: ("position".into(), "m".into()),
            of: ("torque".into(), "N".into()),
            rows: (0..5000).map(row).collect(),
        };
        assert!(figure.cells(Vec::new()).pictures[0].contains("no rows"));
        figure.rows.iter_mut().for_each(|row| row[2] = 0.5 * row[1]);
        let cells = figure.cells(Vec::new());
        let [without, with] = cells.pictures.as_slice() else {
            panic!("{} pictures", cells.pictures.len())
        };
        assert!(
            without.contains("<desc>without it. the residual falls"),
            "{without}"
        );
        let dots = |svg: &str| svg.matches("<circle").count();
        assert!(dots(with) <= ROWS && dots(with) > ROWS / 2);
        assert_eq!(dots(without), 2 * dots(with));
        assert!(without.contains(colour::BLUE) && !without.contains("NaN"));
    }
}
