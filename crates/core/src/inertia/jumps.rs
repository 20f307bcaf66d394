//! Stretches of a log in which several joints leave many times their usual residual: something pushes the robot there.
//!
//! The blocks that are looked at are not fitted, so a motion that the others do not have leaves more for the parameters'
//! own uncertainty: a residual counts beside what the fit of the others can say of the block.

use nalgebra::{DMatrix, DVector};

use super::accumulate::{BlockFactor, BlockFactors};
use super::columns::JointTerm;
use super::solution::FitError;
use super::solve::weighted_unknowns;

/// Numbers that decide what a jump is.
struct Limits {
    /// Share of the blocks that are fitted, those with the least residuals: as many others may be spoilt.
    fitted: f64,
    /// Times that the blocks to be fitted are chosen anew; each time their residuals fall.
    rounds: usize,
    /// A residual jumps to so many times the median of its joint; models of real arms lack half of that.
    times: f64,
    /// So long at least \[s\]: a reversal is over sooner.
    seconds: f64,
    /// Of fewer blocks none is distinguished from the others.
    blocks: usize,
}

const LIMITS: Limits = Limits {
    fitted: 0.7,
    rounds: 3,
    times: 8.0,
    seconds: 0.25,
    blocks: 40,
};

/// A stretch in which residuals jump.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualJump {
    /// First and last time, as its rows have them \[s\].
    pub span: [f64; 2],
    /// Joints, and how many times the usual residual each of them has there.
    pub joints: Vec<(usize, f64)>,
}

/// The stretches of a log in which at least two joints jump; none of a single joint, whose torque has other reasons.
/// The blocks that are fitted leave their place for it and are put back.
///
/// # Errors
/// [`FitError`].
pub fn jumps(factors: &mut BlockFactors) -> Result<Vec<ResidualJump>, FitError> {
    let usable = |b: &BlockFactor| b.span[1] > b.span[0] && b.scores.is_none();
    let places = (0..factors.blocks.len()).filter(|k| usable(&factors.blocks[*k]));
    let places: Vec<usize> = places.collect();
    if factors.columns.joints < 2 || places.len() < LIMITS.blocks {
        return Ok(Vec::new());
    }
    let mut kept = places.clone();
    let (mut ratios, mut usual) = (Vec::new(), Vec::new());
    let mut theta = DVector::zeros(0);
    for round in 0..=LIMITS.rounds {
        let found = fit_blocks(factors, &kept)?;
        let blocks = places.iter().map(|k| &factors.blocks[*k]);
        (ratios, usual) = over_usual(factors, &blocks.collect::<Vec<_>>(), &found);
        theta = found.0;
        if round == LIMITS.rounds {
            break;
        }
        let worst = |of: &Vec<f64>| of.iter().copied().fold(0.0, f64::max);
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by(|a, b| worst(&ratios[*a]).total_cmp(&worst(&ratios[*b])));
        order.truncate((LIMITS.fitted * places.len() as f64) as usize);
        order.sort_unstable();
        kept = order.iter().map(|k| places[*k]).collect();
    }
    let friction = |j: usize| BY_FRICTION * coulomb(factors, &theta, j);
    let friction: Vec<f64> = (0..usual.len()).map(friction).collect();
    for ratios in &mut ratios {
        let beyond = |j: usize| ratios[j] * usual[j] > friction[j];
        if !(0..usual.len()).any(beyond) {
            ratios.fill(0.0);
        }
    }
    let blocks: Vec<&BlockFactor> = places.iter().map(|k| &factors.blocks[*k]).collect();
    Ok(joined(&blocks, &ratios))
}

/// Unknowns by the blocks at some places alone, and their covariance.
fn fit_blocks(
    factors: &mut BlockFactors,
    places: &[usize],
) -> Result<(DVector<f64>, DMatrix<f64>), FitError> {
    let mut part = factors.without_blocks();
    let taken = places
        .iter()
        .map(|k| std::mem::take(&mut factors.blocks[*k]));
    part.blocks = taken.collect();
    let found = weighted_unknowns(&part);
    for (k, block) in places.iter().zip(part.blocks) {
        factors.blocks[*k] = block;
    }
    found
}

/// Coulomb levels that a joint's torque may be off by where it sticks or turns; a push leaves more at one joint.
const BY_FRICTION: f64 = 2.0;

/// Coulomb level of a joint by a fit; 0 where it is not fitted.
fn coulomb(factors: &BlockFactors, theta: &DVector<f64>, j: usize) -> f64 {
    let mut own = factors.columns.own[j].iter();
    let at = own.position(|own| *own == JointTerm::Coulomb);
    at.map_or(0.0, |at| theta[factors.columns.first_own(j) + at].abs())
}

