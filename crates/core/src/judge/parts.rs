//! Agreement of parts of the logs on what a hypothesis of the set-up explains: a statistic that no search has seen.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::Blocks;
use super::chance::exceeded_as_rarely;

/// The numbers that decide whether parts of the logs agree on a hypothesis of the set-up.
#[derive(Debug, Clone, Copy)]
pub struct PartNumbers {
    /// Number of parts that must ask for one share; fewer, where logs are short or a joint rests, must agree so much
    /// the better that chance is as small. Half: one log cut in parts agrees with itself; twice: logs of a minute
    /// show no mistake.
    pub parts: usize,
    /// Blocks that each part is cut into for the screen. One: its standard error rests on 12 values; four: blocks as
    /// short as the residual's own memory.
    pub blocks_per_part: usize,
    /// s = max(0, 1 - doubt / z). Half: right files are refused; twice: a turned sign beside a second mistake is missed.
    pub doubt: f64,
}

/// The numbers of the check of a set-up.
pub const PARTS: PartNumbers = PartNumbers {
    parts: 12,
    blocks_per_part: 2,
    doubt: 4.0,
};

/// Least number of parts that have a deviation of their own.
const LEAST_PARTS: usize = 3;
/// No agreement is as good as this.
const MOST_DOUBT: f64 = 1e6;
/// Part of the mean information below which a part says nothing.
const SILENT: f64 = 1e-3;

/// How far the parts agree on the share of the squared error that another hypothesis takes off, 0..1: errors
/// `[block][joint]` of blocks that neither was fitted to, each joint in its weight.
pub fn agreement_on_share(
    (before, after): (&[Vec<f64>], &[Vec<f64>]),
    weights: &[f64],
    blocks: &Blocks,
) -> f64 {
    let sum = |errors: &[f64]| errors.iter().zip(weights).map(|(e, w)| e * w).sum::<f64>();
    let mut parts = vec![[0.0; 2]; blocks.parts];
    for ((before, after), block) in before.iter().zip(after).zip(&blocks.list) {
        let [all, off] = &mut parts[block.part];
        *all += sum(before);
        *off += sum(before) - sum(after);
    }
    let total: f64 = parts.iter().map(|[all, _]| all).sum();
    // what says nothing of the share is no part that agrees
    let mean = total / parts.len().max(1) as f64;
    parts.retain(|[all, _]| *all > SILENT * mean);
    let share = parts.iter().map(|[_, off]| off).sum::<f64>() / total.max(f64::MIN_POSITIVE);
    let scatter: f64 = (parts
        .iter()
        .map(|[all, off]| all * (off / all - share).powi(2)))
    .sum();
    let p = parts.len() as f64;
    let z = match scatter > 0.0 {
        true => share * share * total * (p - 1.0) / (p * scatter),
        false => 0.0,
    };
    doubt(parts.len()).map_or(0.0, |doubt| (1.0 - doubt / z).max(0.0))
}

/// The z at which so few parts agree by a chance as small as that of [`PartNumbers::parts`] at [`PartNumbers::doubt`].
fn doubt(parts: usize) -> Option<f64> {
    if parts >= PARTS.parts {
        return Some(PARTS.doubt);
    }
    // P z is F with 1 and P - 1 degrees of freedom
    let chance = |parts: usize, z: f64| {
        let parts = parts as f64;
        let distribution = FisherSnedecor::new(1.0, parts - 1.0).ok()?;
        Some(distribution.sf(parts * z))
    };
    let usual = chance(PARTS.parts, PARTS.doubt)?;
    if parts < LEAST_PARTS || chance(parts, MOST_DOUBT)? > usual {
        return None;
    }
    // to a thousandth after thirty
    exceeded_as_rarely(usual, ([PARTS.doubt, MOST_DOUBT], 30), |z| chance(parts, z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_parts_must_agree_so_much_the_better_and_two_never_do() {
        assert_eq!([doubt(12), doubt(40)], [Some(4.0); 2]);
        assert_eq!(doubt(2), None);
        let fewer: Vec<f64> = (3..12).map(|parts| doubt(parts).unwrap()).collect();
        assert!(fewer.windows(2).all(|pair| pair[0] > pair[1]), "{fewer:?}");
        // F(1, 7) and F(1, 4) at the chance of 2.5e-5 that F(1, 11) has beyond 48
        let [eight, five] = [8, 5].map(|parts| doubt(parts).unwrap());
        assert!((10.0..14.0).contains(&eight), "{eight}");
        assert!((70.0..130.0).contains(&five), "{five}");
    }
}
