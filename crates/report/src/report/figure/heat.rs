//! Correlations of parameters as a triangle of shaded cells.

use super::colour;
use super::svg::{LineStroke, SvgPicture, TextAnchor, TextStyle, width_of};

/// Parameters and how their errors go together.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatFigure {
    pub title: String,
    pub names: Vec<String>,
    /// Correlation of two parameters, row by row; of the triangle below the diagonal what counts.
    pub values: Vec<Vec<f64>>,
}

/// Width of the cells together, and of one at most \[px\].
const CELLS: f64 = 480.0;
const CELL: f64 = 22.0;
const TOP: f64 = 52.0;
/// Shades of a correlation: so many on each side of none, and the least that is drawn.
const SHADES: f64 = 8.0;

impl HeatFigure {
    /// The figure as an SVG document; nothing of fewer than two parameters.
    pub fn svg(&self) -> String {
        let n = self.names.len();
        let cell = (CELLS / n.max(1) as f64).min(CELL);
        let size = (cell - 1.0).clamp(4.0, 11.0);
        let widest = self.names.iter().map(|name| width_of(name, size));
        let left = widest.fold(20.0, f64::max) + 12.0;
        let side = cell * n as f64;
        // the name of the last column reads along the diagonal
        let (width, height) = (left + side + left, TOP + side + 10.0);
        let mut svg = SvgPicture::new(width, height, &self.title, &self.strongest());
        let heading = TextStyle::new(14.0, TextAnchor::Start).bold();
        svg.text([12.0, 20.0], &self.title, heading);
        self.key(&mut svg);
        for (row, name) in self.names.iter().enumerate() {
            let y = TOP + cell * row as f64;
            let middle = y + 0.5 * cell + 0.36 * size;
            svg.text(
                [left - 6.0, middle],
                name,
                TextStyle::new(size, TextAnchor::End),
            );
            for (column, value) in self.values[row].iter().take(row).enumerate() {
                let x = left + cell * column as f64;
                shade(&mut svg, [x, y, cell], *value);
            }
            // names of the columns stand on the diagonal
            let at = [left + cell * row as f64 + 3.0, middle];
            svg.text(at, name, TextStyle::new(size, TextAnchor::Start).muted());
        }
        let frame = LineStroke::solid(colour::FRAME, 0.8);
        svg.line([left, TOP], [left, TOP + side], frame);
        svg.line([left, TOP + side], [left + side, TOP + side], frame);
        svg.finish()
    }

    fn key(&self, svg: &mut SvgPicture) {
        let steps = [-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0];
        for (k, value) in steps.into_iter().enumerate() {
            shade(svg, [44.0 + 16.0 * k as f64, 28.0, 16.0], value);
        }
        let style = TextStyle::new(10.5, TextAnchor::Start).muted();
        svg.text([12.0, 40.0], "\u{2212}1", style);
        svg.text([44.0 + 16.0 * 8.0 + 6.0, 40.0], "+1", style);
    }

    /// The strongest correlation in words.
    fn strongest(&self) -> String {
        let pairs = (0..self.names.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let strongest = pairs.max_by(|a, b| {
            let size = |(i, j): (usize, usize)| self.values[i][j].abs();
            size(*a).total_cmp(&size(*b))
        });
        strongest.map_or(String::new(), |(i, j)| {
            format!(
                "Strongest: {} and {}, {:+.2}",
                self.names[j], self.names[i], self.values[i][j]
            )
        })
    }
}

/// A cell, darker the stronger the correlation: vermillion above zero, blue below.
fn shade(svg: &mut SvgPicture, [x, y, cell]: [f64; 3], value: f64) {
    let share = (SHADES * value.abs().min(1.0)).round() / SHADES;
    if share > 0.0 {
        let fill = match value > 0.0 {
            true => colour::VERMILLION,
            false => colour::BLUE,
        };
        let outline = [[x, y], [x + cell, y], [x + cell, y + cell], [x, y + cell]];
        svg.area(&outline, fill, share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strongest_pair_is_dark_and_named_and_a_weak_one_is_not_drawn() {
        let figure = HeatFigure {
            title: "correlation".into(),
            names: ["m1", "m2", "viscous of q1"].map(str::to_owned).to_vec(),
            values: vec![
                vec![1.0, -0.97, 0.01],
                vec![-0.97, 1.0, 0.4],
                vec![0.01, 0.4, 1.0],
            ],
        };
        let svg = figure.svg();
        assert!(svg.contains("Strongest: m1 and m2, -0.97"));
        assert_eq!(svg.matches("viscous of q1<").count(), 2);
        let cells = |svg: &str| svg.matches("fill-opacity").count();
        // eight of the key, and two of three pairs
        assert_eq!(cells(&svg), 10);
    }
}
