//! Small things that a right set-up may still have: a base that leans a little, a zero a few degrees off, torques
//! that lag behind the positions. They are effects and no faults: the check says what a fit looks like, and
//! `diagnose` finds how much of it there is.
//!
//! Each is a column or two beside those of the model, at the fit that the check has made: its derivative there.

use super::channels::{Carried, Drive};
use super::confirm;
use super::decide::{
    BLOCKS, DEVIATIONS, FEW, HARDLY, LOST, MORE_DEVIATIONS, ODDS, STROKES, TENTH, TIED,
};
use super::doubt::{GAIN, MORE};
use super::fit::{Fit, Power};
use super::fitted::{CALIBRATION, TILT};
use super::normal::{Added, Normal, Problem};
use super::trial::{Trial, power};
use cft_ident_core::robot::JointKind;

use nalgebra::DVector;

/// A larger zero is looked for among the faults \[rad\].
const ZERO: f64 = std::f64::consts::FRAC_PI_8;
/// A delay of fewer rows of the log is none: the time of a torque is not known better than its row.
const ROWS: f64 = 2.0;
/// Clocks and filters of drives differ by less \[s\].
const LATE: f64 = 0.1;
/// How the slope of a torque looks, so looks much that a model lacks, friction that lags and elasticity: a delay is
/// told where it is half of the power of what a joint misses.
const HALF: f64 = std::f64::consts::SQRT_2;
/// Step of differences \[rad\].
const STEP: f64 = 1e-4;

/// What a fit looks like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Small {
    /// A joint whose position lacks this \[rad\], and its deviation.
    Zero(usize, f64, f64),
    /// A base that leans: acceleration of free fall in its frame \[m/s^2\].
    Tilt([f64; 3]),
    /// Torques that lag behind the positions by this \[s\], and its deviation.
    Delay(f64, f64),
}

/// A small thing that explains significantly.
#[derive(Debug, Clone)]
pub struct Hint {
    pub small: Small,
    /// Mean relative error over the joints without it and with it.
    pub error: [f64; 2],
    /// Log-likelihood gained on held-out blocks, and what is needed.
    pub gain: f64,
    pub needed: f64,
    pub tried: usize,
    /// Others that explain as much.
    pub tied: Vec<Small>,
}

/// Kinds of columns, by their first place among the added ones.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Zero(usize),
    Tilt,
    Delay,
}

/// What is worth a look.
struct Looks<'a> {
    problem: &'a Problem<'a>,
    kinds: Vec<(Kind, Vec<usize>)>,
    /// Two directions across gravity.
    across: [[f64; 3]; 2],
    gravity: [f64; 3],
}

/// The small thing that explains most, if any explains significantly. `declared` is the set-up as it is, fitted to a
/// few rows.
pub(super) fn hint(
    problem: &Problem,
    declared: &Trial,
    stopped: &(dyn Fn() -> bool + Sync),
) -> Option<Hint> {
    let mut looks = Looks::new(problem);
    let few = problem.sample.spread(MORE);
    let first = looks.fitted(declared, &few)?;
    // as many of them as the few are nearly independent
    let share = (declared.normal.rows as f64 / few.len() as f64).min(1.0);
    let tried = looks.kinds.len();
    looks.kinds = (first.of.iter())
        .filter(|(.., fit)| share * (fit.score - first.declared.1.score) > GAIN)
        .filter(|(kind, normal, fit)| looks.small(*kind, normal, fit).is_some())
        .filter_map(|(kind, ..)| looks.kinds.iter().find(|(k, _)| k == kind).cloned())
        .collect();
    if looks.kinds.is_empty() || stopped() {
        return None;
    }
    let all: Vec<usize> = (0..problem.sample.len()).collect();
    let (fitted, needed) = (looks.fitted(declared, &all)?, ODDS + (tried as f64).ln());
    let (_, before) = &fitted.declared;
    let independent = confirm::independent(problem, &declared.robot, &declared.by, before);
    let mut found: Vec<Hint> = (fitted.of.iter())
        .filter_map(|(kind, normal, fit)| {
            let small = looks.small(*kind, normal, fit)?;
            let least = match kind {
                Kind::Delay => HALF,
                _ => TENTH,
            };
            let gain = fitted.confirmed((normal, fit), &independent, [needed, least])?;
            Some(Hint {
                small,
                error: [before.error(), fit.error()],
                gain,
                needed,
                tried,
                tied: Vec::new(),
            })
        })
        .collect();
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let others = found.iter().skip(1);
    let tied = others.take_while(|other| other.gain >= found[0].gain - TIED);
    let tied = tied.map(|other| other.small).collect();
    let best = found.into_iter().next()?;
    Some(Hint { tied, ..best })
}

