//! Low-pass and least squares of the studies' own, to size what is planted within the band that a fit keeps.

use std::f64::consts::{PI, SQRT_2};

/// Butterworth's low-pass of the second order, forward and backward, from rest at the mean.
pub fn low_passed(x: &[f64], cutoff_hz: f64, rate_hz: f64) -> Vec<f64> {
    let k = (PI * cutoff_hz / rate_hz).tan();
    let norm = 1.0 / (1.0 + SQRT_2 * k + k * k);
    let b = k * k * norm;
    let (a1, a2) = (
        2.0 * (k * k - 1.0) * norm,
        (1.0 - SQRT_2 * k + k * k) * norm,
    );
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    let pass = |x: &mut dyn Iterator<Item = f64>| {
        let (mut x1, mut x2, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0);
        x.map(|now| {
            let y = b * (now + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
            (x2, x1, y2, y1) = (x1, now, y1, y);
            y
        })
        .collect::<Vec<f64>>()
    };
    let forward = pass(&mut x.iter().map(|v| v - mean));
    let mut back = pass(&mut forward.into_iter().rev());
    back.reverse();
    back.iter().map(|v| v + mean).collect()
}

pub fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// What of `y` is left beside columns (Gram and Schmidt, twice for the digits).
pub fn beside(y: &[f64], columns: &[Vec<f64>]) -> Vec<f64> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let rest = without(&without(column, &basis), &basis);
        let size = norm(&rest);
        if size > 1e-9 * norm(column) {
            basis.push(rest.iter().map(|v| v / size).collect());
        }
    }
    without(&without(y, &basis), &basis)
}

fn without(y: &[f64], basis: &[Vec<f64>]) -> Vec<f64> {
    let mut rest = y.to_vec();
    for column in basis {
        let part: f64 = rest.iter().zip(column).map(|(a, b)| a * b).sum();
        for (value, c) in rest.iter_mut().zip(column) {
            *value -= part * c;
        }
    }
    rest
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_low_pass_keeps_slow_sines_and_halves_the_cut_off() {
        let rate = 500.0;
        let sine = |hz: f64| -> Vec<f64> {
            (0..5000)
                .map(|k| (2.0 * PI * hz * f64::from(k) / rate).sin())
                .collect()
        };
        let kept = |hz: f64| {
            rms(&low_passed(&sine(hz), 20.0, rate)[500..4500]) / rms(&sine(hz)[500..4500])
        };
        assert!((kept(1.0) - 1.0).abs() < 1e-4);
        assert!((kept(20.0) - 0.5).abs() < 1e-3, "{}", kept(20.0));
    }

    #[test]
    fn what_columns_span_leaves_nothing() {
        let one: Vec<f64> = (0..50).map(|k| f64::from(k).sin()).collect();
        let two: Vec<f64> = (0..50).map(f64::from).collect();
        let y: Vec<f64> = one
            .iter()
            .zip(&two)
            .map(|(a, b)| 3.0 * a - 0.2 * b)
            .collect();
        assert!(rms(&beside(&y, &[one, two])) < 1e-12);
    }
}
