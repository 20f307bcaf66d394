//! Volts that are played back without a controller.

use super::SimulateError;
use cft_ident_core::explain::ErrorText;

/// Volts over time, each row kept until the next (zero-order hold) and the last for as long as the others on average;
/// zero before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct VoltSeries<const J: usize> {
    times: Vec<f64>,
    volts: Vec<[f64; J]>,
}

impl<const J: usize> VoltSeries<J> {
    /// # Errors
    /// [`SimulateError::Volts`] when the series is empty, its times do not increase, its lengths differ
    /// or a number is not finite.
    pub fn new(times: Vec<f64>, volts: Vec<[f64; J]>) -> Result<Self, SimulateError> {
        let mut numbers = times.iter().chain(volts.as_flattened());
        let what = if times.len() != volts.len() || times.is_empty() {
            let text = format!("{} times and {} rows of volts", times.len(), volts.len());
            ErrorText::new(text).remedy("give as many of each, at least one")
        } else if let Some(k) = times.windows(2).position(|t| t[1] <= t[0]) {
            let (from, to, row) = (times[k], times[k + 1], k + 2);
            format!("time does not increase from {from} s to {to} s at row {row}").into()
        } else if numbers.any(|x| !x.is_finite()) {
            ErrorText::new("a time or a voltage is not finite")
        } else {
            return Ok(Self { times, volts });
        };
        Err(SimulateError::Volts { what })
    }

    /// Time at which the last row ends \[s\]; a single row lasts for ever.
    pub fn seconds(&self) -> f64 {
        match self.times.as_slice() {
            [first, .., last] => last + (last - first) / (self.times.len() - 1) as f64,
            _ => f64::INFINITY,
        }
    }

    /// Volts at time t \[s\].
    pub fn at(&self, t: f64) -> [f64; J] {
        let after = self.times.partition_point(|&x| x <= t);
        if after == 0 || (after == self.times.len() && t >= self.seconds()) {
            return [0.0; J];
        }
        self.volts[after - 1]
    }
}
