//! Long series for small pictures: buckets that keep their smallest and their largest value, so that
//! a spike of one sample survives.

/// Points that a line has at most, gaps aside.
pub(super) const POINTS: usize = 2000;

/// Runs of at most `points` of a series (each gap may add two), split where `x` or `y` is not finite.
pub(super) fn decimated(x: &[f64], y: &[f64], points: usize) -> Vec<Vec<[f64; 2]>> {
    let samples: Vec<[f64; 2]> = x.iter().zip(y).map(|(x, y)| [*x, *y]).collect();
    let size = match samples.len() <= points {
        true => 1,
        false => (2 * samples.len()).div_ceil(points.max(2)),
    };
    let mut runs = Vec::new();
    let mut run: Vec<[f64; 2]> = Vec::new();
    for bucket in samples.chunks(size) {
        let gap = |sample: &[f64; 2]| !(sample[0].is_finite() && sample[1].is_finite());
        for (k, part) in bucket.split(gap).enumerate() {
            if k > 0 {
                runs.push(std::mem::take(&mut run));
            }
            run.extend(extremes(part));
        }
    }
    runs.push(run);
    runs.retain(|run| !run.is_empty());
    runs
}

/// The samples of the smallest and of the largest value, in order of time; once where they are one.
fn extremes(part: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> {
    let value = |k: usize| part[k][1];
    let low = (0..part.len()).reduce(|a, b| if value(b) < value(a) { b } else { a });
    let high = (0..part.len()).reduce(|a, b| if value(b) > value(a) { b } else { a });
    let ends = low.zip(high).map(|(a, b)| [a.min(b), a.max(b)]);
    let ends = ends.map(|[first, last]| [Some(first), Some(last).filter(|_| last > first)]);
    ends.into_iter().flatten().flatten().map(|k| part[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_of_one_sample_survives() {
        let x: Vec<f64> = (0..60_000).map(|k| k as f64 * 1e-3).collect();
        let mut y: Vec<f64> = x.iter().map(|t| t.sin()).collect();
        y[41_234] = 7.0;
        y[12_345] = -6.0;
        let runs = decimated(&x, &y, POINTS);
        assert_eq!(runs.len(), 1);
        assert!(runs[0].len() <= POINTS, "{}", runs[0].len());
        assert!(runs[0].contains(&[41.234, 7.0]) && runs[0].contains(&[12.345, -6.0]));
        assert!(runs[0].is_sorted_by(|a, b| a[0] < b[0]));
    }

    #[test]
    fn short_series_stay_as_they_are_and_gaps_split_even_all_of_it() {
        let x = [0.0, 1.0, 2.0, 3.0, 4.0];
        let y = [5.0, 6.0, f64::NAN, 6.0, 5.0];
        let runs = decimated(&x, &y, POINTS);
        assert_eq!(runs, [[[0.0, 5.0], [1.0, 6.0]], [[3.0, 6.0], [4.0, 5.0]]]);
        assert!(decimated(&[], &[], POINTS).is_empty());
        assert!(decimated(&[0.0, 1.0], &[f64::NAN; 2], POINTS).is_empty());
    }
}
