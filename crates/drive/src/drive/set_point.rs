//! The set point that a firmware makes of its command, step by step.
//!
//! A step sees the set point part by straight part, wherever inside the step the command jumps or bends: what an impulse
//! over the step is made of, smooth in the delay and in the speed limit.

use super::track::CommandIs;

/// A command along time, line by line.
#[derive(Debug, Clone)]
pub struct CommandLines<'a> {
    t: &'a [f64],
    x: &'a [f64],
    kind: CommandIs,
    at: usize,
    /// Where the last line ended.
    last: f64,
}

/// A part of a command on one straight line: its first value, its slope and how long it lasts.
#[derive(Debug, Clone, Copy)]
struct StraightLine {
    from: f64,
    slope: f64,
    long: f64,
}

impl<'a> CommandLines<'a> {
    /// From a time on.
    pub fn new(t: &'a [f64], x: &'a [f64], kind: CommandIs, from: f64) -> Self {
        CommandLines {
            t,
            x,
            kind,
            at: 0,
            last: from,
        }
    }

    /// The line from where the last one ended, at most up to a time; before the first sample the command is the first,
    /// after the last the last.
    #[inline]
    fn next(&mut self, to: f64) -> StraightLine {
        let (from, last) = (self.last, self.t.len() - 1);
        if from < self.t[0] {
            self.last = to.min(self.t[0]);
            return StraightLine {
                from: self.x[0],
                slope: 0.0,
                long: self.last - from,
            };
        }
        while self.at < last && self.t[self.at + 1] <= from {
            self.at += 1;
        }
        let k = self.at;
        let mut slope = 0.0;
        self.last = to;
        if k < last {
            self.last = to.min(self.t[k + 1]);
            if self.kind == CommandIs::Linear {
                slope = (self.x[k + 1] - self.x[k]) / (self.t[k + 1] - self.t[k]);
            }
        }
        StraightLine {
            from: self.x[k] + slope * (from - self.t[k]),
            slope,
            long: self.last - from,
        }
    }
}

/// A set point that runs after its command no faster than it may.
#[derive(Debug, Clone, Copy)]
pub struct SetPointFollower {
    at: f64,
    /// Longest way of one second [rad].
    v_max: f64,
}

impl SetPointFollower {
    pub fn new(at: f64, slowness: f64) -> Self {
        let v_max = if slowness > 0.0 {
            1.0 / slowness
        } else {
            f64::INFINITY
        };
        SetPointFollower { at, v_max }
    }

    /// The set point from where the last step ended up to a time, part by part.
    #[inline]
    pub fn up_to(
        &mut self,
        command: &mut CommandLines,
        to: f64,
        visit: &mut impl FnMut(SetPointPart),
    ) {
        while command.last < to {
            self.along(command.next(to), visit);
        }
    }

    /// The set point along a line of the command.
    #[inline]
    fn along(&mut self, line: StraightLine, visit: &mut impl FnMut(SetPointPart)) {
        let StraightLine {
            mut from,
            slope,
            long,
        } = line;
        let mut left = long;
        if self.v_max.is_finite() && self.at != from {
            let behind = self.at - from;
            let closing = self.v_max + slope * behind.signum();
            let speed = -self.v_max * behind.signum();
            // where it does not catch up, it runs to the line's end
            let run = match closing * left > behind.abs() {
                true => behind.abs() / closing,
                false => left,
            };
            visit(self.part(self.at, speed, run));
            left -= run;
            if left <= 0.0 {
                return;
            }
            from += slope * run;
        }
        // on its command: it stays there, or falls behind one that is too fast
        visit(self.part(from, slope.clamp(-self.v_max, self.v_max), left));
    }

    fn part(&mut self, from: f64, speed: f64, long: f64) -> SetPointPart {
        self.at = from + speed * long;
        SetPointPart {
            from,
            to: self.at,
            long,
        }
    }
}

/// A set point that moves from one position to another \[rad\] in a time \[s\].
#[derive(Debug, Clone, Copy)]
pub struct SetPointPart {
    pub from: f64,
    pub to: f64,
    pub long: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    impl SetPointFollower {
        /// Mean of the set point from where the last step ended up to a time.
        fn mean_up_to(&mut self, command: &mut CommandLines, to: f64) -> f64 {
            let (mut integral, mut long) = (0.0, 0.0);
            self.up_to(command, to, &mut |part| {
                integral += 0.5 * (part.from + part.to) * part.long;
                long += part.long;
            });
            integral / long
        }
    }

