//! Finite Fourier series of eq. (43), entered smoothly from rest and left to it.

use cft_ident_core::explain::ErrorText;
use std::f64::consts::TAU;

use rand::RngExt;

use super::{Target, TimeScaling};
use crate::simulate::SimulateError;
use crate::simulate::chance::{ChancePurpose, stream};
use cft_ident_core::robot::cft::{LaboratorySetup, practice};
use cft_ident_core::robot::practice::Excitation;

/// Positions x_i(t) = offset_i + sum_l a_il/(l w) sin(l w t) - b_il/(l w) cos(l w t), eq. (43).
///
/// The series is entered by running its own clock slowly at first: during the first
/// [`FourierReference::blend`] seconds the phase accelerates from standstill to one second per second, so that
/// the path is that of the series from the start and never leaves its range. It is left in the same way.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierReference<const J: usize> {
    /// Offset per coordinate, m or rad.
    pub offset: [f64; J],
    /// a_l for l = 1, 2, ...: amplitudes of the velocity, m/s or rad/s.
    pub a: Vec<[f64; J]>,
    /// b_l, as many as a_l.
    pub b: Vec<[f64; J]>,
    /// Fundamental angular frequency w \[rad/s\].
    pub fundamental: f64,
    /// Phase at which the motion begins, in seconds of the series' own time.
    pub start: f64,
    /// Time within which the motion reaches full speed, and comes to rest again \[s\].
    pub blend: f64,
    /// Whole periods between the blends; for ever where absent.
    pub periods: Option<u32>,
}

impl FourierReference<4> {
    /// The report's excitation trajectory in (x_c1, x_c2, x_c3, x_c4): Table 3 with the printed offsets.
    pub fn table_3() -> Self {
        Self::of(&practice::of(LaboratorySetup::Tuedacs).excitation)
    }
}

impl<const J: usize> FourierReference<J> {
    /// Time within which a series reaches full speed, where nothing says otherwise \[s\].
    pub const BLEND: f64 = 2.0;

    /// The series of an excitation, without an end.
    pub fn of(excitation: &Excitation) -> Self {
        let widened = |row: &Vec<f64>| std::array::from_fn(|i| row.get(i).copied().unwrap_or(0.0));
        Self {
            offset: widened(&excitation.offset),
            a: excitation.a.iter().map(widened).collect(),
            b: excitation.b.iter().map(widened).collect(),
            fundamental: TAU * excitation.fundamental_hz,
            start: 0.0,
            blend: Self::BLEND,
            periods: None,
        }
    }

    /// The same series, begun anywhere in its period.
    pub fn at_random_phase(mut self, seed: u64) -> Self {
        let mut chance = stream(seed, ChancePurpose::Reference);
        self.start = self.period() * chance.random::<f64>();
        self
    }

    /// Duration of one period \[s\].
    pub fn period(&self) -> f64 {
        TAU / self.fundamental
    }

    /// # Errors
    /// [`SimulateError::Reference`] when a number is not finite, the frequency not positive, or a and
    /// b differ in length.
    pub fn check(&self) -> Result<(), SimulateError> {
        let (w, blend, start) = (self.fundamental, self.blend, self.start);
        let (a, b) = (self.a.len(), self.b.len());
        let mut numbers = self.a.iter().chain(&self.b).flatten().chain(&self.offset);
        let what = if !(w > 0.0 && w.is_finite()) {
            let text = format!("the fundamental frequency is {w} rad/s");
            ErrorText::new(text).remedy("it must be positive")
        } else if !(blend >= 0.0 && blend.is_finite() && start.is_finite()) {
            format!("the blend time {blend} s or the start phase {start} s is no usable time")
                .into()
        } else if a != b {
            let text = format!("the series has {a} coefficients a and {b} coefficients b");
            ErrorText::new(text).remedy("give as many of each")
        } else if let Some(number) = numbers.find(|x| !x.is_finite()) {
            format!("a coefficient of the series is {number}").into()
        } else {
            return Ok(());
        };
        Err(SimulateError::Reference { what })
    }

