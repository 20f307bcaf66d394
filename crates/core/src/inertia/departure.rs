//! How far friction departs from viscous and Coulomb terms, and what that does to all else.
//!
//! The scatter of a residual says how sure parameters are while the law is right. Where friction bends over the speed,
//! the residual has a mean at each speed: the level of friction is only known to within that departure, and inertias
//! take up a part of it. A fit with a level of friction of its own in each class of speed shows which part.

use nalgebra::{DMatrix, DVector, Matrix2};

use super::accumulate::BlockFactors;
use super::by_speed::SpeedColumns;
use super::columns::JointTerm;
use super::solve::{Fit, weights_of};

/// Ridge of the fit with free levels, over the diagonal: rounding alone.
const RIDGE: f64 = 1e-9;

/// Adds to a fit's covariance how far friction departs from its law: to Coulomb and viscous terms what such departures,
/// one of each class of speed, make of a line through the levels, and no less than themselves to the first; to a constant
/// torque the mean of what is the same in both directions; and to the
/// parameters that joints share what a fit with free levels of friction changes in them.
pub fn widen_by_departure(sums: &BlockFactors, fit: &mut Fit) {
    let columns = &sums.columns;
    let correlated = fit.rows as f64 / fit.effective_rows.max(1.0);
    for (j, by_speed) in sums.by_speed.iter().enumerate() {
        let Some(place) = SpeedColumns::of(columns, j) else {
            continue;
        };
        let noise = fit.residual_std[j].powi(2) * correlated;
        let own = sums.own_unknowns(&fit.theta, j);
        let departure = by_speed.departure(&own, noise);
        let (square, _) = sums.parts(&sums.joint(j), j).products();
        let line = [place.coulomb, place.viscous];
        let normal = Matrix2::from_fn(|a, b| square[(line[a], line[b])]);
        let mut of_line = normal.try_inverse().unwrap_or_default();
        of_line *= departure.level * normal[(0, 0)] / departure.classes;
        of_line[(0, 0)] = of_line[(0, 0)].max(departure.level);
        let at = line.map(|c| columns.unknown(j, c));
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            fit.covariance[(at[a], at[b])] += of_line[(a, b)];
        }
        if let Some(offset) = columns.own[j]
            .iter()
            .position(|own| *own == JointTerm::Offset)
        {
            let unknown = columns.first_own(j) + offset;
            fit.covariance[(unknown, unknown)] += departure.constant / departure.classes;
        }
    }
    if let Some(change) = change_by_levels(sums, fit, correlated) {
        fit.covariance.ger(1.0, &change, &change, 1.0);
    }
}

/// Change of the shared parameters by free levels of friction in each class of speed, beyond that by noise.
fn change_by_levels(sums: &BlockFactors, fit: &Fit, correlated: f64) -> Option<DVector<f64>> {
    let columns = &sums.columns;
    let u = columns.unknowns();
    let weights = weights_of(sums, &fit.residual_std);
    let mut equations = NormalEquations::of(u);
    let mut levels = vec![false; u];
    for (j, by_speed) in sums.by_speed.iter().enumerate() {
        let (mut n, mut b) = sums.parts(&sums.joint(j), j).products();
        for class in by_speed.filled() {
            let x = DVector::from_column_slice(&class.product[..b.len()]);
            n.ger(-1.0 / class.square, &x, &x, 1.0);
            b.axpy(-class.product.last()? / class.square, &x, 1.0);
        }
        equations.add(&|c| columns.unknown(j, c), weights[j], &(n, b));
        let spanned = by_speed.filled().next().is_some();
        let of_friction = columns.own[j].iter().enumerate();
        for (k, _) in of_friction.filter(|(_, own)| spanned && **own != JointTerm::Viscous) {
            levels[columns.first_own(j) + k] = true;
        }
    }
    let NormalEquations { normal, target } = equations;
    let kept = |i: &usize| !levels[*i] && normal[(*i, *i)] > 0.0;
    let kept: Vec<usize> = (0..u).filter(kept).collect();
    if kept.len() == u {
        return None;
    }
    let inverse = inverse_scaled(&normal.select_rows(&kept).select_columns(&kept))?;
    let solved = &inverse * target.select_rows(&kept);
    let mut change = DVector::zeros(u);
    let of_shared = kept.iter().enumerate();
    for (a, &i) in of_shared.filter(|(_, i)| **i < columns.shared) {
        let moved = solved[a] - fit.theta[i];
        let by_noise = (inverse[(a, a)] - fit.textbook[(i, i)]).max(0.0);
        let beyond = (moved * moved - by_noise * correlated).max(0.0);
        change[i] = beyond.sqrt().copysign(moved);
    }
    Some(change)
}

/// Normal equations of the rows of several joints.
pub(super) struct NormalEquations {
    pub normal: DMatrix<f64>,
    pub target: DVector<f64>,
}

impl NormalEquations {
    /// Of so many unknowns, without rows.
    pub(super) fn of(unknowns: usize) -> Self {
        NormalEquations {
            normal: DMatrix::zeros(unknowns, unknowns),
            target: DVector::zeros(unknowns),
        }
    }

    /// Adds X'X and X't of a joint whose rows have this weight; `place` says which unknown a column is of.
    pub(super) fn add(
        &mut self,
        place: &dyn Fn(usize) -> usize,
        weight: f64,
        (x, t): &(DMatrix<f64>, DVector<f64>),
    ) {
        let w = weight * weight;
        for a in 0..t.len() {
            self.target[place(a)] += w * t[a];
            for b in 0..t.len() {
                self.normal[(place(a), place(b))] += w * x[(a, b)];
            }
        }
    }
}

/// Inverse of normal equations, by columns of one size; what no row determines, with a diagonal of 0, stays 0.
pub(super) fn inverse_scaled(normal: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = |x: f64| if x > 0.0 { x.sqrt().recip() } else { 0.0 };
    let scale = normal.diagonal().map(size);
    let scaled = |of: &DMatrix<f64>| {
        DMatrix::from_fn(of.nrows(), of.ncols(), |a, b| {
            of[(a, b)] * scale[a] * scale[b]
        })
    };
    let ridge = scale.map(|s| if s > 0.0 { RIDGE } else { 1.0 });
    let ridged = scaled(normal) + DMatrix::from_diagonal(&ridge);
    Some(scaled(&ridged.cholesky()?.inverse()))
}
