//! Steps and ramps, one after the other, by generalised least squares: of one parameter, or of some that change
//! together, as the friction of a joint does.

use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::local_level::smooth;
use super::together::{CourseSignals, CourseWhitener, orthonormal, without};
use super::walk::{TRIED, WalkSizes, median, sizes};

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
pub(super) struct CommonChange {
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
/// Largest share of the logs on one side of a change that are not of that side; of more, the robot carries something.
const OUTLYING_SHARE: f64 = 0.2;
/// Deviations from the level of its side, from which on a log that is nearer to the other is not of its side.
const OUTLYING_DEVIATIONS: f64 = 3.0;
/// Most times that walk and scatter are sized anew with a change taken out.
const REFINED: usize = 3;

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

/// Of the ratio that is tested for another change besides `known` ones, where there is none.
fn law(about: CourseSignals, known: usize) -> Option<FisherSnedecor> {
    let freedom = about.freedom(known + 1).max(1);
    FisherSnedecor::new(about.members.len() as f64, freedom as f64).ok()
}

/// Logs of those that are shown at which a change may begin.
fn places(shown: &[usize]) -> &[usize] {
    let end = (shown.len() + 1).saturating_sub(AFTER);
    shown.get(BEFORE..end).unwrap_or_default()
}

/// Seeks changes whose probability without one is below `level`, with the sizes of walk and scatter of each parameter.
// Bonferroni's correction is for the places and kinds that are tried. Walk and scatter are estimated with the clearest
// change taken out, for a change that is left in makes a walk. The deviation is scaled by the residual where that is
// larger than the variances say. Of several parameters the likelihood ratio is tested, with the correlation of their
// innovations (Basseville and Nikiforov 1993, section 7.2).
pub(super) fn seek(about: CourseSignals, level: f64) -> (Vec<WalkSizes>, Vec<CommonChange>) {
    let mut found: Vec<CommonChange> = Vec::new();
    let mut sizes = likeliest(about, &[], &TRIED).0;
    while found.len() < MAX_CHANGES && about.freedom(found.len() + 1) > about.members.len() {
        // a walk that is large enough hides a change, and a change that is left in makes a walk: both starts are tried
        let starts = [sizes.clone(), likeliest(about, &found, &TRIED[..1]).0];
        let tried = starts.map(|start| settled(about, start, &found));
        let best = tried.into_iter().flatten();
        let best = best.min_by(|a, b| a.2.total_cmp(&b.2));
        let Some((next, anew, _)) = best.filter(|(next, ..)| next.p_value <= level) else {
            break;
        };
        sizes = anew;
        found.push(next);
        fit(about, &sizes, &mut found);
    }
    found.sort_by_key(|c| c.at);
    (sizes, found)
}

/// Size from which on a step of each parameter alone is reported at `level`; none where there are too few logs.
// In the middle of the course; that size itself is reported in one course of two.
pub(super) fn least_seen(
    about: CourseSignals,
    sizes: &[WalkSizes],
    level: f64,
) -> Vec<Option<f64>> {
    let (count, shown) = (about.members.len(), about.shown());
    let tried = 2 * places(&shown).len();
    let (true, Some(law)) = (tried > 0 && about.freedom(1) > 0, law(about, 0)) else {
        return vec![None; count];
    };
    let ratio = law.inverse_cdf(1.0 - level / tried as f64);
    let white = CourseWhitener::new(about, sizes, &rests(about, &[]));
    let middle = shape(ChangeKind::Step, shown[shown.len() / 2], about.times);
    let steps = fitted(&white.columns(&middle), &white.signals(), 1.0);
    let least = |[_, std]: &[f64; 2]| (ratio * count as f64).sqrt() * std;
    let finite = |size: f64| size.is_finite().then_some(size);
    steps.iter().map(|step| finite(least(step))).collect()
}

/// Sizes of walk and scatter of each parameter with changes taken out, and how unlikely the innovations are.
fn likeliest(about: CourseSignals, found: &[CommonChange], walks: &[f64]) -> (Vec<WalkSizes>, f64) {
    let rests = rests(about, found);
    let members = about.members.iter().zip(&rests);
    let all: Vec<(WalkSizes, f64)> = members
        .map(|(member, rest)| sizes(walks, rest, &member.variances, about.spacings))
        .collect();
    let cost = all.iter().map(|(_, cost)| cost).sum();
    (all.iter().map(|(sizes, _)| *sizes).collect(), cost)
}

/// The clearest change and the sizes with it taken out, each found anew by the other, and how unlikely the innovations are.
fn settled(
    about: CourseSignals,
    sizes: Vec<WalkSizes>,
    found: &[CommonChange],
) -> Option<(CommonChange, Vec<WalkSizes>, f64)> {
    let mut next = clearest(about, &sizes, found)?;
    let mut rounds = 0;
    loop {
        let all = [found, std::slice::from_ref(&next)].concat();
        let (anew, cost) = likeliest(about, &all, &TRIED);
        let again = clearest(about, &anew, found)?;
        let same = (again.kind, again.at) == (next.kind, next.at);
        next = again;
        rounds += 1;
        if same || rounds == REFINED {
            return Some((next, anew, cost));
        }
    }
}

/// The signals without changes.
fn rests(about: CourseSignals, changes: &[CommonChange]) -> Vec<Vec<f64>> {
    let mut rests: Vec<Vec<f64>> = (about.members.iter())
        .map(|member| member.values.clone())
        .collect();
    for change in changes {
        let shape = shape(change.kind, change.at, about.times);
        for (rest, [size, _]) in rests.iter_mut().zip(&change.sizes) {
            let pairs = rest.iter_mut().zip(&shape);
            pairs.for_each(|(x, shape)| *x -= size * shape);
        }
    }
    rests
}

/// What changes add, white.
fn columns(
    about: CourseSignals,
    white: &CourseWhitener,
    changes: &[CommonChange],
) -> Vec<Vec<f64>> {
    let each = changes.iter();
    each.flat_map(|c| white.columns(&shape(c.kind, c.at, about.times)))
        .collect()
}

/// The clearest change besides those that are known.
fn clearest(
    about: CourseSignals,
    sizes: &[WalkSizes],
    found: &[CommonChange],
) -> Option<CommonChange> {
    let law = law(about, found.len())?;
    let white = CourseWhitener::new(about, sizes, &rests(about, found));
    let known = orthonormal(columns(about, &white, found).iter());
    let freedom = about.freedom(found.len() + 1).max(1) as f64;
    let residual = without(&white.signals(), &known);
    let square = dot(&residual, &residual);
    let shown = about.shown();
    let places = places(&shown);
    let mut best: Option<(f64, CommonChange)> = None;
    for kind in [ChangeKind::Step, ChangeKind::Ramp] {
        for at in places.iter().copied() {
            let own = white.columns(&shape(kind, at, about.times));
            let own: Vec<Vec<f64>> = own.iter().map(|column| without(column, &known)).collect();
            let units = orthonormal(own.iter());
            let gain = units.iter().map(|u| dot(u, &residual).powi(2)).sum::<f64>();
            let scale = ((square - gain).max(0.0) / freedom).max(1.0);
            let ratio = gain / (about.members.len() as f64 * scale);
            if units.is_empty() || best.as_ref().is_some_and(|(most, _)| ratio <= *most) {
                continue;
            }
            let change = CommonChange {
                kind,
                at,
                sizes: fitted(&own, &residual, scale),
                p_value: 1.0,
            };
            if !carries(about, sizes, found, &change) {
                best = Some((ratio, change));
            }
        }
    }
    let tried = (2 * places.len()) as f64;
    best.map(|(ratio, change)| CommonChange {
        p_value: (tried * law.sf(ratio)).min(1.0),
        ..change
    })
}

/// Whether the robot carries something now and then: that some logs of that kind follow each other is no change.
// So many logs on one side are not of that side, stand alone, or are as those that stood alone before it.
fn carries(
    about: CourseSignals,
    sizes: &[WalkSizes],
    found: &[CommonChange],
    change: &CommonChange,
) -> bool {
    let all = [found, std::slice::from_ref(change)].concat();
    let rests = rests(about, &all);
    let shape = shape(change.kind, change.at, about.times);
    let members = about.members.iter().zip(sizes).zip(&rests).enumerate();
    members.into_iter().any(|(i, ((member, own), rest))| {
        let variances = own.variances(&member.variances, about.spacings);
        let (level, _) = smooth(&member.determined(rest), &variances);
        let [size, _] = change.sizes[i];
        let off = |k: usize| rest[k] - level[k];
        let before = member.outliers.iter().filter(|k| **k < change.at);
        let carried = median(before.map(|k| off(*k)));
        let astray = |k: &usize| {
            // from the level of its side, from that of the other, and from what was carried before
            let own = off(*k);
            let since = *k >= change.at;
            let old = if since { own + size * shape[*k] } else { own };
            let other = if since { old } else { own - size };
            let far = OUTLYING_DEVIATIONS * variances.estimate[*k].sqrt();
            let again = |carried: f64| old.abs() > far && (old - carried).abs() < far;
            member.outliers.contains(k)
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
fn fit(about: CourseSignals, sizes: &[WalkSizes], found: &mut [CommonChange]) {
    let white = CourseWhitener::new(about, sizes, &rests(about, found));
    let columns = columns(about, &white, found);
    let signals = white.signals();
    let left = without(&signals, &orthonormal(columns.iter()));
    let freedom = about.freedom(found.len()).max(1) as f64;
    let scale = (dot(&left, &left) / freedom).max(1.0);
    let fitted = fitted(&columns, &signals, scale);
    for (change, sizes) in found
        .iter_mut()
        .zip(fitted.chunks_exact(about.members.len()))
    {
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
