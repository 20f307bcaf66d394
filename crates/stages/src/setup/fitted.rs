//! Corrections whose number is fitted: zeros of any angle, scales of any factor, gravity of any direction.

use super::channels::Drive;
use super::correction::{Change, Correction};
use super::finding::ChannelKind;
use super::hypotheses::angle;
use super::normal::Problem;
use super::trial::Trial;
use cft_ident_core::robot::JointKind;

/// Step of a zero at which a likelihood is compared with its neighbours \[rad\].
const STEP: f64 = 0.06;
/// A zero that is looked for from the declared one is not farther from it \[rad\].
const NEAR: f64 = 0.8;
/// Smaller zeros are calibration, and no fault of a set-up \[rad\].
pub(super) const CALIBRATION: f64 = 2.5 * std::f64::consts::PI / 180.0;
/// Gravity that is off by less is a tilt, and no fault of a set-up \[rad\].
pub(super) const TILT: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Logarithm of a factor below which a torque constant is badly known, and no unit mistaken.
const LEAST_SCALE: f64 = 0.4;
/// No joint turns farther than this in a log, by its cables \[rad\].
const MANY_TURNS: f64 = 14.0;
/// Nor is a motion that excites it smaller \[rad\].
const HARDLY: f64 = 0.05;
/// Logarithm of the ratio of factors that are tried one after the other.
const RATIO: f64 = 0.025;
/// Logarithm of the ratio by which a factor beside a round one is looked for first.
const UNROUNDED: f64 = 0.3;
/// Halvings of a step behind the top of a climb.
const HALVES: usize = 4;
/// Steps of a search for the direction of gravity \[rad\].
const TURNS: [f64; 3] = [0.25, 0.08, 0.025];

/// Rows that numbers are fitted to.
pub(super) struct Fitted<'a> {
    pub problem: &'a Problem<'a>,
    pub base: &'a Correction,
    pub rows: &'a [usize],
    pub blocks: usize,
    /// The set-up as it is, on these rows.
    pub declared: &'a Trial,
}

