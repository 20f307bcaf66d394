//! A bounded number of smoothed rows, spread over the logs.

/// Most rows that are kept.
pub const MOST_ROWS: usize = 2000;

/// A joint that goes the other way in a smaller share of its rows does not tell friction from a constant
/// torque.
const OTHER_WAY: f64 = 0.1;
/// A speed below this share of the largest one is rest.
const REST: f64 = 0.05;

/// A joint rests below this share of its rms speed.
const RESTING: f64 = 0.01;

/// A speed below this share of the rms speed tells no direction.
const SLOW: f64 = 0.1;

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
    /// Known friction of each joint [N or N m], filtered as the torques are; empty where none is known.
    pub friction: Vec<f64>,
    /// How fast the torques change \[N/s or N m/s\].
    pub rate: Vec<f64>,
    /// Of each row, its log.
    pub log: Vec<usize>,
    /// Time that a row stands for \[s\].
    pub spacing_s: f64,
    /// Time from one row of the logs to the next, the longest of them \[s\].
    pub logged_s: f64,
    /// Cut-off of the filter that the rows came through \[Hz\].
    pub cutoff_hz: f64,
}

/// One row.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub a: &'a [f64],
    pub sign: &'a [f64],
    pub tau: &'a [f64],
    /// Known friction; empty where none is known.
    pub friction: &'a [f64],
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
            tau: &self.tau[at.clone()],
            friction: match self.friction.is_empty() {
                true => &[],
                false => &self.friction[at],
            },
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

    /// How often joints go the other way, all joints together: motions that differ.
    pub fn strokes(&self) -> f64 {
        let n = self.joints.max(1);
        let mut count = 0;
        for (j, rms) in self.rms(&self.v).into_iter().enumerate() {
            let fast = self
                .v
                .iter()
                .skip(j)
                .step_by(n)
                .filter(|v| v.abs() > SLOW * rms);
            let mut last = 0.0;
            for v in fast {
                count += usize::from(last * v < 0.0);
                last = *v;
            }
        }
        count as f64
    }

    /// How far a joint travels \[m or rad\].
    pub(super) fn travel(&self, joint: usize) -> f64 {
        let q = self.q.iter().skip(joint).step_by(self.joints.max(1));
        let ends = |(l, h): (f64, f64), q: &f64| (l.min(*q), h.max(*q));
        let (low, high) = q.fold((f64::INFINITY, f64::NEG_INFINITY), ends);
        high - low
    }

    /// Whether the motion of a joint tells its friction from a constant torque: it goes both ways.
    pub(super) fn tells_friction(&self, joint: usize) -> bool {
        let of_joint = self.v.iter().skip(joint);
        let speeds = || of_joint.clone().step_by(self.joints.max(1)).copied();
        let most = speeds().fold(0.0, |most: f64, v| most.max(v.abs()));
        let forward = speeds().filter(|v| *v > REST * most).count() as f64;
        let backward = speeds().filter(|v| *v < -REST * most).count() as f64;
        forward.min(backward) > OTHER_WAY * (forward + backward)
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
            &mut self.rate,
            &mut self.friction,
        ] {
            if list.is_empty() {
                continue;
            }
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
    /// Time that all rows stand for \[s\].
    seconds: f64,
    /// The last two rows that came, the later one first.
    before: [Passed; 2],
    /// Whether the later one was kept: its rate waits for the row behind it.
    kept: bool,
}

/// A row that has passed.
#[derive(Debug, Clone, Default)]
struct Passed {
    /// Log and stretch of it; none before the first row.
    stretch: Option<(usize, usize)>,
    t: f64,
    tau: Vec<f64>,
}

impl Passed {
    /// How fast each torque changes from this row to another one; 0 across a gap.
    fn rates<'a>(&'a self, to: &'a Self) -> impl Iterator<Item = f64> + 'a {
        let joined = self.stretch.is_some() && self.stretch == to.stretch && to.t > self.t;
        (0..to.tau.len()).map(move |j| match joined {
            true => (to.tau[j] - self.tau[j]) / (to.t - self.t),
            false => 0.0,
        })
    }
}

