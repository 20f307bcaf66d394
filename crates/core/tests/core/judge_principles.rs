//! The judge beside least squares from scratch: blocks left out, gains, amplitudes and their deviations.

use cft_ident_core::judge::{
    BlockSums, Blocks, BlocksLeftOut, Bound, EffectTerms, FitToAll, JointFit, NUMBERS, Term, Terms,
    TimeBlock, agreement_on_share, compare, floor,
};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

use crate::diagnosis_bench::Chance;

const BLOCKS: usize = 20;
const ROWS: usize = 40;
/// Columns of each joint.
const COLUMNS: usize = 4;
const WEIGHTS: [f64; 2] = [1.0, 2.5];

/// Rows of a block and joint, the torque last.
fn rows(block: usize, joint: usize) -> DMatrix<f64> {
    let mut chance = Chance((7 * block + 1000 * joint + 3) as u32);
    let mut x = DMatrix::from_fn(ROWS, COLUMNS + 1, |_, _| chance.next());
    for r in 0..ROWS {
        let truth: f64 = (0..COLUMNS - 1).map(|c| (c as f64 + 1.0) * x[(r, c)]).sum();
        x[(r, COLUMNS)] = truth + 0.3 * chance.next();
    }
    x
}

fn sums() -> BlockSums {
    let mut out = BlockSums::zeros(BLOCKS, &[COLUMNS; 2]);
    for b in 0..BLOCKS {
        for j in 0..2 {
            let x = rows(b, j);
            out.blocks[b][j] += x.tr_mul(&x);
            out.rows[b][j] += ROWS as f64;
        }
    }
    out
}

fn term(columns: &[(usize, usize)]) -> Term {
    Term {
        columns: columns.to_vec(),
        bound: Bound::NONE,
    }
}

/// One unknown that both joints have, and one of each; more are the third column of the first joint and the last.
fn terms() -> Terms {
    Terms {
        list: vec![term(&[(0, 0), (1, 0)]), term(&[(0, 1)]), term(&[(1, 1)])],
        weights: WEIGHTS.to_vec(),
        prior: (DMatrix::zeros(3, 3), DVector::zeros(3)),
        ridge: 0.0,
    }
}

fn more() -> Vec<Term> {
    vec![term(&[(0, 2)]), term(&[(1, 2), (0, 3)])]
}

/// Columns and torques of the rows of some blocks, weighted; rows of the others are zero.
fn weighted_rows(terms: &Terms, keep: impl Fn(usize) -> bool) -> (DMatrix<f64>, DVector<f64>) {
    let u = terms.list.len();
    let count = 2 * BLOCKS * ROWS;
    let (mut x, mut y) = (DMatrix::zeros(count, u), DVector::zeros(count));
    for b in (0..BLOCKS).filter(|b| keep(*b)) {
        for (j, weight) in WEIGHTS.iter().enumerate() {
            let own = rows(b, j);
            for r in 0..ROWS {
                let at = (2 * b + j) * ROWS + r;
                for (i, term) in terms.list.iter().enumerate() {
                    for (_, c) in term.columns.iter().filter(|(of, _)| *of == j) {
                        x[(at, i)] = weight.sqrt() * own[(r, *c)];
                    }
                }
                y[at] = weight.sqrt() * own[(r, COLUMNS)];
            }
        }
    }
    (x, y)
}

/// Least squares of the rows of some blocks, from scratch; and what they leave of a block, joint by joint.
fn solved(terms: &Terms, keep: impl Fn(usize) -> bool) -> DVector<f64> {
    let (x, y) = weighted_rows(terms, keep);
    x.svd(true, true)
        .solve(&y, 1e-12)
        .expect("both sides were asked for")
}

/// Part of the information on the last term beside the others that each block holds.
fn leverages(terms: &Terms) -> Vec<f64> {
    let (x, _) = weighted_rows(terms, |_| true);
    let last = x.ncols() - 1;
    let (others, own) = (x.columns(0, last).into_owned(), x.column(last).into_owned());
    let explained = others.clone().svd(true, true).solve(&own, 1e-12);
    let beside = &own - &others * explained.expect("both sides were asked for");
    let of_block = |b: usize| beside.rows(2 * b * ROWS, 2 * ROWS).norm_squared();
    (0..BLOCKS)
        .map(|b| of_block(b) / beside.norm_squared())
        .collect()
}