impl Fitted<'_> {
    fn gravity(&self) -> [f64; 3] {
        let declared = || self.problem.robot.tree().gravity();
        self.base.gravity.unwrap_or_else(declared)
    }

    fn score(&self, change: &Change) -> Option<f64> {
        let by = self.base.with(change);
        Some(
            Trial::new(
                self.problem,
                by,
                self.rows,
                self.blocks,
                Some(self.declared),
            )?
            .fit
            .score,
        )
    }

    /// Corrections whose number does best, with their scores. `changes` are those without one, with theirs.
    pub fn proposals(
        &self,
        changes: &[Change],
        scores: &[Option<f64>],
        moving: &[usize],
    ) -> Vec<(Change, f64)> {
        let declared = self.declared.fit.score;
        let better = || {
            let both = changes.iter().zip(scores);
            both.filter_map(|(c, s)| s.filter(|s| *s > declared).map(|s| (c, s)))
        };
        let mut out = Vec::new();
        let robot = self.problem.robot;
        let motors = self.problem.channels.drive == Drive::Motors;
        if robot.knows_links() && robot.joints() > 1 && !motors {
            for j in (0..robot.joints()).filter(|j| robot.joint_kind(*j) == JointKind::Revolute) {
                let score = |z: f64| self.score(&Change::Zero(j, z));
                let of = better().filter_map(|(c, s)| match c {
                    Change::Zero(k, z) if *k == j => Some((*z, s)),
                    _ => None,
                });
                let mut starts = vec![(0.0, declared)];
                starts.extend(of.max_by(|a, b| a.1.total_cmp(&b.1)));
                for start in starts {
                    let (zero, score) = climbed(start, STEP, NEAR, &score);
                    if zero.abs() > CALIBRATION && score > declared {
                        out.push((Change::Zero(j, zero), score));
                    }
                }
            }
        }
        let gravity = better().filter_map(|(c, score)| match c {
            Change::Gravity(g) => Some((*g, score)),
            _ => None,
        });
        let now = self.gravity();
        // a base that leans a little is to stand beside the zeros that look like it
        let here = self.problem.in_gravity.map(|_| (now, declared));
        let starts = gravity
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .into_iter()
            .chain(here);
        for (g, score) in starts {
            let (g, score) = self.turned(g, score);
            if angle(&g, &now) > CALIBRATION && score > declared {
                out.push((Change::Gravity(g), score));
            }
        }
        out.extend(self.unrounded(better()));
        if moving.len() > 1 && !motors {
            for &j in moving {
                out.extend(self.scaled(ChannelKind::Torque, j, declared));
                out.extend(self.geared(j, declared));
            }
        }
        out
    }

    /// Factors beside round ones of these scores.
    pub fn beside(&self, changes: &[Change], scores: &[Option<f64>]) -> Vec<(Change, f64)> {
        let known = changes.iter().zip(scores);
        self.unrounded(known.filter_map(|(c, s)| s.map(|s| (c, s))))
    }

    /// Of each scale that does better by a round factor, the factor nearby that does best.
    fn unrounded<'b>(&self, better: impl Iterator<Item = (&'b Change, f64)>) -> Vec<(Change, f64)> {
        let mut best: Vec<(&Change, f64)> = Vec::new();
        for (change, score) in better {
            let Change::Scale(channel, joints, _) = change else {
                continue;
            };
            let same = |known: &&mut (&Change, f64)| matches!(known.0, Change::Scale(c, j, _) if c == channel && j == joints);
            match best.iter_mut().find(same) {
                Some(known) if known.1 < score => *known = (change, score),
                Some(_) => {}
                None => best.push((change, score)),
            }
        }
        let climb = |(change, score): (&Change, f64)| match change {
            Change::Scale(channel, joints, f) => {
                let of = |x: f64| Change::Scale(*channel, joints.clone(), x.exp());
                let (x, score) = climbed((f.ln(), score), UNROUNDED, 1.2, &|x| self.score(&of(x)));
                (x != f.ln()).then(|| (of(x), score))
            }
            _ => None,
        };
        best.into_iter().filter_map(climb).collect()
    }

    /// The vertex of the parabola through the likelihood at x and a step to both sides, and its curvature; x
    /// itself where there is no maximum nearby.
    fn vertex(&self, x: f64, step: f64, f: &dyn Fn(f64) -> Option<f64>) -> (f64, f64) {
        let (Some(a), Some(b), Some(c)) = (f(x - step), f(x), f(x + step)) else {
            return (x, 0.0);
        };
        let curvature = -(a + c - 2.0 * b) / (step * step);
        let slope = (c - a) / (2.0 * step);
        if curvature <= 0.0 {
            return (x, 0.0);
        }
        (x + slope / curvature, curvature)
    }

    /// The same correction with the number that does best on these rows, and the curvature of the
    /// likelihood there, by rows.
    pub fn polished(&self, change: &Change) -> (Change, f64) {
        match change {
            Change::Zero(j, z) => {
                let score = |z: f64| self.score(&Change::Zero(*j, z));
                let (mut z, mut curvature) = (*z, 0.0);
                for step in [STEP / 2.0, STEP / 4.0] {
                    let (next, found) = self.vertex(z, step, &score);
                    if (next - z).abs() < NEAR {
                        (z, curvature) = (next, found);
                    }
                }
                (Change::Zero(*j, z), curvature)
            }
            Change::Scale(channel, joints, f) => {
                let of = |x: f64| Change::Scale(*channel, joints.clone(), x.exp());
                let score = |x: f64| self.score(&of(x));
                let (x, curvature) = self.vertex(f.ln(), STEP, &score);
                // relative to the factor
                (
                    of(if (x - f.ln()).abs() < NEAR { x } else { f.ln() }),
                    curvature / (f * f),
                )
            }
            other => (other.clone(), 0.0),
        }
    }

    /// Gravity turned to where the likelihood is highest, from a direction with this score.
    fn turned(&self, mut g: [f64; 3], mut score: f64) -> ([f64; 3], f64) {
        for step in TURNS {
            for _ in 0..4 {
                let mut moved = false;
                for side in sides(&g, step) {
                    if let Some(other) = self.score(&Change::Gravity(side))
                        && other > score
                    {
                        (g, score, moved) = (side, other, true);
                    }
                }
                if !moved {
                    break;
                }
            }
        }
        (g, score)
    }

    /// A factor of any size on a joint's position, where it goes round many times or hardly at all: what is
    /// logged is before a gear then, or in an unknown unit.
    fn geared(&self, j: usize, declared: f64) -> Option<(Change, f64)> {
        let turns = self.problem.robot.joint_kind(j) == JointKind::Revolute;
        let sign = match self.problem.sample.travel(j) {
            range if turns && range > MANY_TURNS => -1.0,
            range if turns && range < HARDLY => 1.0,
            _ => return None,
        };
        let of = |k: usize| {
            Change::Scale(
                ChannelKind::Position,
                vec![j],
                (sign * RATIO * k as f64).exp(),
            )
        };
        let tried = (1..(8.0 / RATIO) as usize).filter_map(|k| {
            let change = of(k);
            self.score(&change).map(|score| (change, score))
        });
        tried
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, score)| *score > declared)
    }

    /// A factor of any size on a joint's torque, where three times or a third of it does better.
    fn scaled(&self, channel: ChannelKind, j: usize, declared: f64) -> Option<(Change, f64)> {
        let of = |x: f64| Change::Scale(channel, vec![j], x.exp());
        let score = |x: f64| self.score(&of(x));
        let (x, best) = climbed((0.0, declared), 1.1, 8.0, &score);
        (x.abs() > LEAST_SCALE && best > declared).then(|| (of(x), best))
    }
}

