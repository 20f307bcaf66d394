//! Plateau map: mean torque at constant speed, per direction, the report's own idea at (29).
//!
//! At constant speed inertia takes no torque; what the nuisance says of gravity and of the other
//! joints is subtracted. It is drawn over the filter's curve as a check that uses neither the
//! filter nor the friction law.

use schemars::JsonSchema;
use serde::Serialize;

use super::prepare::PreparedProblem;
use super::problem::FRICTION;

/// Mean torque over one plateau, less the nuisance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Plateau")]
pub struct TorquePlateau {
    /// Mean velocity [m/s or rad/s].
    pub v: f64,
    /// Mean torque [N or Nm].
    pub torque: f64,
    /// Standard error of the mean torque, from tenths of the plateau [N or Nm].
    pub std: f64,
    /// Length [s].
    pub seconds: f64,
}

/// Shortest plateau [s]; largest departure from its own speed, relative.
const MIN_PLATEAU_S: f64 = 0.15;
const DEPARTURE: f64 = 0.02;

/// A curve follows its plateaus to this share of their torque.
const FOLLOWS: f64 = 0.03;
/// Speeds within this share of one another are one speed.
const ONE_SPEED: f64 = 0.05;
/// Standard errors that a mean must be off by before it counts.
const SIGNIFICANT_ERRORS: f64 = 3.0;

/// The curve at a speed whose plateaus it misses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MissedPlateau {
    /// Mean velocity of the plateaus [m/s or rad/s].
    pub v: f64,
    /// Their mean torque, and that of the curve [N or Nm].
    pub torque: f64,
    pub curve: f64,
}

/// Speeds at which the mean over all plateaus is off the `curve` by more than 3 % and by more than
/// its own standard error explains, the farthest first.
pub fn missed(plateaus: &[TorquePlateau], curve: &dyn Fn(f64) -> f64) -> Vec<MissedPlateau> {
    let mut sorted: Vec<&TorquePlateau> = plateaus.iter().collect();
    sorted.sort_by(|a, b| a.v.total_cmp(&b.v));
    let alike = |a: &&TorquePlateau, b: &&TorquePlateau| (b.v - a.v).abs() <= ONE_SPEED * a.v.abs();
    let misses = |group: &[&TorquePlateau]| {
        let n = group.len() as f64;
        let mean =
            |of: &dyn Fn(&TorquePlateau) -> f64| group.iter().map(|p| of(p)).sum::<f64>() / n;
        let off = |p: &TorquePlateau| p.torque - curve(p.v);
        let (v, torque, difference) = (mean(&|p| p.v), mean(&|p| p.torque), mean(&off));
        // by the standard error of each, and by how they differ from one another
        let within = mean(&|p| p.std * p.std) / n;
        let between = mean(&|p| (off(p) - difference).powi(2)) / n;
        let sure = difference.abs() > SIGNIFICANT_ERRORS * within.max(between).sqrt();
        let curve = torque - difference;
        let missed = MissedPlateau { v, torque, curve };
        (sure && difference.abs() > FOLLOWS * torque.abs()).then_some(missed)
    };
    let mut out: Vec<MissedPlateau> = sorted.chunk_by(alike).filter_map(misses).collect();
    let share = |m: &MissedPlateau| (m.curve / m.torque - 1.0).abs();
    out.sort_by(|a, b| share(b).total_cmp(&share(a)));
    out
}

/// Speed and torque less the nuisance of every row, record by record, at the estimate `p`.
pub(super) fn net_torques<'a>(
    prepared: &'a PreparedProblem,
    p: &'a [f64],
) -> impl Iterator<Item = (&'a [f64], Vec<f64>)> {
    let problem = &prepared.problem;
    let eta = &p[FRICTION..];
    let e = problem.nuisance;
    let mut first = 0;
    problem.records.iter().map(move |record| {
        let v = &prepared.velocity[first..first + record.t.len()];
        let a = &prepared.acceleration[first..first + record.t.len()];
        first += record.t.len();
        let of =
            |x: &[f64], k: usize| -> f64 { x[k * e..].iter().zip(eta).map(|(x, y)| x * y).sum() };
        let net = |k: usize| {
            record.tau[k] - of(&record.m, k) * 0.5 * (a[k] + a[k + 1]) - of(&record.h, k)
        };
        (v, (0..record.tau.len()).map(net).collect())
    })
}

/// Plateaus of all records at the estimate `p`.
pub fn plateaus(prepared: &PreparedProblem, p: &[f64]) -> Vec<TorquePlateau> {
    let problem = &prepared.problem;
    let mut out = Vec::new();
    for (record, (v, torques)) in problem.records.iter().zip(net_torques(prepared, p)) {
        let n = record.tau.len();
        let net = |k: usize| torques[k];
        let mut k = 0;
        while k < n {
            let speed = v[k].abs();
            let near = |i: usize| (v[i] - v[k]).abs() <= DEPARTURE * speed;
            let mut end = k;
            while end < n && near(end) {
                end += 1;
            }
            let seconds = record.t[end.min(n)] - record.t[k];
            if speed > 0.02 * problem.velocity_scale && seconds >= MIN_PLATEAU_S {
                let count = (end - k) as f64;
                let mean = (k..end).map(net).sum::<f64>() / count;
                let parts = 10usize.min(end - k);
                let part = (end - k) / parts;
                let square = |i: usize| {
                    let from = k + i * part;
                    let m = (from..from + part).map(net).sum::<f64>() / part as f64;
                    (m - mean) * (m - mean)
                };
                let spread = (0..parts).map(square).sum::<f64>();
                out.push(TorquePlateau {
                    v: v[k..end].iter().sum::<f64>() / count,
                    torque: mean,
                    std: (spread / (parts * (parts - 1)).max(1) as f64).sqrt(),
                    seconds,
                });
                k = end;
            } else {
                k += ((end - k) / 4).max(1);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plateau(v: f64, torque: f64) -> TorquePlateau {
        TorquePlateau {
            v,
            torque,
            std: 0.01,
            seconds: 1.0,
        }
    }

    #[test]
    fn a_speed_whose_plateaus_the_curve_misses_is_named_and_no_other() {
        let curve = |v: f64| 2.0 * v.signum();
        // right; off by 5 %; off by 5 % but as unsure as that; off by 1 %
        let unsure = TorquePlateau {
            std: 0.06,
            ..plateau(-0.4, -2.1)
        };
        let all = [
            plateau(0.1, 2.0),
            plateau(0.4, 2.1),
            plateau(0.405, 2.11),
            unsure,
            plateau(1.0, 2.02),
        ];
        let found = missed(&all, &curve);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].v - 0.4025).abs() < 1e-9);
        assert!((found[0].torque - 2.105).abs() < 1e-9);
        assert!((found[0].curve - 2.0).abs() < 1e-9);
    }
}
