//! Low-pass filters as cascades of second-order sections.
//!
//! Analogue prototype (Butterworth, Chebyshev type I), pre-warped bilinear transform (Oppenheim
//! and Schafer 2010, section 7.2). Every section has unit gain at zero frequency except that the
//! first carries the gain of an even Chebyshev filter, `10^(-ripple/20)`.

use std::f64::consts::PI;

use super::MathError;

/// One section `(b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Numerator b0, b1, b2.
    pub b: [f64; 3],
    /// Denominator a1, a2.
    pub a: [f64; 2],
}

impl Section {
    /// Gain at zero frequency.
    fn dc_gain(&self) -> f64 {
        (self.b[0] + self.b[1] + self.b[2]) / (1.0 + self.a[0] + self.a[1])
    }

    /// State of the transposed direct form after a long constant input of 1.
    fn steady_state(&self) -> [f64; 2] {
        let y = self.dc_gain();
        let s2 = self.b[2] - self.a[1] * y;
        [self.b[1] - self.a[0] * y + s2, s2]
    }

    /// Largest modulus of a pole.
    fn pole_radius(&self) -> f64 {
        let [a1, a2] = self.a;
        let discriminant = a1 * a1 / 4.0 - a2;
        if discriminant < 0.0 {
            a2.sqrt()
        } else {
            a1.abs() / 2.0 + discriminant.sqrt()
        }
    }
}

/// State of each section of a cascade after a long constant input of 1 to it.
pub fn steady(sections: &[Section]) -> Vec<[f64; 2]> {
    let mut gain = 1.0;
    let of = |section: &Section| {
        let state = section.steady_state().map(|s| s * gain);
        gain *= section.dc_gain();
        state
    };
    sections.iter().map(of).collect()
}

/// A filter as second-order sections, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct SosFilter {
    sections: Vec<Section>,
}

impl SosFilter {
    /// Butterworth low-pass of `order` 1..=16; gain `1/sqrt 2` at `cutoff_hz` (Hz), sampled at
    /// `rate_hz` (Hz).
    ///
    /// # Errors
    /// [`MathError::FilterOrder`], [`MathError::Cutoff`].
    pub fn butterworth(order: usize, cutoff_hz: f64, rate_hz: f64) -> Result<Self, MathError> {
        let warped = prewarp(order, cutoff_hz, rate_hz)?;
        Ok(Self::from_prototype(order, warped, [1.0, 1.0], 1.0))
    }

    /// Chebyshev low-pass of type I: the pass band up to `cutoff_hz` (Hz) ripples by `ripple_db`
    /// (dB) below 1; sampled at `rate_hz` (Hz), `order` 1..=16.
    ///
    /// # Errors
    /// [`MathError::FilterOrder`], [`MathError::Cutoff`], [`MathError::Ripple`].
    pub fn chebyshev(
        order: usize,
        ripple_db: f64,
        cutoff_hz: f64,
        rate_hz: f64,
    ) -> Result<Self, MathError> {
        let warped = prewarp(order, cutoff_hz, rate_hz)?;
        if !(ripple_db > 0.0 && ripple_db.is_finite()) {
            return Err(MathError::Ripple { ripple_db });
        }
        let epsilon = (10f64.powf(ripple_db / 10.0) - 1.0).sqrt();
        let mu = (1.0 / epsilon).asinh() / order as f64;
        let gain = if order.is_multiple_of(2) {
            10f64.powf(-ripple_db / 20.0)
        } else {
            1.0
        };
        Ok(Self::from_prototype(
            order,
            warped,
            [mu.sinh(), mu.cosh()],
            gain,
        ))
    }

    /// The sections, in the order in which they are applied.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Samples by which a zero-phase pass extends the signal at each end: three times the number
    /// of taps, as `scipy.signal.sosfiltfilt` has it.
    pub fn pad_samples(&self) -> usize {
        let zeros = |of: fn(&Section) -> f64| self.sections.iter().filter(|s| of(s) == 0.0).count();
        let taps = 2 * self.sections.len() + 1 - zeros(|s| s.b[2]).min(zeros(|s| s.a[1]));
        3 * taps
    }

    /// Slowest time constant in samples, `-1 / ln |p|` of the pole nearest to the unit circle.
    pub fn time_constant(&self) -> f64 {
        let radius = self
            .sections
            .iter()
            .map(Section::pole_radius)
            .fold(0.0, f64::max);
        if radius > 0.0 {
            -1.0 / radius.ln()
        } else {
            0.0
        }
    }

    /// `factor` slowest time constants, in whole samples (rounded up): what an impulse leaves
    /// behind has then fallen by about `exp(-factor)`.
    pub fn settle_samples(&self, factor: f64) -> usize {
        (factor * self.time_constant()).ceil() as usize
    }

    /// Gain (modulus) at `frequency_hz` (Hz) when sampled at `rate_hz` (Hz); a zero-phase pass has
    /// its square.
    pub fn gain(&self, frequency_hz: f64, rate_hz: f64) -> f64 {
        let w = 2.0 * PI * frequency_hz / rate_hz;
        let modulus = |c: [f64; 3]| {
            let re = c[0] + c[1] * w.cos() + c[2] * (2.0 * w).cos();
            let im = c[1] * w.sin() + c[2] * (2.0 * w).sin();
            re.hypot(im)
        };
        self.sections
            .iter()
            .map(|s| modulus(s.b) / modulus([1.0, s.a[0], s.a[1]]))
            .product()
    }

    /// Bilinear transform of poles on an ellipse (semi-axes real, imaginary), scaled to `warped` = tan(pi f / fs).
    fn from_prototype(order: usize, warped: f64, axes: [f64; 2], gain: f64) -> Self {
        let mut sections: Vec<Section> = (0..order.div_ceil(2))
            .map(|k| {
                let real = 2 * k + 1 == order;
                let angle = PI * (2 * k + 1) as f64 / (2 * order) as f64;
                if real {
                    let p = warped * axes[0];
                    let scale = 1.0 / (1.0 + p);
                    return Section {
                        b: [p * scale, p * scale, 0.0],
                        a: [(p - 1.0) * scale, 0.0],
                    };
                }
                let re = -warped * axes[0] * angle.sin();
                let im = warped * axes[1] * angle.cos();
                let square = re * re + im * im;
                let scale = 1.0 / (1.0 - 2.0 * re + square);
                let b = square * scale;
                Section {
                    b: [b, 2.0 * b, b],
                    a: [
                        2.0 * (square - 1.0) * scale,
                        (1.0 + 2.0 * re + square) * scale,
                    ],
                }
            })
            .collect();
        // Well damped sections first: the resonant ones then see a signal that is already small.
        sections.reverse();
        if let Some(first) = sections.first_mut() {
            first.b = first.b.map(|b| b * gain);
        }
        Self { sections }
    }
}

/// tan(pi f / fs), the analogue frequency that the bilinear transform maps to `cutoff_hz`.
fn prewarp(order: usize, cutoff_hz: f64, rate_hz: f64) -> Result<f64, MathError> {
    if !(1..=16).contains(&order) {
        return Err(MathError::FilterOrder { order });
    }
    if !(cutoff_hz > 0.0 && cutoff_hz < 0.5 * rate_hz) {
        return Err(MathError::Cutoff { cutoff_hz, rate_hz });
    }
    Ok((PI * cutoff_hz / rate_hz).tan())
}
