//! What is measured and logged: encoders on the motors, sampling instants, noise, lost rows.
//!
//! The controller sees the encoders and nothing else. Noise enters the log only. Each kind of chance
//! has its own stream of the seed (see [`super::chance`]).

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::SimulateError;
use super::chance::{ChancePurpose, stream};

/// White noise on a logged channel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Noise<const J: usize> {
    #[default]
    None,
    /// Standard deviation per channel, in its unit.
    Absolute([f64; J]),
    /// Standard deviation as a fraction of the channel's own root mean square over the run.
    Relative(f64),
}

impl<const J: usize> Noise<J> {
    /// Standard deviation per channel for the rows that are to be logged.
    pub fn deviation(&self, rows: &[[f64; J]]) -> [f64; J] {
        let mut squares = MeanSquare::new();
        squares.add(rows);
        self.of_rms(squares.root())
    }

    /// Standard deviation per channel for rows of that root mean square.
    pub(super) fn of_rms(&self, rms: [f64; J]) -> [f64; J] {
        match self {
            Self::None => [0.0; J],
            Self::Absolute(std) => *std,
            Self::Relative(share) => rms.map(|x| share * x),
        }
    }

    fn check(&self, name: &'static str) -> Result<(), SimulateError> {
        let levels = match self {
            Self::None => [0.0; J],
            Self::Absolute(std) => *std,
            Self::Relative(share) => [*share; J],
        };
        for value in levels {
            let good = value >= 0.0 && value.is_finite();
            SimulateError::require(good, name, value, "must be 0 or more")?;
        }
        Ok(())
    }
}

/// The sensors and the recorder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantSensors<const J: usize> {
    /// Positions are rounded to encoder counts (Table 5).
    pub quantisation: bool,
    /// Standard deviation of the sampling instants as a fraction of the step; offsets are cut at 0.45.
    pub jitter: f64,
    /// Share of the rows that are lost.
    pub dropouts: f64,
    /// On the logged volts, V.
    pub volt_noise: Noise<J>,
    /// On the logged joint torques, N or N m.
    pub torque_noise: Noise<J>,
}

impl<const J: usize> Default for PlantSensors<J> {
    /// Quantised encoders, everything else perfect.
    fn default() -> Self {
        Self {
            quantisation: true,
            jitter: 0.0,
            dropouts: 0.0,
            volt_noise: Noise::None,
            torque_noise: Noise::None,
        }
    }
}

impl<const J: usize> PlantSensors<J> {
    /// No quantisation, no noise: for comparisons with the equations.
    pub fn perfect() -> Self {
        Self {
            quantisation: false,
            ..Self::default()
        }
    }

    /// # Errors
    /// [`SimulateError::Parameter`] for negative noise, and for jitter or dropouts outside [0, 1).
    pub fn check(&self) -> Result<(), SimulateError> {
        self.volt_noise.check("noise of the volts")?;
        self.torque_noise.check("noise of the torques")?;
        for (name, value) in [
            ("jitter", self.jitter),
            ("share of dropouts", self.dropouts),
        ] {
            let good = (0.0..1.0).contains(&value);
            SimulateError::require(good, name, value, "must be at least 0 and below 1")?;
        }
        Ok(())
    }

    /// What the encoders show of the motor coordinates x.
    pub fn encoders(&self, x: &[f64; J], resolution: &[f64; J]) -> [f64; J] {
        std::array::from_fn(|i| match self.quantisation && resolution[i] > 0.0 {
            true => (x[i] / resolution[i]).round() * resolution[i],
            false => x[i],
        })
    }

    /// Sampling instants \[s\] at the given rate, without end; the first is 0.
    pub(super) fn instants(&self, rate_hz: f64, seed: u64) -> impl Iterator<Item = f64> + use<J> {
        let mut chance = stream(seed, ChancePurpose::Jitter);
        let jitter = self.jitter;
        (0_u64..).map(move |k| {
            let draw: f64 = chance.sample(StandardNormal);
            let offset = if k == 0 {
                0.0
            } else {
                (jitter * draw).clamp(-0.45, 0.45)
            };
            (k as f64 + offset) / rate_hz
        })
    }

    /// Which of the next rows are kept.
    pub(super) fn kept(&self, rows: usize, chance: &mut ChaCha8Rng) -> Vec<bool> {
        let kept = (0..rows).map(|_| chance.random::<f64>() >= self.dropouts);
        kept.collect()
    }
}

