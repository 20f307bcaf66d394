//! Propagation between samples: the integrals of (34) and of the sensitivities in (35).
//!
//! The states `(q, v)` are integrated by Runge-Kutta 4 with sub-steps chosen from the local slope
//! of the friction law, because a step longer than its time constant chatters without a sign. The
//! transition matrix and the sensitivities to the parameters are integrals along the same steps by
//! Simpson's rule with the exact exponential of the local decay.

use super::problem::{FRICTION, FrictionProblem, JointRecord};
use crate::math::hyperbolic::tanh;

/// Longest sub-step relative to the local time constant of the friction.
const STEP_LIMIT: f64 = 0.8;
/// Most sub-steps in one interval: beyond it the transition is not resolved by any sample.
const MOST_STEPS: usize = 64;

/// What one interval does to the state and to small changes of state and parameters.
#[derive(Debug, Clone, Default)]
pub struct StateTransition {
    /// dq/dv and dv/dv at the end; dq/dq = 1 and dv/dq = 0.
    pub q_v: f64,
    pub v_v: f64,
    /// Sensitivity of q and v at the end to the parameters.
    pub b_q: Vec<f64>,
    pub b_v: Vec<f64>,
    /// Sensitivity of q and v at the end to a constant torque over the interval.
    pub n_q: f64,
    pub n_v: f64,
}

impl StateTransition {
    pub fn new(parameters: usize) -> Self {
        StateTransition {
            b_q: vec![0.0; parameters],
            b_v: vec![0.0; parameters],
            ..StateTransition::default()
        }
    }
}

/// Friction in SI units, unpacked once per parameter vector.
#[derive(Debug, Clone, Copy)]
pub struct ScaledLaw {
    viscous: f64,
    coulomb: [f64; 2],
    slope: [f64; 2],
    torque_scale: f64,
    viscous_scale: f64,
}

/// Friction at one velocity: torque, slope, and the two tanh and sech^2.
#[derive(Debug, Clone, Copy)]
struct FrictionAt {
    v: f64,
    force: f64,
    slope: f64,
    tanh: [f64; 2],
    sech2: [f64; 2],
}

impl ScaledLaw {
    pub fn new(problem: &FrictionProblem, p: &[f64]) -> Self {
        let (fs, vs) = (problem.torque_scale, problem.velocity_scale);
        ScaledLaw {
            viscous: p[0] * fs / vs,
            coulomb: [p[1] * fs, p[2] * fs],
            slope: [p[3].exp() / vs, p[4].exp() / vs],
            torque_scale: fs,
            viscous_scale: fs / vs,
        }
    }

    #[inline(always)]
    fn force(&self, v: f64) -> f64 {
        self.viscous * v
            + self.coulomb[0] * tanh(self.slope[0] * v)
            + self.coulomb[1] * tanh(self.slope[1] * v)
    }

    #[inline(always)]
    fn at(&self, v: f64) -> FrictionAt {
        let t = [tanh(self.slope[0] * v), tanh(self.slope[1] * v)];
        let s = [1.0 - t[0] * t[0], 1.0 - t[1] * t[1]];
        FrictionAt {
            v,
            force: self.viscous * v + self.coulomb[0] * t[0] + self.coulomb[1] * t[1],
            slope: self.viscous
                + self.coulomb[0] * self.slope[0] * s[0]
                + self.coulomb[1] * self.slope[1] * s[1],
            tanh: t,
            sech2: s,
        }
    }

    /// dF/dv.
    #[inline(always)]
    pub(crate) fn slope_at(&self, v: f64) -> f64 {
        self.at(v).slope
    }

    /// Sub-steps for an interval from v with acceleration a, by the steepest slope that it can meet.
    #[inline(always)]
    fn steps(&self, v: f64, a: f64, minv: f64, dt: f64) -> usize {
        let bound = self.viscous.abs()
            + (self.coulomb[0] * self.slope[0]).abs()
            + (self.coulomb[1] * self.slope[1]).abs();
        if bound * minv * dt <= STEP_LIMIT {
            return 1;
        }
        let end = v + a * dt;
        let turns = v * end <= 0.0;
        let least = if turns { 0.0 } else { v.abs().min(end.abs()) };
        let t = [tanh(self.slope[0] * least), tanh(self.slope[1] * least)];
        let local = self.viscous.abs()
            + (self.coulomb[0] * self.slope[0]).abs() * (1.0 - t[0] * t[0])
            + (self.coulomb[1] * self.slope[1]).abs() * (1.0 - t[1] * t[1]);
        // a NaN makes the comparison false and ends as one step
        match (local * minv * dt / STEP_LIMIT).ceil() {
            n if n > 1.0 => n.min(MOST_STEPS as f64) as usize,
            _ => 1,
        }
    }

