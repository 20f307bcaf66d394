//! Which effects stand: the one that helps most on neighbours left out, again and again; then each by its own
//! deviation in the model of all that stand, until none falls.

use nalgebra::{DMatrix, DVector, Matrix3, SVD, Vector3};

use super::NUMBERS;
use super::effect::{DEGREES, WrenchEffect};
use super::equations::LinearisedAt;
use super::fit::{WrenchFit, WrenchProblem, blocks, held_out_blocks, mean_norms};
use super::physics::{BaseColumns, felt};
use super::taring::with_tarings;
use super::wrench_log::turn_of;
use cft_ident_core::judge::{hotelling, hotelling_floor};
use cft_ident_core::robot::tree::space::UNTURNED;

/// An effect with what was decided of it.
#[derive(Debug, Clone)]
pub(super) struct JudgedEffect {
    pub effect: WrenchEffect,
    /// Mean norms of forces and moments left out, before and with it.
    pub before: [f64; 2],
    pub after: [f64; 2],
    /// What it takes off the squared error of rows left out, in standard errors.
    pub gain: [f64; 2],
    /// F of its numbers and the F that chance does not exceed.
    pub statistic: [f64; 2],
    pub written: bool,
}

impl JudgedEffect {
    /// 1 - floor / F, at least 0.
    pub fn shrinkage(&self) -> f64 {
        let [f, floor] = self.statistic;
        if f > floor { 1.0 - floor / f } else { 0.0 }
    }
}

/// Effects that stand, their fit, and all that were tried and helped.
pub(super) struct FoundEffects {
    pub fit: WrenchFit,
    pub judged: Vec<JudgedEffect>,
}

/// Blocks by which effects are judged and intervals are made: each as long as what is left remembers.
fn judging_blocks(
    problem: &WrenchProblem,
    effects: &[WrenchEffect],
) -> Vec<std::ops::Range<usize>> {
    let n = problem.rows.len();
    let memory = fitted(problem, effects, &held_out_blocks(n)).memory();
    blocks(n, memory.max(n / NUMBERS.blocks))
}

/// The fit of a set of effects, from where a turned sensor is nearest.
pub(super) fn fitted(
    problem: &WrenchProblem,
    effects: &[WrenchEffect],
    blocks: &[std::ops::Range<usize>],
) -> WrenchFit {
    match effects.contains(&WrenchEffect::TurnedSensor) {
        true => problem.fit_from(effects, blocks, nearest_turn(problem)),
        false => problem.fit(effects, blocks),
    }
}

/// The turn that brings gravity's directions nearest to the forces (Kabsch 1976), with the mass that goes with it.
pub(super) fn nearest_turn(problem: &WrenchProblem) -> LinearisedAt {
    let mut at = LinearisedAt {
        mass: 0.0,
        first_moment: [0.0; 3],
        turn: UNTURNED,
        lean: [0.0; 2],
    };
    let n = problem.rows.len().max(1) as f64;
    let pairs: Vec<[Vector3<f64>; 2]> = problem
        .rows
        .iter()
        .map(|row| [Vector3::from(felt(row, &at)), Vector3::from(row.force)])
        .collect();
    let mean = |k: usize| pairs.iter().map(|pair| pair[k]).sum::<Vector3<f64>>() / n;
    let means = [mean(0), mean(1)];
    let mut spread = Matrix3::zeros();
    let mut power = 0.0;
    for [u, f] in &pairs {
        let (u, f) = (u - means[0], f - means[1]);
        spread += u * f.transpose();
        power += u.norm_squared();
    }
    let svd = SVD::new(spread, true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
        return at;
    };
    // from the directions to the forces: u -> turn' u
    let sign = (u * v).determinant().signum();
    let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign));
    let turn = u * flip * v;
    at.turn = std::array::from_fn(|i| std::array::from_fn(|j| turn[(i, j)]));
    let s = svd.singular_values;
    at.mass = (s[0] + s[1] + sign * s[2]) / power.max(f64::MIN_POSITIVE);
    at
}

