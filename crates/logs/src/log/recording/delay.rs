//! Delay between positions and torques, from the motion itself.
//!
//! For each trial delay the torque is fitted per joint by what any joint's motion explains: inertia,
//! viscous and Coulomb friction, gravity of one link and an offset. The delay at which the residual
//! is least is the one by which the torques lag. Its standard deviation follows from the curvature
//! of the residual there (the Gauss-Newton approximation), with the residual's own correlation.

/// Rows that are used at most.
const ROWS: usize = 1 << 13;
/// Trial delays on each side of 0, in steps of the positions' clock.
const TRIALS: usize = 40;
/// Columns of the fit.
const COLUMNS: usize = 7;
/// Share of the torque that the motion must explain for a delay to be told.
const EXPLAINED: f64 = 0.5;

/// Rows from which a delay is estimated.
#[derive(Debug, Default)]
pub struct DelayEstimator {
    joints: usize,
    t: Vec<f64>,
    q: Vec<f64>,
    tau: Vec<f64>,
}

/// An estimated delay of the torques behind the positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DelayEstimate {
    /// Delay [s], positive where torques lag.
    pub delay_s: f64,
    /// Its standard deviation [s].
    pub std_s: f64,
}

impl DelayEstimator {
    /// Adds a row; those beyond the first some thousands are not needed.
    pub fn add(&mut self, t: f64, q: &[f64], tau: &[f64]) {
        if self.t.len() == ROWS || q.len() != tau.len() || q.is_empty() {
            return;
        }
        let finite = q.iter().chain(tau).all(|value| value.is_finite());
        if !finite || (!self.t.is_empty() && q.len() != self.joints) {
            return;
        }
        self.joints = q.len();
        self.t.push(t);
        self.q.extend(q);
        self.tau.extend(tau);
    }

    /// One sentence about the delay for the user; `removed_s` is already taken off.
    pub(super) fn describe(&self, positions: &str, torques: &str, removed_s: f64) -> String {
        let removed = match removed_s {
            0.0 => "not removed: `torque_delay_s` in [log] of the robot file does that".to_owned(),
            removed => format!("{:.1} ms are taken off already", removed * 1e3),
        };
        match self.estimate() {
            None => format!(
                "the delay between {positions} and {torques} cannot be determined from the motion ({removed})"
            ),
            Some(DelayEstimate { delay_s, std_s }) => format!(
                "{torques} lags behind {positions} by {:.1} ms (standard deviation {:.1} ms), estimated from the motion; {removed}",
                delay_s * 1e3,
                std_s * 1e3
            ),
        }
    }

    /// Estimates the delay; `None` where the motion explains too little of the torques.
    pub fn estimate(&self) -> Option<DelayEstimate> {
        let rows = self.t.len();
        if rows < 8 * TRIALS {
            return None;
        }
        let mut steps: Vec<f64> = self.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let dt = *steps.get(steps.len() / 2)?;
        let half = ((0.01 / dt).round() as usize).clamp(1, 25);
        let mut residuals = vec![0.0; 2 * TRIALS + 1];
        let (mut weight, mut best_joint) = (0.0, None);
        for joint in 0..self.joints {
            let Some(found) = self.residuals(joint, dt, half) else {
                continue;
            };
            let least = found.iter().copied().fold(f64::INFINITY, f64::min);
            // What is left at best, of the torque's variation.
            if least > 1.0 - EXPLAINED {
                continue;
            }
            // A joint weighs by how its residual rises away from the delay.
            let most = found.iter().copied().fold(0.0, f64::max);
            for (sum, value) in residuals.iter_mut().zip(&found) {
                *sum += value / least.max(1e-12);
            }
            weight += 1.0;
            if best_joint.is_none_or(|best| most / least > best) {
                best_joint = Some(most / least);
            }
        }
        if weight == 0.0 {
            return None;
        }
        let least = (0..residuals.len()).min_by(|a, b| residuals[*a].total_cmp(&residuals[*b]))?;
        // At the edge of the trials it is no minimum.
        if least == 0 || least + 1 == residuals.len() {
            return None;
        }
        let [left, middle, right] = [residuals[least - 1], residuals[least], residuals[least + 1]];
        let curvature = left - 2.0 * middle + right;
        if curvature <= 0.0 {
            return None;
        }
        let offset = 0.5 * (left - right) / curvature;
        let steps = least as f64 - TRIALS as f64 + offset;
        // Smoothing makes neighbours within its width say the same.
        let independent = rows as f64 / (2 * half + 1) as f64;
        let std = (2.0 * middle / (curvature * independent)).sqrt();
        Some(DelayEstimate {
            delay_s: steps * dt,
            std_s: std * dt,
        })
    }

