//! The judge on motions and noise of our own: what is not there is not written, what is there is, with its amplitude.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

/// Rows per second, and how long a log is.
const RATE: f64 = 50.0;
const SECONDS: f64 = 60.0;

/// Columns of one joint along a motion: three that are declared, then candidates.
fn columns(log: u64) -> Vec<Vec<f64>> {
    let w = [0.9, 1.7, 2.9].map(|w| w * (1.0 + 0.13 * log as f64));
    let rows = (RATE * SECONDS) as usize;
    let at = |k: usize| {
        let t = k as f64 / RATE;
        let q: f64 = w.iter().map(|w| (w * t + w).sin()).sum();
        let v: f64 = w.iter().map(|w| w * (w * t + w).cos()).sum();
        let a: f64 = w.iter().map(|w| -w * w * (w * t + w).sin()).sum();
        let mut row = vec![a, v, v.signum()];
        // a hundred candidates of several kinds
        row.extend((1..=8).map(|n| v.signum() * (-(v / (0.1 * f64::from(n))).powi(2)).exp()));
        row.extend((1..=20).flat_map(|n| [(f64::from(n) * q).sin(), (f64::from(n) * q).cos()]));
        row.extend((1..=20).map(|n| v.signum() * (f64::from(n) * q).sin()));
        row.extend((2..=12).map(|n| q.powi(n) / 3f64.powi(n)));
        row.extend((1..=12).map(|n| v.signum() * v.abs().powf(0.25 * f64::from(n))));
        row.extend((1..=9).map(|n| (0.1 * f64::from(n) * t).sin()));
        row
    };
    let all: Vec<Vec<f64>> = (0..rows).map(at).collect();
    (0..all[0].len())
        .map(|c| all.iter().map(|row| row[c]).collect())
        .collect()
}

const DECLARED: usize = 3;

/// Noise of unit variance that forgets in `memory` seconds.
fn noise(chance: &mut ChaCha8Rng, rows: usize, memory: f64) -> Vec<f64> {
    let keep: f64 = match memory > 0.0 {
        true => (-1.0 / (RATE * memory)).exp(),
        false => 0.0,
    };
    let mut x = 0.0;
    let mut next = |k: usize| {
        let news: f64 = chance.sample(rand_distr::StandardNormal);
        x = match k {
            0 => news,
            _ => keep * x + (1.0 - keep * keep).sqrt() * news,
        };
        x
    };
    (0..rows).map(&mut next).collect()
}

/// A campaign: logs with torques of their own.
struct Campaign {
    sums: BlockSums,
    blocks: Blocks,
    terms: Terms,
    candidates: Vec<Term>,
}

impl Campaign {
    fn of(logs: u64, seed: u64, memory: f64, truth: &dyn Fn(&[Vec<f64>], usize) -> f64) -> Self {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let motions: Vec<Vec<Vec<f64>>> = (0..logs).map(columns).collect();
        let rows = motions[0][0].len();
        let of_log = |log: usize| LogRows {
            log,
            pieces: vec![(log, 0..rows)],
            step_s: 1.0 / RATE,
            moves: vec![true],
            counts: vec![true; rows],
        };
        let logs: Vec<LogRows> = (0..motions.len()).map(of_log).collect();
        let blocks = divide(&logs, memory.max(0.1), (NUMBERS.blocks, 1));
        let tau: Vec<Vec<f64>> = (motions.iter())
            .map(|columns| {
                let noise = noise(&mut chance, rows, memory);
                (0..rows).map(|k| noise[k] + truth(columns, k)).collect()
            })
            .collect();
        let count = motions[0].len();
        let mut sums = BlockSums::zeros(blocks.list.len(), &[count]);
        for (b, block) in blocks.list.iter().enumerate() {
            for (log, range) in &block.pieces {
                let all = motions[*log].iter().chain([&tau[*log]]);
                let own: Vec<f64> = all.flat_map(|c| c[range.clone()].to_vec()).collect();
                let x = DMatrix::from_vec(range.len(), count + 1, own);
                sums.blocks[b][0] += x.tr_mul(&x);
                sums.rows[b][0] += range.len() as f64;
            }
        }
        let term = |column| Term {
            columns: vec![(0, column)],
            bound: Bound::NONE,
        };
        let terms = Terms {
            list: (0..DECLARED).map(term).collect(),
            weights: vec![1.0],
            prior: (DMatrix::zeros(DECLARED, DECLARED), DVector::zeros(DECLARED)),
            ridge: NUMBERS.ridge,
        };
        Campaign {
            sums,
            blocks,
            terms,
            candidates: (DECLARED..count).map(term).collect(),
        }
    }

    /// Declared terms and some candidates.
    fn with(&self, chosen: &[usize]) -> Terms {
        let used = chosen.iter().map(|c| self.candidates[*c].clone());
        self.terms.with(&used.collect::<Vec<Term>>())
    }

