//! Where a shape may go, and what its ends mean: at most ends another law begins, or the effect is gone.

/// Values of a shape parameter on some data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeSpan {
    pub least: f64,
    pub most: f64,
    /// Whether the torque beyond the least, and beyond the most, is as good as that at it: a shape there is a bound
    /// that these data do not tell from what lies beyond, and the effect stands. Elsewhere a shape at its end is no
    /// finding: what the data show is the law that begins there, or nothing.
    pub open: [bool; 2],
    /// The value that physics gives it: it is held there where these data would have it at an end.
    pub physics: Option<f64>,
}

impl ShapeSpan {
    /// From least to most, another law beyond both.
    pub const fn of(least: f64, most: f64) -> Self {
        Self {
            least,
            most,
            open: [false; 2],
            physics: None,
        }
    }

    /// The range below which the torque hardly changes.
    pub const fn open_below(self) -> Self {
        Self {
            open: [true, self.open[1]],
            ..self
        }
    }

    /// The range above which the torque hardly changes.
    pub const fn open_above(self) -> Self {
        Self {
            open: [self.open[0], true],
            ..self
        }
    }

    /// The range of a shape that physics gives this value.
    pub const fn by_physics(self, value: f64) -> Self {
        Self {
            physics: Some(value),
            ..self
        }
    }

    /// The range within other limits; where these are narrower, the end is theirs, and another law's.
    pub fn within(self, least: f64, most: f64) -> Self {
        Self {
            least: self.least.max(least),
            most: self.most.min(most),
            open: [
                self.open[0] && self.least >= least,
                self.open[1] && self.most <= most,
            ],
            physics: self.physics.filter(|x| (least..=most).contains(x)),
        }
    }

    /// Whether a value stands at the lower end, and at the upper one.
    pub fn stands_at(&self, value: f64) -> [bool; 2] {
        let near = NEAR * value.abs();
        [value <= self.least + near, value >= self.most - near]
    }

    /// The end, of those beyond which another law begins, at which a value stands.
    pub fn end_at(&self, value: f64) -> Option<f64> {
        let [below, above] = self.stands_at(value);
        match (!self.open[0] && below, !self.open[1] && above) {
            (true, _) => Some(self.least),
            (_, true) => Some(self.most),
            _ => None,
        }
    }
}

/// Part of a value within which it is at an end: rounding of steps that stop there.
const NEAR: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_at_an_end_that_is_open_is_no_edge() {
        let range = ShapeSpan::of(0.3, 3.0);
        assert_eq!(range.end_at(0.3), Some(0.3));
        assert_eq!(range.end_at(3.0), Some(3.0));
        assert_eq!(range.end_at(2.9), None);
        let open = range.open_above();
        assert_eq!([open.end_at(3.0), open.end_at(0.3)], [None, Some(0.3)]);
        // a narrower limit is an end again
        let narrow = open.within(0.1, 2.0);
        assert_eq!(narrow.end_at(2.0), Some(2.0));
        assert_eq!(narrow.least, 0.3);
    }
}
