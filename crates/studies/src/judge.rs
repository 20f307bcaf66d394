//! Limits of the studies, and shares with their intervals.

use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

/// What the studies ask. Fixed before they are run.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Limits {
    /// Share of 95 % intervals that hold the truth: a cell fails where its interval lies outside.
    pub covered: (f64, f64),
    /// Confidence of a share's own interval.
    pub confidence: f64,
    /// Campaigns on clean plants with something written: fewer.
    pub written_on_clean: f64,
    /// Planted effects at 6 and 20 times the noise whose family is named: at least.
    pub family_named: f64,
    /// Campaigns with a planted effect in which no false one is written: at least.
    pub no_false: f64,
    /// Error on unseen data over that of the true law: at most.
    pub over_truth: f64,
    /// A planted effect whose own column, beside the declared ones, keeps less than this share cannot be told.
    pub own_share: f64,
    /// Warnings on right robot files: fewer.
    pub warned_on_right: f64,
    /// Listed mistakes that are named with the right line: at least.
    pub mistakes_named: f64,
    /// Mistakes that get another's name: fewer.
    pub misnamed: f64,
}

pub const LIMITS: Limits = Limits {
    covered: (0.90, 0.98),
    confidence: 0.99,
    written_on_clean: 0.02,
    family_named: 0.90,
    no_false: 0.98,
    over_truth: 1.3,
    own_share: 0.05,
    warned_on_right: 0.01,
    mistakes_named: 0.95,
    misnamed: 0.01,
};

/// A share of trials.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Share {
    pub hits: f64,
    pub trials: f64,
}

impl Share {
    pub fn of(hits: usize, trials: usize) -> Self {
        Self {
            hits: hits as f64,
            trials: trials as f64,
        }
    }

    /// Trials that come in runs, whose members are alike: as many trials as would scatter as the runs' shares do, from
    /// one a run up to all.
    pub fn of_runs(runs: &[(usize, usize)]) -> Self {
        let (hits, trials) = runs.iter().fold((0, 0), |a, r| (a.0 + r.0, a.1 + r.1));
        let groups = runs.iter().filter(|r| r.1 > 0).count();
        if trials == 0 || groups < 2 {
            return Self::of(hits, trials);
        }
        let p = hits as f64 / trials as f64;
        let scatter: f64 = runs
            .iter()
            .map(|r| (r.0 as f64 - p * r.1 as f64).powi(2))
            .sum::<f64>()
            * groups as f64
            / (groups as f64 - 1.0)
            / (trials as f64).powi(2);
        let like = if scatter > 0.0 {
            (p * (1.0 - p) / scatter).clamp(groups as f64, trials as f64)
        } else {
            groups as f64
        };
        Self {
            hits: p * like,
            trials: like,
        }
    }

    pub fn share(&self) -> Option<f64> {
        (self.trials > 0.0).then(|| self.hits / self.trials)
    }

    /// Clopper and Pearson's interval (1934).
    pub fn interval(&self, confidence: f64) -> (f64, f64) {
        let tail = 0.5 * (1.0 - confidence);
        let misses = self.trials - self.hits;
        let quantile =
            |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |d| d.inverse_cdf(p));
        let low = if self.hits <= 0.0 {
            0.0
        } else {
            quantile(self.hits, misses + 1.0, tail)
        };
        let high = if misses <= 1e-9 {
            1.0
        } else {
            quantile(self.hits + 1.0, misses, 1.0 - tail)
        };
        (low, high)
    }

    /// Whether the share's interval lies outside two bounds altogether.
    pub fn outside(&self, bounds: (f64, f64), confidence: f64) -> bool {
        let (low, high) = self.interval(confidence);
        self.trials > 0.0 && (high < bounds.0 || low > bounds.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_clopper_and_pearsons() {
        let (low, high) = Share::of(7, 10).interval(0.95);
        assert!((low - 0.347_547).abs() < 1e-5 && (high - 0.933_260).abs() < 1e-5);
        assert_eq!(Share::of(8, 8).interval(0.99).1, 1.0);
        assert_eq!(Share::of(0, 8).interval(0.99).0, 0.0);
    }

    #[test]
    fn trials_that_go_together_count_as_their_runs() {
        let together = Share::of_runs(&[(10, 10), (0, 10), (10, 10), (10, 10)]);
        assert!((together.trials - 4.0).abs() < 1.0, "{}", together.trials);
        let apart: Vec<(usize, usize)> = (0..40).map(|k| (9 + k % 2, 10)).collect();
        assert!(Share::of_runs(&apart).trials > 390.0);
    }
}
