//! Temperatures of a log beside its positions: read by themselves, for they may come in messages and at a rate of their
//! own, and between their rows by straight lines.

use super::layout::Layout;
use super::pass::LogPass;
use super::rows::RowStrictness;
use super::time::Instant;
use super::{Block, LogError, LogSpec, Span};

/// Courses of the temperatures of joints, as they were logged.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointTemperatures {
    /// Joint, times \[s\] and temperatures \[degC\], the times in order.
    courses: Vec<(usize, LoggedTemperature)>,
}

/// A logged temperature over time: instants \[s\] and values \[degC\].
#[derive(Debug, Clone, Default, PartialEq)]
struct LoggedTemperature {
    t: Vec<f64>,
    value: Vec<f64>,
}

impl JointTemperatures {
    /// Reads those that a layout names, of these joints in this order; their times count from `origin`, as those of
    /// the log's blocks do. Rows of the whole file are read, whatever its span.
    ///
    /// # Errors
    /// A log that lacks a column or topic of the layout, or a temperature that is no number.
    pub fn read(
        spec: &LogSpec,
        (joints, layout): (&[usize], &Layout),
        origin: Instant,
    ) -> Result<Self, LogError> {
        let whole = LogSpec {
            span: Span::Whole,
            ..spec.clone()
        };
        let mut pass = LogPass::open(&whole, layout, RowStrictness::Refuse, &|| false)?;
        let mut courses = vec![LoggedTemperature::default(); joints.len()];
        let mut row = Block::default();
        while let Some(t) = pass.next()? {
            row.clear();
            row.t.push(t);
            pass.rows.append(&mut row)?;
            let t = t + pass.origin().since(origin);
            for (course, value) in courses.iter_mut().zip(&row.q) {
                course.push(t, *value);
            }
        }
        Ok(Self {
            courses: joints.iter().copied().zip(courses).collect(),
        })
    }

    pub(super) fn of_columns<'a>(
        t: &[f64],
        columns: impl Iterator<Item = (usize, &'a [f64])>,
    ) -> Self {
        let course = |values: &[f64]| {
            let mut course = LoggedTemperature::default();
            t.iter().zip(values).for_each(|(t, x)| course.push(*t, *x));
            course
        };
        Self {
            courses: columns.map(|(j, values)| (j, course(values))).collect(),
        }
    }

    /// The temperature of joint `joint` at time `t` \[s\]: on a straight line between two rows, that of the nearest row
    /// before the first and behind the last; none where it is not known.
    pub fn at(&self, joint: usize, t: f64) -> Option<f64> {
        let of = |(j, course): &(usize, LoggedTemperature)| (*j == joint).then(|| course.at(t));
        self.courses.iter().find_map(of).flatten()
    }

    /// Those of `n` joints at these times, `[joint][time]`; of a joint without one nothing.
    pub fn along(&self, t: &[f64], n: usize) -> Vec<Vec<f64>> {
        let of = |j: usize| t.iter().map_while(|t| self.at(j, *t)).collect();
        match self.courses.is_empty() {
            true => Vec::new(),
            false => (0..n).map(of).collect(),
        }
    }
}

impl LoggedTemperature {
    /// Takes a row that is later than the one before; of rows of one value the first and the last are kept.
    fn push(&mut self, t: f64, value: f64) {
        if self.t.last().is_some_and(|last| t <= *last) {
            return;
        }
        let n = self.value.len();
        if n > 1 && self.value[n - 1] == value && self.value[n - 2] == value {
            self.t[n - 1] = t;
            return;
        }
        self.t.push(t);
        self.value.push(value);
    }

    fn at(&self, t: f64) -> Option<f64> {
        let after = self.t.partition_point(|x| *x < t);
        let (Some(before), Some(to)) = (after.checked_sub(1), self.t.get(after)) else {
            let nearest = after.min(self.value.len().saturating_sub(1));
            return self.value.get(nearest).copied();
        };
        let share = (t - self.t[before]) / (to - self.t[before]);
        Some(self.value[before] + share * (self.value[after] - self.value[before]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_rows_a_temperature_lies_on_a_line_and_beyond_them_it_stays() {
        let t = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let warm = [20.0, 20.0, 20.0, 20.0, 22.0, 21.0];
        let all = JointTemperatures::of_columns(&t, [(1, &warm[..])].into_iter());
        assert_eq!(all.courses[0].1.t, [0.0, 3.0, 4.0, 5.0]);
        for (t, wanted) in [
            (-1.0, 20.0),
            (0.0, 20.0),
            (2.5, 20.0),
            (3.25, 20.5),
            (4.0, 22.0),
            (4.5, 21.5),
            (9.0, 21.0),
        ] {
            assert_eq!(all.at(1, t), Some(wanted), "{t}");
            assert_eq!(all.at(0, t), None);
        }
        assert_eq!(all.along(&[3.5, 6.0], 2), [vec![], vec![21.0, 21.0]]);
        assert!(JointTemperatures::default().along(&t, 2).is_empty());
    }
}
