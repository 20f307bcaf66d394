//! Steps and ramps, one after the other, by generalised least squares: of one parameter, or of some that change
//! together, as the friction of a joint does.

use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::local_level::smooth;
use super::together::{About, White, orthonormal, without};
use super::walk::{Likeliest, Sizes, median, sizes, still};

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
pub struct ParameterChange {
    pub kind: ChangeKind,
    /// Index of the first log that it shows in.
    pub at: usize,
    /// By how much the parameter changed, a ramp up to the last log \[unit\].
    pub size: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Probability of one as clear somewhere in the course without a change, of all parameters that are followed
    /// together.
    pub p_value: f64,
}

/// A change of parameters that are followed together.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub kind: ChangeKind,
    pub at: usize,
    /// Of each parameter, and its standard deviation.
    pub sizes: Vec<[f64; 2]>,
    pub p_value: f64,
}

/// Most changes of one course.
const MAX_CHANGES: usize = 3;
/// Least number of logs before a change.
const BEFORE: usize = 6;
/// Least number of logs from a change on: one log in ten may carry a payload, and some of these follow each other.
const AFTER: usize = 6;
/// Largest share of the logs on one side of a change that are not of that side: where more are, the robot carries
/// something now and then.
const OUTLYING_SHARE: f64 = 0.2;
/// Deviations from the level of its side, from which on a log that is nearer to the other is not of its side.
const OUTLYING_DEVIATIONS: f64 = 3.0;
/// Most times that walk and scatter are sized anew with a change taken out.
const REFINED: usize = 3;
/// What is estimated of each parameter besides the changes: level, walk and scatter.
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

impl Found {
    fn shape(&self, times: &[f64]) -> Vec<f64> {
        shape(self.kind, self.at, times)
    }
}

/// A change that is the clearest of those tried.
struct Clearest {
    change: Found,
    /// What it removes per parameter over what is left per degree of freedom.
    ratio: f64,
    tried: u32,
}

/// Seeks changes whose probability without one is below `level`, Bonferroni's correction for the places and kinds that
/// are tried included; with them the sizes of walk and scatter of each parameter. Those are estimated with the clearest
/// change taken out, for a change that is left in makes a walk. The deviation is scaled by the residual where that is
/// larger than the variances say. Of several parameters the likelihood ratio is tested, with the correlation of their
/// innovations (Basseville and Nikiforov 1993, section 7.2).
pub(super) fn seek(about: About, level: f64) -> (Vec<Sizes>, Vec<Found>) {
    let (count, shown) = (about.members.len(), about.determined());
    let mut found: Vec<Found> = Vec::new();
    let mut sizes = likeliest(about, &[], sizes).0;
    while found.len() < MAX_CHANGES && shown > count * (OTHERS + found.len() + 2) {
        let freedom = (shown - count * (OTHERS + found.len() + 1)) as f64;
        let Ok(law) = FisherSnedecor::new(count as f64, freedom) else {
            break;
        };
        // a walk that is large enough hides a change, and a change that is left in makes a walk: both starts are tried
        let starts = [sizes.clone(), likeliest(about, &found, still).0];
        let tried = starts.map(|start| settled(about, start, &found));
        let tried = tried.into_iter().flatten();
        let best = tried.min_by(|a, b| a.2.total_cmp(&b.2));
        let Some((mut next, anew, _)) = best else {
            break;
        };
        next.change.p_value = (f64::from(next.tried) * law.sf(next.ratio)).min(1.0);
        if next.change.p_value > level {
            break;
        }
        sizes = anew;
        found.push(next.change);
        fit(about, &sizes, &mut found);
    }
    found.sort_by_key(|c| c.at);
    (sizes, found)
}

