//! A torque that was asked for and not delivered: up to a limit the motion follows it, beyond it does not.
//!
//! Whatever else a model lacks acts at all torques. So rows are fitted up to a level, joint by joint, for every level:
//! where that leaves nearly nothing and all rows leave much, and the motion of the other rows shows torques of about
//! that level, the drive gives no more, or something holds the joint. Both are no data for a fit.

use nalgebra::{DMatrix, DVector};

use super::problem::Problem;
use super::rows::JointTable;
use super::trial::Trial;
use crate::setup::channels::Drive;
use cft_ident_core::inertia::columns::JointTerm;
use cft_ident_core::judge::NUMBERS;
use cft_ident_core::math::gram::{gram, stride};

/// The numbers that decide.
struct UndeliveredLimits {
    /// Levels that are tried between the median torque and the largest.
    levels: usize,
    /// Share of the rows that a fit keeps at least. Half: what is left may be one motion; twice: all.
    kept: f64,
    /// A fit to these rows leaves at most this share of the squares that the fit to all rows leaves of them. Half: a
    /// limit beside another missing effect is passed over; twice: effects that grow with torque look like limits.
    floor: f64,
    /// A level is as good as the best one up to this factor of the residual: the highest of them is the limit.
    same: f64,
    /// By the fit the rows beyond show torques that lie within this part of their mean about it, each in the direction
    /// that was asked for: a drive gives its most there. A limit that sags with speed scatters by .04, contacts, stops
    /// and friction of a place by .15 to .8. Half: limits that sag are missed; twice: one contact in ten is a limit.
    scatter: f64,
    /// Rows for each unknown of a fit.
    rows: usize,
    /// Groups of rows that are left out in turn.
    groups: usize,
}

const LIMITS: UndeliveredLimits = UndeliveredLimits {
    levels: 48,
    kept: 0.5,
    floor: 0.25,
    same: 1.25,
    scatter: 0.08,
    rows: 10,
    groups: 4,
};

/// A level of torque beyond which the motion does not follow it.
#[derive(Debug, Clone, PartialEq)]
pub struct UndeliveredTorque {
    pub joint: usize,
    /// \[N or N m\]
    pub level: f64,
    /// Error of the fit to all rows, and of the one to the rows up to the level on rows of these that it left out,
    /// shares of the torque.
    pub errors: [f64; 2],
    /// Share of the rows beyond.
    pub beyond: f64,
}

/// The joints that miss more than sound machines do, and whose torque is one of these.
pub(super) fn undelivered(problem: &Problem, declared: &Trial) -> Vec<UndeliveredTorque> {
    if problem.channels.drive != Drive::Joints {
        return Vec::new();
    }
    let errors = declared.errors();
    let moving = problem.channels_that_move().into_iter();
    let missed = moving.filter(|j| errors[*j] > super::LIMITS.sound);
    let limit = |j: usize| {
        let own = &problem.columns.own[j];
        let coulomb = own.iter().position(|own| *own == JointTerm::Coulomb);
        let sign = |columns: usize| Some(columns - own.len() + coulomb?);
        of_joint(j, &declared.rows.of_joint(j, sign))
    };
    missed.filter_map(limit).collect()
}

/// Sums of products of some rows: the columns, and the torque last.
fn sums(table: &JointTable, of: impl Fn(usize, f64) -> bool) -> DMatrix<f64> {
    let wide = table.columns + 1;
    let mut data = Vec::new();
    for k in (0..table.rows()).filter(|k| of(*k, table.torque(*k).abs())) {
        let at = data.len();
        data.resize(at + stride(wide), 0.0);
        data[at..at + table.columns].copy_from_slice(table.row(k));
        data[at + table.columns] = table.torque(k);
    }
    gram(&data, wide)
}

/// The least squares of sums, columns brought to one size: what no row shows stays 0.
fn solved(sums: &DMatrix<f64>) -> Option<DVector<f64>> {
    let c = sums.ncols() - 1;
    let scale = DVector::from_fn(c, |i, _| match sums[(i, i)] > 0.0 {
        true => sums[(i, i)].sqrt().recip(),
        false => 0.0,
    });
    let normal = DMatrix::from_fn(c, c, |a, b| scale[a] * sums[(a, b)] * scale[b]);
    let target = DVector::from_fn(c, |a, _| scale[a] * sums[(a, c)]);
    let svd = normal.svd(true, true);
    let found = svd.solve(&target, NUMBERS.ridge).ok()?;
    Some(found.component_mul(&scale))
}

/// Squares that numbers leave of the torques.
fn left(sums: &DMatrix<f64>, theta: &DVector<f64>) -> f64 {
    let c = sums.ncols() - 1;
    let of = |k: usize| if k < c { theta[k] } else { -1.0 };
    let full = DVector::from_fn(c + 1, |k, _| of(k));
    (full.dot(&(sums * &full))).max(0.0)
}

