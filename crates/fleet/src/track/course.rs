//! One parameter of one robot over its logs.

use super::changes::{ChangeKind, ParameterChange, least_seen, seek};
use super::local_level::smooth;
use super::together::{CourseSignals, Signal};
use super::walk::{WalkSizes, median};

/// What one log says of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogEstimate {
    /// Time, by a clock that runs through all logs \[s\], or the log's number.
    pub time: f64,
    /// Estimate \[unit\].
    pub value: f64,
    /// Its variance; infinite where the log says nothing of the parameter.
    pub variance: f64,
}

/// A parameter over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ParameterCourse {
    /// Smoothed parameter at each log, and its standard deviation (infinite where no log determines it).
    pub values: Vec<f64>,
    pub std: Vec<f64>,
    /// In order of time.
    pub changes: Vec<ParameterChange>,
    /// Standard deviation of the walk over a usual time between two logs.
    pub walk: f64,
    /// Standard deviation by which estimates scatter beyond their variances.
    pub scatter: f64,
    /// Logs whose estimate stands alone, far from those before and after.
    pub outliers: Vec<usize>,
    /// The size from which on a step in the middle of the course is reported; none where there are too few logs.
    pub least_seen: Option<f64>,
}

/// A step in the variance by which the level is forgotten, over the square of a change.
const FORGETTING: f64 = 100.0;
/// Deviations from its neighbours at which an estimate stands alone.
const OUTLIER_DEVIATIONS: f64 = 5.0;
/// Neighbours on each side: a payload may stay for some logs.
const NEIGHBOURS: usize = 5;

/// The course of a parameter from estimates in order of time. `level` is the probability at which a change is reported
/// where there is none.
pub fn follow(estimates: &[LogEstimate], level: f64) -> ParameterCourse {
    let mut courses = follow_together(&[estimates], None, level);
    courses.pop().unwrap_or_default()
}

/// Courses of parameters that change together, as the friction of a joint does: a change is sought in all of them at
/// once, `level` is the probability that one is reported where there is none, and each course has its own size of it.
/// `parameters` are estimates of the same logs `[parameter][log]`, `correlation` is that of the errors of one log's
/// estimates, row by row, where their fits say it.
pub fn follow_together(
    parameters: &[&[LogEstimate]],
    correlation: Option<&[f64]>,
    level: f64,
) -> Vec<ParameterCourse> {
    let Some(first) = parameters.first() else {
        return Vec::new();
    };
    let times: Vec<f64> = first.iter().map(|e| e.time).collect();
    let spacings = spacings(&times);
    let signals: Vec<Signal> = parameters.iter().map(|own| Signal::of(own)).collect();
    let about = CourseSignals {
        members: &signals,
        spacings: &spacings,
        times: &times,
        correlation,
    };
    let (sizes, found) = seek(about, level);
    let least = least_seen(about, &sizes, level);
    let each = signals.iter().zip(&sizes).enumerate();
    each.map(|(i, (signal, sizes))| {
        let changes = found.iter().map(|change| ParameterChange {
            kind: change.kind,
            at: change.at,
            size: change.sizes[i][0],
            std: change.sizes[i][1],
            p_value: change.p_value,
        });
        ParameterCourse {
            least_seen: least[i],
            ..signal.course(sizes, &spacings, changes.collect())
        }
    })
    .collect()
}

impl Signal {
    fn of(estimates: &[LogEstimate]) -> Self {
        let known =
            |e: &LogEstimate| e.variance.is_finite() && e.variance > 0.0 && e.value.is_finite();
        let pair = |e: &LogEstimate| match known(e) {
            true => (e.value, e.variance),
            false => (0.0, f64::INFINITY),
        };
        let (values, mut variances): (Vec<f64>, Vec<f64>) = estimates.iter().map(pair).unzip();
        let outliers = alone(&values, &variances);
        for k in &outliers {
            variances[*k] = f64::INFINITY;
        }
        Signal {
            values,
            variances,
            outliers,
        }
    }

    /// Its course with these changes.
    fn course(
        &self,
        sizes: &WalkSizes,
        spacings: &[f64],
        changes: Vec<ParameterChange>,
    ) -> ParameterCourse {
        let mut all = sizes.variances(&self.variances, spacings);
        for change in &changes {
            match change.kind {
                ChangeKind::Step => all.walk[change.at] += FORGETTING * change.size * change.size,
                // the walk has to follow the slope
                ChangeKind::Ramp => {
                    let logs = (self.values.len() - change.at).max(1) as f64;
                    let slope = change.size / logs;
                    let walks = all.walk[change.at..].iter_mut();
                    walks.for_each(|q| *q += slope * slope);
                }
            }
        }
        let (values, variance) = smooth(&self.determined(&self.values), &all);
        ParameterCourse {
            values,
            std: variance.into_iter().map(f64::sqrt).collect(),
            changes,
            walk: sizes.walk.sqrt(),
            scatter: sizes.scatter.sqrt(),
            outliers: self.outliers.clone(),
            least_seen: None,
        }
    }
}

/// Times between two logs over the usual one; that before the first is 1.
fn spacings(times: &[f64]) -> Vec<f64> {
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let usual = median(steps().filter(|s| *s > 0.0)).unwrap_or(1.0);
    let spacings = steps().map(|s| (s / usual).clamp(0.0, 100.0));
    let all = std::iter::once(1.0).chain(spacings);
    all.take(times.len()).collect()
}

