//! The continuous-discrete extended Kalman filter (30)-(38), state `(q, v, parameters)`.
//!
//! Between samples state and covariance are integrated ((34), (35): `propagate`); at a sample the
//! update (36)-(38) has Joseph's form, which keeps `P` symmetric and positive definite. `F` has
//! non-zero rows only for `q` and `v`, so that the parameters' block of `P` changes in updates
//! alone.

use super::problem::{FRICTION, FrictionProblem, NoiseLevels};
use super::propagate::{SampleInterval, ScaledLaw, StateTransition, with_sensitivities};

/// Estimate of the filter after a pass over all records.
#[derive(Debug, Clone)]
pub struct FilterPass {
    /// Parameters in the filter's coordinates.
    pub parameters: Vec<f64>,
    /// Gaussian log-likelihood of the innovations (less the constant).
    pub log_likelihood: f64,
}

/// Working memory of the filter; made once, used for any number of passes.
pub struct ExtendedKalmanFilter {
    n: usize,
    x: Vec<f64>,
    p: Vec<f64>,
    gain: Vec<f64>,
    column: Vec<f64>,
    row_q: Vec<f64>,
    row_v: Vec<f64>,
    transition: StateTransition,
}

impl ExtendedKalmanFilter {
    pub fn new(problem: &FrictionProblem) -> Self {
        let n = 2 + problem.parameters();
        ExtendedKalmanFilter {
            n,
            x: vec![0.0; n],
            p: vec![0.0; n * n],
            gain: vec![0.0; n],
            column: vec![0.0; n],
            row_q: vec![0.0; n],
            row_v: vec![0.0; n],
            transition: StateTransition::new(n - 2),
        }
    }

    /// Runs over all records from `start` with prior standard deviations `spread`.
    ///
    /// Linearised along the running estimate, as (32) says. Between records the states are
    /// forgotten and the parameters kept.
    pub fn pass(
        &mut self,
        problem: &FrictionProblem,
        start: &[f64],
        spread: &[f64],
        noise: NoiseLevels,
    ) -> FilterPass {
        let np = self.n - 2;
        self.x[2..].copy_from_slice(start);
        self.p.fill(0.0);
        for (j, s) in spread.iter().enumerate().take(np) {
            self.p[(2 + j) * self.n + 2 + j] = s * s;
        }
        let mut log_likelihood = 0.0;
        for record in &problem.records {
            let r = record.r[0] * noise.position_factor;
            self.begin(problem, record.y[0], record.v0, r);
            for k in 0..record.tau.len() {
                let interval = SampleInterval::of(record, k, problem.nuisance);
                self.predict(problem, &interval, noise);
                let r = record.r[k + 1] * noise.position_factor;
                let (innovation, s) = self.update(record.y[k + 1], r);
                problem.clamp(&mut self.x[2..]);
                log_likelihood -= 0.5 * (innovation * innovation / s + s.ln());
            }
        }
        FilterPass {
            parameters: self.x[2..].to_vec(),
            log_likelihood,
        }
    }

    /// State at the first sample of a record: measured position, guessed velocity.
    fn begin(&mut self, problem: &FrictionProblem, y: f64, v0: f64, r: f64) {
        let n = self.n;
        self.x[0] = y;
        self.x[1] = v0;
        for j in 0..n {
            for i in 0..2 {
                self.p[i * n + j] = 0.0;
                self.p[j * n + i] = 0.0;
            }
        }
        self.p[0] = r;
        self.p[n + 1] = (0.1 * problem.velocity_scale).powi(2);
    }

    fn predict(
        &mut self,
        problem: &FrictionProblem,
        interval: &SampleInterval,
        noise: NoiseLevels,
    ) {
        let n = self.n;
        let law = ScaledLaw::new(problem, &self.x[2..2 + FRICTION]);
        let (q, v) = with_sensitivities(
            &law,
            &self.x[2..],
            interval,
            problem.least_inertia,
            self.x[0],
            self.x[1],
            &mut self.transition,
        );
        self.x[0] = q;
        self.x[1] = v;
        let t = &self.transition;
        // rows of P for q and v against the parameters: Phi P_xp + B P_pp
        let (pq, rest) = self.p.split_at_mut(n);
        let (pv, pp) = rest.split_at_mut(n);
        for j in 2..n {
            self.row_q[j] = pq[j] + t.q_v * pv[j];
            self.row_v[j] = t.v_v * pv[j];
        }
        let (qq, qv, vv) = (pq[0], pq[1], pv[1]);
        let mut xx = [
            qq + 2.0 * t.q_v * qv + t.q_v * t.q_v * vv,
            t.v_v * (qv + t.q_v * vv),
            t.v_v * t.v_v * vv,
        ];
        // Phi P_xp B' with the old cross terms, then B times the new ones
        for j in 2..n {
            xx[0] += self.row_q[j] * t.b_q[j - 2];
            xx[1] += self.row_q[j] * t.b_v[j - 2];
            xx[2] += self.row_v[j] * t.b_v[j - 2];
        }
        for i in 0..n - 2 {
            let row = &pp[i * n + 2..i * n + n];
            let rows = self.row_q[2..].iter_mut().zip(&mut self.row_v[2..]);
            for (c, (row_q, row_v)) in row.iter().zip(rows) {
                *row_q += t.b_q[i] * c;
                *row_v += t.b_v[i] * c;
            }
        }
        for j in 2..n {
            xx[0] += t.b_q[j - 2] * self.row_q[j];
            xx[1] += t.b_q[j - 2] * self.row_v[j];
            xx[2] += t.b_v[j - 2] * self.row_v[j];
        }
        // torque noise, constant over the interval: rank one
        let s2 = noise.torque * noise.torque;
        xx[0] += s2 * t.n_q * t.n_q;
        xx[1] += s2 * t.n_q * t.n_v;
        xx[2] += s2 * t.n_v * t.n_v;
        (pq[0], pq[1], pv[0], pv[1]) = (xx[0], xx[1], xx[1], xx[2]);
        for j in 2..n {
            pq[j] = self.row_q[j];
            pv[j] = self.row_v[j];
            pp[(j - 2) * n] = self.row_q[j];
            pp[(j - 2) * n + 1] = self.row_v[j];
        }
    }