fn left(terms: &Terms, values: &DVector<f64>, b: usize, j: usize) -> f64 {
    let own = rows(b, j);
    let mut y = own.column(COLUMNS).into_owned();
    for (term, x) in terms.list.iter().zip(values) {
        for (_, c) in term.columns.iter().filter(|(of, _)| *of == j) {
            y -= own.column(*c) * *x;
        }
    }
    y.norm_squared()
}

#[track_caller]
fn near(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * b.abs().max(1e-9), "{a} {b}");
}

#[test]
fn a_block_left_out_is_judged_by_a_fit_that_never_saw_it() {
    let (sums, terms) = (sums(), terms());
    let left_out = BlocksLeftOut::new(&sums, 0, &terms).expect("rows that determine all");
    let errors = left_out.errors();
    for (b, values) in left_out.values().enumerate() {
        let expected = solved(&terms, |other| other != b);
        assert!((values - &expected).amax() < 1e-9, "{b}");
        for (j, error) in errors[b].iter().enumerate() {
            near(*error, left(&terms, &expected, b, j), 1e-8);
        }
    }
    assert_eq!(left_out.values().count(), BLOCKS);
}

#[test]
fn blocks_that_judge_alone_are_judged_by_the_fit_to_all_others() {
    let (sums, terms) = (sums(), terms());
    let judging = 5;
    let left_out = BlocksLeftOut::new(&sums, judging, &terms).expect("rows that determine all");
    let fitted = BLOCKS - judging;
    assert_eq!(left_out.values().count(), fitted);
    let expected = solved(&terms, |b| b < fitted);
    let errors = left_out.errors();
    for (b, errors) in errors.iter().enumerate().skip(fitted) {
        near(errors[1], left(&terms, &expected, b, 1), 1e-8);
    }
    let without = solved(&terms, |b| b < fitted && b != 2);
    near(errors[2][0], left(&terms, &without, 2, 0), 1e-8);
}

#[test]
fn the_gain_of_a_fit_to_all_blocks_is_the_fall_of_their_squares() {
    let (sums, terms) = (sums(), terms());
    let left_out = BlocksLeftOut::new(&sums, 0, &terms).expect("rows that determine all");
    let whole = left_out.whole_fit().expect("rows that determine all");
    let squares = |terms: &Terms| {
        let values = solved(terms, |_| true);
        let each = (0..BLOCKS).flat_map(|b| [0, 1].map(|j| (b, j)));
        let each = each.map(|(b, j)| WEIGHTS[j] * left(terms, &values, b, j));
        each.sum::<f64>()
    };
    for more in [more(), more()[..1].to_vec()] {
        let gain = left_out.gain_of_fit(&more, &whole);
        near(gain, squares(&terms) - squares(&terms.with(&more)), 1e-8);
    }
}

