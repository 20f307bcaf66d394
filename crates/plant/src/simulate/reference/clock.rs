//! The clock of a periodic motion: it runs up from standstill, and down to it behind whole periods.

/// Time of the series' own clock over that of the motion.
///
/// While it runs up or down, its rate follows x^3 (10 - 15 x + 6 x^2): the path in space stays that of
/// the period, speeds are those of the period at most, and accelerations are continuous.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Where in the series the motion begins, in seconds of the series' own time.
    pub start: f64,
    /// Time within which the rate goes from 0 to 1, and back \[s\].
    pub blend: f64,
    /// Whole periods at full rate; without a number the motion goes on for ever.
    pub periods: Option<u32>,
}

impl Clock {
    /// Duration of the whole motion \[s\].
    pub fn seconds(&self, period: f64) -> Option<f64> {
        self.periods
            .map(|whole| 2.0 * self.blend + f64::from(whole) * period)
    }

    /// The series' own time, its rate and the rate's rate \[s, 1, 1/s\] at time t of the motion \[s\].
    pub fn at(&self, period: f64, t: f64) -> [f64; 3] {
        if t < self.blend {
            let [way, rate, rise] = self.ramp(t);
            return [self.start + way, rate, rise];
        }
        let way = t - 0.5 * self.blend;
        match self.seconds(period) {
            Some(end) if t > end - self.blend => {
                let [left, rate, rise] = self.ramp(end - t);
                [self.start + end - self.blend - left, rate, -rise]
            }
            _ => [self.start + way, 1.0, 0.0],
        }
    }

    /// Way, rate and rise at a time after standstill.
    fn ramp(&self, t: f64) -> [f64; 3] {
        if self.blend <= 0.0 || t <= 0.0 {
            return [0.0; 3];
        }
        let x = (t / self.blend).min(1.0);
        let x2 = x * x;
        [
            self.blend * x2 * x2 * (2.5 - 3.0 * x + x2),
            x2 * x * (10.0 - 15.0 * x + 6.0 * x2),
            30.0 * x2 * (1.0 - x) * (1.0 - x) / self.blend,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOCK: Clock = Clock {
        start: 0.7,
        blend: 1.5,
        periods: Some(2),
    };

    #[test]
    fn rates_are_derivatives_and_zero_at_both_ends() {
        assert_eq!(CLOCK.seconds(2.5), Some(8.0));
        for t in [-1.0, 0.0, 8.0, 9.0] {
            assert_eq!(CLOCK.at(2.5, t)[1..], [0.0, 0.0], "at {t} s");
        }
        let h = 1e-5;
        for k in 1..800 {
            let t = 0.01 * f64::from(k);
            let [before, here, after] = [t - h, t, t + h].map(|t| CLOCK.at(2.5, t));
            for d in 0..2 {
                let slope = (after[d] - before[d]) / (2.0 * h);
                assert!((slope - here[d + 1]).abs() < 1e-4, "at {t} s");
            }
        }
    }

    #[test]
    fn whole_periods_run_at_full_rate_and_without_a_number_for_ever() {
        for t in [1.5, 3.0, 6.5] {
            assert_eq!(CLOCK.at(2.5, t), [0.7 + (t - 0.75), 1.0, 0.0]);
        }
        let endless = Clock {
            periods: None,
            ..CLOCK
        };
        assert_eq!(endless.at(2.5, 100.0), [0.7 + 99.25, 1.0, 0.0]);
        let at_once = Clock {
            blend: 0.0,
            ..CLOCK
        };
        assert_eq!(at_once.at(2.5, 0.0), [0.7, 1.0, 0.0]);
        assert_eq!(at_once.at(2.5, 6.0), [0.7 + 5.0, 0.0, 0.0]);
    }
}
