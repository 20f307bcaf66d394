//! What a person looks at: the filtered residual over position, velocity, load and time, forward and
//! backward apart, and its spectra over order and frequency, for a model before and after.

use std::f64::consts::TAU;

use serde::Serialize;

use crate::effect::AugmentedModel;
use crate::motion::{MotionError, ParallelFilters, Stretch};
use crate::robot::JointKind;

/// Points of a line.
pub type Line = Vec<[f64; 2]>;

/// The residual of one joint by one model.
#[derive(Debug, Clone, Default, Serialize)]
pub struct JointEvidence {
    /// Mean residual over position, forward and backward.
    pub position: [Line; 2],
    /// Mean residual over velocity.
    pub velocity: Line,
    /// Mean residual over the load torque, forward and backward.
    pub load: [Line; 2],
    /// Residual over time; a gap in the lines is a row that is not finite.
    pub time: Line,
    /// Amplitude over order (1/rev or 1/m).
    pub order: Line,
    /// Amplitude over frequency \[Hz\].
    pub frequency: Line,
}

/// Bins over a quantity.
const BINS: usize = 60;
/// Rows that a bin needs.
const MIN_ROWS_PER_BIN: usize = 5;
/// Points of a spectrum: the fewest, the most, and how many a peak is wide.
const SPECTRUM: usize = 240;
const MOST_POINTS: usize = 2000;
const PEAK: f64 = 3.0;
/// Over the highest order that was found, where its spectrum ends.
const ABOVE: f64 = 1.25;
/// Room between two logs on the axis of time, over the time of all.
const GAP_BETWEEN_LOGS: f64 = 0.02;
/// Rows that a spectrum is made of, about.
const ROWS: usize = 4000;

/// Evidence of a model along stretches, joint by joint. Spectra over frequency end above the cut-off, those over
/// order above `orders`, one per joint.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn evidence(
    model: &AugmentedModel,
    stretches: &[&Stretch],
    filters: &ParallelFilters,
    (cutoff_hz, orders): (f64, &[f64]),
) -> Result<Vec<JointEvidence>, MotionError> {
    let robot = &model.model.robot;
    // rows of each joint: time, position, velocity, load and residual
    let mut all: Vec<[Vec<f64>; 5]> = vec![Default::default(); robot.joints()];
    for (stretch, late) in stretches.iter().zip(one_after_the_other(stretches)) {
        let parallel = filters.of(stretch);
        let torques = model.torques(stretch);
        let residual = model.residual(stretch, &torques);
        for (j, rows) in all.iter_mut().enumerate() {
            let (q, v, load) = (&stretch.q[j], &stretch.v[j], &torques.load[j]);
            let filtered = parallel.run(&[&residual[j]])?;
            let row = |(i, e): (usize, &f64)| {
                let k = parallel.sample_of(i);
                [stretch.t[k] + late, q[k], v[k], load[k], *e]
            };
            // a break between stretches
            let parted = std::iter::once([f64::NAN; 5]);
            for row in parted.chain(filtered[0].iter().enumerate().map(row)) {
                rows.iter_mut().zip(row).for_each(|(to, x)| to.push(x));
            }
        }
    }
    let of_joint = |(j, [t, q, v, load, e]): (usize, &[Vec<f64>; 5])| {
        let slow = 0.02 * mean_square(v).sqrt();
        let by = |x: &[f64]| [1.0, -1.0].map(|sign| binned(x, e, v, &|v| sign * v > slow));
        let per_unit = match robot.joint_kind(j) {
            JointKind::Revolute => 1.0,
            JointKind::Prismatic => TAU,
        };
        let [low, high] = range(q);
        let turns = ((high - low) * per_unit / TAU).max(1e-9);
        let found = orders.get(j).copied().unwrap_or(0.0);
        let waves = (40.0 / turns).max(ABOVE * found);
        JointEvidence {
            position: by(q),
            velocity: binned(v, e, v, &|_| true),
            load: by(load),
            time: t.iter().zip(e).map(|(t, e)| [*t, *e]).collect(),
            order: spectrum(q, e, per_unit, (waves, turns)),
            frequency: spectrum(t, e, TAU, (1.5 * cutoff_hz, 0.0)),
        }
    };
    Ok(all.iter().enumerate().map(of_joint).collect())
}

/// What is added to the times of each stretch so that logs, whose clocks may begin alike, stand one after the other
/// with room between them [s].
pub fn one_after_the_other(stretches: &[&Stretch]) -> Vec<f64> {
    let ends = |s: &Stretch| s.t.first().copied().zip(s.t.last().copied());
    let lasts = |s: &&Stretch| ends(s).map_or(0.0, |(from, to)| to - from);
    let apart = GAP_BETWEEN_LOGS * stretches.iter().map(lasts).sum::<f64>();
    let (mut log, mut late, mut end) = (None, 0.0, None);
    let of = |stretch: &&Stretch| {
        let (from, to) = ends(stretch).unwrap_or_default();
        if log != Some(stretch.log) {
            late = match end {
                Some(end) => end + apart - from,
                None => 0.0,
            };
            log = Some(stretch.log);
        }
        end = Some(to + late);
        late
    };
    stretches.iter().map(of).collect()
}

