//! Parameters with their 95 % intervals, each beside the value that the robot file has of it: a line each, scaled to the
//! largest of its numbers, so that kilograms and newton metres stand below each other.

use super::cell::PictureGroup;
use super::colour;
use super::legend::Key;
use super::svg::{LineStroke, SvgPicture, TextAnchor, TextStyle, fitted, width_of};

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct IntervalRow {
    pub name: String,
    /// Value and interval with the unit.
    pub words: String,
    pub value: f64,
    /// Half the 95 % interval.
    pub half: f64,
    /// The value by the masses of the robot file or URDF, or where the search began.
    pub before: Option<f64>,
    /// The value that torques are computed with, where it is another.
    pub in_use: Option<f64>,
}

/// The parameters in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct IntervalFigure {
    pub title: String,
    /// What the other value is.
    pub before: String,
    pub rows: Vec<IntervalRow>,
}

const WIDTH: f64 = 380.0;
/// Room beside the lines \[px\].
const SIDE: f64 = 12.0;
/// Height of a row: its name, then its line \[px\].
const ROW: f64 = 34.0;
/// Rows of one picture: a page sets as many pictures beside each other as it has room for.
const ROWS: usize = 10;
const SIZE: f64 = 11.0;

impl IntervalFigure {
    /// Pictures of a few parameters each.
    pub fn cells(&self) -> PictureGroup {
        let interval = Key::Dot(colour::BLUE);
        let mut key = vec![(interval, "fitted, 95 % interval")];
        if self.rows.iter().any(|row| row.before.is_some()) {
            key.push((Key::Spot(colour::VERMILLION), &*self.before));
        }
        if self.rows.iter().any(|row| row.in_use.is_some()) {
            key.push((Key::Spot(colour::SKY), "physically consistent, in use"));
        }
        let pictures = self.rows.chunks(ROWS).map(|rows| self.picture(rows));
        let mut cells = PictureGroup::new(&self.title, &key, pictures);
        cells.apart = true;
        cells
    }

    fn picture(&self, rows: &[IntervalRow]) -> String {
        let height = ROW * rows.len() as f64 + 6.0;
        let words: Vec<String> = rows
            .iter()
            .map(|row| format!("{} {}", row.name, row.words))
            .collect();
        let mut svg = SvgPicture::new(WIDTH, height, &self.title, &words.join("; "));
        let middle = 0.5 * WIDTH;
        let zero = LineStroke::solid(colour::ZERO, 1.0);
        svg.line([middle, 0.0], [middle, height], zero);
        for (k, row) in rows.iter().enumerate() {
            row.draw(&mut svg, ROW * k as f64);
        }
        svg.finish()
    }
}

impl IntervalRow {
    fn draw(&self, svg: &mut SvgPicture, top: f64) {
        let room = WIDTH - 2.0 * SIDE;
        let number = width_of(&self.words, SIZE);
        let name = fitted(&self.name, SIZE, room - number - SIDE);
        svg.rect([0.0, top + 2.0, WIDTH, 14.0], colour::PAPER, None);
        svg.text(
            [SIDE, top + 13.0],
            &name,
            TextStyle::new(SIZE, TextAnchor::Start).bold(),
        );
        let at_right = TextStyle::new(SIZE, TextAnchor::End);
        svg.text([WIDTH - SIDE, top + 13.0], &self.words, at_right);
        let ends = [self.value - self.half, self.value + self.half];
        let others = self.before.into_iter().chain(self.in_use);
        let all = ends.into_iter().chain(others).filter(|x| x.is_finite());
        let most = all.fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
        let x = |value: f64| SIDE + 0.5 * room * (1.0 + (value / most).clamp(-1.0, 1.0));
        let level = top + 24.0;
        let axis = LineStroke::solid(colour::GRID, 1.0);
        svg.line([SIDE, level], [WIDTH - SIDE, level], axis);
        let bar = LineStroke::solid(colour::BLUE, 2.0);
        svg.line([x(ends[0]), level], [x(ends[1]), level], bar);
        for end in ends {
            svg.line([x(end), level - 4.0], [x(end), level + 4.0], bar);
        }
        svg.dot([x(self.value), level], 3.4, colour::BLUE);
        if let Some(value) = self.in_use {
            let ring = LineStroke::solid(colour::INK, 0.8);
            svg.ringed([x(value), level], 2.6, colour::SKY, ring);
        }
        if let Some(value) = self.before {
            svg.dot([x(value), level], 3.4, colour::VERMILLION);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(count: usize) -> IntervalFigure {
        let row = |k: usize| IntervalRow {
            name: format!("mx{k} + 0.088 m7"),
            words: "1.2 \u{b1} 0.1 kg m".into(),
            value: 1.2,
            half: 0.2,
            before: Some(-2.4),
            in_use: None,
        };
        IntervalFigure {
            title: "parameters".into(),
            before: "by the URDF".into(),
            rows: (0..count).map(row).collect(),
        }
    }

    #[test]
    fn names_and_numbers_are_whole_and_a_page_gets_pictures_of_ten() {
        let cells = figure(12).cells();
        assert_eq!(cells.pictures.len(), 2);
        assert!(cells.pictures[1].contains("mx11 + 0.088 m7<"));
        assert!(cells.pictures[0].contains("1.2 \u{b1} 0.1 kg m<"));
        assert_eq!(cells.key.len(), 2);
    }

    #[test]
    fn a_value_below_zero_stands_at_the_left_of_the_middle() {
        let svg = &figure(1).cells().pictures[0];
        // the larger number is at the end of its line
        assert!(svg.contains(&format!("cx=\"{SIDE}\"")), "{svg}");
        // half of it is half the way from the middle
        let at = 0.5 * WIDTH + 0.25 * (WIDTH - 2.0 * SIDE);
        assert!(svg.contains(&format!("cx=\"{at}\"")), "{svg}");
    }
}
