//! One parameter of one robot over its logs.

use super::changes::{About, Change, ChangeKind, seek};
use super::local_level::{Variances, smooth};
use super::walk::median;

/// What one log tells of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Time, by a clock that runs through all logs \[s\], or the log's number.
    pub time: f64,
    /// Estimate \[unit\].
    pub value: f64,
    /// Its variance; infinite where the log tells nothing of the parameter.
    pub variance: f64,
}

/// A parameter over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Course {
    /// Smoothed parameter at each log, and its standard deviation (infinite where no log determines it).
    pub values: Vec<f64>,
    pub std: Vec<f64>,
    /// In order of time.
    pub changes: Vec<Change>,
    /// Standard deviation of the walk over a usual time between two logs.
    pub walk: f64,
    /// Standard deviation by which estimates scatter beyond their variances.
    pub scatter: f64,
    /// Logs whose estimate stands alone, far from those before and after.
    pub outliers: Vec<usize>,
}

/// A step in the variance by which the level is forgotten, over the square of a change.
const FORGET: f64 = 100.0;
/// Deviations from its neighbours at which an estimate stands alone.
const ALONE: f64 = 5.0;
/// Neighbours on each side: a payload may stay for some logs.
const NEIGHBOURS: usize = 5;

/// The course of a parameter from estimates in order of time. `level` is the probability at which a change is told
/// where there is none.
pub fn follow(estimates: &[Estimate], level: f64) -> Course {
    let signal: Vec<f64> = estimates.iter().map(|e| e.value).collect();
    let told = |e: &Estimate| e.variance.is_finite() && e.variance > 0.0 && e.value.is_finite();
    let mut variances: Vec<f64> = (estimates.iter())
        .map(|e| if told(e) { e.variance } else { f64::INFINITY })
        .collect();
    let signal: Vec<f64> = (signal.iter().zip(&variances))
        .map(|(y, r)| if r.is_finite() { *y } else { 0.0 })
        .collect();
    let times: Vec<f64> = estimates.iter().map(|e| e.time).collect();
    let spacings = spacings(&times);
    let outliers = alone(&signal, &variances);
    for k in &outliers {
        variances[*k] = f64::INFINITY;
    }
    let about = About {
        estimate: &variances,
        spacings: &spacings,
        times: &times,
        alone: &outliers,
    };
    let (sizes, changes) = seek(&signal, about, level);
    let mut all: Variances = sizes.variances(&variances, &spacings);
    let mut rest = signal.clone();
    for change in &changes {
        match change.kind {
            ChangeKind::Step => all.walk[change.at] += FORGET * change.size * change.size,
            // the walk has to follow the slope
            ChangeKind::Ramp => {
                let logs = (signal.len() - change.at).max(1) as f64;
                let slope = change.size / logs;
                all.walk[change.at..]
                    .iter_mut()
                    .for_each(|q| *q += slope * slope);
            }
        }
    }
    for (y, r) in rest.iter_mut().zip(&all.estimate) {
        if !r.is_finite() {
            *y = 0.0;
        }
    }
    let (values, variance) = smooth(&rest, &all);
    Course {
        values,
        std: variance.into_iter().map(f64::sqrt).collect(),
        changes,
        walk: sizes.walk.sqrt(),
        scatter: sizes.scatter.sqrt(),
        outliers,
    }
}

/// Times between two logs over the usual one; that before the first is 1.
fn spacings(times: &[f64]) -> Vec<f64> {
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let usual = median(steps().filter(|s| *s > 0.0)).unwrap_or(1.0);
    let spacing = |s: f64| (s / usual).clamp(0.0, 100.0);
    std::iter::once(1.0)
        .chain(steps().map(spacing))
        .take(times.len())
        .collect()
}