    /// dF/d(filter coordinate) for the five friction parameters.
    #[inline(always)]
    fn gradient(&self, x: &FrictionAt) -> [f64; FRICTION] {
        [
            self.viscous_scale * x.v,
            self.torque_scale * x.tanh[0],
            self.torque_scale * x.tanh[1],
            self.coulomb[0] * self.slope[0] * x.v * x.sech2[0],
            self.coulomb[1] * self.slope[1] * x.v * x.sech2[1],
        ]
    }
}

/// What acts during one interval: torque, and the rows of the nuisance coefficients.
#[derive(Debug, Clone, Copy)]
pub struct SampleInterval<'a> {
    pub dt: f64,
    pub tau: f64,
    pub m: &'a [f64],
    pub h: &'a [f64],
}

impl<'a> SampleInterval<'a> {
    /// Interval k of a record with so many nuisance parameters.
    #[inline(always)]
    pub fn of(record: &'a JointRecord, k: usize, nuisance: usize) -> Self {
        let row = k * nuisance..(k + 1) * nuisance;
        SampleInterval {
            dt: record.t[k + 1] - record.t[k],
            tau: record.tau[k],
            m: &record.m[row.clone()],
            h: &record.h[row],
        }
    }
}

/// Inverse inertia and net known torque of one interval under the nuisance `eta`.
#[inline(always)]
pub(super) fn known(interval: &SampleInterval, eta: &[f64], least_inertia: f64) -> (f64, f64) {
    let mut inertia = 0.0;
    let mut load = 0.0;
    for ((m, h), e) in interval.m.iter().zip(interval.h).zip(eta) {
        inertia += m * e;
        load += h * e;
    }
    (1.0 / inertia.max(least_inertia), interval.tau - load)
}

/// Integrates the state alone over one interval; returns (q, v) at its end.
#[inline]
pub fn state(
    law: &ScaledLaw,
    eta: &[f64],
    interval: &SampleInterval,
    least: f64,
    q: f64,
    v: f64,
) -> (f64, f64) {
    let (minv, net) = known(interval, eta, least);
    let acc = |v: f64| (net - law.force(v)) * minv;
    let (mut q, mut v) = (q, v);
    let n = law.steps(v, acc(v), minv, interval.dt);
    let dt = interval.dt / n as f64;
    for _ in 0..n {
        let k1 = acc(v);
        let k2 = acc(v + 0.5 * dt * k1);
        let k3 = acc(v + 0.5 * dt * k2);
        let k4 = acc(v + dt * k3);
        q += dt * v + dt * dt / 6.0 * (k1 + k2 + k3);
        v += dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
    }
    (q, v)
}