/// Rms residual of each block and joint over what is usual, the joint's median together with the uncertainty of the fit
/// in the block; 0 where the joint does not move. And the medians.
fn over_usual(
    factors: &BlockFactors,
    blocks: &[&BlockFactor],
    (theta, covariance): &(DVector<f64>, DMatrix<f64>),
) -> (Vec<Vec<f64>>, Vec<f64>) {
    let n = factors.columns.joints;
    let mut all = vec![vec![0.0; n]; blocks.len()];
    let mut usual = vec![0.0; n];
    for j in 0..n {
        let own = factors.own_unknowns(theta, j);
        let place = |c: usize| factors.columns.unknown(j, c);
        let covariance = DMatrix::from_fn(own.len(), own.len(), |a, b| {
            covariance[(place(a), place(b))]
        });
        let mut seen = Vec::with_capacity(blocks.len());
        let mut uncertain = vec![0.0; blocks.len()];
        for ((block, out), uncertain) in blocks.iter().zip(&mut all).zip(&mut uncertain) {
            let r = &block.r[j];
            if r.iter().all(|x| *x == 0.0) {
                continue;
            }
            let parts = factors.parts(r, j);
            let rows = block.rows.max(1) as f64;
            out[j] = (parts.residual_square(&own) / rows).sqrt();
            *uncertain = (parts.x * &covariance)
                .component_mul(&parts.x)
                .sum()
                .max(0.0)
                / rows;
            seen.push(out[j]);
        }
        seen.sort_by(f64::total_cmp);
        let median = seen.get(seen.len() / 2).copied().unwrap_or(0.0);
        for (out, uncertain) in all.iter_mut().zip(uncertain) {
            let usual = median.hypot(uncertain.sqrt());
            out[j] = if usual > 0.0 { out[j] / usual } else { 0.0 };
        }
        usual[j] = median;
    }
    (all, usual)
}

/// Blocks that jump, those next to each other as one.
fn joined(blocks: &[&BlockFactor], ratios: &[Vec<f64>]) -> Vec<ResidualJump> {
    let mut found: Vec<ResidualJump> = Vec::new();
    for (block, ratios) in blocks.iter().zip(ratios) {
        let joints = ratios.iter().copied().enumerate();
        let joints: Vec<(usize, f64)> = joints.filter(|(_, r)| *r > LIMITS.times).collect();
        if joints.len() < 2 {
            continue;
        }
        let length = block.span[1] - block.span[0];
        match found.last_mut() {
            Some(last) if block.span[0] - last.span[1] < 3.0 * length => {
                last.span[1] = block.span[1];
                for (j, ratio) in joints {
                    match last.joints.iter_mut().find(|(known, _)| *known == j) {
                        Some((_, most)) => *most = most.max(ratio),
                        None => last.joints.push((j, ratio)),
                    }
                }
            }
            _ => found.push(ResidualJump {
                span: block.span,
                joints,
            }),
        }
    }
    for jump in &mut found {
        jump.joints.sort_by_key(|(j, _)| *j);
    }
    found.retain(|jump| jump.span[1] - jump.span[0] >= LIMITS.seconds);
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertia::accumulate::RowAccumulator;
    use crate::inertia::columns::RegressorColumns;
    use crate::robot::tree::{Coordinate, Link, Tree, space};
    use crate::robot::{JointKind, Robot};

    /// Two prismatic joints across each other for 20 s, pushed from 8 to 10 s by a force on both or on one.
    fn pushed(force: [f64; 2]) -> Vec<ResidualJump> {
        let link = |axis: [f64; 3], joint: usize| Link {
            name: format!("link_{joint}"),
            parent: joint.checked_sub(1),
            rotation: space::UNTURNED,
            origin: [0.0; 3],
            axis,
            kind: JointKind::Prismatic,
            coordinate: Coordinate::Joint(joint),
        };
        let links = vec![link([1.0, 0.0, 0.0], 0), link([0.0, 1.0, 0.0], 1)];
        let tree = Tree::new(links, 2, [0.0; 3]).unwrap();
        let robot = Robot::of_tree(tree, vec!["a".into(), "b".into()], false, Vec::new());
        let columns = RegressorColumns {
            joints: 2,
            shared: robot.parameters().len(),
            own: vec![vec![JointTerm::Viscous, JointTerm::Coulomb]; 2],
            known: vec![None, None],
            rest_speed: Vec::new(),
        };
        let mut rows = RowAccumulator::new(columns.clone(), 0.05);
        let mut out = vec![0.0; columns.channels()];
        for k in 0..2000 {
            let t = 0.01 * f64::from(k);
            let v = [(0.9 * t).sin(), (1.3 * t).cos()];
            let a = [0.9 * (0.9 * t).cos(), -1.3 * (1.3 * t).sin()];
            let noise = 0.01 * (f64::from(k * 7919 % 1000) / 500.0 - 1.0);
            let pushes = (8.0..10.0).contains(&t);
            let tau: [f64; 2] = std::array::from_fn(|j| {
                let push = if pushes { force[j] } else { 0.0 };
                3.0 * a[j] + 2.0 * v[j] + 0.7 * v[j].signum() + noise + push
            });
            columns.fill(&robot, &[0.0; 2], &v, &a, &tau, &mut out);
            rows.at(t);
            rows.add(0, 0.01, &out);
        }
        jumps(&mut rows.finish()).unwrap()
    }

    #[test]
    fn a_push_at_two_joints_is_found_with_its_times() {
        let found = pushed([2.0, -1.0]);
        assert_eq!(found.len(), 1, "{found:?}");
        let [from, to] = found[0].span;
        let near = (from - 8.0).abs() < 0.1 && (to - 10.0).abs() < 0.1;
        assert!(near, "{found:?}");
        assert_eq!(found[0].joints.len(), 2);
    }

    #[test]
    fn what_one_joint_leaves_alone_is_no_push_and_a_quiet_log_has_none() {
        assert!(pushed([2.0, 0.0]).is_empty());
        assert!(pushed([0.0, 0.0]).is_empty());
    }
}