/// What is tried beside `chosen`; a drift of another degree takes the place of one that is there.
fn candidates(problem: &WrenchProblem, chosen: &[WrenchEffect]) -> Vec<Vec<WrenchEffect>> {
    let mut out = Vec::new();
    let has = |name: &str| chosen.iter().any(|e| e.name() == name);
    let drift = |e: &&WrenchEffect| !matches!(e, WrenchEffect::BiasDrift { .. });
    let rest: Vec<WrenchEffect> = chosen.iter().filter(drift).copied().collect();
    for degree in 1..=DEGREES {
        let effect = WrenchEffect::BiasDrift { degree };
        if !chosen.contains(&effect) {
            out.push([&rest[..], &[effect]].concat());
        }
    }
    let mut single = vec![
        WrenchEffect::LeaningBase,
        WrenchEffect::TurnedSensor,
        WrenchEffect::Gains,
    ];
    if spread(problem) > NUMBERS.cable_m {
        single.push(WrenchEffect::Cable);
    }
    for effect in single {
        if !has(effect.name()) {
            out.push([chosen, &[effect]].concat());
        }
    }
    // steps of the bias stand beside a drift, or in its place
    out.extend(with_tarings(problem, chosen));
    if rest.len() < chosen.len() {
        out.extend(with_tarings(problem, &rest));
    }
    let base = problem.base.len();
    let fits = |set: &Vec<WrenchEffect>| {
        let numbers: usize = set.iter().map(WrenchEffect::numbers).sum();
        base + numbers < 6 * problem.rows.len() / 2
    };
    out.retain(fits);
    out
}

/// Root mean square distance of places from their middle \[m\]; 0 where they are not logged.
fn spread(problem: &WrenchProblem) -> f64 {
    let squares = problem.rows.iter().map(|row| {
        row.away
            .map_or(0.0, |away| away.iter().map(|x| x * x).sum())
    });
    (squares.sum::<f64>() / problem.rows.len().max(1) as f64).sqrt()
}

/// Sum of what one fit takes off another's squared errors by block, and its standard error.
fn gain(before: &[f64], after: &[f64]) -> [f64; 2] {
    let d: Vec<f64> = before.iter().zip(after).map(|(a, b)| a - b).collect();
    let n = d.len() as f64;
    let mean = d.iter().sum::<f64>() / n;
    let scatter = d.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    [n * mean, (scatter * n).sqrt()]
}

/// What a fit takes off the logarithms of the mean squares of force and moment on rows left out.
fn log_gain(before: &WrenchFit, after: &WrenchFit) -> f64 {
    let squares = |fit: &WrenchFit, from: usize| {
        let all = fit.held_out.iter().flat_map(|e| &e[from..from + 3]);
        all.map(|x| x * x).sum::<f64>().max(f64::MIN_POSITIVE).ln()
    };
    [0, 3]
        .map(|from| squares(before, from) - squares(after, from))
        .iter()
        .sum()
}

/// Whether a gain counts, and is worth a word.
fn counts([sum, se]: [f64; 2], before: f64) -> bool {
    let left = 1.0 - NUMBERS.noticeable;
    sum > NUMBERS.screen * se && before - sum < left * left * before
}