/// Uphill from x, whose score is known, first by steps that double, then by halves; no farther than `far`.
fn climbed(
    (from, score): (f64, f64),
    step: f64,
    far: f64,
    f: &dyn Fn(f64) -> Option<f64>,
) -> (f64, f64) {
    let (mut x, mut best) = (from, score);
    let mut h = 0.0;
    for side in [step, -step] {
        if let Some(next) = f(from + side).filter(|next| *next > best) {
            (x, best, h) = (from + side, next, side);
        }
    }
    if h == 0.0 {
        h = step;
    } else {
        while (x + 2.0 * h - from).abs() < far {
            match f(x + 2.0 * h) {
                Some(next) if next > best => (x, best, h) = (x + 2.0 * h, next, 2.0 * h),
                _ => break,
            }
        }
    }
    for _ in 0..HALVES {
        h /= 2.0;
        for at in [x - h, x + h] {
            if let Some(next) = f(at).filter(|next| *next > best) {
                (x, best) = (at, next);
            }
        }
    }
    (x, best)
}

/// Four directions a step away from this one.
fn sides(g: &[f64; 3], step: f64) -> [[f64; 3]; 4] {
    let length = g
        .iter()
        .map(|x| x * x)
        .sum::<f64>()
        .sqrt()
        .max(f64::MIN_POSITIVE);
    let cross = |a: &[f64; 3], b: &[f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    // the axis that it is farthest from
    let mut least = 0;
    for i in 1..3 {
        if g[i].abs() < g[least].abs() {
            least = i;
        }
    }
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let unit = |v: [f64; 3]| {
        let size = v
            .iter()
            .map(|x| x * x)
            .sum::<f64>()
            .sqrt()
            .max(f64::MIN_POSITIVE);
        v.map(|x| x / size)
    };
    let a = unit(cross(g, &axis));
    let b = unit(cross(g, &a));
    let to = |d: [f64; 3], sign: f64| {
        let (s, c) = (sign * step).sin_cos();
        std::array::from_fn(|i| c * g[i] + s * length * d[i])
    };
    [to(a, 1.0), to(a, -1.0), to(b, 1.0), to(b, -1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_beside_another_keep_its_length_and_are_a_step_away() {
        let g = [0.0, 6.0, -7.0];
        for side in sides(&g, 0.1) {
            assert!((angle(&g, &side) - 0.1).abs() < 1e-9);
            let length = |x: [f64; 3]| x.iter().map(|x| x * x).sum::<f64>();
            assert!((length(side) - length(g)).abs() < 1e-9);
        }
    }
}