    /// Position and velocity at time t >= 0 \[s\].
    pub fn at(&self, t: f64) -> Target<J> {
        let [phase, rate, _] = self.ends().clock(self.period(), t);
        let mut target = Target::rest(self.offset);
        for (l, (a, b)) in self.a.iter().zip(&self.b).enumerate() {
            let omega = self.fundamental * (l + 1) as f64;
            let (sin, cos) = (omega * phase).sin_cos();
            for i in 0..J {
                target.position[i] += (a[i] * sin - b[i] * cos) / omega;
                target.velocity[i] += rate * (a[i] * cos + b[i] * sin);
            }
        }
        target
    }

    /// Duration of the motion \[s\], where it ends.
    pub fn seconds(&self) -> Option<f64> {
        self.ends().end(self.period())
    }

    fn ends(&self) -> TimeScaling {
        TimeScaling {
            start: self.start,
            seconds: self.blend,
            periods: self.periods,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_is_the_derivative_of_position_through_the_blend() {
        let series = FourierReference::table_3();
        let h = 1e-5;
        for k in 1..200 {
            let t = 0.05 * f64::from(k);
            let [before, here, after] = [t - h, t, t + h].map(|t| series.at(t));
            for i in 0..4 {
                let slope = (after.position[i] - before.position[i]) / (2.0 * h);
                let off = (slope - here.velocity[i]).abs();
                assert!(off < 1e-8, "t {t}, coordinate {i}: {slope} is {off} off");
            }
        }
    }

    #[test]
    fn motion_starts_at_rest_repeats_itself_and_ends_at_rest_behind_whole_periods() {
        let endless = FourierReference::table_3();
        assert_eq!(endless.seconds(), None);
        assert_eq!(endless.at(0.0).velocity, [0.0; 4]);
        let (one, next) = (endless.at(5.0), endless.at(5.0 + endless.period()));
        for i in 0..4 {
            assert!((one.position[i] - next.position[i]).abs() < 1e-12);
            assert!((one.velocity[i] - next.velocity[i]).abs() < 1e-12);
        }
        let series = FourierReference {
            periods: Some(3),
            ..endless
        };
        let end = series.seconds().expect("it ends");
        assert!((end - 11.5).abs() < 1e-12);
        assert_eq!(series.at(end).velocity, [0.0; 4]);
        assert_eq!(series.at(end + 1.0), series.at(end));
        assert_eq!(series.at(5.0), one);
    }

    #[test]
    fn random_phases_begin_at_rest_on_the_same_path() {
        let series = FourierReference::table_3();
        let other = series.clone().at_random_phase(4);
        assert_eq!(other, series.clone().at_random_phase(4));
        assert_ne!(other.start, series.clone().at_random_phase(5).start);
        assert!((0.0..series.period()).contains(&other.start));
        assert_eq!(other.at(0.0).velocity, [0.0; 4]);
        let on_path = series.at(other.start + 2.0 + 2.0 * series.period());
        let here = other.at(2.0 + 2.0 * series.period());
        for i in 0..4 {
            assert!((here.position[i] - on_path.position[i]).abs() < 1e-12);
        }
    }

    #[test]
    fn table_3_uses_the_shares_of_the_spans_that_are_known() {
        // Shares of the spans of x_c1..x_c4 in use: 28, 21, 26 and 9 %.
        let spans = [0.315, 0.607, 6.16, 0.595];
        let series = FourierReference::table_3();
        for (i, (span, share)) in spans.iter().zip([28.0, 21.0, 26.0, 9.0]).enumerate() {
            let values = (0..5000).map(|k| series.at(2.0 + f64::from(k) * 1e-3).position[i]);
            let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
            let used = 100.0 * (high - low) / span;
            assert!((used - share).abs() < 0.6, "coordinate {i}: {used} %");
        }
    }

    #[test]
    fn unusable_series_are_refused() {
        let broken = |change: fn(&mut FourierReference<4>)| {
            let mut series = FourierReference::table_3();
            change(&mut series);
            series.check().is_err()
        };
        assert!(FourierReference::table_3().check().is_ok());
        assert!(broken(|s| s.fundamental = 0.0));
        assert!(broken(|s| s.b.truncate(2)));
        assert!(broken(|s| s.a[1][2] = f64::NAN));
        assert!(broken(|s| s.blend = -1.0));
    }
}
