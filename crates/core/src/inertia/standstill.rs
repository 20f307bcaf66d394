//! Samples at standstill that count after all: those of a joint whose motion leaves its friction open, where the
//! declared law holds at standstill too.
//!
//! A motor that turns one way shows the sum of Coulomb friction and offset while it turns, and only at its reversals
//! what each is. Where it sticks there, samples at standstill say nothing of either, and the residual shows it.

use super::columns::RegressorColumns;
use super::solve::Fit;

/// When samples at standstill count.
struct Limits {
    /// Standard deviation of a friction term's torque over the joint's torque from which on motion leaves the term open.
    open: f64,
    /// Square of the relative residual with samples at standstill over that without, up to which the law holds there.
    holds: f64,
}

const LIMITS: Limits = Limits {
    open: 1.0,
    holds: 2.0,
};

/// Joints with a friction term that a fit of samples in motion leaves open.
pub fn open_joints(columns: &RegressorColumns, moving: &Fit) -> Vec<usize> {
    let joints = 0..columns.joints;
    joints.filter(|j| is_open(columns, moving, *j)).collect()
}

/// Those of the joints for which samples at standstill are of use: their friction is open in the fit without these and
/// not in the one with them, and both follow the torque.
pub fn counted(
    columns: &RegressorColumns,
    open: Vec<usize>,
    [without, with]: [&Fit; 2],
) -> Vec<usize> {
    let square = |fit: &Fit, j: usize| fit.relative_error[j].all.powi(2);
    let of_use = |j: &usize| {
        !is_open(columns, with, *j) && square(with, *j) <= LIMITS.holds * square(without, *j)
    };
    open.into_iter().filter(of_use).collect()
}

/// Whether a fit leaves a friction term of joint `j` open by more than the joint's whole torque.
fn is_open(columns: &RegressorColumns, fit: &Fit, j: usize) -> bool {
    let own = (columns.shared..columns.unknowns_of(j)).map(|c| columns.unknown(j, c));
    let mut torque = own.map(|i| fit.covariance[(i, i)].sqrt() * fit.column_rms[(j, i)]);
    torque.any(|std| std > LIMITS.open * fit.torque_rms[j])
}
