//! Block bootstrap: how far statistics of pieces of data scatter (Kuensch 1989).

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Resamplings.
const DRAWS: usize = 1000;

/// 95 % intervals of statistics that are computed from the numbers of the pieces that were drawn. Pieces are drawn
/// `block` neighbours at a time, the first after the last, until there are as many as `pieces`.
pub fn intervals_95(
    pieces: usize,
    block: usize,
    seed: u64,
    statistics: &mut dyn FnMut(&[usize]) -> Vec<f64>,
) -> Vec<[f64; 2]> {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let mut drawn: Vec<Vec<f64>> = Vec::new();
    let mut picked = Vec::with_capacity(pieces + block);
    for _ in 0..DRAWS {
        picked.clear();
        while picked.len() < pieces {
            let first = chance.random_range(0..pieces);
            picked.extend((0..block).map(|i| (first + i) % pieces));
        }
        let found = statistics(&picked);
        drawn.resize_with(found.len(), Vec::new);
        for (draws, x) in drawn.iter_mut().zip(found) {
            draws.push(x);
        }
    }
    let interval = |mut draws: Vec<f64>| {
        draws.sort_by(f64::total_cmp);
        [draws[DRAWS * 25 / 1000], draws[DRAWS * 975 / 1000 - 1]]
    };
    drawn.into_iter().map(interval).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_mean_is_two_standard_errors_to_each_side() {
        let x: Vec<f64> = (0..400)
            .map(|k| f64::from((k * 37) % 400) / 400.0)
            .collect();
        let mean = |picked: &[usize]| picked.iter().map(|i| x[*i]).sum::<f64>() / 400.0;
        let found = intervals_95(x.len(), 1, 7, &mut |picked| vec![mean(picked), 2.0]);
        let error = (1.0 / 12.0f64 / 400.0).sqrt();
        for (end, wanted) in found[0].into_iter().zip([-1.96, 1.96]) {
            assert!(((end - 0.5) / error - wanted).abs() < 0.25, "{end}");
        }
        assert_eq!(found[1], [2.0, 2.0]);
    }
}