impl Thinner {
    /// For a robot of `joints` joints whose rows are filtered at `cutoff_hz`.
    pub fn new(joints: usize, cutoff_hz: f64) -> Self {
        Self {
            sample: Sample {
                joints,
                cutoff_hz,
                ..Sample::default()
            },
            every: 1,
            seen: 0,
            seconds: 0.0,
            before: Default::default(),
            kept: false,
        }
    }

    /// The rows to come are of a log whose rows are so far apart \[s\].
    pub fn logged_every(&mut self, seconds: f64) {
        self.sample.logged_s = self.sample.logged_s.max(seconds);
    }

    /// Adds the row at time `t` \[s\] of a stretch without gaps, which stands for `seconds`: positions, velocities,
    /// accelerations, signs of the velocities and torques, one after the other; then friction
    /// where it is known. A stretch is a log and a number in it.
    pub fn add(&mut self, stretch: (usize, usize), t: f64, seconds: f64, channels: &[f64]) {
        let n = self.sample.joints;
        self.seconds += seconds;
        let take = self.seen.is_multiple_of(self.every);
        self.seen += 1;
        if ![5 * n, 6 * n].contains(&channels.len()) || channels.iter().any(|x| !x.is_finite()) {
            return;
        }
        let now = Passed {
            stretch: Some(stretch),
            t,
            tau: channels[4 * n..5 * n].to_vec(),
        };
        let [last, earlier] = &self.before;
        let s = &mut self.sample;
        // around a row where both its neighbours are of its stretch
        if self.kept && last.stretch == now.stretch {
            let from = match earlier.stretch == now.stretch {
                true => earlier,
                false => last,
            };
            s.rate.truncate((s.log.len() - 1) * n);
            s.rate.extend(from.rates(&now));
        }
        self.kept = take;
        if take {
            let lists = [&mut s.q, &mut s.v, &mut s.a, &mut s.sign, &mut s.tau];
            for (list, x) in lists.into_iter().zip(channels.chunks_exact(n)) {
                list.extend_from_slice(x);
            }
            s.friction.extend_from_slice(&channels[5 * n..]);
            s.rate.extend(last.rates(&now));
            s.log.push(stretch.0);
            if s.len() > MOST_ROWS {
                self.every *= 2;
                let kept: Vec<usize> = (0..s.len()).step_by(2).collect();
                s.keep(&kept);
            }
        }
        self.before.rotate_right(1);
        self.before[0] = now;
    }

    /// The rows that were kept.
    pub fn finish(mut self) -> Sample {
        self.sample.spacing_s = self.seconds / self.sample.len().max(1) as f64;
        self.sample.without_rests();
        self.sample
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_log_is_thinned_evenly() {
        let mut thinner = Thinner::new(1, 10.0);
        for k in 0..30_000 {
            let x = f64::from(k);
            let log = (k as usize / 10_000, 0);
            thinner.add(log, 0.01 * x, 0.01, &[x, 1.0, x, x, x]);
        }
        let sample = thinner.finish();
        assert!((MOST_ROWS / 2..=MOST_ROWS).contains(&sample.len()));
        let steps: Vec<f64> = sample.q.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(steps.iter().all(|s| *s == steps[0]), "{steps:?}");
        // torques grow by one a row of 0.01 s, within each log and at its ends
        assert!(sample.rate.len() == sample.len());
        let known = |rate: &f64| (rate - 100.0).abs() < 1e-6;
        assert!(sample.rate[1..].iter().all(known), "{:?}", sample.rate);
        assert_eq!(sample.log[sample.len() - 1], 2);
        let all = sample.spacing_s * sample.len() as f64;
        assert!((all - 300.0).abs() < 1e-6, "{all}");
    }

    #[test]
    fn rows_in_which_nothing_moves_are_left_out() {
        let mut thinner = Thinner::new(2, 10.0);
        for k in 0..100 {
            let (v, w) = if k % 4 == 0 { (0.0, 0.0) } else { (0.0, 1.0) };
            let q = f64::from(k);
            let row = [q, q, v, w, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
            thinner.add((0, 0), 0.01 * q, 0.01, &row);
        }
        let sample = thinner.finish();
        assert_eq!(sample.len(), 75);
        let kept = sample.q.iter().step_by(2);
        assert!(kept.clone().all(|q| q % 4.0 != 0.0) && sample.tau.len() == 150);
    }
}
