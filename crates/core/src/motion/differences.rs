//! Velocity and acceleration of uniformly sampled positions by finite differences.
//!
//! Coefficients: Fornberg (1988), centred formulas. At a segment's ends the formula shortens with
//! the room that is left.

use super::settings::DifferenceFormula;

/// Weights of q[k+m] - q[k-m], m = 1.., for the first derivative, by half width.
const FIRST: [&[f64]; 4] = [
    &[1.0 / 2.0],
    &[2.0 / 3.0, -1.0 / 12.0],
    &[3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0],
    &[4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0],
];

/// Weights of q[k+m] - 2 q[k] + q[k-m], m = 1.., for the second derivative, by half width.
const SECOND: [&[f64]; 4] = [
    &[1.0],
    &[4.0 / 3.0, -1.0 / 12.0],
    &[3.0 / 2.0, -3.0 / 20.0, 1.0 / 90.0],
    &[8.0 / 5.0, -1.0 / 5.0, 8.0 / 315.0, -1.0 / 560.0],
];

impl DifferenceFormula {
    /// Samples to each side that a value depends on.
    pub(super) fn reach(self) -> usize {
        match self {
            DifferenceFormula::Central => 2,
            DifferenceFormula::HighOrder => 4,
        }
    }

    /// Writes v and a of `q`, all `k x joints` row-major with step `dt` (s). Fewer than three rows
    /// have no derivative: v and a are zero then.
    pub fn apply(self, q: &[f64], joints: usize, dt: f64, v: &mut [f64], a: &mut [f64]) {
        let samples = q.len().checked_div(joints).unwrap_or(0);
        if samples < 3 {
            v.fill(0.0);
            a.fill(0.0);
            return;
        }
        match self {
            DifferenceFormula::Central => {
                gradient(q, joints, dt, v);
                gradient(v, joints, dt, a);
            }
            DifferenceFormula::HighOrder => high_order(q, joints, dt, v, a),
        }
    }
}

/// Central differences, one-sided at the first and last sample.
fn gradient(x: &[f64], n: usize, dt: f64, dx: &mut [f64]) {
    let end = x.len();
    for i in 0..n {
        dx[i] = (x[i + n] - x[i]) / dt;
        dx[end - n + i] = (x[end - n + i] - x[end - 2 * n + i]) / dt;
    }
    for (y, w) in dx[n..end - n].iter_mut().zip(x.windows(2 * n + 1)) {
        *y = (w[2 * n] - w[0]) / (2.0 * dt);
    }
}

fn high_order(q: &[f64], n: usize, dt: f64, v: &mut [f64], a: &mut [f64]) {
    let samples = q.len() / n;
    let (by_dt, by_dt2) = (1.0 / dt, 1.0 / (dt * dt));
    for k in (0..4.min(samples)).chain(samples.saturating_sub(4).max(4)..samples) {
        let half = k.min(samples - 1 - k);
        for i in k * n..(k + 1) * n {
            (v[i], a[i]) = match half {
                0 => at_end(q, i, n, k == 0),
                _ => centred(q, i, n, FIRST[half.min(4) - 1], SECOND[half.min(4) - 1]),
            };
            v[i] *= by_dt;
            a[i] *= by_dt2;
        }
    }
    // Rows lie one behind the other, so that all joints are one run of numbers; slices of one
    // length let the compiler take several at a time.
    if samples > 8 {
        let run = (samples - 8) * n;
        let at = |m: usize| &q[m * n..m * n + run];
        let behind: [&[f64]; 4] = std::array::from_fn(|m| at(3 - m));
        let ahead: [&[f64]; 4] = std::array::from_fn(|m| at(5 + m));
        let middle = at(4);
        let (v, a) = (&mut v[4 * n..4 * n + run], &mut a[4 * n..4 * n + run]);
        for i in 0..run {
            let (mut first, mut second) = (0.0, 0.0);
            for m in 0..4 {
                let (x, y) = (ahead[m][i] - middle[i], middle[i] - behind[m][i]);
                first += FIRST[3][m] * (x + y);
                second += SECOND[3][m] * (x - y);
            }
            v[i] = first * by_dt;
            a[i] = second * by_dt2;
        }
    }
}

