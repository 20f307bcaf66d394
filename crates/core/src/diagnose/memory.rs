//! How long a residual remembers: neighbouring rows are no news.

use super::problem::data_split::DataSplit;
use crate::judge::LogRows;

/// Least rows over which a time is looked for, in lags.
const ROWS: usize = 4;

/// The 1/e time of the filtered residual, `[stretch][joint][row]`, of the joint in the middle, about its mean over a log \[s\].
pub fn memory_s(residual: &[Vec<Vec<f64>>], logs: &[LogRows], split: &DataSplit) -> f64 {
    let joints = residual.first().map_or(0, Vec::len);
    let of_joint = |j: usize| {
        let moving = logs.iter().filter(|log| log.moves[j]);
        let step = moving.clone().map(|log| log.step_s).fold(0.0, f64::max);
        let pieces = moving.flat_map(|log| log.pieces.iter().map(|(s, rows)| (*s, rows.clone())));
        let pieces = pieces.filter(|(s, _)| !split.is_stationary(*s, j));
        let own = pieces.map(|(s, rows)| centred(&residual[s][j][rows]));
        step * lag(&own.collect::<Vec<_>>()) as f64
    };
    let mut times: Vec<f64> = (0..joints).map(of_joint).filter(|t| *t > 0.0).collect();
    // on a joint that lacks an effect the residual remembers as long as the motion does
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
}

fn centred(x: &[f64]) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter().map(|x| x - mean).collect()
}

/// Rows after which the correlation has fallen to 1/e.
fn lag(pieces: &[Vec<f64>]) -> usize {
    let longest = pieces.iter().map(Vec::len).max().unwrap_or(0);
    let at = |lag: usize| -> f64 {
        let own = pieces.iter().filter(|x| x.len() > lag);
        own.map(|x| x[lag..].iter().zip(x).map(|(a, b)| a * b).sum::<f64>())
            .sum()
    };
    let fallen = at(0) / std::f64::consts::E;
    let mut lag = 1;
    while lag * ROWS < longest && at(lag) > fallen {
        // a tenth more is near enough
        lag += 1 + lag / 10;
    }
    lag
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_is_forgotten_after_a_fifth_of_its_period_and_noise_at_once() {
        let wave: Vec<f64> = (0..5000).map(|k| (0.01 * f64::from(k)).sin()).collect();
        // cos(x) = 1/e at x = 1.194
        let found = lag(&[wave]);
        assert!((115..=135).contains(&found), "{found}");
        let noise: Vec<f64> = (0..5000u32)
            .map(|k| f64::from(k * k % 1013 * 7919 % 1013) - 506.0)
            .collect();
        assert_eq!(lag(&[centred(&noise)]), 1);
    }
}