/// Estimates far from the median of those before them and of those after: so is a log in which the robot carried something.
fn alone(signal: &[f64], variances: &[f64]) -> Vec<usize> {
    let known: Vec<usize> = (0..signal.len())
        .filter(|k| variances[*k].is_finite())
        .collect();
    if known.len() < 2 * NEIGHBOURS + 1 {
        return Vec::new();
    }
    let middle = |places: std::ops::Range<usize>, but: usize| {
        let others = places.filter(|p| *p != but);
        median(others.map(|p| signal[known[p]])).unwrap_or_default()
    };
    // Beside a step those before and those after differ: what is like either does not stand alone.
    let off = |place: usize| {
        let (from, to) = (
            place.saturating_sub(NEIGHBOURS),
            (place + NEIGHBOURS + 1).min(known.len()),
        );
        let x = signal[known[place]];
        match place - from < 2 || to - place < 3 {
            true => x - middle(from..to, place),
            false => {
                let [before, after] =
                    [from..place, place + 1..to].map(|side| x - middle(side, place));
                if before.abs() < after.abs() {
                    before
                } else {
                    after
                }
            }
        }
    };
    let off: Vec<f64> = (0..known.len()).map(off).collect();
    let Some(scale) = median(off.iter().map(|x| x.abs())) else {
        return Vec::new();
    };
    let far = |place: usize| {
        let std = (1.4826 * scale).max(variances[known[place]].sqrt());
        off[place].abs() > OUTLIER_DEVIATIONS * std
    };
    let alone = (0..known.len()).filter(|place| far(*place));
    alone.map(|place| known[place]).collect()
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
    fn course(seed: u64, change: impl Fn(usize) -> f64) -> Vec<LogEstimate> {
        let mut draw = chance(seed);
        let estimate = |k: usize| LogEstimate {
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
    fn the_least_step_that_is_seen_is_reported_in_about_one_course_of_two() {
        let (mut known, mut sizes) = ([0; 3], Vec::new());
        for seed in 0..60 {
            let least = follow(&course(seed, |_| 0.0), 1e-3).least_seen.unwrap();
            sizes.push(least);
            for (known, times) in known.iter_mut().zip([0.5, 1.0, 1.6]) {
                let step = |k: usize| if k < 25 { 0.0 } else { times * least };
                *known += u32::from(!follow(&course(seed, step), 1e-3).changes.is_empty());
            }
        }
        // noise of 0.3 in 25 logs on each side: a mean difference has a deviation of 0.085, and one of 4.4 deviations
        // comes by chance at 1e-3 among 78 places and kinds
        sizes.sort_by(f64::total_cmp);
        assert!((0.3..0.5).contains(&sizes[30]), "{sizes:?}");
        let half = (18..=45).contains(&known[1]);
        assert!(known[0] <= 6 && half && known[2] >= 54, "{known:?}");
        let few = course(0, |_| 0.0);
        assert_eq!(follow(&few[..11], 1e-3).least_seen, None);
        assert!(follow(&few[..12], 1e-3).least_seen.is_some());
    }

    #[test]
    fn a_ramp_is_no_step() {
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

    /// Viscous and Coulomb friction, with errors of a correlation of 0.36, that grow by `size` from log 16 of 26 on.
    fn friction(seed: u64, size: f64) -> [Vec<LogEstimate>; 2] {
        let mut draw = chance(seed);
        let mut out = [Vec::new(), Vec::new()];
        for k in 0..26 {
            let common = draw();
            for own in &mut out {
                let error = 0.3 * (0.6 * common + 0.8 * draw());
                own.push(LogEstimate {
                    time: k as f64 * 3600.0,
                    value: 10.0 + if k < 16 { 0.0 } else { size } + error,
                    variance: 0.09,
                });
            }
        }
        out
    }

    #[test]
    fn parameters_that_change_together_are_found_where_each_alone_is_not() {
        const CORRELATION: [f64; 4] = [1.0, 0.36, 0.36, 1.0];
        let (mut together, mut alone, mut alarms) = (0, 0, 0);
        for seed in 0..30 {
            let both = |size: f64| {
                let own = friction(seed, size);
                let found = follow_together(&[&own[0], &own[1]], Some(&CORRELATION), 1e-5);
                (own, found)
            };
            let (own, found) = both(0.8);
            // two courses, and the same chance of a false alarm
            let shows = |own: &Vec<LogEstimate>| !follow(own, 0.5e-5).changes.is_empty();
            alone += u32::from(own.iter().any(shows));
            if let [change] = found[0].changes.as_slice() {
                together += 1;
                let other = found[1].changes[0];
                assert_eq!((change.at, change.kind), (other.at, other.kind));
                for c in [change, &other] {
                    assert!((c.size - 0.8).abs() < 5.0 * c.std, "{c:?}");
                }
            }
            alarms += both(0.0).1[0].changes.len();
        }
        assert!(together > 2 * alone, "{together} {alone}");
        assert_eq!(alarms, 0);
    }

    #[test]
    fn a_payload_that_comes_again_for_some_logs_is_no_change_and_a_first_one_that_stays_is() {
        for seed in 0..20 {
            let again = |k: usize| match k {
                7 | 26 => 4.0,
                31.. if k != 34 => 4.0,
                _ => 0.0,
            };
            let found = follow(&course(seed, again)[..38], 1e-4);
            assert!(found.changes.is_empty(), "{seed}: {:?}", found.changes);
            let stays = course(seed, |k| if k < 31 { 0.0 } else { 4.0 });
            assert_eq!(follow(&stays[..38], 1e-4).changes.len(), 1, "{seed}");
        }
    }

    #[test]
    fn bands_cover_and_logs_that_say_nothing_are_bridged() {
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
