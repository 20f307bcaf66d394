//! Least squares with bounds, from normal equations.

use nalgebra::{DMatrix, DVector};

/// Values that a term may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    pub least: f64,
    pub most: f64,
}

impl Bound {
    /// 0 alone.
    pub const NIL: Bound = Bound {
        least: 0.0,
        most: 0.0,
    };

    /// Any value.
    pub const NONE: Bound = Bound {
        least: f64::NEG_INFINITY,
        most: f64::INFINITY,
    };
}

/// Minimises x' A x - 2 x' b; terms that leave their bounds are held there, the farthest first; those without a diagonal stay 0.
pub fn solve(a: &DMatrix<f64>, b: &DVector<f64>, bounds: &[Bound]) -> DVector<f64> {
    let n = b.len();
    let silent = |x: f64| (x.is_nan() || x <= 0.0).then_some(0.0);
    let mut held: Vec<Option<f64>> = (0..n).map(|i| silent(a[(i, i)])).collect();
    loop {
        let x = with_held(a, b, &held);
        let nearest = |i: usize| x[i].max(bounds[i].least).min(bounds[i].most);
        let excess = |i: usize| (bounds[i].least - x[i]).max(x[i] - bounds[i].most).max(0.0);
        let off = |i: &usize| excess(*i) * a[(*i, *i)].max(0.0).sqrt();
        let free = (0..n).filter(|i| held[*i].is_none());
        let worst = free.max_by(|i, j| off(i).total_cmp(&off(j)));
        match worst.filter(|i| off(i) > 0.0) {
            Some(i) => held[i] = Some(nearest(i)),
            None => return x,
        }
    }
}

/// The minimum with some terms held.
fn with_held(a: &DMatrix<f64>, b: &DVector<f64>, held: &[Option<f64>]) -> DVector<f64> {
    let free: Vec<usize> = (0..b.len()).filter(|i| held[*i].is_none()).collect();
    let mut x = DVector::from_iterator(b.len(), held.iter().map(|h| h.unwrap_or(0.0)));
    let pulled = b - a * &x;
    let own = a.select_rows(&free).select_columns(&free);
    let right = pulled.select_rows(&free);
    // without a factor the matrix says nothing, and all stays where it is
    if let Some(factor) = own.cholesky() {
        for (i, value) in free.iter().zip(factor.solve(&right).iter()) {
            x[*i] = *value;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leaves_its_bound_is_held_there_and_the_others_follow() {
        let a = DMatrix::from_row_slice(3, 3, &[2.0, 1.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0]);
        let b = DVector::from_vec(vec![3.0, -1.0, 5.0]);
        let free = [Bound::NONE; 3];
        let x = solve(&a, &b, &free);
        assert!((x[0] - 7.0 / 3.0).abs() < 1e-12 && (x[1] + 5.0 / 3.0).abs() < 1e-12);
        assert_eq!(x[2], 0.0);
        let [least, most] = [0.0, 9.0];
        let above = [Bound::NONE, Bound { least, most }, Bound::NONE];
        let x = solve(&a, &b, &above);
        assert!((x[0] - 1.5).abs() < 1e-12, "{x}");
        assert_eq!(x[1], 0.0);
    }
}