/// Adds white noise to the rows.
pub(super) fn disturb<const J: usize>(
    rows: &mut [[f64; J]],
    deviation: &[f64; J],
    chance: &mut ChaCha8Rng,
) {
    for row in rows {
        for (value, std) in row.iter_mut().zip(deviation) {
            let draw: f64 = chance.sample(StandardNormal);
            *value += std * draw;
        }
    }
}

/// Mean square of each column, row by row.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeanSquare<const J: usize> {
    sums: [f64; J],
    rows: u64,
}

impl<const J: usize> MeanSquare<J> {
    pub fn new() -> Self {
        Self {
            sums: [0.0; J],
            rows: 0,
        }
    }

    pub fn add(&mut self, rows: &[[f64; J]]) {
        for row in rows {
            for (sum, value) in self.sums.iter_mut().zip(row) {
                *sum += value * value;
            }
        }
        self.rows += rows.len() as u64;
    }

    pub fn root(&self) -> [f64; J] {
        self.sums.map(|sum| (sum / self.rows.max(1) as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoders_show_whole_counts_within_half_a_count() {
        let resolution = [8.7989e-6, 0.0];
        let sensors = PlantSensors::default();
        for k in 0..1000 {
            let x = 1e-6 * f64::from(k) * 1.37 - 5e-4;
            let seen = sensors.encoders(&[x, x], &resolution);
            let counts = seen[0] / resolution[0];
            assert!((counts - counts.round()).abs() < 1e-9);
            assert!((seen[0] - x).abs() <= 0.5 * resolution[0] * (1.0 + 1e-9));
            assert_eq!(seen[1], x);
        }
    }

    #[test]
    fn noise_has_the_deviation_that_was_asked_for() {
        let clean: Vec<[f64; 2]> = (0..40_000).map(|k| [2.0, f64::from(k % 2)]).collect();
        let rms = |rows: &[[f64; 2]]| {
            let mut squares = MeanSquare::new();
            squares.add(rows);
            squares.root()
        };
        let deviation = Noise::Relative(0.01).deviation(&clean);
        assert!((deviation[0] - 0.02).abs() < 1e-12);
        assert!((deviation[1] - 0.01 * 0.5f64.sqrt()).abs() < 1e-12);
        let mut noisy = clean.clone();
        disturb(
            &mut noisy,
            &deviation,
            &mut stream(5, ChancePurpose::Torque),
        );
        let pairs = noisy.iter().zip(&clean);
        let differences: Vec<[f64; 2]> = pairs.map(|(a, b)| [a[0] - b[0], a[1] - b[1]]).collect();
        let measured = rms(&differences);
        for (found, asked) in measured.iter().zip(&deviation) {
            assert!((found / asked - 1.0).abs() < 0.02, "{found} for {asked}");
        }
    }

    #[test]
    fn instants_increase_at_any_jitter_and_are_even_without() {
        let mut sensors = PlantSensors::<1>::default();
        let even: Vec<f64> = sensors.instants(500.0, 1).take(1001).collect();
        let mut steps = even.iter().enumerate();
        assert!(steps.all(|(k, t)| (t - 0.002 * k as f64).abs() < 1e-12));
        sensors.jitter = 0.9;
        let uneven: Vec<f64> = sensors.instants(500.0, 1).take(1001).collect();
        assert!(uneven.windows(2).all(|t| t[1] > t[0]));
        assert!(even.iter().zip(&uneven).any(|(a, b)| (a - b).abs() > 1e-4));
    }

    #[test]
    fn dropouts_lose_the_share_that_was_asked_for() {
        let mut sensors = PlantSensors::<1>::default();
        let mut chance = stream(2, ChancePurpose::Dropout);
        assert!(sensors.kept(1000, &mut chance).iter().all(|kept| *kept));
        sensors.dropouts = 0.1;
        let kept = sensors.kept(20_000, &mut chance);
        let lost = kept.iter().filter(|kept| !**kept).count();
        assert!((1800..2200).contains(&lost), "{lost}");
    }

    #[test]
    fn impossible_sensors_are_refused() {
        let refuse = |change: fn(&mut PlantSensors<1>)| {
            let mut sensors = PlantSensors::default();
            change(&mut sensors);
            sensors.check().is_err()
        };
        assert!(PlantSensors::<1>::default().check().is_ok());
        assert!(refuse(|s| s.jitter = -0.1));
        assert!(refuse(|s| s.dropouts = 1.0));
        assert!(refuse(|s| s.torque_noise = Noise::Relative(f64::NAN)));
        assert!(refuse(|s| s.volt_noise = Noise::Absolute([-1.0])));
    }
}
