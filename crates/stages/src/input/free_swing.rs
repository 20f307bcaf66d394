//! Whether a robot whose torque reads exactly 0 moves as it does without its motors: then these rows
//! are data like others, and good ones. Where a channel is dead instead, no model of the robot gives
//! torques of 0 there and the logged ones elsewhere.
//!
//! The inertial parameters with friction and offset of every joint are fitted to the rows with torques
//! (which leaves e of a joint's torque), and to all rows. A robot of the right model leaves about e
//! then, too. With a dead channel in a share f of like rows, least squares gives (1 - f) of the torques
//! in all of them: it misses f where they were measured and 1 - f where they were not, so that one of
//! the two is half of them or more. Half-way between e and 1/2 parts the two. Besides, without motors the
//! inertial terms cancel but for friction: what is left of them is less than half of what they are.

use nalgebra::{DMatrix, DVector};

use super::error::IdentifyError;
use cft_ident_core::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident_core::math::rank;
use cft_ident_core::math::rfactor::RFactor;
use cft_ident_core::motion::{self, FilterSettings};
use cft_ident_core::robot::Robot;
use cft_ident_logs::recording::RowBlocks;

/// Half of the torques: the least that a dead channel leaves.
const DEAD_CHANNEL_SHARE: f64 = 0.5;
/// Periods of the cut-off about the ends of a stretch whose filtered rows hold both kinds.
const END_PERIODS: f64 = 1.0;

/// Rows of one joint: those with torques, those without.
struct JointRows {
    driven: RFactor,
    off: RFactor,
    /// Sum of the squared torques of the driven ones.
    square: f64,
}

/// Whether the joints move, where their torques are `off` (joint, from, to \[s\]), as they do without.
pub(crate) fn moves_freely(
    (robot, settings): (&Robot, &FilterSettings),
    name: &str,
    blocks: &mut RowBlocks,
    off: &[(usize, [f64; 2])],
) -> Result<bool, IdentifyError> {
    let n = robot.joints();
    let columns = RegressorColumns {
        joints: n,
        shared: robot.parameters().len(),
        own: vec![vec![JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset]; n],
        known: vec![None; n],
        rest_speed: Vec::new(),
    };
    let unknowns = columns.unknowns();
    let mut joints: Vec<JointRows> = (0..n)
        .map(|_| JointRows {
            driven: RFactor::new(unknowns + 1),
            off: RFactor::new(unknowns + 1),
            square: 0.0,
        })
        .collect();
    let mut row = vec![0.0; unknowns + 1];
    let near = END_PERIODS / settings.cutoff_hz;
    let run = motion::run(
        &mut |block| blocks.read(block),
        n,
        settings,
        None,
        columns.channels(),
        &|s, out| columns.fill(robot, s.q, s.v, s.a, s.tau, out),
        &mut |r| {
            for (j, joint) in joints.iter_mut().enumerate() {
                let of_joint = || off.iter().filter(|(of, _)| *of == j);
                let beside = of_joint()
                    .any(|(_, [from, to])| (r.t - from).abs() < near || (r.t - to).abs() < near);
                if beside {
                    continue;
                }
                let own = &r.filtered[columns.offset(j)..][..columns.row_width(j)];
                row.fill(0.0);
                for (c, x) in own[..own.len() - 1].iter().enumerate() {
                    row[columns.unknown(j, c)] = *x;
                }
                let torque = own[own.len() - 1];
                row[unknowns] = torque;
                if of_joint().any(|(_, [from, to])| *from <= r.t && r.t <= *to) {
                    joint.off.fold(&row);
                } else {
                    joint.driven.fold(&row);
                    joint.square += torque * torque;
                }
            }
        },
    );
    match run {
        Ok(_) => {}
        Err(motion::RunError::Motion(_)) => return Ok(false),
        Err(error) => return Err(IdentifyError::of_run(name, error)),
    }
    let concerned = |j: usize| off.iter().any(|(of, _)| *of == j);
    Ok(judged(&joints, unknowns, columns.shared, &concerned).unwrap_or(false))
}

