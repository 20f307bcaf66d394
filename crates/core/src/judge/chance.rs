//! How sure an amplitude is beside chance: its variance by two readings, and the floor that F must exceed.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::Numbers;

/// Part of the mean information below which a block says nothing of an amplitude.
pub(super) const SILENT: f64 = 1e-3;
/// Readings of chance of which the surer one judges.
const READINGS: f64 = 2.0;
/// Steps of halving by which the floor is found.
const HALVINGS: usize = 60;

/// Chance in an amplitude, as a part of it, and how sure that is.
pub(super) struct ChanceReading {
    /// Square of the relative deviation.
    pub variance: f64,
    /// Number of blocks of equal information that would tell the variance as surely.
    pub blocks: f64,
    /// How much wider than the truth the variance comes out.
    pub wide: f64,
}

impl ChanceReading {
    /// By the scatter of fits without each block, whose relative `changes` these are; and moderated by the noise that
    /// all blocks tell, which tells an effect of few blocks from chance (Smyth 2004).
    pub fn both(changes: &[f64], leverages: &[f64], numbers: &Numbers) -> Option<[Self; 2]> {
        let (blocks, wide) = freedom(leverages)?;
        let n = changes.len() as f64;
        let scatter = changes.iter().map(|x| x * x).sum::<f64>() * (n - 1.0) / n;
        let plain = ChanceReading {
            variance: scatter,
            blocks,
            wide,
        };
        // without a block of leverage h the fit moves by noise of the variance h / (1 - h) of its own
        let telling = changes.iter().zip(leverages);
        let telling = telling.filter(|(_, h)| **h * n > SILENT);
        let count = telling.clone().count() as f64;
        let alike = telling.map(|(x, h)| x * x * (1.0 - h) / h).sum::<f64>() / count.max(1.0);
        let (shared, own) = (numbers.shared_noise, blocks - 1.0);
        let moderated = ChanceReading {
            variance: (shared * alike + own * scatter / wide) / (shared + own),
            blocks: (blocks + shared).min(n),
            wide: 1.0,
        };
        Some([plain, moderated])
    }
}

/// How many equal blocks would show as much scatter by chance as these, and how much wider than the truth the deviation
/// comes out: the jackknife's variance of independent blocks with these leverages (Satterthwaite 1946; Bell and
/// McCaffrey 2002).
fn freedom(leverages: &[f64]) -> Option<(f64, f64)> {
    let h: Vec<f64> = leverages
        .iter()
        .map(|h| h.min(1.0 - f64::EPSILON.sqrt()))
        .collect();
    let n = h.len() as f64;
    let mean: f64 = h.iter().map(|h| h / (1.0 - h)).sum();
    let mut square = 0.0;
    for (b, x) in h.iter().enumerate() {
        for (c, y) in h.iter().enumerate() {
            let covariance = if b == c { x * (1.0 - x) } else { -x * y };
            square += (covariance / ((1.0 - x) * (1.0 - y))).powi(2);
        }
    }
    (square > 0.0).then(|| (1.0 + mean * mean / square, mean * (n - 1.0) / n))
}

/// The F of k numbers by n blocks that chance exceeds as rarely as [`Numbers::deviations`] of one number by
/// [`Numbers::blocks`], for the combination of them that was found (Scheffé 1953), where two readings of chance are
/// asked; none of less than two blocks.
pub fn floor(k: usize, n: f64, numbers: &Numbers) -> Option<f64> {
    let chance = |k: f64, n: f64, f: f64| Some(FisherSnedecor::new(k, n).ok()?.sf(f));
    let usual = numbers.blocks as f64 - 1.0;
    let rare = chance(1.0, usual, numbers.deviations.powi(2))? / READINGS;
    let k = k as f64;
    // blocks that are not there are not missed
    let n = n.min(numbers.blocks as f64);
    if n < 2.0 {
        return None;
    }
    exceeded_as_rarely(rare, ([1e-9, 1e9], HALVINGS), |f| chance(k, n - 1.0, f))
}

/// The value between two others that `chance` exceeds as rarely, by so many halves of the logarithm; none where the chance
/// of one is not known.
pub(super) fn exceeded_as_rarely(
    rare: f64,
    ([mut low, mut high], halvings): ([f64; 2], usize),
    chance: impl Fn(f64) -> Option<f64>,
) -> Option<f64> {
    for _ in 0..halvings {
        let middle = (low * high).sqrt();
        match chance(middle)? > rare {
            true => low = middle,
            false => high = middle,
        }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::NUMBERS;

    #[test]
    fn the_floor_is_that_of_one_chance_for_every_number_of_numbers_and_blocks() {
        let of = |k, n| floor(k, n, &NUMBERS).unwrap();
        let near = |found: f64, wanted: f64| {
            assert!((found / wanted - 1.0).abs() < 0.04, "{found} {wanted}")
        };
        near(of(1, 24.0), 28.6);
        near(of(1, 12.0), 50.0);
        // each number beside the first makes the square of a torque that chance reaches greater, and F less
        let each: Vec<f64> = (1..=10).map(|k| of(k, 24.0)).collect();
        assert!(each.windows(2).all(|f| f[1] < f[0]), "{each:?}");
        let squares = (1..).zip(&each).map(|(k, f)| f64::from(k) * f);
        assert!(squares.clone().zip(squares.skip(1)).all(|(a, b)| a < b));
        assert_eq!(floor(2, 1.5, &NUMBERS), None);
        let (blocks, wide) = freedom(&[1.0 / 24.0; 24]).unwrap();
        assert!((blocks - 24.0).abs() < 1e-9 && (wide - 1.0).abs() < 1e-9);
        let half: Vec<f64> = (0..24)
            .map(|b| if b < 6 { 1.0 / 6.0 } else { 0.0 })
            .collect();
        let (blocks, wide) = freedom(&half).unwrap();
        assert!((blocks - 6.0).abs() < 1e-9 && wide > 1.0);
        assert!(of(1, 8.0) > of(1, 12.0));
    }
}
