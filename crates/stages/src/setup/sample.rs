//! A bounded number of smoothed rows, spread over the logs.

/// Most rows that are kept.
pub const MOST_ROWS: usize = 2000;

/// A joint rests below this share of its rms speed.
const RESTING: f64 = 0.01;

/// Rows of smoothed motion and torque; each list holds n numbers a row. Of motors behind a linkage they are what the
/// channels have: it is to be told which of them belong to no pose.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    pub joints: usize,
    /// Positions [m or rad], velocities and accelerations, joint side as declared.
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub a: Vec<f64>,
    /// Signs of the velocities, filtered as all others.
    pub sign: Vec<f64>,
    /// Torques [N or N m], joint side as declared.
    pub tau: Vec<f64>,
    /// Of each row, its log.
    pub log: Vec<usize>,
}

/// One row.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub a: &'a [f64],
    pub sign: &'a [f64],
    pub tau: &'a [f64],
}

impl Sample {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.log.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.log.is_empty()
    }

    /// Row k.
    pub fn row(&self, k: usize) -> Row<'_> {
        let at = k * self.joints..(k + 1) * self.joints;
        Row {
            q: &self.q[at.clone()],
            v: &self.v[at.clone()],
            a: &self.a[at.clone()],
            sign: &self.sign[at.clone()],
            tau: &self.tau[at],
        }
    }

    /// Root mean square of each column of one list.
    pub fn rms(&self, of: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.joints];
        for row in of.chunks_exact(self.joints.max(1)) {
            for (sum, x) in sums.iter_mut().zip(row) {
                *sum += x * x;
            }
        }
        let rows = self.len().max(1) as f64;
        sums.iter().map(|sum| (sum / rows).sqrt()).collect()
    }

    /// How far a joint travels \[m or rad\].
    pub(super) fn travel(&self, joint: usize) -> f64 {
        let q = self.q.iter().skip(joint).step_by(self.joints.max(1));
        let ends = |(l, h): (f64, f64), q: &f64| (l.min(*q), h.max(*q));
        let (low, high) = q.fold((f64::INFINITY, f64::NEG_INFINITY), ends);
        high - low
    }

    /// Leaves out the rows in which nothing moves: static friction takes any torque there.
    fn without_rests(&mut self) {
        let n = self.joints;
        let speeds = self.rms(&self.v);
        let moves = |v: &[f64]| {
            v.iter()
                .zip(&speeds)
                .any(|(v, rms)| v.abs() > RESTING * rms)
        };
        let kept: Vec<usize> = (0..self.len())
            .filter(|k| moves(&self.v[k * n..(k + 1) * n]))
            .collect();
        if kept.len() < self.len() / 4 {
            return;
        }
        self.keep(&kept);
    }

    /// Keeps these rows, in order.
    fn keep(&mut self, kept: &[usize]) {
        let n = self.joints;
        for list in [
            &mut self.q,
            &mut self.v,
            &mut self.a,
            &mut self.sign,
            &mut self.tau,
        ] {
            for (to, from) in kept.iter().enumerate() {
                list.copy_within(from * n..(from + 1) * n, to * n);
            }
            list.truncate(kept.len() * n);
        }
        for (to, from) in kept.iter().enumerate() {
            self.log[to] = self.log[*from];
        }
        self.log.truncate(kept.len());
    }

    /// About `most` rows of these, evenly spread.
    pub fn spread(&self, most: usize) -> Vec<usize> {
        let step = self.len().div_ceil(most.max(1)).max(1);
        (0..self.len()).step_by(step).collect()
    }
}

/// Takes rows as they come and keeps at most [`MOST_ROWS`], every so many: twice as rarely each time that
/// there are too many.
#[derive(Debug, Clone)]
pub struct Thinner {
    sample: Sample,
    every: u64,
    seen: u64,
}

impl Thinner {
    /// For a robot of so many joints.
    pub fn new(joints: usize) -> Self {
        Self {
            sample: Sample {
                joints,
                ..Sample::default()
            },
            every: 1,
            seen: 0,
        }
    }

    /// Adds a row of a log: positions, velocities, accelerations, signs of the velocities and torques, one after the
    /// other.
    pub fn add(&mut self, log: usize, channels: &[f64]) {
        let n = self.sample.joints;
        let take = self.seen.is_multiple_of(self.every);
        self.seen += 1;
        if !take || channels.len() != 5 * n || channels.iter().any(|x| !x.is_finite()) {
            return;
        }
        let s = &mut self.sample;
        let lists = [&mut s.q, &mut s.v, &mut s.a, &mut s.sign, &mut s.tau];
        for (list, x) in lists.into_iter().zip(channels.chunks_exact(n)) {
            list.extend_from_slice(x);
        }
        s.log.push(log);
        if s.len() > MOST_ROWS {
            self.every *= 2;
            let kept: Vec<usize> = (0..s.len()).step_by(2).collect();
            s.keep(&kept);
        }
    }

    /// The rows that were kept.
    pub fn finish(mut self) -> Sample {
        self.sample.without_rests();
        self.sample
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_log_is_thinned_evenly() {
        let mut thinner = Thinner::new(1);
        for k in 0..30_000 {
            let x = f64::from(k);
            thinner.add(k as usize / 10_000, &[x, 1.0, x, x, x]);
        }
        let sample = thinner.finish();
        assert!((MOST_ROWS / 2..=MOST_ROWS).contains(&sample.len()));
        let steps: Vec<f64> = sample.q.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(steps.iter().all(|s| *s == steps[0]), "{steps:?}");
        assert_eq!(sample.log[sample.len() - 1], 2);
    }

    #[test]
    fn rows_in_which_nothing_moves_are_left_out() {
        let mut thinner = Thinner::new(2);
        for k in 0..100 {
            let (v, w) = if k % 4 == 0 { (0.0, 0.0) } else { (0.0, 1.0) };
            let q = f64::from(k);
            let row = [q, q, v, w, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
            thinner.add(0, &row);
        }
        let sample = thinner.finish();
        assert_eq!(sample.len(), 75);
        let kept = sample.q.iter().step_by(2);
        assert!(kept.clone().all(|q| q % 4.0 != 0.0) && sample.tau.len() == 150);
    }
}
