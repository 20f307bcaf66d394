//! From errors of data set aside to the widths of a band.

use super::NORMAL_95;
use cft_ident_files::config::held_out::HeldOut;

/// Quantiles of the speeds, and of the torques, between whose values a band has a width of its own.
const SPEEDS: [f64; 4] = [0.1, 0.3, 0.55, 0.8];
const TORQUES: [f64; 2] = [0.5, 0.85];
/// Independent samples that a width of its own takes.
const MIN_SAMPLES: f64 = 20.0;

/// A sample that a model did not see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Error {
    pub position: f64,
    pub speed: f64,
    pub acceleration: f64,
    /// The model's torque.
    pub torque: f64,
    /// Measured less the model's torque.
    pub error: f64,
    /// Variance of the model's torque by its parameters.
    pub variance: f64,
}

/// The value that the share `p` of the numbers, which are sorted here, lies at or below; 0 of none.
pub fn quantile(x: &mut [f64], p: f64) -> f64 {
    if x.is_empty() {
        return 0.0;
    }
    let rank = (p * x.len() as f64).ceil() as usize;
    let at = rank.clamp(1, x.len()) - 1;
    *x.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Values of the modulus of `x` at these quantiles, each once and above 0.
pub fn edges(x: impl Iterator<Item = f64>, at: &[f64]) -> Vec<f64> {
    let mut x: Vec<f64> = x.map(f64::abs).collect();
    let mut out: Vec<f64> = at.iter().map(|p| quantile(&mut x, *p)).collect();
    out.retain(|x| *x > 0.0);
    out.dedup_by(|b, a| *b <= *a * (1.0 + 1e-9));
    out
}

/// Quantile of so many independent numbers that holds 95 % of the next ones on average: (n + 1) 0.95 of n.
fn level(effective: f64) -> f64 {
    (0.95 * (effective + 1.0) / effective.max(1.0)).min(1.0)
}

/// The band's widths and what was seen, alarms left open; `independent` is the share of samples that are.
pub fn held_out(joint: &str, errors: &[Error], independent: f64) -> HeldOut {
    let speed_edges = edges(errors.iter().map(|e| e.speed), &SPEEDS);
    let torque_edges = edges(errors.iter().map(|e| e.torque), &TORQUES);
    let excess = |e: &Error| {
        let of_parameters = NORMAL_95 * NORMAL_95 * e.variance;
        (e.error * e.error - of_parameters).max(0.0).sqrt()
    };
    let range = |edges: &[f64], x: f64| edges.iter().take_while(|edge| x.abs() > **edge).count();
    let width = |of: &dyn Fn(&Error) -> bool| {
        let mut sizes: Vec<f64> = errors.iter().filter(|e| of(e)).map(excess).collect();
        let effective = sizes.len() as f64 * independent;
        (quantile(&mut sizes, level(effective)), effective)
    };
    let all = width(&|_| true).0;
    let mut half_width_95 = Vec::new();
    for i in 0..=speed_edges.len() {
        let here = |e: &Error| range(&speed_edges, e.speed) == i;
        let (mut of_speed, effective) = width(&here);
        if effective < MIN_SAMPLES {
            of_speed = all;
        }
        let of_torque = (0..=torque_edges.len()).map(|k| {
            let (own, effective) = width(&|e| here(e) && range(&torque_edges, e.torque) == k);
            if effective < MIN_SAMPLES {
                of_speed
            } else {
                own
            }
        });
        half_width_95.push(of_torque.collect());
    }
    let greatest = |of: fn(&Error) -> f64| errors.iter().map(|e| of(e).abs()).fold(0.0, f64::max);
    let positions = errors.iter().map(|e| e.position);
    HeldOut {
        joint: joint.to_owned(),
        samples: errors.len() as u64,
        effective_samples: errors.len() as f64 * independent,
        position_cutoff_hz: f64::NAN,
        half_width_95,
        positions_seen: [
            positions.clone().fold(f64::INFINITY, f64::min),
            positions.fold(f64::NEG_INFINITY, f64::max),
        ],
        speed_seen: greatest(|e| e.speed),
        acceleration_seen: greatest(|e| e.acceleration),
        torque_seen: greatest(|e| e.torque + e.error),
        external_std: vec![f64::NAN; speed_edges.len() + 1],
        external_99: f64::NAN,
        speed_edges,
        torque_edges,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_hold_95_percent_in_each_range_of_speed() {
        // errors that grow with speed, by a fixed pattern
        let error = |k: usize| {
            let speed = 0.001 * (k % 1000) as f64;
            let u = ((k * 7919) % 10_007) as f64 / 10_007.0;
            Error {
                position: 0.1,
                speed,
                acceleration: 0.0,
                torque: 3.0,
                error: (0.2 + speed) * (2.0 * u - 1.0),
                variance: 0.0,
            }
        };
        let all: Vec<Error> = (0..40_000).map(error).collect();
        let held = held_out("q1", &all, 0.1);
        assert_eq!(held.speed_edges.len(), 4);
        for row in &held.half_width_95 {
            let inside = |e: &&Error| held.half_width(e.speed, e.torque) == row[0];
            let of_range: Vec<&Error> = all.iter().filter(inside).collect();
            let held = of_range.iter().filter(|e| e.error.abs() <= row[0]).count();
            let share = held as f64 / of_range.len() as f64;
            assert!((0.945..0.96).contains(&share), "{share}");
        }
        let widths: Vec<f64> = held.half_width_95.iter().map(|row| row[0]).collect();
        assert!(widths.windows(2).all(|w| w[0] < w[1]), "{widths:?}");
    }
}