fn centred(q: &[f64], i: usize, n: usize, first: &[f64], second: &[f64]) -> (f64, f64) {
    let (mut v, mut a) = (0.0, 0.0);
    for (m, (c, d)) in first.iter().zip(second).enumerate() {
        let (ahead, behind) = (q[i + (m + 1) * n] - q[i], q[i] - q[i - (m + 1) * n]);
        v += c * (ahead + behind);
        a += d * (ahead - behind);
    }
    (v, a)
}

/// Parabola through the three samples at an end.
fn at_end(q: &[f64], i: usize, n: usize, start: bool) -> (f64, f64) {
    if start {
        let (x, y) = (q[i + n] - q[i], q[i + 2 * n] - q[i + n]);
        (1.5 * x - 0.5 * y, y - x)
    } else {
        let (x, y) = (q[i] - q[i - n], q[i - n] - q[i - 2 * n]);
        (1.5 * x - 0.5 * y, x - y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(degree: i32, dt: f64, samples: usize) -> [Vec<f64>; 3] {
        let at = |f: &dyn Fn(f64) -> f64| (0..samples).map(|k| f(k as f64 * dt - 0.3)).collect();
        let p = f64::from(degree);
        [
            at(&|t| t.powi(degree)),
            at(&|t| p * t.powi(degree - 1)),
            at(&|t| p * (p - 1.0) * t.powi(degree - 2)),
        ]
    }

    #[test]
    fn nine_points_are_exact_for_degree_eight() {
        let dt = 0.05;
        for degree in 2..=8 {
            let [q, v0, a0] = polynomial(degree, dt, 15);
            let (mut v, mut a) = (vec![0.0; 15], vec![0.0; 15]);
            DifferenceFormula::HighOrder.apply(&q, 1, dt, &mut v, &mut a);
            for k in 4..11 {
                assert!((v[k] - v0[k]).abs() < 1e-13, "degree {degree}: {}", v[k]);
                assert!((a[k] - a0[k]).abs() < 1e-11, "degree {degree}: {}", a[k]);
            }
        }
    }

    #[test]
    fn a_parabola_is_exact_up_to_the_ends() {
        let dt = 0.01;
        for samples in 3..14 {
            let [q, v0, a0] = polynomial(2, dt, samples);
            let (mut v, mut a) = (vec![0.0; samples], vec![0.0; samples]);
            DifferenceFormula::HighOrder.apply(&q, 1, dt, &mut v, &mut a);
            for k in 0..samples {
                assert!((v[k] - v0[k]).abs() < 1e-13, "{samples} samples, {k}");
                assert!((a[k] - a0[k]).abs() < 1e-10, "{samples} samples, {k}");
            }
        }
    }

    #[test]
    fn central_differences_are_taken_twice() {
        let q = [0.0, 1.0, 4.0, 9.0, 16.0, 26.0];
        let (mut v, mut a) = ([0.0; 6], [0.0; 6]);
        DifferenceFormula::Central.apply(&q, 1, 1.0, &mut v, &mut a);
        assert_eq!(v, [1.0, 2.0, 4.0, 6.0, 8.5, 10.0]);
        assert_eq!(a, [1.0, 1.5, 2.0, 2.25, 2.0, 1.5]);
    }

    #[test]
    fn joints_do_not_mix() {
        let dt = 0.01;
        let samples = 20;
        let x = |k: usize, j: usize| ((k * (j + 1)) as f64 * 0.1).sin();
        for kind in [DifferenceFormula::Central, DifferenceFormula::HighOrder] {
            let q: Vec<f64> = (0..samples * 3).map(|i| x(i / 3, i % 3)).collect();
            let (mut v, mut a) = (vec![0.0; 60], vec![0.0; 60]);
            kind.apply(&q, 3, dt, &mut v, &mut a);
            for j in 0..3 {
                let alone: Vec<f64> = (0..samples).map(|k| x(k, j)).collect();
                let (mut v1, mut a1) = (vec![0.0; 20], vec![0.0; 20]);
                kind.apply(&alone, 1, dt, &mut v1, &mut a1);
                for k in 0..samples {
                    assert_eq!((v[3 * k + j], a[3 * k + j]), (v1[k], a1[k]), "{kind:?}");
                }
            }
        }
    }

    #[test]
    fn two_samples_have_no_derivative() {
        let (mut v, mut a) = ([1.0; 2], [1.0; 2]);
        DifferenceFormula::HighOrder.apply(&[0.0, 1.0], 1, 0.1, &mut v, &mut a);
        assert_eq!((v, a), ([0.0; 2], [0.0; 2]));
    }
}
