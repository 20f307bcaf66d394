//! A velocity channel against the derivative of its position.

use super::windows::Window;

/// Rows by which the velocity may lag or lead.
const FARTHEST: usize = 50;

/// How a logged velocity follows the derivative of its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct VelocityMatch {
    /// Rows by which it is late; negative where it is early.
    pub(crate) rows: f64,
    /// Correlation with the derivative at that lag, and without a lag.
    pub(crate) best: f64,
    pub(crate) now: f64,
    /// How many times the derivative it is at that lag.
    pub(crate) times: f64,
}

/// Sums over the rows at one lag.
#[derive(Debug, Clone, Copy, Default)]
struct LagSums {
    n: f64,
    v: f64,
    d: f64,
    vv: f64,
    dd: f64,
    vd: f64,
}

impl LagSums {
    /// Slope of the velocity over the derivative.
    fn times(&self) -> f64 {
        (self.vd - self.v * self.d / self.n) / (self.dd - self.d * self.d / self.n)
    }

    fn correlation(&self) -> f64 {
        let spread = (self.vv - self.v * self.v / self.n) * (self.dd - self.d * self.d / self.n);
        (self.vd - self.v * self.d / self.n) / spread.sqrt()
    }
}

/// Finds the lag at which a velocity resembles the derivative of a position most; `None` where they move too little.
pub(crate) fn follows(
    windows: &[Window],
    position: usize,
    velocity: usize,
) -> Option<VelocityMatch> {
    let mut sums = [LagSums::default(); 2 * FARTHEST + 1];
    let mut derivative = Vec::new();
    for window in windows {
        let (q, v) = (&window.columns[position], &window.columns[velocity]);
        derivative.clear();
        // Row k of it belongs to row k + 1 of the window.
        let triples = q.windows(3).zip(window.t.windows(3));
        derivative.extend(triples.map(|(q, t)| (q[2] - q[0]) / (t[2] - t[0])));
        let usable = FARTHEST + 1..derivative.len().saturating_sub(FARTHEST);
        for (lag, sums) in sums.iter_mut().enumerate() {
            for k in usable.clone() {
                // lag 0 is the earliest velocity: it resembles the derivative FARTHEST rows later
                let (v, d) = (v[k], derivative[k - 1 + FARTHEST - lag]);
                sums.n += 1.0;
                sums.v += v;
                sums.d += d;
                sums.vv += v * v;
                sums.dd += d * d;
                sums.vd += v * d;
            }
        }
    }
    let correlations = sums.map(|sums| sums.correlation());
    let now = correlations[FARTHEST];
    if !(now.is_finite() && sums[FARTHEST].n > 200.0) {
        return None;
    }
    let finite = correlations.iter().enumerate();
    let finite = finite.filter(|(_, c)| c.is_finite());
    let (peak, _) = finite.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let mut rows = peak as f64 - FARTHEST as f64;
    let about = peak.checked_sub(1).and_then(|k| correlations.get(k..k + 3));
    if let Some([before, top, after]) = about {
        // The parabola through the three highest has its top between them.
        let bend = before - 2.0 * top + after;
        if bend.abs() > 1e-15 {
            rows += (0.5 * (before - after) / bend).clamp(-0.5, 0.5);
        }
    }
    Some(VelocityMatch {
        rows,
        best: correlations[peak],
        now,
        times: sums[peak].times(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(velocity: impl Fn(f64) -> f64) -> Vec<Window> {
        let t: Vec<f64> = (0..4000).map(|k| f64::from(k) * 0.001).collect();
        let position = |t: &f64| (5.0 * t).sin() + 0.2 * (17.0 * t).cos();
        let q = t.iter().map(position).collect();
        let v = t.iter().map(|t| velocity(*t)).collect();
        let columns = vec![q, v];
        vec![Window { t, columns }]
    }

    fn speed(t: f64) -> f64 {
        5.0 * (5.0 * t).cos() - 3.4 * (17.0 * t).sin()
    }

    #[test]
    fn a_late_velocity_is_found_with_its_delay_and_a_true_one_has_none() {
        for (delay, sign) in [(0.0, 1.0), (0.0123, 1.0), (-0.004, 1.0), (0.008, -1.0)] {
            let log = window(|t| sign * speed(t - delay));
            let found = follows(&log, 0, 1).unwrap();
            assert!((found.rows * 0.001 - delay).abs() < 2e-4, "{found:?}");
            assert!(sign * found.best > 0.9999, "{found:?}");
            assert!((sign * found.times - 1.0).abs() < 0.01, "{found:?}");
        }
    }

    #[test]
    fn at_rest_nothing_is_said() {
        assert_eq!(follows(&window(|_| 0.0), 0, 1), None);
    }
}