/// The size from which on a step of each parameter alone, in the middle of the course, is reported at `level`; none where
/// there are too few logs to report any. That size itself is reported in one course of two.
pub(super) fn least_seen(about: About, sizes: &[Sizes], level: f64) -> Vec<Option<f64>> {
    let count = about.members.len();
    let shown: Vec<usize> = (0..about.times.len())
        .filter(|k| about.members.iter().any(|m| m.estimate[*k].is_finite()))
        .collect();
    let freedom = about.determined().saturating_sub(count * (OTHERS + 1));
    let law = FisherSnedecor::new(count as f64, freedom.max(1) as f64);
    let (true, Ok(law)) = (shown.len() >= BEFORE + AFTER && freedom > 0, law) else {
        return vec![None; count];
    };
    let tried = 2 * (shown.len() - BEFORE - AFTER + 1);
    let ratio = law.inverse_cdf(1.0 - level / tried as f64);
    let white = White::new(about, sizes, &rests(about, &[]));
    let columns = white.columns(&shape(
        ChangeKind::Step,
        shown[shown.len() / 2],
        about.times,
    ));
    let steps = fitted(&columns, &white.signals(), 1.0);
    let least = |[_, std]: &[f64; 2]| (ratio * count as f64).sqrt() * std;
    let finite = |size: f64| size.is_finite().then_some(size);
    steps.iter().map(|step| finite(least(step))).collect()
}

/// Sizes of walk and scatter of each parameter with changes taken out, and how unlikely the innovations are.
fn likeliest(
    about: About,
    found: &[Found],
    by: fn(&[f64], &[f64], &[f64]) -> Likeliest,
) -> (Vec<Sizes>, f64) {
    let rests = rests(about, found);
    let members = about.members.iter().zip(&rests);
    let all: Vec<Likeliest> = members
        .map(|(member, rest)| by(rest, member.estimate, about.spacings))
        .collect();
    let cost = all.iter().map(|one| one.cost).sum();
    (all.iter().map(|one| one.sizes).collect(), cost)
}

/// The clearest change and the sizes with it taken out, each found anew by the other from `sizes` on; and how unlikely
/// the innovations are then.
fn settled(
    about: About,
    sizes: Vec<Sizes>,
    found: &[Found],
) -> Option<(Clearest, Vec<Sizes>, f64)> {
    let mut next = clearest(about, &sizes, found)?;
    let mut rounds = 0;
    loop {
        let all = [found, std::slice::from_ref(&next.change)].concat();
        let (anew, cost) = likeliest(about, &all, self::sizes);
        let again = clearest(about, &anew, found)?;
        let same = (again.change.kind, again.change.at) == (next.change.kind, next.change.at);
        next = again;
        rounds += 1;
        if same || rounds == REFINED {
            return Some((next, anew, cost));
        }
    }
}

/// The signals without changes.
fn rests(about: About, changes: &[Found]) -> Vec<Vec<f64>> {
    let mut rests: Vec<Vec<f64>> = (about.members.iter())
        .map(|member| member.signal.to_vec())
        .collect();
    for change in changes {
        let shape = change.shape(about.times);
        for (rest, [size, _]) in rests.iter_mut().zip(&change.sizes) {
            let pairs = rest.iter_mut().zip(&shape);
            pairs.for_each(|(x, shape)| *x -= size * shape);
        }
    }
    rests
}

/// The clearest change besides those that are known.
fn clearest(about: About, sizes: &[Sizes], found: &[Found]) -> Option<Clearest> {
    let count = about.members.len();
    let white = White::new(about, sizes, &rests(about, found));
    let columns: Vec<Vec<f64>> = (found.iter())
        .flat_map(|c| white.columns(&c.shape(about.times)))
        .collect();
    let known = orthonormal(columns.iter());
    let freedom = about
        .determined()
        .saturating_sub(count * (OTHERS + found.len() + 1));
    let freedom = freedom.max(1) as f64;
    let residual = without(&white.signals(), &known);
    let square = dot(&residual, &residual);
    let shown: Vec<usize> = (0..about.times.len())
        .filter(|k| about.members.iter().any(|m| m.estimate[*k].is_finite()))
        .collect();
    let mut best: Option<Clearest> = None;
    let mut tried = 0_u32;
    for kind in [ChangeKind::Step, ChangeKind::Ramp] {
        let places = BEFORE..(shown.len() + 1).saturating_sub(AFTER).max(BEFORE);
        for at in shown.get(places).into_iter().flatten().copied() {
            tried += 1;
            let shape = shape(kind, at, about.times);
            let own = white.columns(&shape);
            let own: Vec<Vec<f64>> = own.iter().map(|column| without(column, &known)).collect();
            let units = orthonormal(own.iter());
            let gain = units.iter().map(|u| dot(u, &residual).powi(2)).sum::<f64>();
            let scale = ((square - gain).max(0.0) / freedom).max(1.0);
            let ratio = gain / (count as f64 * scale);
            if units.is_empty() || best.as_ref().is_some_and(|b| ratio <= b.ratio) {
                continue;
            }
            let change = Found {
                kind,
                at,
                sizes: fitted(&own, &residual, scale),
                p_value: 1.0,
            };
            if !carries(about, sizes, found, &change) {
                best = Some(Clearest {
                    change,
                    ratio,
                    tried,
                });
            }
        }
    }
    best.map(|best| Clearest { tried, ..best })
}

