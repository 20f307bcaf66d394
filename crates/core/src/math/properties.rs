//! Properties that hold for any matrix, tried on random ones.

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use super::rfactor::RFactor;
use super::{jacobi, rank};

/// Rows of an `m x n` matrix whose columns differ in size by up to 1e6 each way.
fn matrix(
    rows: std::ops::Range<usize>,
    columns: std::ops::Range<usize>,
) -> impl Strategy<Value = DMatrix<f64>> {
    (rows, columns).prop_flat_map(|(m, n)| {
        let entries = prop::collection::vec(-1.0..1.0_f64, m * n);
        let sizes = prop::collection::vec(-6.0..6.0_f64, n);
        (entries, sizes).prop_map(move |(entries, sizes)| {
            DMatrix::from_fn(m, n, |i, j| entries[i * n + j] * 10f64.powf(sizes[j]))
        })
    })
}

fn row_major(a: &DMatrix<f64>) -> Vec<f64> {
    a.transpose().as_slice().to_vec()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn any_split_and_merge_recovers_the_parameters(
        columns in 1_usize..14,
        extra in 5_usize..1200,
        cuts in prop::collection::vec(0.0..1.0_f64, 0..6),
        seed in prop::collection::vec(-1.0..1.0_f64, 997),
        sizes in prop::collection::vec(-3.0..3.0_f64, 13),
        order in any::<prop::sample::Index>(),
    ) {
        let rows = columns + extra;
        // The diagonal keeps the random matrix well away from losing rank.
        let y = DMatrix::from_fn(rows, columns, |i, j| {
            let random = seed[(i * 131 + j * 17 + i * i) % 997];
            (random + if i % columns == j { 2.0 } else { 0.0 }) * 10f64.powf(sizes[j])
        });
        let theta = DVector::from_fn(columns, |j, _| (1.0 + j as f64) / 10f64.powf(sizes[j]));
        let b = &y * &theta;
        let whole = DMatrix::from_fn(rows, columns + 1, |i, j| {
            if j < columns { y[(i, j)] } else { b[i] }
        });
        let mut bounds: Vec<usize> = cuts.iter().map(|c| (c * rows as f64) as usize).collect();
        bounds.extend([0, rows]);
        bounds.sort_unstable();
        let mut parts: Vec<RFactor> = bounds
            .windows(2)
            .map(|pair| {
                let mut part = RFactor::new(columns + 1);
                part.fold(&row_major(&whole.rows(pair[0], pair[1] - pair[0]).into_owned()));
                part
            })
            .collect();
        // Any order and any tree of merges.
        while parts.len() > 1 {
            let taken = parts.remove(order.index(parts.len()));
            let onto = order.index(parts.len());
            parts[onto].merge(&taken).expect("same width");
        }
        prop_assert_eq!(parts[0].rows(), rows as u64);
        let r = parts[0].r();
        let found = r
            .view((0, 0), (columns, columns))
            .solve_upper_triangular(&r.view((0, columns), (columns, 1)))
            .expect("full rank");
        for j in 0..columns {
            let error = found[j] / theta[j] - 1.0;
            prop_assert!(error.abs() < 1e-9, "{}: {:e}", j, error);
        }
    }

    #[test]
    fn faer_and_jacobi_find_the_same_singular_values(a in matrix(1..40, 1..30)) {
        let (by_faer, by_jacobi) = (rank::svd(&a).expect("finite"), jacobi::svd(&a));
        let largest = by_jacobi.s[0];
        for (x, y) in by_faer.s.iter().zip(&by_jacobi.s) {
            prop_assert!((x - y).abs() < 1e-13 * largest, "{x:e} {y:e} of {largest:e}");
        }
    }

    #[test]
    fn a_rank_that_is_made_is_found(
        left in matrix(20..60, 1..9),
        right in matrix(15..25, 9..10),
    ) {
        let k = left.ncols();
        let a = left.map(f64::signum) * right.columns(0, k).map(f64::signum).transpose();
        let expected = jacobi_rank(&a);
        let s = rank::svd(&a).expect("finite").s;
        prop_assert!(rank::rank(&s, a.nrows() as u64) == expected && expected <= k);
    }

    #[test]
    fn the_factor_keeps_the_singular_values_of_the_rows(a in matrix(30..400, 1..14)) {
        let mut factor = RFactor::new(a.ncols());
        factor.fold(&row_major(&a));
        let (of_r, of_a) = (jacobi::svd(&factor.r()).s, jacobi::svd(&a).s);
        for (x, y) in of_r.iter().zip(&of_a) {
            prop_assert!((x - y).abs() < 1e-13 * of_a[0]);
        }
    }
}

fn jacobi_rank(a: &DMatrix<f64>) -> usize {
    rank::rank(&jacobi::svd(a).s, a.nrows() as u64)
}
