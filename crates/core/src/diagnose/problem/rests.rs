//! Where a joint with a jump in its friction law stands or turns: static friction takes any torque there.

use crate::effect::AugmentedModel;
use crate::motion::{MotionError, Parallel, ParallelFilters, Stretch, rest};
use crate::robot::model::JointFriction;

/// Speed below which a joint counts as standing, over its rms speed.
const STANDING: f64 = 0.01;

/// Rows in which a joint with a jump in its friction law stands still for as long as the filter
/// remembers: static friction takes any torque up to its limit there, and no law of v says which.
pub(crate) fn standing(
    model: &AugmentedModel,
    stretch: &Stretch,
    parallel: &Parallel,
    j: usize,
) -> Vec<usize> {
    if !model.model.friction[j].jumps() {
        return Vec::new();
    }
    let v = &stretch.v[j];
    let slow = slow(v);
    // samples since the joint last moved, and until it moves again
    let mut since = vec![0usize; v.len()];
    let mut count = usize::MAX / 2;
    for (k, v) in v.iter().enumerate() {
        count = if v.abs() > slow { 0 } else { count + 1 };
        since[k] = count;
    }
    count = usize::MAX / 2;
    for (k, v) in v.iter().enumerate().rev() {
        count = if v.abs() > slow { 0 } else { count + 1 };
        since[k] = since[k].min(count);
    }
    (0..parallel.rows(stretch.len()))
        .filter(|i| since[parallel.sample_of(*i)] > parallel.decimation)
        .collect()
}

/// Speed below which a joint counts as standing.
fn slow(v: &[f64]) -> f64 {
    let square = v.iter().map(|v| v * v).sum::<f64>() / v.len().max(1) as f64;
    STANDING * square.sqrt()
}

/// Periods of the parallel filter's cut-off over which it carries what happens at a rest.
const REACH: f64 = 1.0;

/// Which rows are within the filter's reach of a sample at which a joint with a jump in its friction law stands or
/// turns: the law says more of friction there than friction does.
pub(crate) fn near_rests(
    model: &AugmentedModel,
    stretch: &Stretch,
    parallel: &Parallel,
    cutoff_hz: f64,
    j: usize,
) -> Vec<bool> {
    let mut near = vec![false; parallel.rows(stretch.len())];
    if !model.model.friction[j].jumps() {
        return near;
    }
    let v = &stretch.v[j];
    let slow = slow(v);
    let reach = (REACH / (cutoff_hz * stretch.dt)) as usize;
    // the last sample before each row's end of reach at which it stood or turned
    let mut last = None;
    let mut k = 0;
    for (i, near) in near.iter_mut().enumerate() {
        let centre = parallel.sample_of(i);
        while k < v.len() && k <= centre + reach {
            if v[k].abs() <= slow || (k > 0 && v[k] * v[k - 1] < 0.0) {
                last = Some(k);
            }
            k += 1;
        }
        *near = last.is_some_and(|l| l + reach >= centre);
    }
    near
}

/// Rows in which each joint rests, as `validate` tells them, `[joint][row]`; none of joints without friction.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn resting(
    model: &AugmentedModel,
    stretch: &Stretch,
    parallel: &Parallel,
    rest_speed: &[f64],
) -> Result<Vec<Vec<bool>>, MotionError> {
    let rows = parallel.rows(stretch.len());
    let of_joint = |(j, speed): (usize, &f64)| {
        if model.model.friction[j] == JointFriction::None {
            return Ok(vec![false; rows]);
        }
        let speeds = stretch.v[j].iter();
        let moving: Vec<f64> = speeds.map(|v| rest::movement(*v, *speed)).collect();
        let filtered = parallel.run(&[&moving])?;
        Ok(filtered[0].iter().map(|m| rest::rests(*m)).collect())
    };
    rest_speed.iter().enumerate().map(of_joint).collect()
}

/// Gives rows of a column another weight.
pub(crate) fn weigh(column: &mut [f64], rows: &[usize], weight: f64) {
    for i in rows {
        column[*i] *= weight;
    }
}

/// Weight of each joint's rows at rest, whose residual has the standard deviation `noise` otherwise [N or Nm].
/// Friction at rest is anything up to its Coulomb level, evenly, and one number through a rest: all rows of a
/// rest together tell as much as one number with that error.
pub(crate) fn rest_weight(
    model: &AugmentedModel,
    stretches: &[Stretch],
    filters: &ParallelFilters,
    noise: &[f64],
) -> Vec<f64> {
    let of_joint = |(j, noise): (usize, &f64)| {
        let level = match model.model.friction[j] {
            JointFriction::ViscousCoulomb(law) => law.coulomb.abs(),
            _ => return 0.0,
        };
        let (mut rows, mut rests) = (0usize, 0usize);
        for stretch in stretches {
            let still = standing(model, stretch, filters.of(stretch), j);
            rows += still.len();
            rests += usize::from(!still.is_empty());
            rests += still.windows(2).filter(|w| w[1] > w[0] + 1).count();
        }
        if rests == 0 {
            return 0.0;
        }
        let friction = rows as f64 / rests as f64 * level * level / 3.0;
        let noise = noise * noise;
        match noise > 0.0 {
            true => (noise / (noise + friction)).sqrt(),
            false => 0.0,
        }
    };
    noise.iter().enumerate().map(of_joint).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::FilterSettings;
    use crate::robot::friction::ViscousCoulomb;
    use crate::robot::model::{JointFriction, Model};
    use crate::robot::{JointKind, Robot};

    #[test]
    fn rows_near_a_rest_are_those_that_the_filter_reaches_from_it() {
        let settings = FilterSettings {
            cutoff_hz: 20.0,
            ..FilterSettings::default()
        };
        let (dt, n) = (1e-3, 4000);
        let parallel = Parallel::design(&settings, dt).unwrap();
        // one reversal, at 2 s
        let v: Vec<f64> = (0..n).map(|k| 2.0005 - k as f64 * dt).collect();
        let stretch = Stretch {
            dt,
            t: vec![0.0; n],
            q: vec![vec![0.0; n]],
            v: vec![v],
            a: vec![vec![-1.0; n]],
            tau: vec![vec![0.0; n]],
            ..Stretch::default()
        };
        let near = |law: JointFriction| {
            let robot = Robot::single_joint("slide", JointKind::Prismatic);
            let model = AugmentedModel::plain(Model {
                robot,
                theta: vec![1.0],
                friction: vec![law],
                offset: vec![0.0],
            });
            near_rests(&model, &stretch, &parallel, settings.cutoff_hz, 0)
        };
        let jumps = near(JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous: 1.0,
            coulomb: 1.0,
        }));
        // a hundredth of the rms speed of 1.15 m/s to each side of it, and 50 ms more
        for (i, near) in jumps.iter().enumerate() {
            let off = (parallel.sample_of(i) as f64 * dt - 2.0005).abs();
            assert_eq!(*near, off < 0.0115 + 0.05, "{off}");
        }
        assert!(near(JointFriction::None).iter().all(|near| !near));
    }
}
