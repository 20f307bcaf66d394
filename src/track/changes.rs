//! Steps and ramps in a course, one after the other, by generalised least squares.

use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::local_level::Whitener;
use super::walk::{Likeliest, Sizes, sizes, still};

/// How a parameter changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChangeKind {
    /// From one log to the next.
    Step,
    /// Log by log, from the time of the change to the last log.
    Ramp,
}

/// A change of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    pub kind: ChangeKind,
    /// Index of the first log that it shows in.
    pub at: usize,
    /// By how much the parameter changed, a ramp up to the last log \[unit\].
    pub size: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Probability of one as clear somewhere in the course without a change.
    pub p_value: f64,
}

/// Most changes of one course.
const MOST: usize = 3;
/// Least number of logs before a change.
const BEFORE: usize = 6;
/// Least number of logs from a change on: one log in ten may carry a payload, and some of these follow each other.
const AFTER: usize = 6;
/// Largest share of the logs from a change on that stand alone: where more do, the robot carries something now and then.
const ALONE: f64 = 0.2;
/// Most times that walk and scatter are sized anew with a change taken out.
const REFINED: usize = 3;
/// What is estimated besides the changes: level, walk and scatter.
const OTHERS: usize = 3;

/// What a change of `kind` at log `at` adds, over its size.
fn shape(kind: ChangeKind, at: usize, times: &[f64]) -> Vec<f64> {
    let last = times.last().copied().unwrap_or_default();
    let from = at.checked_sub(1).map_or(f64::NEG_INFINITY, |k| times[k]);
    let of = |(k, t): (usize, &f64)| match kind {
        _ if k < at => 0.0,
        ChangeKind::Step => 1.0,
        ChangeKind::Ramp => (t - from) / (last - from),
    };
    times.iter().enumerate().map(of).collect()
}

/// What is known of the estimates of a course besides their values.
#[derive(Debug, Clone, Copy)]
pub(super) struct About<'a> {
    /// Variances; infinite where a log tells nothing, or stands alone.
    pub estimate: &'a [f64],
    /// Spacings over the usual one.
    pub spacings: &'a [f64],
    pub times: &'a [f64],
    /// Logs that stand alone.
    pub alone: &'a [usize],
}

impl About<'_> {
    /// Whether so many logs before or from `at` on stand alone that the robot carries something now and then: that
    /// some of these follow each other is no change.
    fn varies_beside(&self, at: usize) -> bool {
        let before = self.alone.iter().filter(|k| **k < at).count();
        let since = self.alone.len() - before;
        let often = |alone: usize, logs: usize| alone as f64 > ALONE * logs as f64;
        often(before, at) || often(since, self.times.len() - at)
    }
}

/// A change that is the clearest of those tried.
struct Clearest {
    change: Change,
    /// Its size over its deviation.
    clear: f64,
    tried: u32,
}

/// Seeks changes whose probability without one is below `level`, Bonferroni's correction for the places and kinds that
/// are tried included; with them the sizes of walk and scatter. Those are estimated with the clearest change taken
/// out, for a change that is left in makes a walk. The deviation is scaled by the residual where that is larger than
/// the variances say.
pub(super) fn seek(signal: &[f64], about: About, level: f64) -> (Sizes, Vec<Change>) {
    let About {
        estimate,
        spacings,
        times,
        ..
    } = about;
    let n = estimate.iter().filter(|r| r.is_finite()).count();
    let mut found: Vec<Change> = Vec::new();
    let mut sizes = self::sizes(signal, estimate, spacings).sizes;
    while found.len() < MOST && n > OTHERS + found.len() + 2 {
        let freedom = (n - OTHERS - found.len() - 1) as f64;
        let Ok(law) = StudentsT::new(0.0, 1.0, freedom) else {
            break;
        };
        // a walk that is large enough hides a change, and a change that is left in makes a walk: both starts are tried
        let known = rest_of(signal, times, &found);
        let starts = [sizes, still(&known, estimate, spacings).sizes];
        let tried = starts.map(|start| settled(signal, about, start, &found));
        let tried = tried.into_iter().flatten();
        let best = tried.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let Some((mut next, Likeliest { sizes: anew, .. })) = best else {
            break;
        };
        next.change.p_value = (f64::from(next.tried) * 2.0 * law.sf(next.clear)).min(1.0);
        if next.change.p_value > level {
            break;
        }
        sizes = anew;
        found.push(next.change);
        let whitener = Whitener::new(&sizes.variances(estimate, spacings));
        together(&whitener.apply(signal), &whitener, (times, n), &mut found);
    }
    found.sort_by_key(|c| c.at);
    (sizes, found)
}

