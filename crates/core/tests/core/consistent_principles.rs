//! The plain fit and the physically consistent one on rows that neither has seen.

use cft_ident_core::inertia::accumulate::BlockFactors;
use cft_ident_core::inertia::feasible::ConsistencyProblem;
use cft_ident_core::inertia::left_out::{FitParts, FitsOnLeftOut, TrialLeftOut, left_out};
use cft_ident_core::inertia::solve::{RowWeighting, factor, fit, weights_of};
use nalgebra::{DMatrix, DVector};

use crate::gains_principles::{bodies, robot, rows, waves};

const NOISE: f64 = 0.3;

/// Rows of two logs by links with these standard parameters.
fn two_logs(bodies: &[f64]) -> BlockFactors {
    let mut all = rows(bodies, &waves(1.0), [1.0; 2], NOISE);
    all.merge(rows(bodies, &waves(1.3), [1.0; 2], NOISE));
    all
}

fn weights(factors: &BlockFactors) -> Vec<f64> {
    let plain = fit(factors, RowWeighting::Wls).expect("rows that determine all");
    weights_of(factors, &plain.residual_std)
}

/// Both fits on some of these parts left out, nothing known of bodies.
fn tried_on(factors: &BlockFactors, parts: &FitParts) -> Option<FitsOnLeftOut> {
    let weights = weights(factors);
    let whole = factor(factors, &weights).expect("rows");
    let map = robot().standard_map();
    let task = ConsistencyProblem {
        map: &map,
        bodies: &[None, None],
        factor: &whole,
        effective: 1.0,
        friction: &[],
    };
    left_out(factors, parts, &weights, &task).expect("rows that determine all")
}

fn tried(factors: &BlockFactors) -> FitsOnLeftOut {
    tried_on(factors, &factors.in_parts()).expect("parts enough")
}

/// Squared residual of each joint's rows of a part, by weighted least squares of all other parts from scratch.
fn from_scratch(factors: &BlockFactors) -> [f64; 2] {
    let (parts, weights) = (factors.in_parts().in_time, weights(factors));
    let columns = &factors.columns;
    let u = columns.unknowns();
    let mut out = [0.0; 2];
    let own = |r: &DMatrix<f64>, j: usize| {
        let n = columns.unknowns_of(j);
        let mut x = DMatrix::zeros(r.nrows(), u);
        (0..n).for_each(|c| x.set_column(columns.unknown(j, c), &r.column(c)));
        (x, r.column(r.ncols() - 1).into_owned())
    };
    for (k, part) in parts.iter().enumerate() {
        let (mut normal, mut right) = (DMatrix::zeros(u, u), DVector::zeros(u));
        for (_, other) in parts.iter().enumerate().filter(|(at, _)| *at != k) {
            for (j, r) in other.r.iter().enumerate() {
                let (x, t) = own(r, j);
                normal += x.tr_mul(&x) * weights[j].powi(2);
                right += x.tr_mul(&t) * weights[j].powi(2);
            }
        }
        let theta = normal.cholesky().expect("all are determined").solve(&right);
        for (j, r) in part.r.iter().enumerate() {
            let (x, t) = own(r, j);
            out[j] += (t - x * &theta).norm_squared();
        }
    }
    out
}

#[test]
fn parts_left_out_are_judged_by_fits_that_never_saw_them() {
    let factors = two_logs(&bodies());
    let found = tried(&factors);
    for (j, square) in from_scratch(&factors).iter().enumerate() {
        let expected = (square / factors.moving[j].torque_square).sqrt();
        let plain = found.joints[j].plain;
        assert!(
            (plain / expected - 1.0).abs() < 1e-6,
            "{j}: {plain} {expected}"
        );
        // bodies that there are cost nothing
        assert!((found.joints[j].consistent / plain - 1.0).abs() < 0.02);
        assert!(!found.joints[j].costs);
    }
    assert!(!found.plain_wins && !found.plain_is_better());
    assert!(found.plain_loses_faster.is_some());
}

#[test]
fn torques_that_no_bodies_make_are_better_explained_without_them_on_faster_blocks_too() {
    let mut none = bodies();
    // a moment of inertia of the last link that is below nothing
    none[15] = -0.5;
    let found = tried(&two_logs(&none));
    assert!(found.plain_wins && found.plain_is_better());
    assert!(
        found
            .joints
            .iter()
            .any(|j| j.costs && j.consistent > 1.1 * j.plain)
    );
    assert_eq!(found.plain_loses_faster, Some(false));
    let alone = tried(&rows(&none, &waves(1.0), [1.0; 2], NOISE));
    assert!(alone.plain_is_better());
}

#[test]
fn a_plain_fit_that_loses_faster_motion_is_not_taken_and_one_beside_no_model_is() {
    let joint = |plain: f64, consistent: f64| TrialLeftOut {
        plain,
        consistent,
        costs: true,
    };
    let of = |joint: TrialLeftOut, plain_loses_faster: Option<bool>| FitsOnLeftOut {
        joints: vec![joint],
        plain_wins: true,
        plain_loses_faster,
    };
    let taken = [Some(false), Some(true), None].map(|f| of(joint(0.02, 0.03), f).plain_is_better());
    assert_eq!(taken, [true, false, false]);
    // what leaves more than the joint's torque is no model of it, whatever faster motion says
    assert!(of(joint(0.18, 1.23), Some(true)).plain_is_better());
    assert!(!of(joint(0.82, 1.23), Some(true)).plain_is_better());
}

#[test]
fn too_few_parts_are_not_tried() {
    let factors = two_logs(&bodies());
    let mut parts = factors.in_parts();
    parts.in_time.truncate(3);
    assert!(tried_on(&factors, &parts).is_none());
}
