//! Long series for small pictures: buckets that keep their smallest and their largest value, so that
//! a spike of one sample survives.

/// Points that a line has at most, gaps aside.
pub(super) const POINTS: usize = 2000;

/// Runs of drawable points of a series, split where `x` or `y` is not finite.
///
/// At most `points` of them (each gap may add two): consecutive samples form buckets, and a bucket
/// gives its smallest and its largest value in order of time. Short series are kept as they are.
pub(super) fn decimated(x: &[f64], y: &[f64], points: usize) -> Vec<Vec<[f64; 2]>> {
    let count = x.len().min(y.len());
    let size = if count <= points {
        1
    } else {
        (2 * count).div_ceil(points.max(2))
    };
    let mut runs = Vec::new();
    let mut run: Vec<[f64; 2]> = Vec::new();
    let mut bucket = Bucket::default();
    for k in 0..count {
        if k % size == 0 {
            bucket.empty_into(&mut run);
        }
        if x[k].is_finite() && y[k].is_finite() {
            bucket.add([x[k], y[k]]);
        } else {
            bucket.empty_into(&mut run);
            if !run.is_empty() {
                runs.push(std::mem::take(&mut run));
            }
        }
    }
    bucket.empty_into(&mut run);
    if !run.is_empty() {
        runs.push(run);
    }
    runs
}

/// Extremes of consecutive samples, with their place among them.
#[derive(Default)]
struct Bucket {
    samples: usize,
    low: (usize, [f64; 2]),
    high: (usize, [f64; 2]),
}

impl Bucket {
    fn add(&mut self, point: [f64; 2]) {
        if self.samples == 0 || point[1] < self.low.1[1] {
            self.low = (self.samples, point);
        }
        if self.samples == 0 || point[1] > self.high.1[1] {
            self.high = (self.samples, point);
        }
        self.samples += 1;
    }

    fn empty_into(&mut self, run: &mut Vec<[f64; 2]>) {
        if self.samples > 0 {
            let (first, second) = if self.low.0 <= self.high.0 {
                (self.low, self.high)
            } else {
                (self.high, self.low)
            };
            run.push(first.1);
            if second.0 > first.0 {
                run.push(second.1);
            }
            self.samples = 0;
        }
    }
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
    fn short_series_stay_as_they_are_and_gaps_split() {
        let x = [0.0, 1.0, 2.0, 3.0, 4.0];
        let y = [5.0, 6.0, f64::NAN, 6.0, 5.0];
        let runs = decimated(&x, &y, POINTS);
        assert_eq!(runs, [[[0.0, 5.0], [1.0, 6.0]], [[3.0, 6.0], [4.0, 5.0]]]);
    }

    #[test]
    fn nothing_comes_of_nothing() {
        assert!(decimated(&[], &[], POINTS).is_empty());
        assert!(decimated(&[0.0, 1.0], &[f64::NAN; 2], POINTS).is_empty());
    }
}