/// The clearest change and the sizes with it taken out, each found anew by the other from `sizes` on.
fn settled(
    signal: &[f64],
    about: About,
    sizes: Sizes,
    found: &[Change],
) -> Option<(Clearest, Likeliest)> {
    let About {
        estimate,
        spacings,
        times,
        ..
    } = about;
    let mut next = clearest(signal, about, &sizes, found)?;
    let mut rounds = 0;
    loop {
        let all = [found, &[next.change]].concat();
        let anew = self::sizes(&rest_of(signal, times, &all), estimate, spacings);
        let again = clearest(signal, about, &anew.sizes, found)?;
        let same = (again.change.kind, again.change.at) == (next.change.kind, next.change.at);
        next = again;
        rounds += 1;
        if same || rounds == REFINED {
            return Some((next, anew));
        }
    }
}

/// The signal without changes.
fn rest_of(signal: &[f64], times: &[f64], changes: &[Change]) -> Vec<f64> {
    let mut rest = signal.to_vec();
    for change in changes {
        let shape = shape(change.kind, change.at, times);
        let pairs = rest.iter_mut().zip(shape);
        pairs.for_each(|(x, shape)| *x -= change.size * shape);
    }
    rest
}

/// The clearest change besides those that are known.
fn clearest(signal: &[f64], about: About, sizes: &Sizes, found: &[Change]) -> Option<Clearest> {
    let About {
        estimate,
        spacings,
        times,
        ..
    } = about;
    let told: Vec<usize> = (0..signal.len())
        .filter(|k| estimate[*k].is_finite())
        .collect();
    let n = told.len();
    let whitener = Whitener::new(&sizes.variances(estimate, spacings));
    let columns: Vec<Vec<f64>> = (found.iter())
        .map(|c| whitener.apply(&shape(c.kind, c.at, times)))
        .collect();
    let known = orthonormal(columns.iter());
    let freedom = n.saturating_sub(OTHERS + found.len() + 1).max(1) as f64;
    let residual = without(&whitener.apply(signal), &known);
    let square = residual.iter().map(|x| x * x).sum::<f64>();
    let mut best: Option<Clearest> = None;
    let mut tried = 0_u32;
    for kind in [ChangeKind::Step, ChangeKind::Ramp] {
        let places = BEFORE..(n + 1).saturating_sub(AFTER).max(BEFORE);
        for at in told.get(places).into_iter().flatten().copied() {
            tried += 1;
            if about.varies_beside(at) {
                continue;
            }
            let column = without(&whitener.apply(&shape(kind, at, times)), &known);
            let norm = column.iter().map(|x| x * x).sum::<f64>();
            if norm <= 1e-12 {
                continue;
            }
            let product: f64 = column.iter().zip(&residual).map(|(x, y)| x * y).sum();
            let left = (square - product * product / norm).max(0.0);
            let std = ((left / freedom).max(1.0) / norm).sqrt();
            let size = product / norm;
            let clear = (size / std).abs();
            if best.as_ref().is_none_or(|b| clear > b.clear) {
                let change = Change {
                    kind,
                    at,
                    size,
                    std,
                    p_value: 1.0,
                };
                best = Some(Clearest {
                    change,
                    clear,
                    tried,
                });
            }
        }
    }
    best.map(|best| Clearest { tried, ..best })
}

/// A signal without its parts along orthonormal ones.
fn without(signal: &[f64], known: &[Vec<f64>]) -> Vec<f64> {
    let mut rest = signal.to_vec();
    for unit in known {
        let part: f64 = rest.iter().zip(unit).map(|(x, u)| x * u).sum();
        rest.iter_mut().zip(unit).for_each(|(x, u)| *x -= part * u);
    }
    rest
}

/// Sizes of all changes fitted together, and their deviations; `n` estimates tell something.
fn together(white: &[f64], whitener: &Whitener, (times, n): (&[f64], usize), found: &mut [Change]) {
    let columns: Vec<Vec<f64>> = (found.iter())
        .map(|c| whitener.apply(&shape(c.kind, c.at, times)))
        .collect();
    let freedom = n.saturating_sub(OTHERS + found.len()).max(1) as f64;
    let all = orthonormal(columns.iter());
    let left = without(white, &all).iter().map(|x| x * x).sum::<f64>();
    let scale = (left / freedom).max(1.0);
    for (i, change) in found.iter_mut().enumerate() {
        let others = columns.iter().enumerate().filter(|(j, _)| *j != i);
        let others = orthonormal(others.map(|(_, column)| column));
        let own = without(&columns[i], &others);
        let norm = own.iter().map(|x| x * x).sum::<f64>();
        if norm > 1e-12 {
            change.size = own.iter().zip(white).map(|(x, y)| x * y).sum::<f64>() / norm;
            change.std = (scale / norm).sqrt();
        }
    }
}

/// Orthonormal signals that span the same.
fn orthonormal<'a>(columns: impl Iterator<Item = &'a Vec<f64>>) -> Vec<Vec<f64>> {
    let mut units: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let rest = without(column, &units);
        let norm = rest.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm > 1e-9 {
            units.push(rest.iter().map(|x| x / norm).collect());
        }
    }
    units
}