fn of_joint(joint: usize, table: &JointTable) -> Option<UndeliveredTorque> {
    let rows = table.rows();
    let mut torques: Vec<f64> = (0..rows).map(|k| table.torque(k).abs()).collect();
    torques.sort_by(f64::total_cmp);
    let (low, high) = (*torques.get(rows / 2)?, *torques.last()?);
    if low <= 0.0 || high <= low {
        return None;
    }
    let all = sums(table, |_, _| true);
    let by_all = solved(&all)?;
    let square = |sums: &DMatrix<f64>| sums[(table.columns, table.columns)];
    let level = |i: usize| low * (high / low).powf(i as f64 / LIMITS.levels as f64);
    // residual of the rows up to each level by a fit to them
    let mut tried: Vec<(f64, f64)> = Vec::new();
    let mut own = DMatrix::zeros(table.columns + 1, table.columns + 1);
    let mut below = f64::NEG_INFINITY;
    for i in 0..=LIMITS.levels {
        let most = level(i);
        own += sums(table, |_, tau| tau > below && tau <= most);
        below = most;
        let kept = torques.partition_point(|tau| *tau <= most);
        if kept < (LIMITS.kept * rows as f64) as usize || kept < LIMITS.rows * table.columns {
            continue;
        }
        let theta = solved(&own)?;
        tried.push((most, (left(&own, &theta) / square(&own)).sqrt()));
    }
    let best = tried.iter().map(|t| t.1).fold(f64::INFINITY, f64::min);
    let (most, _) = *tried.iter().rfind(|t| t.1 <= LIMITS.same * best)?;
    let inside = sums(table, |_, tau| tau <= most);
    let theta = solved(&inside)?;
    // rows up to the level that the fit has not seen
    let mut unseen = 0.0;
    for group in 0..LIMITS.groups {
        let in_group = |k: usize| k * LIMITS.groups / rows.max(1) == group;
        let theta = solved(&sums(table, |k, tau| tau <= most && !in_group(k)))?;
        unseen += left(&sums(table, |k, tau| tau <= most && in_group(k)), &theta);
    }
    // what the motion shows beyond, in the direction that was asked for
    let along = |k: usize| {
        let of_model: f64 = table
            .row(k)
            .iter()
            .zip(theta.iter())
            .map(|(x, p)| x * p)
            .sum();
        of_model * table.torque(k).signum()
    };
    let shown: Vec<f64> = (0..rows)
        .filter(|k| table.torque(*k).abs() > most)
        .map(along)
        .collect();
    if shown.len() < LIMITS.rows {
        return None;
    }
    let mean = shown.iter().sum::<f64>() / shown.len() as f64;
    let square_off = shown.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    let scatter = (square_off / shown.len() as f64).sqrt();
    // no more than was asked for
    let level = mean.min(most);
    let beyond = rows - torques.partition_point(|tau| *tau <= level);
    let holds = unseen <= LIMITS.floor * left(&inside, &by_all)
        && unseen.sqrt() <= super::LIMITS.sound * square(&inside).sqrt()
        && mean > 0.0
        && scatter <= LIMITS.scatter * mean
        && (rows - beyond) as f64 >= LIMITS.kept * rows as f64;
    holds.then(|| UndeliveredTorque {
        joint,
        level,
        errors: [
            (left(&all, &by_all) / square(&all)).sqrt(),
            (unseen / square(&inside)).sqrt(),
        ],
        beyond: beyond as f64 / rows as f64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint of inertia and friction whose drive gives no more than `limit`, whatever its controller asks for; to what
    /// is asked for `more` adds what the model lacks.
    fn table(limit: f64, more: impl Fn(f64, f64) -> f64) -> JointTable {
        let mut table = JointTable::new(3);
        for k in 0..4000 {
            let t = f64::from(k) * 0.01;
            let v = 1.3 * (0.9 * t).sin() + 0.5 * (2.3 * t).cos();
            let wanted = 1.17 * (0.9 * t).cos() - 1.15 * (2.3 * t).sin();
            let friction = 0.25 * v + 0.5 * v.signum();
            // the farther behind, the more it asks for
            let asked = match 0.3 * wanted + friction {
                tau if tau.abs() > limit => tau + 4.0 * (tau.abs() - limit) * tau.signum(),
                tau => tau,
            };
            let acts = asked.clamp(-limit, limit);
            let noise = 0.01 * f64::from(k * 7919 % 101 - 50) / 50.0;
            let a = (acts - friction) / 0.3;
            table.push(&[a, v, v.signum()], asked + more(v, acts) + noise);
        }
        table
    }

    #[test]
    fn what_was_asked_for_beyond_a_limit_is_found_and_the_limit_with_it() {
        let found = of_joint(0, &table(1.05, |_, _| 0.0)).unwrap();
        assert!((0.95..=1.12).contains(&found.level), "{found:?}");
        assert!(found.errors[0] > 0.2 && found.errors[1] < 0.03, "{found:?}");
    }

    #[test]
    fn other_effects_are_no_limit() {
        let unlimited = |more: &dyn Fn(f64, f64) -> f64| of_joint(0, &table(9.0, more));
        // nothing, a torque of the speed squared, one that grows with the load, noise
        assert_eq!(unlimited(&|_, _| 0.0), None);
        assert_eq!(unlimited(&|v, _| 0.6 * v * v.abs()), None);
        assert_eq!(unlimited(&|_, tau| 0.4 * tau.abs()), None);
        assert_eq!(unlimited(&|v, tau| 0.8 * (1e4 * (v + tau)).sin()), None);
    }
}
