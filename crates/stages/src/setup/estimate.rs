//! Factors, zeros and directions that are fitted. One that is a ratio or a unit of the list is a mistake; any other is an
//! estimate and no fault.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::LIMITS;
use super::correction::{Change, Correction};
use super::finding::ChannelKind::{self, Both, Position, Torque};
use super::hypotheses::{LARGEST, round_numbers};
use super::problem::Problem;
use super::sum_waves::SumWaves;
use super::trial::Trial;
use super::weight::TWO_SIDED;

/// Step of the grid of factors, by their logarithm, and of angles \[rad\].
const STEP: f64 = 0.2;
/// Newton steps to the best value.
const STEPS: usize = 4;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Free {
    Factor(ChannelKind, usize),
    Zero(usize),
    /// The base leans about this axis.
    Lean(usize),
    /// The position where a velocity begins that is taken for it.
    Begins(usize),
}

/// A value by the data.
#[derive(Debug, Clone, PartialEq)]
pub struct SetupEstimate {
    /// The change of the set-up that it stands for.
    pub change: Change,
    /// A factor, or an angle \[rad\].
    pub value: f64,
    pub interval_95: [f64; 2],
    free: Free,
}

impl Free {
    fn joint(self) -> Option<usize> {
        match self {
            Self::Factor(_, j) | Self::Zero(j) | Self::Begins(j) => Some(j),
            Self::Lean(_) => None,
        }
    }

    fn change(self, problem: &Problem, x: f64) -> Change {
        match self {
            Self::Factor(Both, j) => Change::Gear(j, x.exp()),
            Self::Factor(channel, j) => Change::Scale(channel, vec![j], x.exp()),
            Self::Zero(j) => Change::Zero(j, x),
            Self::Begins(j) => Change::Velocity(j, x),
            Self::Lean(axis) => {
                let mut g = problem.robot.tree().gravity();
                let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
                (g[a], g[b]) = (
                    x.cos() * g[a] - x.sin() * g[b],
                    x.sin() * g[a] + x.cos() * g[b],
                );
                Change::Gravity(g)
            }
        }
    }

    /// Where it is looked for: torques have factors both ways, positions on a motor's side are too large.
    fn range(self) -> [f64; 2] {
        let widest = LARGEST.ln() + 2.0 * STEP;
        match self {
            Self::Factor(Torque, _) => [-widest, widest],
            Self::Factor(Position, _) => [-widest, 2.0],
            Self::Factor(Both, _) => [0.0, widest],
            _ => [-PI, PI],
        }
    }

    /// Values that are tried at first, no further from each other than a step.
    fn grid(self) -> Vec<f64> {
        let [low, high] = self.range();
        match self {
            Self::Factor(..) => {
                let steps = (low / STEP).ceil() as i32..=(high / STEP).floor() as i32;
                let steps = steps
                    .map(|k| f64::from(k) * STEP)
                    .filter(|x| low < *x && *x < high);
                [low].into_iter().chain(steps).chain([high]).collect()
            }
            _ => {
                let count = ((high - low) / STEP).ceil();
                let values = (0..=count as usize).map(|k| low + (high - low) * k as f64 / count);
                values.collect()
            }
        }
    }

    /// The value that its rows go by: what it does to torques alone leaves them as they are, and positions on a motor's
    /// side are those in another unit.
    fn motion(self, x: f64) -> f64 {
        match self {
            Self::Factor(Torque, _) => 0.0,
            Self::Factor(Both, _) => -x,
            _ => x,
        }
    }

    /// Whether rows that go by a value of one are those of the other.
    fn share_motions(&self, other: &Self) -> bool {
        matches!((self, other), (Self::Factor(Position, a), Self::Factor(Both, b)) if a == b)
    }

    /// Waves of its value that products of rows consist of: a row has two of an angle. None of what is no angle.
    fn waves(self) -> Option<usize> {
        match self {
            Self::Zero(_) | Self::Begins(_) => Some(4),
            Self::Lean(_) => Some(2),
            Self::Factor(..) => None,
        }
    }

    /// What these joints may have beside the list; positions of those in `asked`, whatever is missed.
    fn all(problem: &Problem, joints: &[usize], errors: &[f64], asked: &[usize]) -> Vec<Free> {
        let mut out = Vec::new();
        let zeros = problem.has_zeros();
        for &j in joints {
            out.push(Self::Factor(Torque, j));
            // a position that is none leaves nothing explained
            if errors[j] > LIMITS.sound || asked.contains(&j) {
                out.extend([Position, Both].map(|side| Self::Factor(side, j)));
                out.push(Self::Begins(j));
                out.extend(zeros.then_some(Self::Zero(j)));
            }
        }
        let leans =
            problem.in_gravity.is_some() && joints.iter().any(|j| errors[*j] > LIMITS.sound);
        out.extend([0, 1].into_iter().filter(|_| leans).map(Self::Lean));
        out
    }
}

impl SetupEstimate {
    /// Whether it is said where it is no mistake.
    pub(super) fn is_known(&self) -> bool {
        !matches!(self.free, Free::Begins(_))
    }