fn mean_square(x: &[f64]) -> f64 {
    let finite = x.iter().filter(|x| x.is_finite());
    let (sum, count) = finite.fold((0.0, 0usize), |(s, c), x| (s + x * x, c + 1));
    sum / count.max(1) as f64
}

fn range(x: &[f64]) -> [f64; 2] {
    let finite = x.iter().filter(|x| x.is_finite());
    finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
        [a.min(*x), b.max(*x)]
    })
}

/// Mean of e in bins of x, over the rows whose velocity is wanted; empty bins part the line.
fn binned(x: &[f64], e: &[f64], v: &[f64], wanted: &dyn Fn(f64) -> bool) -> Line {
    let [low, high] = range(x);
    let width = (high - low) / BINS as f64;
    if width <= 0.0 || !width.is_finite() {
        return Vec::new();
    }
    let mut sums = vec![(0.0, 0usize); BINS];
    for ((x, e), v) in x.iter().zip(e).zip(v) {
        if x.is_finite() && wanted(*v) {
            let bin = (((x - low) / width) as usize).min(BINS - 1);
            sums[bin].0 += e;
            sums[bin].1 += 1;
        }
    }
    let point = |(i, (sum, count)): (usize, &(f64, usize))| {
        let y = match *count < MIN_ROWS_PER_BIN {
            true => f64::NAN,
            false => sum / *count as f64,
        };
        [low + (i as f64 + 0.5) * width, y]
    };
    sums.iter().enumerate().map(point).collect()
}

/// Amplitude of e at up to `last` waves of x per unit, where x covers `units`: a peak is as narrow as a wave over all of it.
fn spectrum(x: &[f64], e: &[f64], per_unit: f64, (last, units): (f64, f64)) -> Line {
    let stride = (x.len() / ROWS).max(1);
    let rows = x.iter().zip(e).step_by(stride);
    let rows: Vec<(&f64, &f64)> = rows.filter(|(x, _)| x.is_finite()).collect();
    if rows.len() < 10 || !last.is_finite() {
        return Vec::new();
    }
    let mean = rows.iter().map(|r| r.1).sum::<f64>() / rows.len() as f64;
    let points = ((PEAK * last * units) as usize).clamp(SPECTRUM, MOST_POINTS);
    let point = |i: usize| {
        let wave = last * i as f64 / points as f64;
        let (mut re, mut im) = (0.0, 0.0);
        for (x, e) in &rows {
            let (s, c) = (per_unit * wave * *x).sin_cos();
            re += (*e - mean) * c;
            im += (*e - mean) * s;
        }
        [wave, 2.0 * re.hypot(im) / rows.len() as f64]
    };
    (1..=points).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logs_stand_apart_and_the_stretches_of_one_log_keep_their_times() {
        let stretch = |log, from: f64| Stretch {
            log,
            t: vec![from, from + 10.0],
            ..Stretch::default()
        };
        let all = [(0, 0.0), (0, 15.0), (1, 0.0), (2, 90.0)];
        let all = all.map(|(log, from)| stretch(log, from));
        let late = one_after_the_other(&all.each_ref());
        let apart = GAP_BETWEEN_LOGS * 40.0;
        let expected = [0.0, 0.0, 25.0 + apart, 35.0 + 2.0 * apart - 90.0];
        for (late, expected) in late.iter().zip(expected) {
            assert!((late - expected).abs() < 1e-9, "{late} {expected}");
        }
    }

    #[test]
    fn bins_hold_means_and_a_spectrum_peaks_where_the_wave_is() {
        let x: Vec<f64> = (0..3000).map(|k| f64::from(k) / 3000.0).collect();
        let e: Vec<f64> = x.iter().map(|x| 0.7 * (TAU * 8.0 * x).sin()).collect();
        let line = spectrum(&x, &e, TAU, (40.0, 1.0));
        let peak = line.iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
        let [off, height] = [(peak[0] - 8.0).abs(), (peak[1] - 0.7).abs()];
        assert!(off < 0.2 && height < 0.02, "{peak:?}");
        let flat = binned(&x, &vec![0.3; 3000], &vec![1.0; 3000], &|v| v > 0.0);
        assert!(flat.len() == BINS && flat.iter().all(|p| (p[1] - 0.3).abs() < 1e-12));
    }
}
