//! Where the links of a tree are.

use super::links::{Coordinate, MOST_JOINTS, Tree};
use super::space::{Rotation, UNTURNED, Vector, about, add, product, times, turn};
use crate::robot::joint::JointKind;

/// Orientation of a frame and its origin \[m\], in the base frame.
pub type Frame = (Rotation, Vector);

/// The frame of the base.
pub const BASE: Frame = (UNTURNED, [0.0; 3]);

/// The links' frames in the order of the tree, where the independent joints are at `q` \[m or rad\].
pub fn frames(tree: &Tree, q: &[f64]) -> Vec<Frame> {
    let (still, mut slope) = ([0.0; MOST_JOINTS], [0.0; MOST_JOINTS]);
    let (v, a) = (&still[..q.len()], &still[..q.len()]);
    let mut frames: Vec<Frame> = Vec::with_capacity(tree.links().len());
    for link in tree.links() {
        let (rotation, origin) = link.parent.map_or(BASE, |parent| frames[parent]);
        let at = add(&origin, &turn(&rotation, &link.origin));
        let joint = product(&rotation, &link.rotation);
        let [moved, ..] = link.coordinate.motion(q, v, a, &mut slope);
        frames.push(match link.kind {
            JointKind::Revolute => (product(&joint, &about(&link.axis, moved)), at),
            JointKind::Prismatic => {
                let slid = turn(&joint, &times(moved, &link.axis));
                (joint, add(&at, &slid))
            }
        });
    }
    frames
}

/// Origins of the links' frames in the base frame \[m\], in the order of the tree, where the independent joints are
/// at `q` \[m or rad\].
pub fn origins(tree: &Tree, q: &[f64]) -> Vec<Vector> {
    let frames = frames(tree, q).into_iter();
    frames.map(|(_, origin)| origin).collect()
}

/// The link that each independent joint drives itself, or moves first.
pub fn driven(tree: &Tree) -> Vec<usize> {
    let own = |j: usize| {
        let links = tree.links();
        let drives = links
            .iter()
            .position(|l| l.coordinate == Coordinate::Joint(j));
        let moved = (0..links.len()).find(|i| tree.upstream(*i).contains(&j));
        drives.or(moved).unwrap_or(0)
    };
    (0..tree.joints()).map(own).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::tree::Link;
    use std::f64::consts::FRAC_PI_2;

    fn link(parent: Option<usize>, origin: Vector, kind: JointKind, joint: usize) -> Link {
        Link {
            name: format!("link_{joint}"),
            parent,
            rotation: UNTURNED,
            origin,
            axis: [0.0, 0.0, 1.0],
            kind,
            coordinate: Coordinate::Joint(joint),
        }
    }

    #[test]
    fn a_planar_arm_stands_where_trigonometry_says_and_a_slide_where_it_slid() {
        let links = vec![
            link(None, [0.0, 0.0, 0.2], JointKind::Revolute, 0),
            link(Some(0), [1.0, 0.0, 0.0], JointKind::Revolute, 1),
            link(Some(1), [0.5, 0.0, 0.0], JointKind::Prismatic, 2),
        ];
        let tree = Tree::new(links, 3, [0.0, 0.0, -9.81]).unwrap();
        let found = origins(&tree, &[FRAC_PI_2, -FRAC_PI_2, 0.3]);
        let expected = [[0.0, 0.0, 0.2], [0.0, 1.0, 0.2], [0.5, 1.0, 0.5]];
        for (a, b) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!((a - b).abs() < 1e-12, "{found:?}");
        }
        assert_eq!(driven(&tree), [0, 1, 2]);
    }
}
