//! The continuous-discrete extended Kalman filter (30)-(38), state `(q, v, parameters)`.
//!
//! Between samples state and covariance are integrated ((34), (35): `propagate`); at a sample the
//! update (36)-(38) has Joseph's form, which keeps `P` symmetric and positive definite. `F` has
//! non-zero rows only for `q` and `v`, so that the parameters' block of `P` changes in updates
//! alone.

use super::problem::{FRICTION, FrictionProblem, NoiseLevels};
use super::propagate::{SampleInterval, ScaledLaw, Transition, with_sensitivities};

/// Estimate of the filter after a pass over all records.
#[derive(Debug, Clone)]
pub struct FilterPass {
    /// Parameters in the filter's coordinates.
    pub parameters: Vec<f64>,
    /// Their covariance, row-major.
    pub covariance: Vec<f64>,
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
    transition: Transition,
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
            transition: Transition::new(n - 2),
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
            self.begin(
                problem,
                record.y[0],
                record.v0,
                record.r[0] * noise.position_factor,
            );
            for k in 0..record.tau.len() {
                let interval = SampleInterval::of(record, k, problem.nuisance);
                self.predict(problem, &interval, noise);
                let r = record.r[k + 1] * noise.position_factor;
                let (innovation, s) = self.update(record.y[k + 1], r);
                problem.clamp(&mut self.x[2..]);
                log_likelihood -= 0.5 * (innovation * innovation / s + s.ln());
            }
        }
        let mut covariance = vec![0.0; np * np];
        for i in 0..np {
            let row = (2 + i) * self.n + 2;
            covariance[i * np..(i + 1) * np].copy_from_slice(&self.p[row..row + np]);
        }
        FilterPass {
            parameters: self.x[2..].to_vec(),
            covariance,
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
            let (bq, bv) = (t.b_q[i], t.b_v[i]);
            for ((c, rq), rv) in row
                .iter()
                .zip(&mut self.row_q[2..n])
                .zip(&mut self.row_v[2..n])
            {
                *rq += bq * c;
                *rv += bv * c;
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
        pq[0] = xx[0];
        pq[1] = xx[1];
        pv[0] = xx[1];
        pv[1] = xx[2];
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
    use super::super::passes::{GivenNoise, first_noise, spread};
    use super::super::score::score;
    use super::super::trial::FrictionTrial;
    use super::*;
    use nalgebra::DMatrix;

    fn start(trial: &FrictionTrial, problem: &FrictionProblem) -> Vec<f64> {
        let mut p = vec![0.0; problem.parameters()];
        problem.coordinates(&trial.law, &mut p);
        p
    }

    #[test]
    fn the_covariance_stays_symmetric_and_positive_definite() {
        let trial = FrictionTrial::usual();
        let prepared = trial.prepared(1);
        let problem = &prepared.problem;
        let noise = first_noise(problem, &GivenNoise::default());
        let mut p = start(&trial, problem);
        p[FRICTION..].copy_from_slice(&super::super::start::constant_inertia(&prepared, 12.0));
        let mut filter = ExtendedKalmanFilter::new(problem);
        let pass = filter.pass(problem, &p, &spread(problem), noise);
        let n = problem.parameters();
        let c = DMatrix::from_row_slice(n, n, &pass.covariance);
        assert_eq!(c, c.transpose());
        assert!(c.cholesky().is_some());
        assert!(pass.parameters.iter().all(|x| x.is_finite()));
    }

    #[test]
    fn at_the_maximum_its_covariance_is_the_inverse_information() {
        let trial = FrictionTrial::usual();
        let prepared = trial.prepared(2);
        let problem = &prepared.problem;
        let starts = super::super::start::from_log(&prepared, 2);
        let top =
            super::super::passes::maximise(&prepared, &starts, &GivenNoise::default()).unwrap();
        let spread = spread(problem);
        // a filter that begins at the maximum, sure to within a few standard deviations, moves
        // little and so linearises there
        let tight: Vec<f64> = (0..problem.parameters())
            .map(|i| 3.0 * top.covariance[(i, i)].sqrt())
            .collect();
        let pass =
            ExtendedKalmanFilter::new(problem).pass(problem, &top.parameters, &tight, top.noise);
        let mut h = score(problem, &top.parameters, top.noise, 100).information;
        for (i, s) in tight.iter().enumerate() {
            h[(i, i)] += 1.0 / (s * s);
        }
        let c = h.cholesky().unwrap().inverse();
        assert_eq!(spread.len(), tight.len());
        for i in 0..FRICTION {
            let found = pass.covariance[i * problem.parameters() + i].sqrt();
            let ratio = found / c[(i, i)].sqrt();
            assert!((0.9..1.1).contains(&ratio), "parameter {i}: {ratio}");
        }
    }
}