    /// Mean of the set point over a span, of a command that is followed at any speed.
    fn mean(t: &[f64], x: &[f64], kind: CommandIs, [from, to]: [f64; 2]) -> f64 {
        let mut command = CommandLines::new(t, x, kind, from);
        SetPointFollower::new(x[0], 0.0).mean_up_to(&mut command, to)
    }

    #[test]
    fn the_mean_over_a_step_is_exact_for_jumps_and_ramps() {
        let (held, ramp) = (CommandIs::Held, CommandIs::Linear);
        for (kind, span, expected) in [
            (held, [0.5, 1.5], 1.0),
            (held, [-1.0, 0.5], 0.0),
            (ramp, [0.0, 1.0], 1.0),
            (ramp, [0.5, 1.5], 1.75),
            // after its last sample the command stays
            (ramp, [5.0, 6.0], 2.0),
        ] {
            let found = mean(&[0.0, 1.0, 2.0], &[0.0, 2.0, 2.0], kind, span);
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
        for kind in [CommandIs::Held, CommandIs::Linear] {
            for slowness in [0.0, 0.2] {
                let total = |late: f64| -> f64 {
                    let mut command = CommandLines::new(&t, &x, kind, -late);
                    let mut follower = SetPointFollower::new(0.0, slowness);
                    let ends = (1..190).map(|k| f64::from(k) * h);
                    ends.map(|end| follower.mean_up_to(&mut command, end - late))
                        .sum()
                };
                // a set point that is behind at the end is behind by as much as its command came later
                for late in [0.03, 0.0312, 0.0324] {
                    let change = total(late + step) - total(late);
                    assert!(
                        (change * h / step + 1.0).abs() < 1e-6,
                        "{kind:?} {slowness} {late}: {change}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_slow_set_point_runs_at_its_speed_and_arrives() {
        let steps = |count: usize| {
            let mut command = CommandLines::new(&[0.0, 1.0], &[1.0, 1.0], CommandIs::Held, 0.0);
            let mut follower = SetPointFollower::new(0.0, 0.2);
            let ends = (1..=count).map(|k| 2.5e-3 * k as f64);
            ends.map(|end| follower.mean_up_to(&mut command, end))
                .last()
                .unwrap()
        };
        assert_eq!(steps(100), 1.0);
        assert!((steps(40) - 5.0 * 39.5 * 2.5e-3).abs() < 1e-12);
    }

    #[test]
    fn a_slow_set_point_over_long_steps_is_that_of_short_ones() {
        let t: Vec<f64> = (0..40).map(|k| 0.013 * f64::from(k)).collect();
        let x: Vec<f64> = (0..40)
            .map(|k| 0.3 * (0.9 * f64::from(k)).sin() + 0.1 * f64::from(k % 3))
            .collect();
        for kind in [CommandIs::Held, CommandIs::Linear] {
            for slowness in [0.05, 0.2, 1.0] {
                let means = |h: f64, count: usize| -> Vec<f64> {
                    let mut command = CommandLines::new(&t, &x, kind, -0.0312);
                    let mut follower = SetPointFollower::new(x[0], slowness);
                    let ends = (1..=count).map(|k| h * k as f64 - 0.0312);
                    ends.map(|end| follower.mean_up_to(&mut command, end))
                        .collect()
                };
                let (long, short) = (means(5e-3, 100), means(5e-6, 100_000));
                for (long, short) in long.iter().zip(short.chunks(1000)) {
                    let short = short.iter().sum::<f64>() / 1000.0;
                    assert!((long - short).abs() < 1e-9, "{kind:?} {slowness}");
                }
            }
        }
    }

    #[test]
    fn a_set_point_that_is_fast_enough_is_its_target() {
        let t: Vec<f64> = (0..100).map(|k| 2.5e-3 * f64::from(k)).collect();
        let x: Vec<f64> = (0..100).map(|k| 0.01 * f64::from(k)).collect();
        let mut command = CommandLines::new(&t, &x, CommandIs::Linear, 0.0);
        let mut follower = SetPointFollower::new(0.0, 0.2);
        for k in 1..100 {
            let mean = 0.5 * (x[k - 1] + x[k]);
            assert!((follower.mean_up_to(&mut command, t[k]) - mean).abs() < 1e-12);
        }
    }
}