/// The effects of a log.
pub(super) fn search(problem: &WrenchProblem) -> FoundEffects {
    let n = problem.rows.len();
    let left_out = held_out_blocks(n);
    let mut chosen: Vec<WrenchEffect> = Vec::new();
    let mut judged: Vec<JudgedEffect> = Vec::new();
    if left_out.len() < NUMBERS.fewest_blocks {
        let fit = problem.fit(&[], &left_out);
        return FoundEffects { fit, judged };
    }
    let mut now = problem.fit(&[], &left_out);
    let mut squares = problem.squares(&now);
    let mut steps: Vec<JudgedEffect> = Vec::new();
    while chosen.len() < NUMBERS.effects {
        let tried = candidates(problem, &chosen).into_iter().map(|set| {
            let fit = fitted(problem, &set, &left_out);
            let after = problem.squares(&fit);
            (gain(&squares, &after), after, fit)
        });
        // force and moment each by its own error, whichever is the larger
        let helps = tried.filter(|(gained, ..)| counts(*gained, squares.iter().sum()));
        let best = helps.max_by(|a, b| log_gain(&now, &a.2).total_cmp(&log_gain(&now, &b.2)));
        let Some((gained, after, fit)) = best else {
            break;
        };
        // a drift of another degree, or steps at other places, began where those before them did
        let begun = |name: &str| {
            steps
                .iter()
                .find(|step| step.effect.name() == name)
                .cloned()
        };
        let stands = |effect: &WrenchEffect| {
            let own = steps.iter().find(|step| step.effect == *effect).cloned();
            own.unwrap_or_else(|| {
                let before = begun(effect.name());
                let [sum, se] = before.as_ref().map_or([0.0; 2], |step| step.gain);
                JudgedEffect {
                    effect: *effect,
                    before: before.map_or(mean_norms(&now.held_out), |step| step.before),
                    after: mean_norms(&fit.held_out),
                    gain: [sum + gained[0], se.hypot(gained[1])],
                    statistic: [0.0, f64::INFINITY],
                    written: false,
                }
            })
        };
        steps = fit.effects.iter().map(stands).collect();
        (chosen, squares, now) = (fit.effects.clone(), after, fit);
    }
    let fit = settled(problem, &mut steps);
    judged.append(&mut steps);
    FoundEffects { fit, judged }
}

/// Judges what was found in the model of all that stand; what falls leaves, the weakest first.
fn settled(problem: &WrenchProblem, steps: &mut [JudgedEffect]) -> WrenchFit {
    let mut standing: Vec<usize> = (0..steps.len()).collect();
    loop {
        let effects: Vec<WrenchEffect> = standing.iter().map(|k| steps[*k].effect).collect();
        let judging = judging_blocks(problem, &effects);
        let fit = fitted(problem, &effects, &judging);
        let count = judging.len();
        for (k, at) in standing.iter().enumerate() {
            let of = fit.of_effect(k);
            let asked: Vec<usize> = effects[k]
                .judged()
                .into_iter()
                .map(|i| of.start + i)
                .collect();
            let a = DVector::from_fn(asked.len(), |i, _| fit.x[asked[i]]);
            let v = DMatrix::from_fn(asked.len(), asked.len(), |i, j| {
                fit.covariance[(asked[i], asked[j])]
            });
            let least = match count >= NUMBERS.fewest_blocks {
                true => hotelling_floor(asked.len(), count),
                false => f64::INFINITY,
            };
            steps[*at].statistic = [hotelling(&a, &v), least];
            steps[*at].written = steps[*at].shrinkage() > NUMBERS.confirmed;
        }
        let over = |k: &usize| steps[*k].statistic[0] / steps[*k].statistic[1];
        let weak = standing.iter().filter(|k| !steps[**k].written).copied();
        let Some(weakest) = weak.min_by(|a, b| over(a).total_cmp(&over(b))) else {
            return fit;
        };
        match steps[weakest].effect {
            // the same with fewer numbers
            WrenchEffect::BiasDrift { degree } if degree > 1 => {
                steps[weakest].effect = WrenchEffect::BiasDrift { degree: degree - 1 };
            }
            _ => standing.retain(|k| *k != weakest),
        }
    }
}

/// The turn of a sensor as three numbers, for a message \[rad\].
pub(super) fn turn_in_numbers(at: &LinearisedAt) -> [f64; 3] {
    turn_of(&at.turn)
}

/// Places of what is to be known of the body.
pub(super) const BODY: std::ops::Range<usize> = BaseColumns::MASS..BaseColumns::INERTIA;
