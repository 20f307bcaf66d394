//! What must be positive whatever the machine: the inertia that a joint's own drive feels, and the power
//! that its friction takes.

use nalgebra::DVector;

use super::channels::Carried;
use super::correction::Correction;
use super::fit::Fit;
use super::normal::{Normal, Problem};
use super::sample::Sample;
use cft_ident_core::inertia::columns::Own;
use cft_ident_core::robot::Robot;

/// What the model lacks may look like a quantity to this correlation: a share of the residual that has any sign.
const ALIKE: f64 = 0.25;
/// Rows whose poses stand for all of them.
const POSES: usize = 60;

/// Rows whose motion stands for all of them.
const MOTIONS: usize = 500;

/// What it is that must be positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Mean inertia that the joint's own drive feels \[kg or kg m^2\].
    Inertia,
    /// Mean power of the joint's friction \[W\].
    FrictionPower,
}

/// A quantity of a joint with what the data say about it.
#[derive(Debug, Clone)]
pub(super) struct Positive {
    pub joint: usize,
    pub quantity: Quantity,
    pub value: f64,
    pub std: f64,
    /// What may come from effects that the model lacks.
    pub notable: f64,
    /// Whether the motion is one that tells it.
    pub told: bool,
}

impl Positive {
    /// How many deviations it is above zero, what is not worth mentioning counted as one.
    pub fn deviations(&self) -> f64 {
        self.value / self.std.hypot(self.notable).max(f64::MIN_POSITIVE)
    }
}

/// Log-probability that all are positive, each beyond `-LEAST` deviations counting no more: one contradiction
/// must not hide what the residual says.
pub(super) fn credit(of: &[Positive]) -> f64 {
    let told = of.iter().filter(|p| p.told);
    told.map(|p| log_normal_cdf(p.deviations().max(-LEAST)))
        .sum()
}

const LEAST: f64 = 8.0;

/// ln of the standard normal distribution function.
fn log_normal_cdf(z: f64) -> f64 {
    if z > -5.0 {
        return (0.5 * statrs::function::erf::erfc(-z / std::f64::consts::SQRT_2)).ln();
    }
    // Abramowitz and Stegun 26.2.12
    -0.5 * z * z - (-z).ln() - 0.5 * std::f64::consts::TAU.ln()
}

/// The quantities of every joint that moves.
pub(super) fn positives(
    problem: &Problem,
    robot: &Robot,
    by: &Correction,
    normal: &Normal,
    fit: &Fit,
) -> Vec<Positive> {
    let (n, p) = (robot.joints(), robot.parameters().len());
    let rows = problem.sample.spread(POSES);
    let mut carried = Carried::new(n);
    let mut inertia = vec![DVector::zeros(normal.unknowns); n];
    let mut power = inertia.clone();
    let (mut known, mut count) = (vec![0.0; n], 0.0);
    // squares of speed, acceleration
    let (mut speed, mut acceleration) = (vec![0.0; n], vec![0.0; n]);
    let (mut unit, still) = (vec![0.0; n], vec![0.0; n]);
    let (mut y, mut at_rest) = (vec![0.0; n * p], vec![0.0; n * p]);
    for &k in &rows {
        if !problem
            .channels
            .carry(robot, problem.sample.row(k), by, &mut carried)
        {
            continue;
        }
        count += 1.0;
        robot.regressor(&carried.q, &still, &still, &mut at_rest);
        for j in (0..n).filter(|j| !normal.places[*j].is_empty()) {
            unit[j] = 1.0;
            robot.regressor(&carried.q, &still, &unit, &mut y);
            unit[j] = 0.0;
            for c in 0..p {
                inertia[j][c] += y[j * p + c] - at_rest[j * p + c];
            }
        }
    }
    inertia.iter_mut().for_each(|f| *f /= f64::max(count, 1.0));
    let mut all = 0.0;
    for k in problem.sample.spread(MOTIONS) {
        if !problem
            .channels
            .carry(robot, problem.sample.row(k), by, &mut carried)
        {
            continue;
        }
        all += 1.0;
        for j in (0..n).filter(|j| !normal.places[*j].is_empty()) {
            let v = carried.v[j];
            speed[j] += v * v;
            acceleration[j] += carried.a[j] * carried.a[j];
            let first = problem.first_own(robot, j);
            for (i, own) in problem.columns.own[j].iter().enumerate() {
                power[j][first + i] += match own {
                    Own::Coulomb => v * carried.sign[j],
                    Own::Offset => 0.0,
                    own => v * own.column(v),
                };
            }
            if let Some(friction) = &problem.columns.known[j] {
                known[j] += v * friction.law.torque(v);
            }
        }
    }
    let all = f64::max(all, 1.0);
    let joints = problem.of_joints();
    let torque = torque_rms(problem, joints, &fit.targets);
    let missed = |j: usize| ALIKE * fit.left[j].sqrt() * torque[j];
    let mut out = Vec::new();
    for j in (0..n).filter(|j| !normal.places[*j].is_empty()) {
        let (v, a) = ((speed[j] / all).sqrt(), (acceleration[j] / all).sqrt());
        out.push(Positive {
            joint: j,
            quantity: Quantity::Inertia,
            value: inertia[j].dot(&fit.theta),
            std: fit.deviation(normal, &inertia[j]),
            told: true,
            notable: missed(j) / a.max(f64::MIN_POSITIVE),
        });
        if problem.columns.known[j].is_some() || !problem.columns.own[j].is_empty() {
            let f = &power[j] / all;
            let friction = fit.targets[j][n];
            let told = joints.tells_friction(j);
            out.push(Positive {
                joint: j,
                quantity: Quantity::FrictionPower,
                // the target holds known friction with the sign that takes it off
                value: f.dot(&fit.theta) - friction * known[j] / all,
                std: fit.deviation(normal, &f),
                told,
                notable: missed(j) * v,
            });
        }
    }
    out
}

/// Root mean square of each joint's torque.
fn torque_rms(problem: &Problem, joints: &Sample, targets: &[DVector<f64>]) -> Vec<f64> {
    let rms = joints.rms(&joints.tau);
    let n = rms.len();
    // an exchange moves torques between joints
    let of = |j: usize| {
        (0..n)
            .map(|k| (targets[j][k] * rms[k]).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    match problem.channels.drive {
        super::channels::Drive::Joints => (0..n).map(of).collect(),
        _ => rms,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_logarithm_of_the_normal_distribution_joins_its_asymptote() {
        assert!((log_normal_cdf(0.0) - 0.5_f64.ln()).abs() < 1e-12);
        assert!((log_normal_cdf(-4.999) - log_normal_cdf(-5.001)).abs() < 0.05);
        assert!(log_normal_cdf(-8.0) < -34.0);
    }
}
