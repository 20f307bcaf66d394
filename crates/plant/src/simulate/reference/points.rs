//! A list of poses at times, joined smoothly.

use super::Target;
use crate::simulate::SimulateError;
use cft_ident_core::explain::ErrorText;

/// Cubic spline through poses at given times, twice continuously differentiable, at rest at both ends.
///
/// Two equal poses in a row are a dwell: the spline is at rest at both of them and the parts before
/// and after are joined separately, so that a dwell never overshoots.
#[derive(Debug, Clone, PartialEq)]
pub struct SplineReference<const J: usize> {
    times: Vec<f64>,
    positions: Vec<[f64; J]>,
    velocities: Vec<[f64; J]>,
}

impl<const J: usize> SplineReference<J> {
    /// Spline through `points`, each a time \[s\] and a pose \[m or rad\].
    ///
    /// # Errors
    /// [`SimulateError::Reference`] for fewer than two points, times that do not increase, and numbers
    /// that are not finite.
    pub fn new(points: &[(f64, [f64; J])]) -> Result<Self, SimulateError> {
        let reject = |what: String| Err(SimulateError::reference(what));
        if points.len() < 2 {
            let what = ErrorText::new(format!("the point list has {} points", points.len()));
            return Err(SimulateError::reference(
                what.remedy("it needs at least two"),
            ));
        }
        let mut before = f64::NEG_INFINITY;
        for (k, (t, pose)) in (1..).zip(points) {
            if !t.is_finite() || pose.iter().any(|x| !x.is_finite()) {
                return reject(format!("point {k} of the list is not finite"));
            }
            if *t <= before {
                return reject(format!(
                    "point {k} of the list is at {t} s, not after the point before it at {before} s"
                ));
            }
            before = *t;
        }
        let times: Vec<f64> = points.iter().map(|p| p.0).collect();
        let positions: Vec<[f64; J]> = points.iter().map(|p| p.1).collect();
        let mut velocities = vec![[0.0; J]; points.len()];
        let mut first = 0;
        for k in 1..points.len() {
            let dwell = positions[k] == positions[k - 1];
            if dwell || k + 1 == points.len() {
                let last = if dwell { k - 1 } else { k };
                clamped_slopes(&times, &positions, first, last, &mut velocities);
                first = k;
            }
        }
        Ok(Self {
            times,
            positions,
            velocities,
        })
    }

    /// Time of the last point \[s\].
    pub fn seconds(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// Position and velocity at time t \[s\]; at rest before the first and after the last point.
    pub fn at(&self, t: f64) -> Target<J> {
        let n = self.times.len();
        let after = self.times.partition_point(|&x| x <= t);
        if after == 0 || after == n {
            return Target::rest(self.positions[if after == 0 { 0 } else { n - 1 }]);
        }
        let k = after - 1;
        let h = self.times[after] - self.times[k];
        let x = (t - self.times[k]) / h;
        // Hermite form on [0, 1].
        let (x2, x3) = (x * x, x * x * x);
        let mut target = Target::rest([0.0; J]);
        for i in 0..J {
            let (p0, p1) = (self.positions[k][i], self.positions[after][i]);
            let (v0, v1) = (self.velocities[k][i], self.velocities[after][i]);
            target.position[i] = p0
                + (p1 - p0) * (3.0 * x2 - 2.0 * x3)
                + h * (v0 * (x - 2.0 * x2 + x3) + v1 * (x3 - x2));
            target.velocity[i] = (p1 - p0) / h * 6.0 * (x - x2)
                + v0 * (1.0 - 4.0 * x + 3.0 * x2)
                + v1 * (3.0 * x2 - 2.0 * x);
        }
        target
    }
}

/// Slopes of the cubic spline through points `first..=last`, zero at both ends: a tridiagonal system, by elimination.
fn clamped_slopes<const J: usize>(
    times: &[f64],
    positions: &[[f64; J]],
    first: usize,
    last: usize,
    velocities: &mut [[f64; J]],
) {
    if last < first + 2 {
        return;
    }
    let mut upper = vec![0.0; last - first];
    for k in first + 1..last {
        let (h0, h1) = (times[k] - times[k - 1], times[k + 1] - times[k]);
        let (w0, w1) = (1.0 / h0, 1.0 / h1);
        let pivot = 2.0 * (w0 + w1) - w0 * upper[k - first - 1];
        upper[k - first] = w1 / pivot;
        for i in 0..J {
            let right = 3.0
                * (w0 * w0 * (positions[k][i] - positions[k - 1][i])
                    + w1 * w1 * (positions[k + 1][i] - positions[k][i]));
            velocities[k][i] = (right - w0 * velocities[k - 1][i]) / pivot;
        }
    }
    for k in (first + 1..last).rev() {
        let next = velocities[k + 1];
        for (slope, next) in velocities[k].iter_mut().zip(next) {
            *slope -= upper[k - first] * next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIST: [(f64, [f64; 2]); 6] = [
        (0.0, [0.0, 1.0]),
        (1.0, [0.5, 1.2]),
        (1.7, [0.1, 1.1]),
        (2.5, [0.1, 1.1]),
        (3.0, [0.3, 0.9]),
        (4.0, [0.6, 0.7]),
    ];

    #[test]
    fn a_spline_passes_smoothly_through_every_point_and_rests_where_it_dwells() {
        let points = SplineReference::new(&LIST).expect("usable list");
        for (t, pose) in LIST {
            assert_eq!(points.at(t).position, pose);
        }
        for k in 0..=80 {
            let target = points.at(1.7 + 0.01 * f64::from(k));
            assert!((target.position[0] - 0.1).abs() < 1e-15);
            assert!(target.velocity[0].abs() < 1e-15);
        }
        let h = 1e-6;
        for t in [1.0, 3.0] {
            let acceleration = |t: f64| {
                let (a, b) = (points.at(t), points.at(t + h));
                (b.velocity[0] - a.velocity[0]) / h
            };
            let jump = acceleration(t) - acceleration(t - h);
            assert!(jump.abs() < 1e-4, "jump {jump} at {t} s");
        }
    }

    #[test]
    fn lists_that_are_no_motion_are_refused() {
        let lists: [&[(f64, [f64; 1])]; 3] = [
            &[(0.0, [0.0]), (0.0, [1.0])],
            &[(0.0, [0.0])],
            &[(0.0, [0.0]), (1.0, [f64::NAN])],
        ];
        for list in lists {
            let outcome = SplineReference::new(list);
            assert!(matches!(outcome, Err(SimulateError::Reference { .. })));
        }
    }
}