    /// Candidates in the order in which they are chosen.
    fn chosen(&self) -> Vec<usize> {
        let mut chosen: Vec<usize> = Vec::new();
        while chosen.len() < NUMBERS.effects {
            let terms = self.with(&chosen);
            let left_out = BlocksLeftOut::new(&self.sums, 0, &terms).unwrap();
            let open = (0..self.candidates.len()).filter(|c| !chosen.contains(c));
            let gains = open.map(|c| (c, left_out.gain(&self.candidates[c..=c])));
            let best = gains
                .filter(|(_, gain)| gain.is_beyond(NUMBERS.screen, Some(0)))
                .max_by(|a, b| a.1.value.total_cmp(&b.1.value));
            match best {
                Some((c, _)) => chosen.push(c),
                None => break,
            }
        }
        chosen
    }

    fn joint_fit(&self, chosen: &[usize]) -> JointFit {
        let fitted = self.blocks.list.len();
        JointFit::new(&self.sums, fitted, self.with(chosen), 1.0).unwrap()
    }

    /// What is left in the set when all that stand pass, with what the blocks say of each; the least sure leaves first.
    fn judged(&self) -> Vec<(usize, EffectAmplitude)> {
        let mut set = self.chosen();
        loop {
            let fit = self.joint_fit(&set);
            let of =
                |(i, c): (usize, &usize)| (*c, fit.amplitude(&own(i), (None, false), &NUMBERS));
            let found: Vec<(usize, EffectAmplitude)> = set.iter().enumerate().map(of).collect();
            let out = found.iter().enumerate().filter(|(_, (_, a))| a.s == 0.0);
            let out = out.min_by(|a, b| a.1.1.certainty().total_cmp(&b.1.1.certainty()));
            match out.map(|(i, _)| i) {
                Some(i) => set.remove(i),
                None => return found,
            };
        }
    }
}

/// The terms of the candidate that was chosen in its turn.
fn own(at: usize) -> EffectTerms {
    let first = DECLARED + at;
    EffectTerms {
        coefficients: first..first + 1,
        slopes: Vec::new(),
    }
}

#[test]
fn noise_along_a_motion_confirms_nothing_and_writes_a_part_in_few_campaigns() {
    let plain = |c: &[Vec<f64>], k: usize| 0.7 * c[0][k] + 1.3 * c[1][k] + 2.0 * c[2][k];
    let (mut written, mut confirmed, mut all) = (0, 0, 0);
    for memory in [0.0, 0.2, 1.0] {
        for (logs, seeds) in [(1, 34), (2, 33)] {
            for seed in 0..seeds {
                let found = Campaign::of(logs, 100 * logs + seed, memory, &plain).judged();
                let above = |s: f64| u32::from(found.iter().any(|(_, a)| a.s > s));
                all += 1;
                written += above(0.0);
                confirmed += above(NUMBERS.confirmed);
            }
        }
    }
    assert_eq!(confirmed, 0, "of {all}");
    // 4 to 8 % where noise is slow, which a third of these is
    assert!(written * 20 <= all, "{written} of {all}");
}

#[test]
fn what_is_there_is_chosen_confirmed_and_has_its_amplitude() {
    // a sixth of the noise's power; of noise that remembers ten rows there are a twentieth as many
    for (memory, seed, size) in [(0.0, 1, 0.6), (0.2, 2, 2.0), (0.2, 3, 2.0)] {
        let truth = |c: &[Vec<f64>], k: usize| 2.0 * c[2][k] + size * c[DECLARED + 8][k];
        let found = Campaign::of(2, seed, memory, &truth).judged();
        let planted = found.iter().find(|(c, _)| *c == 8);
        let (_, amplitude) = planted.unwrap_or_else(|| panic!("{found:?}"));
        assert!(amplitude.s > 0.7, "{amplitude:?}");
        let value = amplitude.values[0];
        assert!((value - size).abs() < 0.15 * size, "{value}");
        // its torque has the deviation that judged it
        let [torque, std] = amplitude.torque;
        assert!(((torque / std).powi(2) / amplitude.f - 1.0).abs() < 1e-6);
        let false_ones = found.iter().filter(|(c, _)| *c != 8);
        assert_eq!(false_ones.count(), 0, "{found:?}");
    }
}

#[test]
fn a_shape_that_trades_with_its_amplitude_leaves_the_torque_as_sure() {
    let truth = |c: &[Vec<f64>], k: usize| 2.0 * c[2][k] + 2.0 * c[DECLARED + 2][k];
    let campaign = Campaign::of(2, 5, 0.0, &truth);
    let fit = campaign.joint_fit(&[2, 3]);
    let of = |coefficients, slopes| {
        let own = EffectTerms {
            coefficients,
            slopes,
        };
        fit.amplitude(&own, (None, false), &NUMBERS)
    };
    let shaped = of(DECLARED..DECLARED + 1, vec![DECLARED + 1]);
    let both = of(DECLARED..DECLARED + 2, Vec::new());
    let alone = of(DECLARED..DECLARED + 1, Vec::new());
    assert!(
        (shaped.torque[0] / both.torque[0] - 1.0).abs() < 1e-3,
        "{shaped:?} {both:?}"
    );
    // the coefficient by itself is as uncertain as the shape lets it be, the torque is not
    assert!(shaped.f > 4.0 * alone.f, "{shaped:?} {alone:?}");
    // of two numbers the torque is as sure as both together
    assert!(
        2.0 * both.f > 0.9 * shaped.f && both.s > 0.8,
        "{shaped:?} {both:?}"
    );
}

