//! How far the torque at each speed departs from the law: the part that innovations of a filter, which follow a slow
//! error, leave unseen.

use std::collections::BTreeMap;

use super::plateau::net_torques;
use super::prepare::PreparedProblem;

/// How speeds are parted, as for least squares.
struct Limits {
    /// Lowest speed over the joint's rms speed; the filter knows slower motion no better than its law's slopes.
    lowest: f64,
    /// Classes in each octave of speed and direction.
    per_octave: f64,
    /// Least passes through a class of which a mean is distinguished from chance.
    passes: usize,
}

const LIMITS: Limits = Limits {
    lowest: 0.125,
    per_octave: 2.0,
    passes: 3,
};

/// A class of direction and speed: means of the passes through it, and rows.
#[derive(Default)]
struct PassClass {
    means: Vec<f64>,
    rows: usize,
}

/// Mean square of the mean departure from `law` in classes of speed, beyond what their passes differ by [N^2 or (Nm)^2].
pub(super) fn departure(prepared: &PreparedProblem, p: &[f64], law: &dyn Fn(f64) -> f64) -> f64 {
    let mut classes: BTreeMap<i64, PassClass> = BTreeMap::new();
    let class_of = |v: f64| {
        let octaves = (v.abs() / (LIMITS.lowest * prepared.problem.velocity_scale)).log2();
        let class = 1 + (LIMITS.per_octave * octaves) as i64;
        (octaves >= 0.0).then_some(if v < 0.0 { -class } else { class })
    };
    for (v, net) in net_torques(prepared, p) {
        let rows = v.iter().zip(&net);
        let rows = rows.map(|(v, net)| (class_of(*v), net - law(*v)));
        let rows: Vec<(Option<i64>, f64)> = rows.collect();
        for pass in rows.chunk_by(|a, b| a.0 == b.0) {
            if let Some(key) = pass[0].0 {
                let class = classes.entry(key).or_default();
                let sum: f64 = pass.iter().map(|(_, off)| off).sum();
                class.means.push(sum / pass.len() as f64);
                class.rows += pass.len();
            }
        }
    }
    let (mut rows, mut sum) = (0.0, 0.0);
    for class in classes.values().filter(|c| c.means.len() >= LIMITS.passes) {
        let n = class.means.len() as f64;
        let mean = class.means.iter().sum::<f64>() / n;
        let spread = class.means.iter().map(|m| (m - mean).powi(2)).sum::<f64>();
        rows += class.rows as f64;
        sum += class.rows as f64 * (mean * mean - spread / (n * (n - 1.0)));
    }
    if rows > 0.0 {
        (sum / rows).max(0.0)
    } else {
        0.0
    }
}
