//! The robot along its motion, as points of its links.

use super::LogReplay;
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::tree::pose::{driven, origins};
use cft_ident_core::robot::tree::space::{Vector, cross, dot, times};

/// Poses that are kept, and points of the way of the last joint.
const POSES: usize = 5;
const WAY: usize = 200;

/// Poses of a tree of links, in a frame whose third axis points upwards.
#[derive(Debug, Clone)]
pub struct TreePoses {
    /// Names of the logs.
    pub logs: Vec<String>,
    /// Place of each joint among the points of a pose.
    pub driven: Vec<usize>,
    /// Points that each point of a pose is joined with; none for the base.
    pub parents: Vec<Option<usize>>,
    /// Points \[m\], pose by pose.
    pub poses: Vec<Vec<[f64; 3]>>,
    /// Way of the tip \[m\].
    pub way: Vec<[f64; 3]>,
}

/// Poses along some logs; none for a robot whose links are not known.
pub(super) fn poses(replay: &LogReplay, logs: &[usize]) -> Option<TreePoses> {
    let robot = &replay.setup.robot;
    let tree = robot.tree();
    if !robot.knows_links() {
        return None;
    }
    let wanted = |stretch: &&Stretch| logs.contains(&stretch.log);
    let stretches: Vec<&Stretch> = replay.stretches.iter().filter(wanted).collect();
    let samples: usize = stretches.iter().map(|s| s.len()).sum();
    let at = |k: usize| -> Option<Vec<Vector>> {
        let mut k = k;
        for stretch in &stretches {
            if k < stretch.len() {
                let q: Vec<f64> = stretch.q.iter().map(|q| q[k]).collect();
                return Some(origins(tree, &q));
            }
            k -= stretch.len();
        }
        None
    };
    let spread = |count: usize| (0..count).map(move |i| (2 * i + 1) * samples / (2 * count));
    let mut poses: Vec<Vec<Vector>> = spread(POSES).filter_map(at).collect();
    let last = tree.links().len().checked_sub(1)?;
    let mut way: Vec<Vector> = spread(WAY.min(samples))
        .filter_map(|k| Some(at(k)?[last]))
        .collect();
    let extent = |of: &Vec<Vector>| of.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
    if poses.iter().map(extent).fold(0.0, f64::max) < 1e-6 {
        return None;
    }
    let axes = axes(tree.gravity(), &poses);
    let turned = |p: &Vector| -> Vector { std::array::from_fn(|i| dot(&axes[i], p)) };
    poses.iter_mut().flatten().for_each(|p| *p = turned(p));
    way.iter_mut().for_each(|p| *p = turned(p));
    Some(TreePoses {
        logs: replay.named(logs),
        driven: driven(tree),
        parents: tree.links().iter().map(|link| link.parent).collect(),
        poses,
        way,
    })
}

/// A frame whose third axis points against gravity, and whose first points where the robot reaches farthest.
fn axes(gravity: Vector, poses: &[Vec<Vector>]) -> [Vector; 3] {
    let size = dot(&gravity, &gravity).sqrt();
    let up = match size > 0.0 {
        true => times(-1.0 / size, &gravity),
        false => [0.0, 0.0, 1.0],
    };
    // two horizontal axes, then the direction between them in which the points spread most
    let other = match up[0].abs() < 0.9 {
        true => [1.0, 0.0, 0.0],
        false => [0.0, 1.0, 0.0],
    };
    let along = dot(&other, &up);
    let flat: Vector = std::array::from_fn(|i| other[i] - along * up[i]);
    let first = times(1.0 / dot(&flat, &flat).sqrt(), &flat);
    let second = cross(&up, &first);
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for p in poses.iter().flatten() {
        let (a, b) = (dot(&first, p), dot(&second, p));
        (aa, bb, ab) = (aa + a * a, bb + b * b, ab + a * b);
    }
    let (s, c) = (0.5 * f64::atan2(2.0 * ab, aa - bb)).sin_cos();
    let front: Vector = std::array::from_fn(|i| c * first[i] + s * second[i]);
    [front, cross(&up, &front), up]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_third_axis_points_up_and_the_first_where_the_robot_reaches() {
        let poses = vec![vec![[0.0, 0.0, 0.5], [-3.0, -4.0, 0.7]]];
        let [front, left, up] = axes([0.0, 0.0, -9.81], &poses);
        assert_eq!(up, [0.0, 0.0, 1.0]);
        assert!(
            (dot(&front, &poses[0][1]).abs() - 5.0).abs() < 1e-12,
            "{front:?}"
        );
        assert!(dot(&front, &left).abs() < 1e-12 && dot(&front, &up).abs() < 1e-12);
        // a robot that hangs
        let [front, _, up] = axes([-9.81, 0.0, 0.0], &poses);
        assert_eq!(up, [1.0, 0.0, 0.0]);
        assert!(front.iter().all(|x| x.is_finite()));
    }
}