#[test]
fn a_coefficient_at_its_bound_is_held_and_does_not_count() {
    let truth = |c: &[Vec<f64>], k: usize| 2.0 * c[2][k] + 2.0 * c[DECLARED + 8][k];
    let mut campaign = Campaign::of(1, 6, 0.0, &truth);
    campaign.candidates[8].bound = Bound {
        least: f64::NEG_INFINITY,
        most: 0.0,
    };
    let fit = campaign.joint_fit(&[8]);
    let found = fit.amplitude(&own(0), (None, false), &NUMBERS);
    assert_eq!((found.values[0], found.f, found.s), (0.0, 0.0, 0.0));
}

#[test]
fn what_noise_of_positions_adds_is_in_the_deviation() {
    let truth = |c: &[Vec<f64>], k: usize| 2.0 * c[2][k] + 0.6 * c[DECLARED + 8][k];
    let campaign = Campaign::of(2, 1, 0.0, &truth);
    let fit = campaign.joint_fit(&[8]);
    let plain = fit.amplitude(&own(0), (None, false), &NUMBERS);
    // the torque along the column grows by a third of what it is: an amplitude that is sure to a third is not there
    let mut sums = campaign.sums.over(0..campaign.blocks.list.len());
    let (column, tau) = (DECLARED + 8, sums[0].ncols() - 1);
    let more = sums[0].column(column) * (plain.values[0] / 3.0);
    let through = sums[0].column(tau).into_owned() + more;
    sums[0].set_column(tau, &through);
    sums[0].set_row(tau, &through.transpose());
    let doubted = fit.amplitude(&own(0), (Some(&sums), false), &NUMBERS);
    let expected = 1.0 / (1.0 / plain.f + 1.0 / 9.0);
    assert!(
        (doubted.f / expected - 1.0).abs() < 0.02,
        "{doubted:?} {expected}"
    );
    assert!(plain.s > 0.7 && doubted.s == 0.0);
}

#[test]
fn what_only_one_part_asks_for_is_seen_and_not_confirmed() {
    let rows = (RATE * SECONDS) as usize;
    let event = |c: &[Vec<f64>], k: usize| {
        let there = (rows / 2..rows / 2 + rows / 8).contains(&k);
        2.0 * c[2][k] + if there { 4.0 * c[DECLARED + 8][k] } else { 0.0 }
    };
    let found = Campaign::of(1, 9, 0.1, &event).judged();
    assert!(found.iter().all(|(_, a)| a.s < 0.5), "{found:?}");
}

#[test]
fn a_block_left_out_has_the_error_of_a_fit_without_it() {
    let truth = |c: &[Vec<f64>], k: usize| c[0][k] + 0.3 * c[DECLARED + 3][k];
    let campaign = Campaign::of(1, 4, 0.0, &truth);
    let left_out = BlocksLeftOut::new(&campaign.sums, 0, &campaign.terms).unwrap();
    let more = &campaign.candidates[3..4];
    let with = campaign.terms.with(more);
    let gain = left_out.gain(more);
    let before = left_out.errors();
    for b in [0, 7, campaign.blocks.list.len() - 1] {
        let others = (0..campaign.blocks.list.len()).filter(|o| *o != b);
        let others = campaign.sums.over(others);
        let of_block = campaign.sums.over(b..=b);
        let plain = campaign.terms.fit(&others, &[]);
        let expected = campaign.terms.squares(&of_block, &plain.values)[0];
        assert!((before[b][0] / expected - 1.0).abs() < 1e-5);
        let fuller = with.fit(&others, &[]);
        let after = with.squares(&of_block, &fuller.values)[0];
        let off = gain.blocks[b] - (expected - after);
        assert!(off.abs() < 1e-3 * expected, "{off}");
    }
    let again = compare(&before, &before, &[1.0]);
    assert_eq!((again.value, again.se), (0.0, 0.0));
}

#[test]
fn a_gain_within_some_blocks_is_that_of_a_column_which_is_there_alone() {
    let truth = |c: &[Vec<f64>], k: usize| c[0][k] + if k > 1500 { 0.8 * c[2][k] } else { 0.0 };
    let campaign = Campaign::of(1, 5, 0.0, &truth);
    let left_out = BlocksLeftOut::new(&campaign.sums, 0, &campaign.terms).unwrap();
    let coulomb = &campaign.terms.list[2..3];
    let blocks = campaign.blocks.list.len();
    let gains = (1..blocks).map(|b| left_out.gain_within(coulomb, b..blocks));
    let best = gains.enumerate();
    let best = best.max_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let (at, gain) = best.unwrap();
    assert_eq!(at + 1, blocks / 2);
    assert!(gain.is_beyond(10.0, Some(0)));
    let by = left_out.amplitude_within(coulomb, blocks / 2..blocks);
    assert!((by[0] - 0.8).abs() < 0.1, "{by}");
}