    /// Measurement of q; returns the innovation and its variance.
    fn update(&mut self, y: f64, r: f64) -> (f64, f64) {
        let n = self.n;
        self.column.copy_from_slice(&self.p[..n]);
        let s = self.column[0] + r;
        let innovation = y - self.x[0];
        for i in 0..n {
            self.gain[i] = self.column[i] / s;
            self.x[i] += self.gain[i] * innovation;
        }
        // Joseph: (I - K H) P (I - K H)' + K r K' = P - K p' - p K' + s K K', written so that
        // entries (i, j) and (j, i) round alike and P stays symmetric to the bit
        for i in 0..n {
            let (ki, ci) = (self.gain[i], self.column[i]);
            let row = &mut self.p[i * n..(i + 1) * n];
            for ((p, k), c) in row.iter_mut().zip(&self.gain).zip(&self.column) {
                *p += s * (ki * k) - (ci * k + ki * c);
            }
        }
        (innovation, s)
    }
}

#[cfg(test)]
mod tests {
    use super::super::passes::{GivenNoise, first_noise, maximise, spread};
    use super::super::score::score;
    use super::super::start::{constant_inertia, from_log};
    use super::super::trial::FrictionTrial;
    use super::*;
    use nalgebra::DMatrix;

    /// Covariance of the parameters after a pass.
    fn covariance(filter: &ExtendedKalmanFilter) -> DMatrix<f64> {
        let whole = DMatrix::from_row_slice(filter.n, filter.n, &filter.p);
        whole.remove_rows(0, 2).remove_columns(0, 2)
    }

    #[test]
    fn the_covariance_stays_symmetric_and_positive_definite() {
        let trial = FrictionTrial::usual();
        let prepared = trial.prepared(1);
        let problem = &prepared.problem;
        let noise = first_noise(problem, &GivenNoise::default());
        let mut p = vec![0.0; problem.parameters()];
        problem.coordinates(&trial.law, &mut p);
        p[FRICTION..].copy_from_slice(&constant_inertia(&prepared, 12.0));
        let mut filter = ExtendedKalmanFilter::new(problem);
        let pass = filter.pass(problem, &p, &spread(problem), noise);
        let c = covariance(&filter);
        assert_eq!(c, c.transpose());
        assert!(c.cholesky().is_some());
        assert!(pass.parameters.iter().all(|x| x.is_finite()));
    }

    #[test]
    fn at_the_maximum_its_covariance_is_the_inverse_information() {
        let trial = FrictionTrial::usual();
        let prepared = trial.prepared(2);
        let problem = &prepared.problem;
        let starts = from_log(&prepared, 2);
        let top = maximise(&prepared, &starts, &GivenNoise::default()).unwrap();
        // a filter that begins at the maximum, sure to within a few standard deviations, moves
        // little and so linearises there
        let tight: Vec<f64> = (0..problem.parameters())
            .map(|i| 3.0 * top.covariance[(i, i)].sqrt())
            .collect();
        let mut filter = ExtendedKalmanFilter::new(problem);
        filter.pass(problem, &top.parameters, &tight, top.noise);
        let found = covariance(&filter);
        let mut h = score(problem, &top.parameters, top.noise, 100).information;
        for (i, s) in tight.iter().enumerate() {
            h[(i, i)] += 1.0 / (s * s);
        }
        let c = h.cholesky().unwrap().inverse();
        for i in 0..FRICTION {
            let ratio = (found[(i, i)] / c[(i, i)]).sqrt();
            assert!((0.9..1.1).contains(&ratio), "parameter {i}: {ratio}");
        }
    }
}