#[test]
fn a_gain_is_the_fall_of_the_errors_where_all_is_fitted_anew() {
    let (sums, terms) = (sums(), terms());
    let left_out = BlocksLeftOut::new(&sums, 0, &terms).expect("rows");
    let gain = left_out.gain(&more());
    let with = terms.with(&more());
    let after = BlocksLeftOut::new(&sums, 0, &with).expect("rows").errors();
    let expected = compare(&left_out.errors(), &after, &WEIGHTS);
    near(gain.value, expected.value, 1e-8);
    for (a, b) in gain.joints.iter().zip(&expected.joints) {
        near(a[0], b[0], 1e-7);
        assert!(a[1] <= b[1] * (1.0 + 1e-7));
    }
    for (a, b) in gain.blocks.iter().zip(&expected.blocks) {
        near(*a, *b, 1e-7);
    }
    // by the scatter of the blocks, or by twice that about parts as the squares of the changes of torque are
    let n = BLOCKS as f64;
    let mean = gain.value / n;
    let square: f64 = gain.blocks.iter().map(|x| (x - mean).powi(2)).sum();
    let scatter = (n * square / (n - 1.0)).sqrt();
    let torques: Vec<f64> = (0..BLOCKS)
        .map(|b| {
            let values = |terms: &Terms| solved(terms, |other| other != b);
            let (x, _) = weighted_rows(&with, |other| other == b);
            let mut moved = values(&with);
            let before = values(&terms);
            (0..before.len()).for_each(|i| moved[i] -= before[i]);
            (x * moved).norm_squared()
        })
        .collect();
    let all: f64 = torques.iter().sum();
    let off = |b: usize| (gain.blocks[b] - gain.value * torques[b] / all).powi(2);
    let about = (0..BLOCKS)
        .map(|b| off(b) / (1.0 - torques[b] / all))
        .sum::<f64>();
    let alike = (0..BLOCKS).map(|b| off(b) * all / torques[b]).sum::<f64>() / n;
    near(gain.se, scatter.min(2.0 * about.max(alike).sqrt()), 1e-6);
    let ratio = gain.value / gain.se;
    assert!(gain.is_beyond(0.99 * ratio, None) && !gain.is_beyond(1.01 * ratio, None));
    let own = gain.joints[0][0] / gain.joints[0][1];
    assert!(gain.is_beyond(0.99 * ratio.min(own), Some(0)));
    assert!(!gain.is_beyond(1.01 * own, Some(0)));
    // what is only noise gains nothing beyond chance
    let noise = left_out.gain(&[term(&[(0, 3)])]);
    assert!(!noise.is_beyond(NUMBERS.screen, None));
}

#[test]
fn the_quick_errors_of_blocks_are_those_of_blocks_left_out() {
    let (sums, terms) = (sums(), terms());
    // a torque as the sum of two columns
    let half = |s: &DMatrix<f64>| {
        let n = s.nrows();
        let map = DMatrix::from_fn(n, n + 1, |r, c| match (r, c) {
            (r, c) if r + 1 < n && r == c => 1.0,
            (r, c) if r + 1 == n && c + 1 >= n => 0.5,
            _ => 0.0,
        });
        map.tr_mul(&(s * &map))
    };
    let split: Vec<Vec<DMatrix<f64>>> = (sums.blocks.iter())
        .map(|joints| joints.iter().map(half).collect())
        .collect();
    let add = |mut a: Vec<DMatrix<f64>>, b: &Vec<DMatrix<f64>>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let total = split[1..].iter().fold(split[0].clone(), add);
    let torques = vec![DVector::from_element(2, 1.0); 2];
    let expected = BlocksLeftOut::new(&sums, 0, &terms).expect("rows");
    let errors = expected.errors();
    let whole: f64 = errors
        .iter()
        .map(|e| e[0] * WEIGHTS[0] + e[1] * WEIGHTS[1])
        .sum();
    let order: Vec<usize> = (0..BLOCKS).rev().collect();
    let quick = |most: f64| {
        let all = FitToAll::new(&total, &torques, &terms);
        all.blocks((&order, |b| split[b].as_slice()), most)
    };
    let found = quick(1.001 * whole).expect("not above the most");
    let pairs = found.errors.iter().flatten().zip(errors.iter().flatten());
    pairs.for_each(|(a, b)| near(*a, *b, 1e-7));
    for (a, b) in found.without.iter().zip(expected.values()) {
        assert!((a - b).amax() < 1e-9);
    }
    assert!((&found.values - solved(&terms, |_| true)).amax() < 1e-9);
    assert!(quick(0.999 * whole).is_none());
    let all = FitToAll::new(&total, &torques, &terms);
    let least = all.least().expect("it explains something");
    near(all.error_of(&total), least, 1e-9);
    // a fit to all blocks leaves less of them than fits without each
    assert!(least < whole && least > 0.8 * whole);
    assert!(all.is_above(1.01 * whole, whole) && !all.is_above(whole, whole));
}