/// The set-up as it is declared and with each small thing, fitted to the same rows.
struct Fits<'a> {
    problem: &'a Problem<'a>,
    declared: (Normal, Fit),
    of: Vec<(Kind, Normal, Fit)>,
    power: Power,
}

impl<'a> Looks<'a> {
    fn new(problem: &'a Problem<'a>) -> Self {
        let robot = problem.robot;
        let n = robot.joints();
        let gravity = robot.tree().gravity();
        let mut out = Self {
            problem,
            kinds: vec![(Kind::Delay, vec![0])],
            across: across(&gravity),
            gravity,
        };
        let moving = problem.moving().iter().filter(|moves| **moves).count();
        if robot.knows_links() && moving > 1 {
            out.kinds.push((Kind::Tilt, vec![1, 2]));
            let turns = |j: &usize| {
                problem.channels.drive != Drive::Motors
                    && robot.joint_kind(*j) == JointKind::Revolute
            };
            let zeros = (0..n).filter(turns).map(|j| (Kind::Zero(j), vec![3 + j]));
            out.kinds.extend(zeros);
        }
        out
    }

    /// Fits these rows, the columns taken at an earlier fit.
    fn fitted(&self, at: &Trial, rows: &[usize]) -> Option<Fits<'a>> {
        let problem = self.problem;
        let (robot, n) = (&at.robot, at.robot.joints());
        let p = robot.parameters().len();
        let theta: Vec<f64> = at.fit.theta.iter().take(p).copied().collect();
        let tilt = robot.tilt_along(&theta, self.across);
        let count = 3 + n;
        let has = |kind: Kind| self.kinds.iter().any(|(k, _)| *k == kind);
        let leans = has(Kind::Tilt);
        let zeros: Vec<usize> = (0..n).filter(|j| has(Kind::Zero(*j))).collect();
        let fill = |k: usize, row: &Carried, out: &mut [f64]| {
            let rates = &problem.sample.rate[k * n..(k + 1) * n];
            for (j, rate) in rates.iter().enumerate() {
                out[j * count] = -rate;
            }
            if leans {
                let mut torques = vec![[0.0; 2]; n];
                tilt.torques(&row.q, &mut torques);
                for (j, [a, b]) in torques.into_iter().enumerate() {
                    (out[j * count + 1], out[j * count + 2]) = (a, b);
                }
            }
            let mut q = row.q.clone();
            let torque = |q: &[f64]| {
                let mut tau = vec![0.0; n];
                robot.torque(&theta, q, &row.v, &row.a, &mut tau);
                tau
            };
            let here = torque(&q);
            for &z in &zeros {
                q[z] += STEP;
                for (j, (there, here)) in torque(&q).iter().zip(&here).enumerate() {
                    out[j * count + 3 + z] = (there - here) / STEP;
                }
                q[z] = row.q[z];
            }
        };
        let added = Added { count, fill: &fill };
        let whole = problem.normal_with(robot, &at.by, rows, BLOCKS, &added)?;
        let first = whole.unknowns - count;
        let mix = problem.channels.mix(&at.by);
        let power = power(problem, robot, &at.by, &whole, &mix, rows);
        let fit = |kept: &[usize]| -> Option<(Normal, Fit)> {
            let kept: Vec<usize> = kept.iter().map(|k| first + k).collect();
            let normal = whole.only(first, &kept);
            let fit = Fit::new(&normal, at.fit.targets.clone(), &power)?;
            Some((normal, fit))
        };
        let of = |(kind, places): &(Kind, Vec<usize>)| {
            let (normal, fit) = fit(places)?;
            Some((*kind, normal, fit))
        };
        Some(Fits {
            problem,
            declared: fit(&[])?,
            of: self.kinds.iter().filter_map(of).collect(),
            power,
        })
    }

    /// What a fit says of a kind, where that is neither nothing nor a fault.
    fn small(&self, kind: Kind, normal: &Normal, fit: &Fit) -> Option<Small> {
        let size = |back: usize| fit.theta[normal.unknowns - back];
        let deviation = || {
            let mut last = DVector::zeros(normal.unknowns);
            last[normal.unknowns - 1] = 1.0;
            fit.deviation(normal, &last)
        };
        match kind {
            Kind::Zero(j) => {
                let angle = size(1);
                let told = (CALIBRATION..ZERO).contains(&angle.abs());
                told.then(|| Small::Zero(j, angle, deviation()))
            }
            Kind::Delay => {
                let least = ROWS * self.problem.sample.logged_s;
                let told = (least..LATE).contains(&size(1).abs());
                told.then(|| Small::Delay(size(1), deviation()))
            }
            Kind::Tilt => {
                let length = norm(&self.gravity);
                let lean = (size(2).hypot(size(1)) / length).atan();
                let [a, b] = self.across;
                let there: [f64; 3] =
                    std::array::from_fn(|i| self.gravity[i] + size(2) * a[i] + size(1) * b[i]);
                let scale = length / norm(&there);
                (CALIBRATION..TILT)
                    .contains(&lean)
                    .then(|| Small::Tilt(there.map(|x| scale * x)))
            }
        }
    }
}

