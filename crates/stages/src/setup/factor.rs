//! Factors that are fitted. One that is a ratio or a unit of the list is a mistake; any other is an estimate.

use rayon::prelude::*;

use super::LIMITS;
use super::correction::{Change, Correction};
use super::finding::ChannelKind::{self, Both, Position, Torque};
use super::hypotheses::round_numbers;
use super::problem::Problem;
use super::trial::Trial;

/// Logarithm of the largest factor that is looked for.
const WIDEST: f64 = 5.5;
/// Steps of the logarithm in which the best factor is looked for.
const STEP: f64 = 0.1;
/// Newton steps to the best factor.
const STEPS: usize = 4;
/// Standard deviations to the ends of a 95 % interval.
const TWO_SIDED: f64 = 1.96;

/// A factor of a channel by the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    pub channel: ChannelKind,
    pub joint: usize,
    pub value: f64,
    pub interval_95: [f64; 2],
}

impl Factor {
    fn change(channel: ChannelKind, joint: usize, x: f64) -> Change {
        match channel {
            Both => Change::Gear(joint, x),
            channel => Change::Scale(channel, vec![joint], x),
        }
    }

    /// The factor as a change, and the mistakes that it may be.
    pub fn changes(&self, ratios: &[f64]) -> (Change, Vec<Change>) {
        let of = |x: f64| Self::change(self.channel, self.joint, x);
        let round = round_numbers(self.channel, ratios, self.interval_95);
        (of(self.value), round.into_iter().map(of).collect())
    }
}

/// The best factor of each channel of some joints, where it takes off what a mistake does.
pub(super) fn factors(
    problem: &Problem,
    base: &Correction,
    joints: &[usize],
    (few, whole): (&Trial, &Trial),
    [few_rows, rows]: [(&[usize], usize); 2],
) -> Vec<Factor> {
    let sides = [Torque, Position, Both];
    let errors = whole.errors();
    // a position in another unit leaves nothing explained
    let may = |(side, j): &(ChannelKind, usize)| *side == Torque || errors[*j] > LIMITS.unexplained;
    let cases: Vec<(ChannelKind, usize)> = (joints.iter())
        .flat_map(|j| sides.map(|side| (side, *j)))
        .filter(may)
        .collect();
    let all: Vec<usize> = (0..few.power.len()).collect();
    let of = |(side, j): &(ChannelKind, usize)| {
        let at = |x: f64, rows: (&[usize], usize), same: &Trial| {
            let change = Factor::change(*side, *j, x.exp());
            Trial::new(problem, (base, Some(&change)), rows, Some(same))
        };
        // torques have factors both ways, positions on a motor's side are too large
        let [low, high] = match side {
            Torque => [-WIDEST, WIDEST],
            Position => [-WIDEST, 2.0],
            Both => [0.0, WIDEST],
        };
        let count = ((high - low) / STEP) as usize;
        let grid = (0..=count).map(|k| low + STEP * k as f64);
        let best = grid
            .filter_map(|x| Some((x, at(x, few_rows, few)?.square(&all))))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        if best.1 > LIMITS.floor * few.square(&all) || best.0 <= low || best.0 >= high - STEP {
            return None;
        }
        let (mut x, mut std, mut h) = (best.0, 0.0, 0.2 * STEP);
        for _ in 0..STEPS {
            let of = |x: f64| Some(at(x, rows, whole)?.fitted());
            let (below, here, above) = (of(x - h)?, of(x)?, of(x + h)?);
            let scores = below.iter().zip(&above).map(|(b, a)| (a - b) / (2.0 * h));
            let sum = |of: &[f64]| of.iter().sum::<f64>();
            let curvature = (sum(&below) + sum(&above) - 2.0 * sum(&here)) / (h * h);
            if curvature <= 0.0 {
                x += h * (sum(&below) - sum(&above)).signum();
                continue;
            }
            let score = (sum(&above) - sum(&below)) / (2.0 * h);
            std = scores.map(|s| s * s).sum::<f64>().sqrt() / curvature;
            x -= (score / curvature).clamp(-STEP, STEP);
            h = std.clamp(1e-4, 0.2 * STEP);
        }
        (std > 0.0).then(|| Factor {
            channel: *side,
            joint: *j,
            value: x.exp(),
            interval_95: [-TWO_SIDED, TWO_SIDED].map(|k| (x + k * std).exp()),
        })
    };
    cases.par_iter().filter_map(of).collect()
}
