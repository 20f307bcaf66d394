//! The set point that a firmware makes of its command, step by step.
//!
//! A step's set point is the mean of the late command over it: what an impulse over the step sees, whether the command
//! jumps inside the step or not, so that it is smooth in the delay.

use super::track::CommandIs;

/// The running integral of a command.
#[derive(Debug, Clone)]
pub struct CommandIntegral<'a> {
    t: &'a [f64],
    x: &'a [f64],
    kind: CommandIs,
    sums: Vec<f64>,
    at: usize,
    /// Where the last step ended, and the integral up to there.
    last: (f64, f64),
}

impl<'a> CommandIntegral<'a> {
    /// From a time on.
    pub fn new(t: &'a [f64], x: &'a [f64], kind: CommandIs, from: f64) -> Self {
        let mut sums = Vec::with_capacity(t.len());
        let mut sum = 0.0;
        for k in 0..t.len() {
            if k > 0 {
                let mean = match kind {
                    CommandIs::Held => x[k - 1],
                    CommandIs::Linear => 0.5 * (x[k - 1] + x[k]),
                };
                sum += mean * (t[k] - t[k - 1]);
            }
            sums.push(sum);
        }
        let mut out = CommandIntegral {
            t,
            x,
            kind,
            sums,
            at: 0,
            last: (from, 0.0),
        };
        out.last.1 = out.up_to(from).0;
        out
    }

    /// The integral up to a time, and the command there; before the first sample the command is the first.
    fn up_to(&mut self, time: f64) -> (f64, f64) {
        let last = self.t.len() - 1;
        if time <= self.t[0] {
            return (self.x[0] * (time - self.t[0]), self.x[0]);
        }
        while self.at > 0 && self.t[self.at] > time {
            self.at -= 1;
        }
        while self.at < last && self.t[self.at + 1] <= time {
            self.at += 1;
        }
        let k = self.at;
        let since = time - self.t[k];
        let mut slope = 0.0;
        if self.kind == CommandIs::Linear && k < last {
            slope = (self.x[k + 1] - self.x[k]) / (self.t[k + 1] - self.t[k]);
        }
        let sum = self.sums[k] + (self.x[k] + 0.5 * slope * since) * since;
        (sum, self.x[k] + slope * since)
    }

    /// Mean from where the last step ended up to a time, and the command there.
    #[inline]
    pub fn mean_up_to(&mut self, to: f64) -> (f64, f64) {
        let (from, before) = self.last;
        let (sum, there) = self.up_to(to);
        self.last = (to, sum);
        ((sum - before) / (to - from), there)
    }
}

/// A set point that runs after its target no faster than it may.
#[derive(Debug, Clone, Copy)]
pub struct Follower {
    at: f64,
    /// The target where the last step ended.
    target: f64,
    /// Longest way of one second [rad].
    v_max: f64,
}

impl Follower {
    pub fn new(at: f64, slowness: f64) -> Self {
        let v_max = if slowness > 0.0 {
            1.0 / slowness
        } else {
            f64::INFINITY
        };
        let target = at;
        Follower { at, target, v_max }
    }

    /// The mean of the set point over a step of `h`, along which its target has a mean and an end.
    #[inline]
    pub fn step(&mut self, (mean, end): (f64, f64), h: f64) -> f64 {
        let way = self.v_max * h;
        let moved = end - self.target;
        let behind = self.at - self.target;
        self.at += (end - self.at).clamp(-way, way);
        self.target = end;
        let left = self.at - end;
        if left != 0.0 {
            return mean + 0.5 * (behind + left);
        }
        if behind == 0.0 {
            return mean;
        }
        // it catches up inside the step
        let closing = way + moved * behind.signum();
        mean + 0.5 * behind * (behind.abs() / closing.max(behind.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_over_a_step_is_exact_for_jumps_and_ramps() {
        let t = [0.0, 1.0, 2.0];
        let mean = |x: &[f64], kind, [from, to]: [f64; 2]| {
            CommandIntegral::new(&t, x, kind, from).mean_up_to(to).0
        };
        let (held, ramp) = (CommandIs::Held, CommandIs::Linear);
        for (kind, span, expected) in [
            (held, [0.5, 1.5], 1.0),
            (held, [-1.0, 0.5], 0.0),
            (ramp, [0.0, 1.0], 1.0),
            (ramp, [0.5, 1.5], 1.75),
            // after its last sample the command stays
            (ramp, [5.0, 6.0], 2.0),
        ] {
            let found = mean(&[0.0, 2.0, 2.0], kind, span);
            assert!(
                (found - expected).abs() < 1e-12,
                "{kind:?} {span:?}: {found}"
            );
        }
    }

    #[test]
    fn the_mean_is_smooth_in_the_delay_where_the_command_jumps() {
        let t: Vec<f64> = (0..100).map(|k| 0.005 * f64::from(k)).collect();
        let x: Vec<f64> = t.iter().map(|t| if *t < 0.2 { 0.0 } else { 1.0 }).collect();
        let (h, step) = (2.5e-3, 1e-6);
        let total = |late: f64| -> f64 {
            let mut command = CommandIntegral::new(&t, &x, CommandIs::Held, -late);
            let ends = (1..190).map(|k| f64::from(k) * h);
            ends.map(|end| command.mean_up_to(end - late).0).sum()
        };
        let change = total(0.0312 + step) - total(0.0312);
        assert!((change * h / step + 1.0).abs() < 1e-6, "{change}");
    }

    #[test]
    fn a_slow_set_point_runs_at_its_speed_and_arrives() {
        let steps = |count: usize| {
            let mut follower = Follower::new(0.0, 0.2);
            (0..count)
                .map(|_| follower.step((1.0, 1.0), 2.5e-3))
                .last()
                .unwrap()
        };
        assert_eq!(steps(100), 1.0);
        assert!((steps(40) - 5.0 * 39.5 * 2.5e-3).abs() < 1e-12);
    }

    #[test]
    fn a_set_point_that_is_fast_enough_is_its_target() {
        let mut follower = Follower::new(0.0, 0.2);
        for k in 0..100 {
            let (from, to) = (0.01 * f64::from(k), 0.01 * f64::from(k + 1));
            let mean = 0.5 * (from + to);
            assert!((follower.step((mean, to), 2.5e-3) - mean).abs() < 1e-12);
        }
    }
}
