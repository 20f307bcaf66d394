//! What a torque that is logged late, and a drive that gives way, change in a fit.
//!
//! A controller sets a torque, holds it and logs it at times of its own: a row's torque is of its position to within a
//! step or so. Late by d it is tau - d tau', and friction's part of tau' is viscous friction times an acceleration: half
//! a millisecond takes two percent off a light joint's inertia, and its residual hardly shows. The rate of each joint's
//! torque as one more column shows how late the rows let it be; a fit without that column is wrong by as much.
//!
//! A drive of stiffness k that is read at its motor stands tau / k before its link, whose inertia M then asks for
//! M tau'' / k less: tau'' over the square of the joint's frequency with its motor held. The bend of each torque as another
//! column shows how soft the rows let the drive be.

use nalgebra::{DMatrix, DVector};

use super::accumulate::BlockFactors;
use super::columns::JointTerm;
use super::departure::{NormalEquations, inverse_scaled};
use super::solve::{Fit, weights_of};

/// Standard deviation of a delay beforehand, in samples: a command is logged with the position before or after it.
const DELAY_SAMPLES: f64 = 0.5;

/// Standard deviation of a drive's compliance beforehand, as 1 / frequency squared with its motor held: gears of arms
/// lie at 10 to 40 Hz. Half the frequency: stiff arms hold no inertia any more; twice: soft ones are sure of a wrong one.
const SOFT_HZ: f64 = 20.0;

/// The rows of columns [`with_torque_rates`](super::columns::RegressorColumns::with_torque_rates) without the rates.
pub fn without_rates(sums: &BlockFactors) -> BlockFactors {
    let own = |own: &JointTerm| !matches!(own, JointTerm::TorqueRate | JointTerm::TorqueBend);
    sums.with_own(&sums.columns.places(own))
}

/// Adds to a fit's covariance the second moment of what delays and soft drives change in it: their mean and scatter by
/// `sums`, rows with the rates, and what is known of them before. `step` is that of the samples \[s\]. Nothing where the
/// rows determine no fit.
pub fn widen_by_delay(sums: &BlockFactors, step: f64, fit: &mut Fit) -> Option<()> {
    let columns = &sums.columns;
    let (joints, u) = (columns.joints, fit.theta.len());
    let both = 2 * joints;
    let softness = (std::f64::consts::TAU * SOFT_HZ * step).powi(-2);
    let correlated = fit.rows as f64 / fit.effective_rows.max(1.0);
    let weights = weights_of(sums, &fit.residual_std);
    let mut equations = NormalEquations::of(u + both);
    for (j, weight) in weights.iter().enumerate() {
        let own = columns.unknowns_of(j);
        // the rates stand behind all other unknowns, and the bends behind them
        let place = |c: usize| match c {
            c if c + 2 == own => u + j,
            c if c + 1 == own => u + joints + j,
            c if c < columns.shared => c,
            c => columns.unknown(j, c) - 2 * j,
        };
        let rows = sums.parts(&sums.joint(j), j).products();
        equations.add(&place, *weight, &rows);
    }
    let NormalEquations { normal, target } = equations;
    let inverse = inverse_scaled(&normal.view((0, 0), (u, u)).into_owned())?;
    let cross = normal.view((0, u), (u, both)).into_owned();
    let moved = &inverse * &cross;
    let known = (normal.view((u, u), (both, both)) - cross.tr_mul(&moved)) / correlated;
    let by_fit = cross.tr_mul(&(&inverse * target.rows(0, u)));
    let score = (target.rows(u, both) - by_fit) / correlated;
    // scatter of the first n of rates and bends where the others are nothing
    let scatter = |n: usize| {
        let before = DVector::from_fn(n, |k, _| match k < joints {
            true => DELAY_SAMPLES.powi(-2),
            false => softness.powi(-2),
        });
        let known = known.view((0, 0), (n, n)) + DMatrix::from_diagonal(&before);
        Some(known.cholesky()?.inverse())
    };
    // a torque's noise bends as a soft drive does: delays are those of stiff ones, lest they make up for it
    let by_delay = moved.columns(0, joints);
    let of_delays = scatter(joints)?;
    let delays = &of_delays * score.rows(0, joints);
    fit.covariance += by_delay * (of_delays + &delays * delays.transpose()) * by_delay.transpose();
    // what a drive gives way is below zero, and of a stiff one nothing: only what the rows show of it counts
    let of_all = scatter(both)? * score;
    let gives_way = of_all.rows(joints, joints).map(|x| x.min(0.0));
    let change = moved.columns(joints, joints) * gives_way;
    fit.covariance.ger(1.0, &change, &change, 1.0);
    Some(())
}