/// Whether so many logs on one side of a change are not of that side, stand alone, or are as those that stood alone
/// before it, that the robot carries something now and then: that some of these follow each other is no change.
fn carries(about: About, sizes: &[Sizes], found: &[Found], change: &Found) -> bool {
    let all = [found, std::slice::from_ref(change)].concat();
    let rests = rests(about, &all);
    let shape = change.shape(about.times);
    let members = about.members.iter().zip(sizes).zip(&rests).enumerate();
    members.into_iter().any(|(i, ((member, own), rest))| {
        let variances = own.variances(member.estimate, about.spacings);
        let (level, _) = smooth(&member.determined(rest), &variances);
        let [size, _] = change.sizes[i];
        let off = |k: usize| rest[k] - level[k];
        let before = member.alone.iter().filter(|k| **k < change.at);
        let carried = median(before.map(|k| off(*k)));
        let astray = |k: &usize| {
            // from the level of its side, from that of the other, and from what was carried before
            let own = off(*k);
            let since = *k >= change.at;
            let old = if since { own + size * shape[*k] } else { own };
            let other = if since { old } else { own - size };
            let far = OUTLYING_DEVIATIONS * variances.estimate[*k].sqrt();
            let again = |carried: f64| old.abs() > far && (old - carried).abs() < far;
            member.alone.contains(k)
                || (own.abs() > far && other.abs() < own.abs())
                || (since && carried.is_some_and(again))
        };
        let often = |side: std::ops::Range<usize>| {
            let logs = side.len() as f64;
            side.filter(astray).count() as f64 > OUTLYING_SHARE * logs
        };
        often(0..change.at) || often(change.at..about.times.len())
    })
}

/// Sizes of changes that are fitted together, each with the deviation of its size.
fn fit(about: About, sizes: &[Sizes], found: &mut [Found]) {
    let count = about.members.len();
    let white = White::new(about, sizes, &rests(about, found));
    let columns: Vec<Vec<f64>> = (found.iter())
        .flat_map(|c| white.columns(&c.shape(about.times)))
        .collect();
    let signals = white.signals();
    let left = without(&signals, &orthonormal(columns.iter()));
    let freedom = about
        .determined()
        .saturating_sub(count * (OTHERS + found.len()));
    let scale = (dot(&left, &left) / freedom.max(1) as f64).max(1.0);
    let fitted = fitted(&columns, &signals, scale);
    for (change, sizes) in found.iter_mut().zip(fitted.chunks_exact(count)) {
        change.sizes = sizes.to_vec();
    }
}

/// Coefficient of each column and its standard deviation; 0 and infinite where the others hold it.
fn fitted(columns: &[Vec<f64>], signal: &[f64], scale: f64) -> Vec<[f64; 2]> {
    let of = |i: usize| {
        let others = columns.iter().enumerate().filter(|(j, _)| *j != i);
        let others = orthonormal(others.map(|(_, column)| column));
        let own = without(&columns[i], &others);
        let norm = dot(&own, &own);
        match norm > 1e-12 {
            true => [dot(&own, signal) / norm, (scale / norm).sqrt()],
            false => [0.0, f64::INFINITY],
        }
    };
    (0..columns.len()).map(of).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