/// Estimates that stand alone: far from the median of those before them and of those after them. So is a log in which the robot carried
/// something; a change is one when as many logs show it as do not.
fn alone(signal: &[f64], variances: &[f64]) -> Vec<usize> {
    let told: Vec<usize> = (0..signal.len())
        .filter(|k| variances[*k].is_finite())
        .collect();
    if told.len() < 2 * NEIGHBOURS + 1 {
        return Vec::new();
    }
    let middle = |places: std::ops::Range<usize>, but: usize| {
        let others = places.filter(|p| *p != but);
        median(others.map(|p| signal[told[p]])).unwrap_or_default()
    };
    // Beside a step those before and those after differ: what is like either does not stand alone.
    let off = |place: usize| {
        let (from, to) = (
            place.saturating_sub(NEIGHBOURS),
            (place + NEIGHBOURS + 1).min(told.len()),
        );
        let x = signal[told[place]];
        match place - from < 2 || to - place < 3 {
            true => x - middle(from..to, place),
            false => {
                let sides = [from..place, place + 1..to].map(|side| x - middle(side, place));
                let [before, after] = sides;
                if before.abs() < after.abs() {
                    before
                } else {
                    after
                }
            }
        }
    };
    let off: Vec<f64> = (0..told.len()).map(off).collect();
    let Some(scale) = median(off.iter().map(|x| x.abs())) else {
        return Vec::new();
    };
    let far = |place: usize| {
        let std = (1.4826 * scale).max(variances[told[place]].sqrt());
        off[place].abs() > ALONE * std
    };
    (0..told.len())
        .filter(|p| far(*p))
        .map(|p| told[p])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn chance(seed: u64) -> impl FnMut() -> f64 {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        move || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0
    }

    /// A parameter of 10 with noise of 0.3 in each of 50 logs, and a change.
    fn course(seed: u64, change: impl Fn(usize) -> f64) -> Vec<Estimate> {
        let mut draw = chance(seed);
        let estimate = |k: usize| Estimate {
            time: k as f64 * 3600.0,
            value: 10.0 + change(k) + 0.3 * draw(),
            variance: 0.09,
        };
        (0..50).map(estimate).collect()
    }

    #[test]
    fn a_step_is_found_with_its_time_and_size() {
        for seed in 0..20 {
            let found = follow(&course(seed, |k| if k < 30 { 0.0 } else { 2.0 }), 1e-4);
            assert_eq!(found.changes.len(), 1, "{seed}: {:?}", found.changes);
            let change = found.changes[0];
            assert_eq!(change.kind, ChangeKind::Step);
            assert!(change.at.abs_diff(30) <= 1, "{change:?}");
            assert!((change.size - 2.0).abs() < 4.0 * change.std, "{change:?}");
            assert!((found.values[10] - 10.0).abs() < 0.5 && (found.values[45] - 12.0).abs() < 0.5);
        }
    }

    #[test]
    fn a_ramp_is_told_from_a_step() {
        let mut found = 0;
        for seed in 0..20 {
            let ramp = |k: usize| if k < 20 { 0.0 } else { 0.2 * (k as f64 - 19.0) };
            let course = follow(&course(seed, ramp), 1e-4);
            let last = course.changes.last();
            let right = last.filter(|c| c.kind == ChangeKind::Ramp && c.at.abs_diff(20) <= 6);
            found += u32::from(right.is_some_and(|c| (c.size - 6.0).abs() < 2.0));
        }
        assert!(found >= 17, "{found}");
    }

    #[test]
    fn nothing_is_found_in_noise_and_beside_a_payload() {
        let mut alarms = [0; 2];
        for seed in 0..200 {
            let noise = follow(&course(seed, |_| 0.0), 1e-3);
            let loaded = follow(&course(seed, |k| if k == 25 { 8.0 } else { 0.0 }), 1e-3);
            assert_eq!(loaded.outliers, [25], "{seed}");
            for (k, course) in [noise, loaded].iter().enumerate() {
                alarms[k] += course.changes.len();
            }
        }
        // of 200 courses at 1e-3 more than 3 come in one test of 17 000
        assert!(alarms.iter().all(|n| *n <= 3), "{alarms:?}");
    }

    #[test]
    fn bands_cover_and_logs_that_tell_nothing_are_bridged() {
        let (mut inside, mut all) = (0, 0);
        for seed in 0..40 {
            let mut estimates = course(seed, |_| 0.0);
            estimates[20].variance = f64::INFINITY;
            estimates[21].value = f64::NAN;
            let found = follow(&estimates, 1e-4);
            for k in [0, 20, 21, 30, 49] {
                all += 1;
                inside += u32::from((found.values[k] - 10.0).abs() < 1.96 * found.std[k]);
            }
        }
        assert!(inside >= 180 && all == 200, "{inside} of {all}");
    }
}
