//! The clock of a periodic motion: it runs up from standstill, and down to it behind whole periods.

/// Time of the series' own clock over that of the motion.
///
/// While it runs up or down, its rate follows x^3 (10 - 15 x + 6 x^2): the path in space stays that of
/// the period, speeds are those of the period at most, and accelerations are continuous.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeScaling {
    /// Time of the series' clock at which the motion begins \[s\].
    pub start: f64,
    /// Time within which the rate goes from 0 to 1, and back \[s\].
    pub seconds: f64,
    /// Whole periods at full rate; without a number the motion does not end by itself.
    pub periods: Option<u32>,
}

impl TimeScaling {
    /// Duration of the whole motion \[s\].
    pub(crate) fn end(&self, period: f64) -> Option<f64> {
        let end = |whole| 2.0 * self.seconds + f64::from(whole) * period;
        self.periods.map(end)
    }

    /// The series' own time, its rate and the rate's rate \[s, 1, 1/s\] at time t of the motion \[s\].
    pub(crate) fn clock(&self, period: f64, t: f64) -> [f64; 3] {
        if t < self.seconds {
            let [way, rate, rise] = self.ramp(t);
            return [self.start + way, rate, rise];
        }
        let way = t - 0.5 * self.seconds;
        match self.end(period) {
            Some(end) if t > end - self.seconds => {
                let [left, rate, rise] = self.ramp(end - t);
                [self.start + end - self.seconds - left, rate, -rise]
            }
            _ => [self.start + way, 1.0, 0.0],
        }
    }

    /// Way, rate and rise at a time after standstill.
    fn ramp(&self, t: f64) -> [f64; 3] {
        if self.seconds <= 0.0 || t <= 0.0 {
            return [0.0; 3];
        }
        let x = (t / self.seconds).min(1.0);
        let x2 = x * x;
        [
            self.seconds * x2 * x2 * (2.5 - 3.0 * x + x2),
            x2 * x * (10.0 - 15.0 * x + 6.0 * x2),
            30.0 * x2 * (1.0 - x) * (1.0 - x) / self.seconds,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLEND: TimeScaling = TimeScaling {
        start: 0.7,
        seconds: 1.5,
        periods: Some(2),
    };

    #[test]
    fn rates_are_derivatives_and_zero_at_both_ends() {
        assert_eq!(BLEND.end(2.5), Some(8.0));
        for t in [-1.0, 0.0, 8.0, 9.0] {
            assert_eq!(BLEND.clock(2.5, t)[1..], [0.0, 0.0], "at {t} s");
        }
        let h = 1e-5;
        for k in 1..800 {
            let t = 0.01 * f64::from(k);
            let [before, here, after] = [t - h, t, t + h].map(|t| BLEND.clock(2.5, t));
            for d in 0..2 {
                let slope = (after[d] - before[d]) / (2.0 * h);
                assert!((slope - here[d + 1]).abs() < 1e-4, "at {t} s");
            }
        }
    }

    #[test]
    fn whole_periods_run_at_full_rate_and_without_a_number_for_ever() {
        for t in [1.5, 3.0, 6.5] {
            assert_eq!(BLEND.clock(2.5, t), [0.7 + (t - 0.75), 1.0, 0.0]);
        }
        let (periods, seconds) = (None, 0.0);
        let endless = TimeScaling { periods, ..BLEND };
        assert_eq!(endless.clock(2.5, 100.0), [0.7 + 99.25, 1.0, 0.0]);
        let at_once = TimeScaling { seconds, ..BLEND };
        assert_eq!(at_once.clock(2.5, 0.0), [0.7, 1.0, 0.0]);
        assert_eq!(at_once.clock(2.5, 6.0), [0.7 + 5.0, 0.0, 0.0]);
    }
}