    /// Share of one joint's torque variation that is left at each trial delay.
    fn residuals(&self, joint: usize, dt: f64, half: usize) -> Option<Vec<f64>> {
        let rows = self.t.len();
        let column = |of: &[f64]| -> Vec<f64> {
            let values = of.iter().skip(joint).step_by(self.joints);
            values.copied().collect()
        };
        let twice = |x: &[f64]| smoothed(&smoothed(x, half), half);
        // Lightly smoothed for the sign of the speed; torque and motion alike for the fit.
        let q = smoothed(&column(&self.q), half.min(2));
        let tau = twice(&column(&self.tau));
        let v = derivative(&q, dt);
        let a = derivative(&v, dt);
        let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
        let (v_rms, a_rms) = (rms(&v), rms(&a));
        if v_rms == 0.0 || a_rms == 0.0 {
            return None;
        }
        let of = |column: &dyn Fn(usize) -> f64| twice(&(0..rows).map(column).collect::<Vec<_>>());
        let columns: [Vec<f64>; COLUMNS] = [
            of(&|i| a[i] / a_rms),
            of(&|i| v[i] / v_rms),
            of(&|i| (10.0 * v[i] / v_rms).tanh()),
            of(&|i| (50.0 * v[i] / v_rms).tanh()),
            of(&|i| q[i].sin()),
            of(&|i| q[i].cos()),
            vec![1.0; rows],
        ];
        let edge = TRIALS + 2 * half + 2;
        let used = edge..rows.checked_sub(edge).filter(|end| *end > edge)?;
        let mean = tau[used.clone()].iter().sum::<f64>() / used.len() as f64;
        let total: f64 = tau[used.clone()].iter().map(|x| (x - mean).powi(2)).sum();
        if total <= 0.0 {
            return None;
        }
        // The motion stays, the torques are shifted: the normal matrix is the same for all trials.
        let mut normal = [[0.0; COLUMNS]; COLUMNS];
        for i in 0..COLUMNS {
            for j in 0..=i {
                let pairs = columns[i][used.clone()]
                    .iter()
                    .zip(&columns[j][used.clone()]);
                normal[i][j] = pairs.map(|(x, y)| x * y).sum();
            }
        }
        let factor = cholesky(normal, used.len() as f64)?;
        let trials = (0..=2 * TRIALS).map(|trial| {
            let shifted = used.start + trial - TRIALS..used.end + trial - TRIALS;
            let tau: Vec<f64> = tau[shifted].iter().map(|tau| tau - mean).collect();
            let power: f64 = tau.iter().map(|tau| tau * tau).sum();
            let mut right = [0.0; COLUMNS];
            for (sum, column) in right.iter_mut().zip(&columns) {
                let pairs = column[used.clone()].iter().zip(&tau);
                *sum = pairs.map(|(x, tau)| x * tau).sum();
            }
            // |r|^2 = |tau|^2 - |L^-1 Y' tau|^2
            for i in 0..COLUMNS {
                for j in 0..i {
                    right[i] -= factor[i][j] * right[j];
                }
                right[i] /= factor[i][i];
            }
            let explained: f64 = right.iter().map(|x| x * x).sum();
            ((power - explained) / total).max(0.0)
        });
        Some(trials.collect())
    }
}

/// Mean over `half` neighbours on each side.
fn smoothed(x: &[f64], half: usize) -> Vec<f64> {
    (0..x.len())
        .map(|i| {
            let near = &x[i.saturating_sub(half)..(i + half + 1).min(x.len())];
            near.iter().sum::<f64>() / near.len() as f64
        })
        .collect()
}

/// Central differences; 0 at the ends.
fn derivative(x: &[f64], dt: f64) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    for (to, near) in out.iter_mut().skip(1).zip(x.windows(3)) {
        *to = (near[2] - near[0]) / (2.0 * dt);
    }
    out
}

/// Lower Cholesky factor of a normal matrix of `rows` rows, with a ridge far below what is measured.
fn cholesky(mut m: [[f64; COLUMNS]; COLUMNS], rows: f64) -> Option<[[f64; COLUMNS]; COLUMNS]> {
    for i in 0..COLUMNS {
        m[i][i] += 1e-9 * rows;
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| m[i][k] * m[j][k]).sum();
            let sum = m[i][j] - known;
            if i == j {
                if sum <= 0.0 {
                    return None;
                }
                m[i][i] = sum.sqrt();
            } else {
                m[i][j] = sum / m[j][j];
            }
        }
    }
    Some(m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint whose torque lags by `delay_s`, with measurement noise from a fixed pattern.
    fn moved(delay_s: f64, noise: f64) -> DelayEstimator {
        let mut delay = DelayEstimator::default();
        let dt = 0.004;
        let q = |t: f64| 0.8 * (1.7 * t).sin() + 0.3 * (4.1 * t).sin();
        let v = |t: f64| 0.8 * 1.7 * (1.7 * t).cos() + 0.3 * 4.1 * (4.1 * t).cos();
        let a = |t: f64| {
            -0.8 * 1.7f64.powi(2) * (1.7 * t).sin() - 0.3 * 4.1f64.powi(2) * (4.1 * t).sin()
        };
        let mut seed = 1u64;
        for i in 0..5000 {
            let t = i as f64 * dt;
            let s = t - delay_s;
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let white = (seed >> 33) as f64 / (1u64 << 30) as f64 - 1.0;
            let tau = 2.0 * a(s) + 0.7 * v(s) + 1.5 * (20.0 * v(s)).tanh() + 4.0 * q(s).cos();
            delay.add(t, &[q(t)], &[tau + noise * white]);
        }
        delay
    }

    #[test]
    fn a_lag_between_two_steps_of_the_clock_is_found() {
        for delay_s in [0.0, 0.0131, -0.0062, 0.05] {
            for noise in [0.0, 0.5] {
                let found = moved(delay_s, noise).estimate().unwrap();
                assert!(
                    (found.delay_s - delay_s).abs() < 2e-4 + 4.0 * noise * found.std_s,
                    "{delay_s}: {found:?}"
                );
                assert!((1e-6..5e-4).contains(&found.std_s), "{found:?}");
            }
        }
    }

    #[test]
    fn torques_that_have_nothing_to_do_with_the_motion_have_no_delay() {
        let mut other = moved(0.0, 0.0);
        for (index, tau) in other.tau.iter_mut().enumerate() {
            *tau = ((index * 7919) % 104729) as f64;
        }
        assert_eq!(other.estimate(), None);
        assert_eq!(DelayEstimator::default().estimate(), None);
        assert!(
            DelayEstimator::default()
                .describe("/a", "/b", 0.0)
                .contains("cannot be determined")
        );
    }
}