/// Whether all rows follow one model about as well as those with torques do.
fn judged(
    joints: &[JointRows],
    unknowns: usize,
    shared: usize,
    concerned: &dyn Fn(usize) -> bool,
) -> Option<bool> {
    let alone = solved(joints.iter().map(|joint| &joint.driven), unknowns)?;
    let all = joints.iter().flat_map(|joint| [&joint.driven, &joint.off]);
    let together = solved(all, unknowns)?;
    // Joints together, each by its share of the torque: a joint that is hardly driven says little.
    let of_all = |part: &dyn Fn(&JointRows) -> f64| -> f64 {
        let of = joints.iter().enumerate().filter(|(j, _)| concerned(*j));
        of.map(|(_, joint)| part(joint)).sum()
    };
    let left = |rows: &RFactor, theta: &DVector<f64>| {
        (rows.r() * theta).norm_squared() / rows.rows().max(1) as f64
    };
    let torque = of_all(&|joint| joint.square / joint.driven.rows().max(1) as f64).sqrt();
    let share = |part: &dyn Fn(&JointRows) -> f64| of_all(part).sqrt() / torque;
    let of_model = share(&|joint| left(&joint.driven, &alone));
    let driven = share(&|joint| left(&joint.driven, &together)) - of_model;
    let off = share(&|joint| left(&joint.off, &together));
    // What the inertial terms are, each for itself, before they cancel.
    let terms = share(&|joint| {
        let r = joint.off.r();
        let columns = r.column_iter().zip(together.iter()).take(shared);
        let squares = columns.map(|(column, theta)| column.norm_squared() * theta * theta);
        squares.sum::<f64>() / joint.off.rows().max(1) as f64
    });
    let known = torque > 0.0 && of_all(&|joint| joint.off.rows() as f64) > 0.0;
    known.then(|| {
        driven.max(off) <= 0.5 * (of_model + DEAD_CHANNEL_SHARE)
            && off <= DEAD_CHANNEL_SHARE * terms
    })
}

/// The parameters of least norm for some rows, and -1 for the torque's own column after them.
fn solved<'a>(parts: impl Iterator<Item = &'a RFactor>, unknowns: usize) -> Option<DVector<f64>> {
    let mut whole = RFactor::new(unknowns + 1);
    for part in parts {
        whole.merge(part).ok()?;
    }
    let r = whole.r();
    let b = r.column(unknowns).into_owned();
    let mut a: DMatrix<f64> = r.columns(0, unknowns).into_owned();
    // Columns of one size: torques of a kilogram and of a kilogram square metre differ.
    let sizes: Vec<f64> = a.column_iter().map(|column| column.norm()).collect();
    for (mut column, size) in a.column_iter_mut().zip(&sizes) {
        if *size > 0.0 {
            column /= *size;
        }
    }
    let found = rank::svd(&a).ok()?;
    let kept = rank::rank(&found.s, whole.rows().max(1));
    let mut theta = DVector::zeros(unknowns + 1);
    for k in 0..kept {
        let share = found.u.column(k).dot(&b) / found.s[k];
        for (i, size) in sizes.iter().enumerate().filter(|(_, size)| **size > 0.0) {
            theta[i] += found.v[(i, k)] * share / size;
        }
    }
    theta[unknowns] = -1.0;
    Some(theta)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a pendulum, m l^2 a + m g l sin q + f v + sgn v + 1: torques read as `logged` says.
    fn rows(logged: impl Fn(f64) -> f64, freely: bool) -> JointRows {
        let mut joint = JointRows {
            driven: RFactor::new(6),
            off: RFactor::new(6),
            square: 0.0,
        };
        let (mut q, mut v) = (1.2f64, 0.0f64);
        for k in 0..8000 {
            let t = f64::from(k) * 1e-3;
            let is_off = t > 4.0;
            let drive = match is_off && freely {
                true => 0.0,
                false => 3.0 * (2.3 * t).sin() + 1.5 * (5.1 * t).cos(),
            };
            let a = (drive - 4.0 * q.sin() - 0.1 * v) / 0.5;
            v += a * 1e-3;
            q += v * 1e-3;
            let row = [
                a,
                q.sin(),
                v,
                v.signum(),
                1.0,
                if is_off { 0.0 } else { logged(drive) },
            ];
            match is_off {
                true => joint.off.fold(&row),
                false => {
                    joint.driven.fold(&row);
                    joint.square += row[5] * row[5];
                }
            }
        }
        joint
    }

    #[test]
    fn a_free_swing_is_no_dead_channel() {
        let wavers = |drive: f64| drive + 0.3 * (17.0 * drive).sin();
        assert_eq!(judged(&[rows(wavers, true)], 5, 2, &|_| true), Some(true));
        assert_eq!(judged(&[rows(wavers, false)], 5, 2, &|_| true), Some(false));
    }
}
