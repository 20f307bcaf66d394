//! Seeded chance: the same seed gives the same plant, motion and noise.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[derive(Clone)]
pub struct Chance(ChaCha8Rng);

impl Chance {
    /// Of a name and a number, so that studies and cells draw apart.
    pub fn of(name: &str, number: u64) -> Self {
        // FNV-1a
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for byte in name.bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        Self(ChaCha8Rng::seed_from_u64(
            hash ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15),
        ))
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Between both, all ratios alike.
    pub fn ratio(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    pub fn sign(&mut self) -> f64 {
        if self.0.random::<f64>() < 0.5 {
            -1.0
        } else {
            1.0
        }
    }

    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        let at = (self.0.random::<f64>() * of.len() as f64) as usize;
        of[at.min(of.len() - 1)]
    }

    /// A normal number (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.0.random::<f64>()).cos()
    }

    /// Noise of unit variance; with a memory [s], half of the power forgets as slowly as that, the other half is white.
    pub fn noise(&mut self, rows: usize, rate_hz: f64, memory_s: Option<f64>) -> Vec<f64> {
        let Some(memory) = memory_s else {
            return (0..rows).map(|_| self.normal()).collect();
        };
        let keep = (-1.0 / (memory * rate_hz)).exp();
        let fresh = (1.0 - keep * keep).sqrt();
        let mut slow = self.normal();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        (0..rows)
            .map(|_| {
                slow = keep * slow + fresh * self.normal();
                half * (slow + self.normal())
            })
            .collect()
    }
}
