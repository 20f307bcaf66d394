//! The local-level model: x(k) = x(k-1) + w(k), y(k) = x(k) + e(k), by the Kalman filter.
//!
//! Durbin and Koopman, Time Series Analysis by State Space Methods, 2nd ed. 2012, chapter 2, with the exact
//! diffuse start.

/// Variances of a course: of each estimate, and of the walk before it.
#[derive(Debug, Clone)]
pub(super) struct CourseVariances {
    /// Of e(k); infinite where nothing is known.
    pub estimate: Vec<f64>,
    /// Of w(k); that of the first does not matter.
    pub walk: Vec<f64>,
}

/// Gains and variances of the innovations, which depend on the variances alone.
#[derive(Debug, Clone)]
pub(super) struct InnovationGains {
    steps: Vec<Step>,
}

#[derive(Debug, Clone, Copy)]
enum Step {
    Nothing,
    Start,
    Innovation { gain: f64, std: f64 },
}

impl InnovationGains {
    pub(super) fn new(variances: &CourseVariances) -> Self {
        let mut state: Option<f64> = None;
        let pairs = variances.estimate.iter().zip(&variances.walk);
        let steps = pairs.map(|(r, q)| {
            let before = state.map(|p| p + q);
            match before {
                _ if !r.is_finite() => {
                    state = before;
                    Step::Nothing
                }
                None => {
                    state = Some(*r);
                    Step::Start
                }
                Some(p) => {
                    let f = p + r;
                    state = Some(p * r / f);
                    Step::Innovation {
                        gain: p / f,
                        std: f.sqrt(),
                    }
                }
            }
        });
        InnovationGains {
            steps: steps.collect(),
        }
    }

    /// Innovations of a signal over their deviations, log by log; 0 where there is none. The level is not in them.
    pub(super) fn apply(&self, signal: &[f64]) -> Vec<f64> {
        let (mut level, mut out) = (0.0, Vec::with_capacity(signal.len()));
        for (step, y) in self.steps.iter().zip(signal) {
            match step {
                Step::Nothing => out.push(0.0),
                Step::Start => {
                    level = *y;
                    out.push(0.0);
                }
                Step::Innovation { gain, std } => {
                    let innovation = y - level;
                    level += gain * innovation;
                    out.push(innovation / std);
                }
            }
        }
        out
    }

    /// Whether a log has an innovation.
    pub(super) fn is_informative(&self, log: usize) -> bool {
        matches!(self.steps[log], Step::Innovation { .. })
    }

    /// Sum of the logarithms of the innovations' deviations.
    pub(super) fn log_std(&self) -> f64 {
        let log = |step: &Step| match step {
            Step::Innovation { std, .. } => std.ln(),
            _ => 0.0,
        };
        self.steps.iter().map(log).sum()
    }
}

/// Smoothed level and its variance at every estimate (fixed-interval smoother, as two filters that meet).
pub(super) fn smooth(signal: &[f64], variances: &CourseVariances) -> (Vec<f64>, Vec<f64>) {
    let n = signal.len();
    let forward = filtered(signal, &variances.estimate, &variances.walk);
    let back = |x: &[f64]| x.iter().rev().copied().collect::<Vec<f64>>();
    // backward in time the walk between two estimates stands before the earlier one
    let mut walk = back(&variances.walk);
    walk.rotate_right(1);
    let backward = filtered(&back(signal), &back(&variances.estimate), &walk);
    let (mut level, mut variance) = (vec![0.0; n], vec![0.0; n]);
    for k in 0..n {
        // the estimate at k is in the forward filter alone
        let [_, [x, p]] = forward[k];
        let [[y, s], _] = backward[n - 1 - k];
        let (a, b) = (1.0 / p, 1.0 / s);
        variance[k] = 1.0 / (a + b);
        level[k] = match (a > 0.0, b > 0.0) {
            (true, true) => (a * x + b * y) * variance[k],
            (true, false) => x,
            _ => y,
        };
    }
    (level, variance)
}

/// Level and its variance, without and with each estimate; infinite variance where nothing is known.
fn filtered(signal: &[f64], estimate: &[f64], walk: &[f64]) -> Vec<[[f64; 2]; 2]> {
    let mut state = [0.0, f64::INFINITY];
    let mut out = Vec::with_capacity(signal.len());
    for ((y, r), q) in signal.iter().zip(estimate).zip(walk) {
        let before = [state[0], state[1] + q];
        state = match (before[1].is_finite(), r.is_finite()) {
            (_, false) => before,
            (false, true) => [*y, *r],
            (true, true) => {
                let f = before[1] + r;
                let level = before[0] + before[1] / f * (y - before[0]);
                [level, before[1] * r / f]
            }
        };
        out.push([before, state]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn variances() -> CourseVariances {
        CourseVariances {
            estimate: vec![1.0, 0.5, f64::INFINITY, 2.0, 0.7],
            walk: vec![0.0, 0.3, 0.2, 0.4, 0.0],
        }
    }

    const SIGNAL: [f64; 5] = [1.0, 2.5, 0.0, 2.0, 4.0];

    /// Inverse covariance of the estimates that say something, by the walk that two have in common, and these estimates.
    fn dense(walked: impl Fn(usize, usize) -> f64) -> (DMatrix<f64>, DVector<f64>) {
        let (estimate, known) = (variances().estimate, [0, 1, 3, 4]);
        let covariance = DMatrix::from_fn(4, 4, |a, b| {
            let (i, j) = (known[a], known[b]);
            walked(i, j) + if a == b { estimate[i] } else { 0.0 }
        });
        let inverse = covariance.try_inverse().unwrap();
        (inverse, DVector::from_fn(4, |a, _| SIGNAL[known[a]]))
    }

    #[test]
    fn whitened_innovations_have_the_square_of_generalised_least_squares() {
        // about an unknown level at the first place
        let v = variances();
        let (inverse, y) = dense(|i, j| v.walk[1..=i.min(j)].iter().sum());
        let one = DVector::from_element(4, 1.0);
        let level = (one.dot(&(&inverse * &y))) / one.dot(&(&inverse * &one));
        let e = &y - &one * level;
        let square = e.dot(&(&inverse * &e));
        let whitener = InnovationGains::new(&variances());
        let white = whitener.apply(&SIGNAL);
        let found: f64 = white.iter().map(|x| x * x).sum();
        assert!((found / square - 1.0).abs() < 1e-12, "{found} {square}");
        let shown: Vec<usize> = (0..5).filter(|k| whitener.is_informative(*k)).collect();
        assert_eq!(shown, [1, 3, 4]);
        assert!((0..5).all(|k| shown.contains(&k) || white[k] == 0.0));
    }

    #[test]
    fn the_smoothed_level_is_that_of_generalised_least_squares() {
        // the level at the last place: walks counted back from there
        let (level, variance) = smooth(&SIGNAL, &variances());
        let v = variances();
        let (inverse, y) = dense(|i, j| v.walk[i.max(j) + 1..].iter().sum());
        let one = DVector::from_element(4, 1.0);
        let certainty = one.dot(&(&inverse * &one));
        assert!((variance[4] * certainty - 1.0).abs() < 1e-12);
        assert!((level[4] - one.dot(&(&inverse * &y)) / certainty).abs() < 1e-12);
        assert!(variance[2] > variance[1], "{variance:?}");
    }
}
