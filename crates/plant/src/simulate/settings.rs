//! How an experiment is run: duration, rate, saturation, limits, sensors, seed.

use super::SimulateError;
use super::integrate::StepTolerance;
use super::sensors::PlantSensors;

/// How the experiment is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings<const J: usize> {
    /// Duration \[s\].
    pub seconds: f64,
    /// Control and sampling rate \[Hz\].
    pub rate_hz: f64,
    /// Largest voltage of the amplifiers, in both directions \[V\].
    pub saturation: f64,
    pub tolerance: StepTolerance,
    pub sensors: PlantSensors<J>,
    pub seed: u64,
}

/// Most rows of a log that goes to its file block by block: a day at 1 kHz. More is a slip of the keyboard.
const MOST_ROWS: f64 = 1e8;
/// Most numbers that a simulated log may have in memory, 2 GB of them.
const MOST_NUMBERS: f64 = (1u64 << 28) as f64;
/// Numbers of a row for each joint: positions, volts, torques, status, and what was true.
const NUMBERS_OF_JOINT: usize = 13;

impl<const J: usize> Settings<J> {
    /// Rows of the log, handed on block by block or wanted as a whole.
    pub(super) fn samples(&self, in_memory: bool) -> Result<usize, SimulateError> {
        let most = match in_memory {
            true => (MOST_NUMBERS / (NUMBERS_OF_JOINT * J + 2) as f64).floor(),
            false => MOST_ROWS,
        };
        let rows = (self.seconds * self.rate_hz).round().max(1.0);
        if rows > most {
            return Err(SimulateError::TooLong {
                seconds: self.seconds,
                rate_hz: self.rate_hz,
                most: most as usize,
                most_s: most / self.rate_hz,
            });
        }
        Ok(rows as usize)
    }

    /// 1 kHz, 10 V, encoders as they are, no noise, stop at a limit.
    pub fn new(seconds: f64) -> Self {
        Self {
            seconds,
            rate_hz: 1000.0,
            saturation: 10.0,
            tolerance: StepTolerance::default(),
            sensors: PlantSensors::default(),
            seed: 0,
        }
    }

    /// # Errors
    /// [`SimulateError::Parameter`] for the first number that no experiment can have.
    pub fn check(&self) -> Result<(), SimulateError> {
        self.sensors.check()?;
        let finite = |x: f64| x > 0.0 && x.is_finite();
        let rule = "must be above 0 s and finite";
        SimulateError::require(finite(self.seconds), "duration", self.seconds, rule)?;
        let rule = "must be above 0 Hz and finite";
        SimulateError::require(finite(self.rate_hz), "rate", self.rate_hz, rule)?;
        let (StepTolerance { absolute, relative }, rule) = (self.tolerance, "must be above 0");
        SimulateError::require(finite(absolute), "absolute tolerance", absolute, rule)?;
        SimulateError::require(finite(relative), "relative tolerance", relative, rule)?;
        let (most, rule) = (self.saturation, "must be above 0 V");
        SimulateError::require(most > 0.0, "saturation", most, rule)
    }
}
