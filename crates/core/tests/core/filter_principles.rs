//! What filters and sums must satisfy whatever passes through them.

use cft_ident_core::math::gram::{gram, stride};
use cft_ident_core::math::rfactor::RFactor;
use cft_ident_core::math::sos::SosFilter;
use cft_ident_core::math::zero_phase::ZeroPhase;
use nalgebra::DMatrix;

const RATE: f64 = 1000.0;

fn filters() -> [ZeroPhase; 3] {
    let butterworth = |order, cutoff| SosFilter::butterworth(order, cutoff, RATE).expect("valid");
    let chebyshev = SosFilter::chebyshev(8, 0.05, 40.0, RATE).expect("valid");
    [butterworth(4, 20.0), butterworth(5, 80.0), chebyshev].map(ZeroPhase::new)
}

fn signal(k: usize, of: usize) -> f64 {
    let (k, of) = (k as f64, of as f64);
    (0.03 * k * (of + 1.0)).sin() + 0.4 * (0.11 * k + of).cos() + 1e-3 * of * k
}

fn filtered(filter: &ZeroPhase, mut x: Vec<f64>) -> Vec<f64> {
    filter.run(&mut x, 1).expect("long enough");
    x
}

#[track_caller]
fn alike(a: &[f64], b: &[f64], off: f64) {
    assert_eq!(a.len(), b.len());
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() < off, "{k}: {a} {b}");
    }
}

#[test]
fn a_filter_is_linear() {
    for filter in filters() {
        let [x, y] = [0, 1].map(|of| (0..900).map(|k| signal(k, of)).collect::<Vec<_>>());
        let sum: Vec<f64> = x.iter().zip(&y).map(|(x, y)| 2.5 * x - 0.75 * y).collect();
        let [x, y, sum] = [x, y, sum].map(|of| filtered(&filter, of));
        let expected: Vec<f64> = x.iter().zip(&y).map(|(x, y)| 2.5 * x - 0.75 * y).collect();
        alike(&sum, &expected, 1e-11);
    }
}

#[test]
fn a_constant_passes_with_the_gain_at_0_and_what_is_added_to_a_signal_is_added_to_its_output() {
    for filter in filters() {
        let x: Vec<f64> = (0..900).map(|k| signal(k, 2)).collect();
        let lifted: Vec<f64> = x.iter().map(|x| x + 7.0).collect();
        let [x, lifted] = [x, lifted].map(|of| filtered(&filter, of));
        // one of even order that ripples is at the bottom of its ripple at frequency 0
        let gain = filter.sos().gain(0.0, RATE).powi(2);
        let expected: Vec<f64> = x.iter().map(|x| x + 7.0 * gain).collect();
        alike(&lifted, &expected, 1e-10);
        let constant = filtered(&filter, vec![7.0; 900]);
        alike(&constant, &[7.0 * gain; 900], 1e-10);
    }
}

#[test]
fn a_signal_backwards_gives_the_output_backwards_but_for_the_ends() {
    for filter in filters() {
        let x: Vec<f64> = (0..3000).map(|k| signal(k, 1)).collect();
        let back: Vec<f64> = x.iter().rev().copied().collect();
        let [x, mut back] = [x, back].map(|of| filtered(&filter, of));
        back.reverse();
        alike(&x[1000..2000], &back[1000..2000], 1e-9);
    }
}

#[test]
fn a_wave_leaves_with_the_square_of_one_passes_gain_and_in_phase() {
    for filter in filters() {
        for hz in [3.0, 15.0, 35.0, 90.0] {
            let w = std::f64::consts::TAU * hz / RATE;
            let wave = |k: usize| (w * k as f64 + 0.4).sin();
            let out = filtered(&filter, (0..6000).map(wave).collect());
            let gain = filter.sos().gain(hz, RATE).powi(2);
            let middle: Vec<f64> = (2500..3500).map(|k| gain * wave(k)).collect();
            alike(&out[2500..3500], &middle, 1e-8);
        }
    }
}

#[test]
fn an_r_factor_holds_the_products_of_its_rows_however_they_were_folded() {
    let columns = 5;
    let x = DMatrix::from_fn(40, columns, |k, c| signal(3 * k + c, c));
    let rows: Vec<f64> = x.transpose().as_slice().to_vec();
    let products = x.transpose() * &x;
    for part in [1, 3, 7, 40] {
        let mut whole = RFactor::new(columns);
        for rows in rows.chunks(part * columns) {
            let mut own = RFactor::new(columns);
            own.fold(rows);
            whole.merge(&own).expect("as many columns");
        }
        assert_eq!(whole.rows(), 40);
        let r = whole.r();
        let off = (r.transpose() * &r - &products).abs().max();
        assert!(off < 1e-11, "{part}: {off:e}");
        assert!((0..columns).all(|i| (0..i).all(|k| r[(i, k)] == 0.0)));
    }
    let mut padded = vec![0.0; 40 * stride(columns)];
    for (row, from) in padded
        .chunks_exact_mut(stride(columns))
        .zip(rows.chunks(columns))
    {
        row[..columns].copy_from_slice(from);
    }
    assert!((gram(&padded, columns) - products).abs().max() < 1e-11);
}