#[test]
fn an_amplitude_and_its_deviation_are_those_of_the_fits_without_each_block() {
    let (sums, terms) = (sums(), terms().with(&more()));
    let fit = JointFit::new(&sums, BLOCKS, terms.clone(), 1.0).expect("rows");
    let expected = solved(&terms, |_| true);
    assert!((&fit.values - &expected).amax() < 1e-9);
    let n = BLOCKS as f64;
    let mut scatter = DMatrix::zeros(5, 5);
    for b in 0..BLOCKS {
        let off = solved(&terms, |other| other != b) - &expected;
        scatter += &off * off.transpose() * ((n - 1.0) / n);
    }
    assert!((fit.covariance() - &scatter).amax() < 1e-9 * scatter.amax());
    // of one coefficient F is the square of its value over its deviation
    let alone = EffectTerms {
        coefficients: 3..4,
        slopes: Vec::new(),
    };
    let found = fit.amplitude(&alone, (None, false), &NUMBERS);
    near(found.values[0], expected[3], 1e-9);
    let mut order = terms.clone();
    order.list.swap(3, 4);
    let h = leverages(&order);
    let square = |b: usize, c: usize| match b == c {
        true => (h[b] / (1.0 - h[b])).powi(2),
        false => (h[b] * h[c] / ((1.0 - h[b]) * (1.0 - h[c]))).powi(2),
    };
    let mean: f64 = h.iter().map(|h| h / (1.0 - h)).sum();
    let pairs = (0..BLOCKS).flat_map(|b| (0..BLOCKS).map(move |c| (b, c)));
    let blocks = 1.0 + mean * mean / pairs.map(|(b, c)| square(b, c)).sum::<f64>();
    let change = |b: usize| solved(&terms, |other| other != b)[3] / expected[3] - 1.0;
    let alike = (0..BLOCKS).map(|b| change(b).powi(2) * (1.0 - h[b]) / h[b]);
    let alike = alike.sum::<f64>() / n;
    let plain = scatter[(3, 3)] / expected[3].powi(2);
    let wide = mean * (n - 1.0) / n;
    let moderated = (4.0 * alike + (blocks - 1.0) * plain / wide) / (blocks + 3.0);
    let floor_of = |blocks: f64| floor(1, blocks, &NUMBERS).expect("blocks enough");
    let certainties = [
        wide / (plain * floor_of(blocks)),
        1.0 / (moderated * floor_of((blocks + 4.0).min(n))),
    ];
    let judging = if certainties[0] > certainties[1] {
        plain
    } else {
        moderated
    };
    near(found.certainty(), certainties[0].max(certainties[1]), 1e-4);
    near(found.f, 1.0 / judging, 1e-4);
    near(found.over_covariance, judging / plain, 1e-4);
    near(found.torque[1] / found.torque[0], judging.sqrt(), 1e-4);
    let square: f64 = (0..BLOCKS)
        .map(|b| rows(b, 0).column(2).norm_squared())
        .sum();
    let rms = expected[3].abs() * (square / (BLOCKS * ROWS) as f64).sqrt();
    near(found.torque[0], rms, 1e-6);
    assert!(found.blocks > 0.5 * n && found.blocks <= n);
    let sure = found.floor.expect("blocks enough");
    near(found.s, 1.0 - sure / found.f, 1e-9);
    near(found.certainty(), found.f / sure, 1e-9);
    near(
        found.deviations(&NUMBERS),
        5.0 * (found.f / sure).sqrt(),
        1e-9,
    );
    // in each block all else stays
    let by_block = fit.by_block(&alone, &NUMBERS);
    assert_eq!(by_block.len(), BLOCKS);
    let mean: f64 = by_block.iter().map(|x| x[0]).sum::<f64>() / n;
    assert!((mean / expected[3] - 1.0).abs() < 0.1, "{mean}");
    // what is only noise is as far off zero as its deviation
    let noise = Terms {
        list: vec![
            term(&[(0, 0)]),
            term(&[(0, 1)]),
            term(&[(0, 2)]),
            term(&[(0, 3)]),
        ],
        weights: vec![1.0, 0.0],
        prior: (DMatrix::zeros(4, 4), DVector::zeros(4)),
        ridge: 0.0,
    };
    let fit = JointFit::new(&sums, BLOCKS, noise, 1.0).expect("rows");
    let alone = EffectTerms {
        coefficients: 3..4,
        slopes: Vec::new(),
    };
    let found = fit.amplitude(&alone, (None, false), &NUMBERS);
    assert!(found.f < 16.0 && found.s == 0.0, "{found:?}");
}

