//! Samples of a log that is faster than its motion: every so many of them are enough.
//!
//! Positions come out of their filter with nothing above its cut-off, and so do speeds, accelerations, and what is
//! computed smoothly from them: ten samples a period of that cut-off hold them. Torques hold noise up to half of the
//! sampling rate, which would be folded into the band; they come through
//!
//! ```text
//! h = (box of m samples)^4 * (-c, 1 + 2 c, -c), m samples apart, c = (1 - 1/m^2)/6
//! ```
//!
//! whose zeros lie where frequencies are folded onto zero, and whose gain differs from 1 in the fourth order alone.

/// Samples a period of the highest position cut-off that stay. Half: accelerations are off by some thousandths; twice:
/// no log is thinned below 10 kHz.
const SAMPLES_A_PERIOD: f64 = 10.0;

/// Every how many samples of step `dt` \[s\] are enough beside position cut-offs up to `highest_hz`; a divisor of
/// `decimation`, so that the rows stay those of the log.
pub(super) fn factor(thin: bool, highest_hz: f64, decimation: usize, dt: f64) -> usize {
    let enough = |m: &usize| SAMPLES_A_PERIOD * highest_hz * dt * *m as f64 <= 1.0 + 1e-9;
    let divides = |m: &usize| decimation.is_multiple_of(*m);
    match thin {
        true => (2..=decimation)
            .rev()
            .filter(divides)
            .find(enough)
            .unwrap_or(1),
        false => 1,
    }
}

/// The weights by which a torque is taken at every m-th sample.
#[derive(Debug, Clone)]
pub(super) struct TorqueThinner {
    /// Weights of a sample and of so many to each side.
    weights: Vec<f64>,
}

impl TorqueThinner {
    pub fn new(m: usize) -> Self {
        let box_of = vec![1.0 / m as f64; m];
        let mut weights = vec![1.0];
        for _ in 0..4 {
            weights = convolved(&weights, &box_of);
        }
        let c = (1.0 - 1.0 / (m * m) as f64) / 6.0;
        let mut level = vec![0.0; 2 * m + 1];
        (level[0], level[m], level[2 * m]) = (-c, 1.0 + 2.0 * c, -c);
        Self {
            weights: convolved(&weights, &level),
        }
    }

    /// Torques of all joints at sample k of rows of so many joints; beyond an end its last row stands.
    pub fn at(&self, tau: &[f64], joints: usize, k: isize, out: &mut [f64]) {
        let last = (tau.len() / joints) as isize - 1;
        let reach = (self.weights.len() / 2) as isize;
        out.fill(0.0);
        for (i, weight) in self.weights.iter().enumerate() {
            let from = (k + i as isize - reach).clamp(0, last) as usize * joints;
            for (out, tau) in out.iter_mut().zip(&tau[from..from + joints]) {
                *out += weight * tau;
            }
        }
    }
}

fn convolved(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        for (out, b) in out[i..].iter_mut().zip(b) {
            *out += a * b;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gain at a frequency, in cycles a sample.
    fn gain(of: &TorqueThinner, frequency: f64) -> f64 {
        let middle = (of.weights.len() / 2) as f64;
        let wave = |(i, w): (usize, &f64)| {
            w * (std::f64::consts::TAU * frequency * (i as f64 - middle)).cos()
        };
        of.weights.iter().enumerate().map(wave).sum()
    }

    #[test]
    fn torques_keep_what_is_slow_and_lose_what_would_be_folded_onto_it() {
        for m in [2, 3, 5, 8] {
            let thinner = TorqueThinner::new(m);
            assert_eq!(thinner.weights.len() % 2, 1, "{m}");
            let thinned = 1.0 / m as f64;
            assert!((gain(&thinner, 0.0) - 1.0).abs() < 1e-14, "{m}");
            // a fiftieth of the thinned rate is the cut-off of the rows of most logs
            let slow = gain(&thinner, thinned / 50.0) - 1.0;
            assert!(slow.abs() < 2e-5, "{m}: {slow}");
            for k in 1..=m / 2 {
                for side in [-1.0, 1.0] {
                    let folded = gain(&thinner, thinned * (k as f64 + side / 50.0));
                    assert!(folded.abs() < 1e-5, "{m}, {k}: {folded}");
                }
            }
        }
    }

    #[test]
    fn a_log_is_thinned_as_far_as_its_positions_and_its_rows_allow() {
        // 5 kHz, positions up to 100 Hz, every 25th sample a row
        assert_eq!(factor(true, 100.0, 25, 2e-4), 5);
        assert_eq!(factor(true, 101.0, 25, 2e-4), 1);
        assert_eq!(factor(true, 60.0, 24, 2e-4), 8);
        assert_eq!(factor(true, 60.0, 10, 1e-3), 1);
        assert_eq!(factor(false, 100.0, 25, 2e-4), 1);
    }
}
