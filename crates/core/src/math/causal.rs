//! A section cascade run forward alone, sample by sample, over several channels.

use super::sos::{Section, SosFilter, steady};

/// A causal filter of some channels with their states; each starts in the steady state of its first value.
#[derive(Debug, Clone)]
pub struct CausalSections {
    sections: Vec<Section>,
    channels: usize,
    /// State of each section after a long constant input of 1 to the cascade.
    steady: Vec<[f64; 2]>,
    /// Of each channel, section by section.
    states: Vec<[f64; 2]>,
    fresh: bool,
}

impl CausalSections {
    /// The same filter for `channels` channels; none lets them through as they are.
    pub fn new(sos: Option<&SosFilter>, channels: usize) -> Self {
        let sections = sos.map_or(Vec::new(), |sos| sos.sections().to_vec());
        let steady = steady(&sections);
        Self {
            states: vec![[0.0; 2]; sections.len() * channels],
            sections,
            channels,
            steady,
            fresh: true,
        }
    }

    /// Forgets what went before.
    pub fn reset(&mut self) {
        self.fresh = true;
    }

    /// Filters one sample of every channel in place.
    pub fn step(&mut self, x: &mut [f64]) {
        debug_assert_eq!(x.len(), self.channels);
        let k = self.sections.len();
        if std::mem::take(&mut self.fresh) {
            for (c, x) in x.iter().enumerate() {
                let states = self.states[c * k..(c + 1) * k].iter_mut();
                for (state, steady) in states.zip(&self.steady) {
                    *state = steady.map(|s| s * x);
                }
            }
        }
        for (c, x) in x.iter_mut().enumerate() {
            let states = self.states[c * k..(c + 1) * k].iter_mut();
            for (section, state) in self.sections.iter().zip(states) {
                // transposed direct form II
                let y = section.b[0] * *x + state[0];
                state[0] = section.b[1] * *x - section.a[0] * y + state[1];
                state[1] = section.b[2] * *x - section.a[1] * y;
                *x = y;
            }
        }
    }
}

/// Time by which slow signals leave a cascade late, in samples: its group delay at zero frequency.
pub fn delay_samples(sos: &SosFilter) -> f64 {
    // -d arg H / dw at 0 of B/A: (sum k b_k)/(sum b_k) - (sum k a_k)/(sum a_k)
    let of = |[x0, x1, x2]: [f64; 3]| (x1 + 2.0 * x2) / (x0 + x1 + x2);
    let sections = sos.sections().iter();
    sections.map(|s| of(s.b) - of([1.0, s.a[0], s.a[1]])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_comes_out_late_by_the_group_delay_and_a_constant_as_it_is() {
        let sos = SosFilter::butterworth(4, 20.0, 1000.0).unwrap();
        let late = delay_samples(&sos);
        // order 4: 2.613 / (2 pi 20 Hz)
        assert!(
            (late - 2.6131 / (std::f64::consts::TAU * 0.02)).abs() < 0.1,
            "{late}"
        );
        let mut filter = CausalSections::new(Some(&sos), 2);
        let mut x = [0.0; 2];
        for k in 0..2000 {
            x = [3.0, 0.5 * f64::from(k)];
            filter.step(&mut x);
        }
        assert!((x[0] - 3.0).abs() < 1e-12);
        assert!((x[1] - 0.5 * (1999.0 - late)).abs() < 1e-9, "{}", x[1]);
    }
}
