//! How far a parameter walks from log to log, and by how much estimates scatter beyond their variances.

use super::local_level::{CourseVariances, InnovationGains};

/// Sizes of the walk and of the scatter that are tried, as variances over the median variance of an estimate.
pub(super) const TRIED: [f64; 9] = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0];
/// Degrees of freedom of the innovations: a step and a log with a payload are no walk.
const FREEDOM: f64 = 4.0;

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct WalkSizes {
    /// Variance of the walk over a usual time between two logs.
    pub walk: f64,
    /// Variance of the scatter.
    pub scatter: f64,
}

impl WalkSizes {
    /// Variances of a course whose estimates have these; `spacings` over the usual one.
    pub(super) fn variances(&self, estimate: &[f64], spacings: &[f64]) -> CourseVariances {
        CourseVariances {
            estimate: estimate.iter().map(|r| r + self.scatter).collect(),
            walk: spacings.iter().map(|s| s * self.walk).collect(),
        }
    }
}

/// Median of numbers that are finite; none where there are none.
pub(super) fn median(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let mut all: Vec<f64> = numbers.filter(|x| x.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    let middle = all.len() / 2;
    match all.len() {
        0 => None,
        n if n % 2 == 1 => Some(all[middle]),
        _ => Some(0.5 * (all[middle - 1] + all[middle])),
    }
}

/// The sizes under which the innovations are likeliest, by Student's law with 4 degrees of freedom: what moves once is
/// sought as a change, and must not pass for a walk (Lange, Little and Taylor 1989). With them how unlikely they are:
/// half of minus twice the logarithm of the likelihood, but for a constant. `walks` are tried as [`TRIED`] are.
pub(super) fn sizes(
    walks: &[f64],
    signal: &[f64],
    estimate: &[f64],
    spacings: &[f64],
) -> (WalkSizes, f64) {
    let mut best = (WalkSizes::default(), f64::INFINITY);
    let Some(unit) = median(estimate.iter().copied()) else {
        return best;
    };
    for walk in walks {
        for scatter in TRIED {
            let sizes = WalkSizes {
                walk: walk * unit,
                scatter: scatter * unit,
            };
            let whitener = InnovationGains::new(&sizes.variances(estimate, spacings));
            let unlikely = |x: f64| 0.5 * (FREEDOM + 1.0) * (1.0 + x * x / (FREEDOM - 2.0)).ln();
            let innovations = whitener.apply(signal).into_iter();
            let cost = whitener.log_std() + innovations.map(unlikely).sum::<f64>();
            if cost < best.1 - 1e-9 {
                best = (sizes, cost);
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn walk_and_scatter_are_not_confused() {
        let mut chance = ChaCha8Rng::seed_from_u64(5);
        let mut draw = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
        let n = 200;
        let (estimate, spacings) = (vec![1.0; n], vec![1.0; n]);
        let (mut scattered, mut walked) = (vec![], vec![]);
        let mut level = 0.0;
        for _ in 0..n {
            level += draw();
            scattered.push(3.0 * draw());
            walked.push(level + draw());
        }
        let (found, _) = sizes(&TRIED, &scattered, &estimate, &spacings);
        assert!(found.scatter >= 3.0 && found.walk <= 0.1, "{found:?}");
        let (found, _) = sizes(&TRIED, &walked, &estimate, &spacings);
        assert!(found.walk >= 0.3 && found.scatter <= 1.0, "{found:?}");
    }
}
