//! Rest at both ends: the series' own clock runs up before the whole periods and down behind them.
//!
//! The path in space is that of the period, so that the blend leaves no position limit; speeds are
//! at most those of the period. Accelerations have the clock's own in them: a blend must be long
//! enough, and begin where that costs least.

pub use crate::simulate::reference::TimeScaling;

use super::series::{Kinematics, Series};

impl TimeScaling {
    /// Duration of the whole motion \[s\]; of the first blend and period where it does not end.
    pub fn duration(&self, period: f64) -> f64 {
        self.end(period).unwrap_or(self.seconds + period)
    }

    /// All coordinates at the time t of the motion \[s\], at rest before and behind it.
    pub fn at(&self, series: &Series, t: f64) -> Kinematics {
        let [clock, rate, rise] = self.clock(series.period(), t);
        let mut k = series.at(clock);
        for i in 0..series.coordinates() {
            k.xdd[i] = rate * rate * k.xdd[i] + rise * k.xd[i];
            k.xd[i] *= rate;
        }
        k
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn motions_begin_and_end_at_rest_and_are_smooth_all_along() {
        let series = Series {
            fundamental: TAU * 0.4,
            offset: vec![0.1],
            a: vec![vec![0.2, -0.1]],
            b: vec![vec![-0.3, 0.1]],
        };
        let blend = TimeScaling {
            start: 0.7,
            seconds: 1.5,
            periods: Some(2),
        };
        let end = blend.duration(series.period());
        assert!((end - 8.0).abs() < 1e-12);
        for t in [0.0, end, -1.0, end + 3.0] {
            let k = blend.at(&series, t);
            assert_eq!((k.xd[0], k.xdd[0]), (0.0, 0.0), "at {t} s");
        }
        let h = 1e-5;
        for m in 1..800 {
            let t = 0.01 * f64::from(m);
            let [before, here, after] = [t - h, t, t + h].map(|t| blend.at(&series, t));
            let speed = (after.x[0] - before.x[0]) / (2.0 * h);
            let acceleration = (after.xd[0] - before.xd[0]) / (2.0 * h);
            assert!((speed - here.xd[0]).abs() < 1e-8, "at {t} s");
            assert!((acceleration - here.xdd[0]).abs() < 1e-4, "at {t} s");
        }
    }
}