impl Fits<'_> {
    /// Log-likelihood that a small thing gains on blocks that were held out, where it is what is needed, all of them say
    /// so, and the error of a joint falls by this ratio.
    fn confirmed(
        &self,
        (normal, fit): (&Normal, &Fit),
        independent: &[f64],
        [needed, ratio]: [f64; 2],
    ) -> Option<f64> {
        let (plain, before) = &self.declared;
        let gain = confirm::gain(
            (before, plain, &self.power),
            (fit, normal, &self.power),
            independent,
        )?;
        let rows = independent.iter().sum::<f64>() * normal.rows as f64;
        let unknowns = normal.unknowns as f64;
        let deviations = match rows < FEW * unknowns {
            true => MORE_DEVIATIONS,
            false => DEVIATIONS,
        };
        let strokes = self.problem.sample.strokes();
        let pairs = before.left.iter().zip(&fit.left);
        let moved = pairs
            .filter(|(b, a)| **b > 0.0 && **a > 0.0)
            .map(|(b, a)| (b / a).sqrt())
            .fold(0.0, f64::max);
        let told = gain.all >= needed
            && gain.half >= -LOST * gain.all
            && gain.deviations >= deviations
            && strokes >= STROKES[0].max(STROKES[1] * unknowns)
            && strokes >= HARDLY * unknowns
            && moved > ratio;
        told.then_some(gain.all)
    }
}

fn norm(x: &[f64; 3]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Two directions across a third one and each other: those of the base's x and y, where that is its z.
fn across(g: &[f64; 3]) -> [[f64; 3]; 2] {
    let mut axes: [usize; 3] = [0, 1, 2];
    axes.sort_by(|a, b| g[*a].abs().total_cmp(&g[*b].abs()));
    let square = g.iter().map(|x| x * x).sum::<f64>().max(f64::MIN_POSITIVE);
    let mut first = [0.0; 3];
    first[axes[0].min(axes[1])] = 1.0;
    let along = g[axes[0].min(axes[1])] / square;
    let first: [f64; 3] = std::array::from_fn(|i| first[i] - along * g[i]);
    let first = first.map(|x| x / norm(&first));
    let length = square.sqrt();
    let next = |i: usize| {
        (first[(i + 2) % 3] * g[(i + 1) % 3] - first[(i + 1) % 3] * g[(i + 2) % 3]) / length
    };
    [first, std::array::from_fn(next)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_across_gravity_are_of_length_one_and_square_to_it() {
        for g in [[0.0, 0.0, -9.81], [0.0, -9.81, 0.0], [3.0, -4.0, 8.0]] {
            let [a, b] = across(&g);
            let dot = |x: &[f64; 3], y: &[f64; 3]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
            for square in [
                dot(&a, &g),
                dot(&b, &g),
                dot(&a, &b),
                norm(&a) - 1.0,
                norm(&b) - 1.0,
            ] {
                assert!(square.abs() < 1e-12, "{g:?} {a:?} {b:?}");
            }
        }
    }
}
