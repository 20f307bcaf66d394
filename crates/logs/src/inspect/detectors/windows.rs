//! A few stretches of a log, evenly spread over it, for what is judged from many rows at once.

/// Stretches that are kept at most.
const MAX_STRETCHES: usize = 16;
/// Numbers that they hold together at most.
const NUMBERS: usize = 1 << 23;

/// Consecutive rows without a gap.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Window {
    pub(crate) t: Vec<f64>,
    /// One list per channel.
    pub(crate) columns: Vec<Vec<f64>>,
}

/// Stretches of a channel that are kept for a closer look, evenly over the log.
#[derive(Debug, Clone)]
pub(crate) struct WindowSampler {
    pub(crate) kept: Vec<Window>,
    /// Every how many stretches one is kept.
    stride: u64,
    seen: u64,
}

impl Default for WindowSampler {
    fn default() -> Self {
        Self {
            kept: Vec::new(),
            stride: 1,
            seen: 0,
        }
    }
}

impl WindowSampler {
    pub(crate) fn offer(&mut self, t: &[f64], columns: &[&[f64]]) {
        let number = self.seen;
        self.seen += 1;
        if !number.is_multiple_of(self.stride) {
            return;
        }
        let most = (NUMBERS / (t.len() * (columns.len() + 1)).max(1)).min(MAX_STRETCHES);
        // Too wide to keep more than the first rows.
        if most < 2 && (most == 0 || !self.kept.is_empty()) {
            return;
        }
        if self.kept.len() >= most {
            // Every other one goes, so that what is kept stays evenly spread.
            let mut index = 0;
            self.kept.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride *= 2;
            if !number.is_multiple_of(self.stride) {
                return;
            }
        }
        self.kept.push(Window {
            t: t.to_vec(),
            columns: columns.iter().map(|column| column.to_vec()).collect(),
        });
    }

    /// At most so many of them, evenly spread.
    pub(crate) fn spread(&self, most: usize) -> impl Iterator<Item = &Window> {
        let step = self.kept.len().div_ceil(most).max(1);
        self.kept.iter().step_by(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_of_a_long_log_are_kept_evenly_and_in_order() {
        let mut windows = WindowSampler::default();
        for k in 0..1000 {
            windows.offer(&[f64::from(k)], &[&[f64::from(-k)]]);
        }
        let times: Vec<f64> = windows.kept.iter().map(|w| w.t[0]).collect();
        assert!(times.len() > MAX_STRETCHES / 2 && times.len() <= MAX_STRETCHES);
        let step = times[1] - times[0];
        let even = times.windows(2).all(|pair| pair[1] - pair[0] == step);
        assert!(even, "{times:?}");
        assert!(*times.last().unwrap() >= 1000.0 - 2.0 * step);
    }
}
