//! Ten numbers of any size for a physically consistent body.
//!
//! A body of positive mass density has a positive definite pseudo-inertia J (Wensing, Kim and
//! Slotine 2018). J = e^(2 a) U U' with U upper triangular, diagonal (e^d1, e^d2, e^d3, 1), reaches
//! all of them and no others (Rucker and Wensing 2022, eq. (12)), so that a search needs no bounds.

use nalgebra::{Matrix3, Matrix4};

use crate::robot::standard::{STANDARD, standard_of};

/// a, d1, d2, d3, s12, s23, s13, t1, t2, t3.
pub type LogCholesky = [f64; STANDARD];

/// Where the entries of U that are no diagonal stand, in the order of [`LogCholesky`].
const ABOVE: [(usize, usize); 6] = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)];

fn factor(x: &LogCholesky) -> Matrix4<f64> {
    let mut u = Matrix4::zeros();
    for i in 0..3 {
        u[(i, i)] = x[1 + i].exp();
    }
    u[(3, 3)] = 1.0;
    for (k, at) in ABOVE.into_iter().enumerate() {
        u[at] = x[4 + k];
    }
    u
}

/// Standard parameters of the body, and their derivatives by the ten numbers, column by column.
pub fn standard(x: &LogCholesky) -> ([f64; STANDARD], [[f64; STANDARD]; STANDARD]) {
    let u = factor(x);
    let size = (2.0 * x[0]).exp();
    let j = u * u.transpose() * size;
    let mut slopes = [[0.0; STANDARD]; STANDARD];
    slopes[0] = standard_of(&(j * 2.0));
    for (k, slope) in slopes.iter_mut().enumerate().skip(1) {
        let mut e = Matrix4::zeros();
        if k < 4 {
            e[(k - 1, k - 1)] = u[(k - 1, k - 1)];
        } else {
            e[ABOVE[k - 4]] = 1.0;
        }
        let half = e * u.transpose() * size;
        *slope = standard_of(&(half + half.transpose()));
    }
    (standard_of(&j), slopes)
}

/// The ten numbers of a pseudo-inertia; `None` where it is not positive definite.
pub fn of(j: &Matrix4<f64>) -> Option<LogCholesky> {
    let m = j[(3, 3)];
    if m <= 0.0 {
        return None;
    }
    let mut x = [0.0; STANDARD];
    x[0] = 0.5 * m.ln();
    let t: [f64; 3] = std::array::from_fn(|i| j[(i, 3)] / m);
    let s = Matrix3::from_fn(|r, c| j[(r, c)] / m - t[r] * t[c]);
    // U U' from the last row up: the Cholesky factor of the matrix turned around
    let mut u = Matrix3::<f64>::zeros();
    for c in (0..3).rev() {
        let rest = s[(c, c)] - (c + 1..3).map(|k| u[(c, k)] * u[(c, k)]).sum::<f64>();
        if rest <= 0.0 {
            return None;
        }
        u[(c, c)] = rest.sqrt();
        for r in 0..c {
            let rest = s[(r, c)] - (c + 1..3).map(|k| u[(r, k)] * u[(c, k)]).sum::<f64>();
            u[(r, c)] = rest / u[(c, c)];
        }
    }
    for i in 0..3 {
        x[1 + i] = u[(i, i)].ln();
        x[7 + i] = t[i];
    }
    (x[4], x[5], x[6]) = (u[(0, 1)], u[(1, 2)], u[(0, 2)]);
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::standard::pseudo_inertia;

    const X: LogCholesky = [0.4, -2.0, -1.5, -1.8, 0.05, -0.02, 0.01, 0.1, -0.2, 0.03];

    #[test]
    fn the_ten_numbers_and_the_pseudo_inertia_belong_together() {
        let (s, _) = standard(&X);
        let back = of(&pseudo_inertia(&s)).unwrap();
        for (a, b) in back.iter().zip(&X) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert!(pseudo_inertia(&s).symmetric_eigenvalues().min() > 0.0);
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let (_, slopes) = standard(&X);
        for k in 0..STANDARD {
            let moved = |h: f64| {
                let mut x = X;
                x[k] += h;
                standard(&x).0
            };
            let (up, down) = (moved(1e-6), moved(-1e-6));
            for i in 0..STANDARD {
                let difference = (up[i] - down[i]) / 2e-6;
                assert!((difference - slopes[k][i]).abs() < 1e-8, "{k} {i}");
            }
        }
    }

    #[test]
    fn an_inconsistent_body_has_no_such_numbers() {
        let (mut s, _) = standard(&X);
        s[0] += 10.0;
        assert_eq!(of(&pseudo_inertia(&s)), None);
        s[9] = -1.0;
        assert_eq!(of(&pseudo_inertia(&s)), None);
    }
}