/// State at the end of an interval, and its sensitivities into `out`; `law` was made from `p`.
#[inline]
pub(crate) fn with_sensitivities(
    law: &ScaledLaw,
    p: &[f64],
    interval: &SampleInterval,
    least: f64,
    q: f64,
    v: f64,
    out: &mut StateTransition,
) -> (f64, f64) {
    let eta = &p[FRICTION..];
    let (minv, net) = known(interval, eta, least);
    let (mut q, mut v) = (q, v);
    let first = law.at(v);
    let n = law.steps(v, (net - first.force) * minv, minv, interval.dt);
    let dt = interval.dt / n as f64;
    (out.q_v, out.v_v) = (0.0, 1.0);
    let mut b_q = [0.0; FRICTION];
    let mut b_v = [0.0; FRICTION];
    // sums for the nuisance: sensitivity = -(h_j W + m_j A) / m, with W = integral of the decay
    // and A = integral of decay times acceleration
    let (mut w_q, mut w_v, mut a_q, mut a_v) = (0.0, 0.0, 0.0, 0.0);
    for _ in 0..n {
        let x1 = law.at(v);
        let k1 = (net - x1.force) * minv;
        let k2 = (net - law.force(v + 0.5 * dt * k1)) * minv;
        let xm = law.at(v + 0.5 * dt * k2);
        let k3 = (net - xm.force) * minv;
        let x2 = law.at(v + dt * k3);
        let k4 = (net - x2.force) * minv;
        q += dt * v + dt * dt / 6.0 * (k1 + k2 + k3);
        v += dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);

        // decay from the middle and from the start to the end, and from start to middle
        let (l1, lm, l2) = (x1.slope * minv, xm.slope * minv, x2.slope * minv);
        let late = (-0.25 * dt * (lm + l2)).exp();
        let early = (-0.25 * dt * (l1 + lm)).exp();
        let whole = (-dt / 6.0 * (l1 + 4.0 * lm + l2)).exp();
        let s_whole = dt / 6.0 * (1.0 + 4.0 * early + whole);
        let s_late = 0.25 * dt * (1.0 + late);
        let w = [dt / 6.0 * whole, dt * 4.0 / 6.0 * late, dt / 6.0];
        let s = [dt / 6.0 * s_whole, dt * 4.0 / 6.0 * s_late];

        let [g1, gm, g2] = [&x1, &xm, &x2].map(|x| law.gradient(x));
        for j in 0..FRICTION {
            b_q[j] += s_whole * b_v[j] - minv * (s[0] * g1[j] + s[1] * gm[j]);
            b_v[j] = whole * b_v[j] - minv * (w[0] * g1[j] + w[1] * gm[j] + w[2] * g2[j]);
        }
        w_q += s_whole * w_v + s[0] + s[1];
        w_v = whole * w_v + w[0] + w[1] + w[2];
        a_q += s_whole * a_v + s[0] * k1 + s[1] * k3;
        a_v = whole * a_v + w[0] * k1 + w[1] * k3 + w[2] * k4;
        out.q_v += s_whole * out.v_v;
        out.v_v *= whole;
    }
    out.n_q = minv * w_q;
    out.n_v = minv * w_v;
    out.b_q[..FRICTION].copy_from_slice(&b_q);
    out.b_v[..FRICTION].copy_from_slice(&b_v);
    let (bq, bv) = (&mut out.b_q[FRICTION..], &mut out.b_v[FRICTION..]);
    for (j, (m, h)) in interval.m.iter().zip(interval.h).enumerate() {
        bq[j] = -minv * (h * w_q + m * a_q);
        bv[j] = -minv * (h * w_v + m * a_v);
    }
    (q, v)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem() -> FrictionProblem {
        FrictionProblem {
            records: Vec::new(),
            nuisance: 2,
            torque_scale: 8.0,
            velocity_scale: 0.4,
            slope_range: (0.1, 1e5),
            least_inertia: 1e-6,
        }
    }

    /// Bv, Bf1, Bf2, ln w1, ln w2 in the filter's coordinates, then an inertia and a constant.
    const P: [f64; 7] = [0.2, 0.8, -0.3, 3.2, 0.9, 0.7, 1.1];

    #[test]
    fn sensitivities_are_the_differences_of_the_integrated_state() {
        let problem = problem();
        let interval = SampleInterval {
            dt: 2e-3,
            tau: 3.0,
            m: &[1.0, 0.0],
            h: &[0.4, 1.0],
        };
        let end = |p: &[f64], v: f64, tau: f64| {
            let law = ScaledLaw::new(&problem, p);
            let interval = SampleInterval { tau, ..interval };
            state(&law, &p[FRICTION..], &interval, 1e-6, 0.1, v)
        };
        // across standstill Simpson's rule meets the bend of the tanh with three points a step
        for (v, tolerance) in [(-1e-3, 1e-2), (0.02, 6e-3), (0.9, 1e-4)] {
            let mut t = StateTransition::new(7);
            let law = ScaledLaw::new(&problem, &P);
            let x = with_sensitivities(&law, &P, &interval, 1e-6, 0.1, v, &mut t);
            assert_eq!(x, end(&P, v, 3.0));
            let near = |name: &str, found: f64, plus: f64, minus: f64, step: f64, size: f64| {
                let difference = (plus - minus) / (2.0 * step);
                assert!(
                    (found - difference).abs() < tolerance * size,
                    "{name} at v = {v}: {found} {difference}"
                );
            };
            let (s, dt) = (1e-6, interval.dt);
            let (a, b) = (end(&P, v + s, 3.0), end(&P, v - s, 3.0));
            near("dq/dv", t.q_v, a.0, b.0, s, dt);
            near("dv/dv", t.v_v, a.1, b.1, s, 1.0);
            let (a, b) = (end(&P, v, 3.0 + s), end(&P, v, 3.0 - s));
            near("dq/dtau", t.n_q, a.0, b.0, s, dt * dt);
            near("dv/dtau", t.n_v, a.1, b.1, s, dt);
            for j in 0..7 {
                let (mut plus, mut minus) = (P, P);
                plus[j] += s;
                minus[j] -= s;
                let (a, b) = (end(&plus, v, 3.0), end(&minus, v, 3.0));
                near("dq/dp", t.b_q[j], a.0, b.0, s, 8.0 * dt * dt);
                near("dv/dp", t.b_v[j], a.1, b.1, s, 8.0 * dt);
            }
        }
    }

    #[test]
    fn a_long_interval_through_a_steep_reversal_is_cut_until_it_is_right() {
        let problem = problem();
        let mut p = P;
        p[3] = 6.0;
        let law = ScaledLaw::new(&problem, &p);
        let whole = SampleInterval {
            dt: 4e-3,
            tau: 0.3,
            m: &[1.0, 0.0],
            h: &[0.0, 0.0],
        };
        let one = state(&law, &p[FRICTION..], &whole, 1e-6, 0.0, 0.05);
        let mut many = (0.0, 0.05);
        for _ in 0..4000 {
            let part = SampleInterval { dt: 1e-6, ..whole };
            many = state(&law, &p[FRICTION..], &part, 1e-6, many.0, many.1);
        }
        assert!((one.1 - many.1).abs() < 1e-5, "{one:?} {many:?}");
        assert!((one.0 - many.0).abs() < 1e-7, "{one:?} {many:?}");
    }
}