#[cfg(test)]
mod tests {
    use super::super::accumulate::RowAccumulator;
    use super::super::columns::RegressorColumns;
    use super::super::solve::{RowWeighting, fit};
    use super::*;

    const STEP: f64 = 0.01;
    /// Inertia and viscous friction of a light joint, and of a heavy one.
    const LIGHT: [f64; 2] = [0.012, 0.5];
    const HEAVY: [f64; 2] = [1.2, 0.5];

    /// Error of a joint's inertia in deviations, before and after; and the deviation over that of an unseen delay. The
    /// torque is logged `late` samples late, and the drive gives way by `soft` samples squared.
    fn errors(truth: [f64; 2], late: f64, soft: f64) -> [f64; 3] {
        let columns = RegressorColumns::of_one(&[JointTerm::Viscous], None);
        let rates = columns.with_torque_rates();
        // speed, and what it changes over time again and again
        let motion = |t: f64| -> [f64; 4] {
            let waves = [(0.4, 3.0, 0.0), (0.2, 7.0, 1.0)];
            let mut out = [0.0; 4];
            for (size, w, phase) in waves {
                let (sin, cos) = f64::sin_cos(w * t + phase);
                for (k, wave) in [cos, -sin, -cos, sin].into_iter().enumerate() {
                    out[k] += size * w.powi(k as i32 + 1) * wave;
                }
            }
            out
        };
        let torque = |k: f64| {
            let [v, a, ..] = motion((k - late) * STEP);
            truth[0] * a + truth[1] * v + 0.005 * (k * k * 0.7).sin()
        };
        let mut plain = RowAccumulator::new(columns, 0.1);
        let mut with = RowAccumulator::new(rates, 0.1);
        for k in 0..4000 {
            let k = f64::from(k);
            let [v, a, slope, bend] = motion(k * STEP);
            // the motor stands before its link by what the torque over the inertia turns the drive
            let (by, damped) = (soft * STEP * STEP, truth[1] / truth[0]);
            let (v, a) = (
                v + by * (slope + damped * a),
                a + by * (bend + damped * slope),
            );
            let rate = (torque(k + 1.0) - torque(k - 1.0)) / 2.0;
            plain.add(0, STEP, &[a, v, torque(k), torque(k)]);
            let bend = torque(k + 1.0) - 2.0 * torque(k) + torque(k - 1.0);
            with.add(0, STEP, &[a, v, rate, bend, torque(k), torque(k)]);
        }
        let with = with.finish();
        let mut found = fit(&plain.finish(), RowWeighting::Wls).unwrap();
        let same = fit(&without_rates(&with), RowWeighting::Wls).unwrap();
        assert!((&same.theta - &found.theta).amax() < 1e-12);
        let error = |fit: &Fit| (fit.theta[0] - truth[0]) / fit.covariance[(0, 0)].sqrt();
        let before = error(&found);
        widen_by_delay(&with, STEP, &mut found).unwrap();
        let blind = truth[1] * DELAY_SAMPLES * STEP;
        [
            before,
            error(&found),
            found.covariance[(0, 0)].sqrt() / blind,
        ]
    }

    #[test]
    fn an_interval_holds_the_inertia_of_a_joint_whose_torque_is_logged_late() {
        for late in [0.25, -0.5, 0.8] {
            let [before, after, _] = errors(LIGHT, late, 0.0);
            assert!(
                before.abs() > 10.0 && after.abs() < 2.0,
                "{late}: {before} {after}"
            );
        }
        let [_, after, std] = errors(LIGHT, 0.0, 0.0);
        assert!(after.abs() < 2.0 && std < 0.3, "{after} {std}");
    }

    #[test]
    fn an_interval_holds_the_inertia_behind_a_drive_that_gives_way() {
        for hz in [10.0, 20.0, 30.0] {
            let soft = (std::f64::consts::TAU * hz * STEP).powi(-2);
            let [before, after, _] = errors(HEAVY, 0.0, soft);
            assert!(
                before.abs() > 10.0 && after.abs() < 2.0,
                "{hz}: {before} {after}"
            );
        }
    }
}