    /// The mistakes that it may be.
    pub(super) fn mistakes(&self, ratios: &[f64]) -> Vec<Change> {
        let of = |f: f64| match self.free {
            Free::Factor(Both, j) => Change::Gear(j, f),
            Free::Factor(channel, j) => Change::Scale(channel, vec![j], f),
            _ => self.change.clone(),
        };
        match self.free {
            Free::Factor(channel, _) => {
                let round = round_numbers(channel, ratios, self.interval_95);
                round.into_iter().map(of).collect()
            }
            Free::Begins(_) => vec![self.change.clone()],
            _ => Vec::new(),
        }
    }
}

/// The best values for some joints, where they take off what a mistake does.
pub(super) fn estimates(
    problem: &Problem,
    base: &Correction,
    (joints, asked): (&[usize], &[usize]),
    both: (&Trial, &Trial),
) -> Vec<SetupEstimate> {
    let cases = Free::all(problem, joints, &both.1.errors(), asked);
    let groups: Vec<&[Free]> = cases.chunk_by(Free::share_motions).collect();
    let of = |group: &&[Free]| -> Vec<SetupEstimate> {
        let nearest = nearest(problem, base, group);
        let pairs = group.iter().zip(nearest);
        let refined = |(free, x): (&Free, Option<f64>)| refined(problem, base, (*free, x?), both);
        pairs.filter_map(refined).collect()
    };
    groups.par_iter().flat_map_iter(of).collect()
}

/// The value of a grid that leaves least, of each of some that move the rows alike.
fn nearest(problem: &Problem, base: &Correction, group: &[Free]) -> Vec<Option<f64>> {
    let of_free = |(i, free): (usize, &Free)| {
        let free = *free;
        (free.grid().into_iter()).map(move |x| (free.motion(x), x, i))
    };
    let mut grid: Vec<(f64, f64, usize)> = group.iter().enumerate().flat_map(of_free).collect();
    // the nearest to the declared set-up of equals is tried first
    grid.sort_by(|(a, x, _), (b, y, _)| x.abs().total_cmp(&y.abs()).then(a.total_cmp(b)));
    let correction = |free: Free, x: f64| base.with(&free.change(problem, x));
    let waves = match group {
        [free] => free.waves(),
        _ => None,
    };
    let wave = waves.and_then(|waves| {
        SumWaves::new(waves, |x| {
            problem.sums(&correction(group[0], x), problem.few())
        })
    });
    let mut best = vec![(f64::INFINITY, None); group.len()];
    for of_motion in grid.chunk_by(|a, b| a.0 == b.0) {
        let (_, x, i) = of_motion[0];
        let sums = match &wave {
            Some(wave) => Some(wave.at(x)),
            None => problem.sums(&correction(group[i], x), problem.few()),
        };
        let Some(sums) = sums else { continue };
        for &(_, x, i) in of_motion {
            let score = Trial::least(problem, &correction(group[i], x), &sums);
            if let Some(score) = score.filter(|score| *score < best[i].0) {
                best[i] = (score, Some(x));
            }
        }
    }
    best.into_iter().map(|(_, x)| x).collect()
}

/// The best value from a near one on, where it takes off what a mistake does.
fn refined(
    problem: &Problem,
    base: &Correction,
    (free, mut x): (Free, f64),
    (few, whole): (&Trial, &Trial),
) -> Option<SetupEstimate> {
    let [low, high] = free.range();
    let change = free.change(problem, x);
    let rows = (problem.few(), f64::INFINITY);
    let found = Trial::new(problem, (base, Some(&change)), rows, &[few])?;
    let own = free.joint().map(|j| vec![j]);
    let own = own.unwrap_or_else(|| problem.channels_that_move());
    let turns = (low, high) == (-PI, PI);
    let at_end = !turns && (x <= low || x >= high);
    if at_end || found.square(&own) > LIMITS.floor * few.square(&own) {
        return None;
    }
    let (mut std, mut h) = (0.0, 0.2 * STEP);
    for _ in 0..STEPS {
        let of = |x: f64| {
            let change = free.change(problem, x);
            Trial::fitted(problem, (base, Some(&change)), whole)
        };
        let (below, here, above) = (of(x - h)?, of(x)?, of(x + h)?);
        let scores = below.iter().zip(&above).map(|(b, a)| (a - b) / (2.0 * h));
        let sum = |of: &[f64]| of.iter().sum::<f64>();
        let curvature = (sum(&below) + sum(&above) - 2.0 * sum(&here)) / (h * h);
        let score = (sum(&above) - sum(&below)) / (2.0 * h);
        if curvature <= 0.0 {
            x -= h * score.signum();
            continue;
        }
        std = scores.map(|s| s * s).sum::<f64>().sqrt() / curvature;
        x -= (score / curvature).clamp(-STEP, STEP);
        h = std.clamp(1e-4, 0.2 * STEP);
    }
    let from_log = |x: f64| match free {
        Free::Factor(..) => x.exp(),
        _ => x,
    };
    (std > 0.0).then(|| SetupEstimate {
        change: free.change(problem, x),
        value: from_log(x),
        interval_95: [-TWO_SIDED, TWO_SIDED].map(|k| from_log(x + k * std)),
        free,
    })
}