#[test]
fn what_is_known_beforehand_pulls_as_firmly_as_it_is_known() {
    let sums = sums();
    let mut known = terms();
    let free = known.fit(&sums.over(0..BLOCKS), &[]).values;
    known.prior.0[(1, 1)] = 1e9;
    known.prior.1[1] = 1e9 * 7.0;
    let held = terms().fit(&sums.over(0..BLOCKS), &[(1, 7.0)]);
    let pulled = known.fit(&sums.over(0..BLOCKS), &[]);
    assert!((&pulled.values - &held.values).amax() < 1e-5);
    assert!((free[1] - 7.0).abs() > 1.0);
    for (a, b) in pulled.squares.iter().zip(&held.squares) {
        near(*a, *b, 1e-4);
    }
    // a bound that the values do not reach changes nothing; one that they would pass holds
    let mut bounded = terms();
    bounded.list[1].bound = Bound {
        least: 0.0,
        most: 100.0,
    };
    let found = bounded.fit(&sums.over(0..BLOCKS), &[]).values;
    assert!((&found - &free).amax() < 1e-9);
    bounded.list[1].bound.most = 1.0;
    let found = bounded.fit(&sums.over(0..BLOCKS), &[]).values;
    let expected = terms().fit(&sums.over(0..BLOCKS), &[(1, 1.0)]).values;
    assert!((&found - &expected).amax() < 1e-9);
}

#[test]
fn the_floor_of_f_is_as_rare_as_so_many_deviations_of_one_number() {
    // two readings of chance are asked, each half as often wrong
    let t = StudentsT::new(0.0, 1.0, 23.0).expect("degrees above 0");
    let rare = t.sf(NUMBERS.deviations);
    // of one number F is the square of Student's t
    for blocks in [24.0, 60.0] {
        let found = floor(1, blocks, &NUMBERS).expect("blocks");
        near(2.0 * t.sf(found.sqrt()), rare, 1e-6);
    }
    for (k, blocks) in [(1, 12.0), (2, 9.5), (3, 24.0), (6, 16.0)] {
        let found = floor(k, blocks, &NUMBERS).expect("blocks");
        let f = FisherSnedecor::new(k as f64, blocks - 1.0).expect("degrees above 0");
        near(f.sf(found), rare, 1e-6);
    }
    let of = |blocks: f64| floor(2, blocks, &NUMBERS).expect("blocks");
    assert!(of(8.0) > of(12.0) && of(12.0) > of(23.0));
    assert!(floor(1, 1.9, &NUMBERS).is_none());
}

#[test]
fn parts_that_take_off_the_same_share_agree_by_the_t_of_their_shares() {
    let parts = 14;
    let block = |part: usize| TimeBlock {
        log: 0,
        pieces: Vec::new(),
        part,
    };
    let blocks = Blocks {
        list: (0..2 * parts).map(|b| block(b / 2)).collect(),
        parts,
        least_s: 1.0,
    };
    let agreed = |spread: f64, scale: f64| {
        let mut chance = Chance(9);
        let shares: Vec<f64> = (0..parts).map(|_| 0.4 + spread * chance.next()).collect();
        let before = vec![vec![3.0 * scale, 1.0 * scale]; 2 * parts];
        let after = |b: usize| {
            before[b]
                .iter()
                .map(|e| e * (1.0 - shares[b / 2]))
                .collect()
        };
        let after: Vec<Vec<f64>> = (0..2 * parts).map(after).collect();
        let n = parts as f64;
        let mean = shares.iter().sum::<f64>() / n;
        let square: f64 = shares.iter().map(|s| (s - mean).powi(2)).sum();
        let t = mean / (square / (n * (n - 1.0))).sqrt();
        let found = agreement_on_share((&before, &after), &[1.0, 2.0], &blocks);
        near(found, (1.0 - 4.0 * n / (t * t)).max(0.0), 1e-9);
        found
    };
    let (sure, doubtful, none) = (agreed(0.1, 1.0), agreed(0.5, 1.0), agreed(3.0, 1.0));
    assert!(
        sure > 0.9 && doubtful < sure && none == 0.0,
        "{sure} {doubtful} {none}"
    );
    near(agreed(0.1, 1e6), sure, 1e-9);
}
