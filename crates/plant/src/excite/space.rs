//! The room that a motion must keep: points above a floor and in a box, links apart from each other.

use std::f64::consts::PI;

use cft_ident_core::robot::Robot;
use cft_ident_core::robot::tree::capsule::Capsule;
use cft_ident_core::robot::tree::pose::{BASE, Frame, frames};
use cft_ident_core::robot::tree::space::{Vector, add, dot, times, turn};
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::limits::link_of;
use cft_ident_logs::log::escape;

use super::limits::{BoundedQuantity, Quantity};

/// Least distance where the file says none \[m\].
const DISTANCE: f64 = 0.02;

/// Points and pairs of links that are looked at.
#[derive(Debug, Clone, Default)]
pub struct DesignSpace {
    points: Vec<Point>,
    pairs: Vec<LinkPair>,
    /// Away from where things fall, a unit vector of the base frame.
    up: Vector,
    /// Height of the floor \[m\].
    floor: Option<f64>,
    /// Whether points have a box.
    boxed: bool,
    /// Links without a capsule.
    bare: Vec<String>,
}

#[derive(Debug, Clone)]
struct Point {
    name: String,
    /// Index of its link; `None` for the base.
    link: Option<usize>,
    xyz: Vector,
}

/// Two links that are no neighbours.
#[derive(Debug, Clone)]
struct LinkPair {
    names: [String; 2],
    one: Vec<Capsule>,
    other: Vec<Capsule>,
}

/// Poses by which links count as always touching.
const POSES: u32 = 256;

/// Pairs of links that are no neighbours and whose capsules are nearer than the distance to keep in every one of
/// many poses within the limits: shapes that overlap by how they are drawn, and that no motion can part.
pub fn always_touching(file: &RobotFile) -> Vec<[String; 2]> {
    let robot = file.robot();
    let (space, channels) = DesignSpace::of(file, &robot);
    let spans = robot.joint_names().iter().map(|joint| {
        let position = file.limits.get(joint).and_then(|of| of.position);
        position.unwrap_or([-PI, PI])
    });
    let spans: Vec<[f64; 2]> = spans.collect();
    // poses spread evenly: multiples of the square roots of primes, less whole numbers (Kronecker)
    let pose = |k: u32| -> Vec<Frame> {
        let shares = (2..).filter(|n| (2..*n).all(|d| n % d != 0));
        let shares = shares.map(|prime: u32| (f64::from(k) * f64::from(prime).sqrt()).fract());
        let of = |([low, high], share): (&[f64; 2], f64)| low + share * (high - low);
        let q: Vec<f64> = spans.iter().zip(shares).map(of).collect();
        frames(robot.tree(), &q)
    };
    let poses: Vec<Vec<Frame>> = (0..POSES).map(pose).collect();
    let apart = channels.iter().filter(|c| c.quantity == Quantity::Distance);
    let touching = apart.filter(|channel| {
        let near = |frames: &Vec<Frame>| {
            space.value(channel.quantity, channel.index, frames) < channel.lower
        };
        poses.iter().all(near)
    });
    let names = touching.map(|channel| space.pairs[channel.index].names.clone());
    names.collect()
}

impl DesignSpace {
    /// What `[limits]` declares, and the limits that come of it.
    pub(super) fn of(file: &RobotFile, robot: &Robot) -> (Self, Vec<BoundedQuantity>) {
        let (limits, tree) = (&file.limits, robot.tree());
        let link = |name: &str| link_of(tree, name).flatten();
        let gravity = tree.gravity();
        let size = dot(&gravity, &gravity).sqrt();
        let named = limits.point.iter().map(|point| Point {
            name: point.name.clone(),
            link: link(&point.link),
            xyz: point.xyz,
        });
        let capsules = limits.capsule.iter().map(|given| Capsule {
            link: link(&given.link),
            ends: [given.from, given.to],
            radius: given.radius,
        });
        let capsules: Vec<Capsule> = capsules.collect();
        let of = |link| -> Vec<Capsule> {
            let own = capsules.iter().filter(|c| c.link == link);
            own.copied().collect()
        };
        let all = || (0..tree.links().len()).map(Some);
        let name = |link: Option<usize>| {
            let name = link.map_or("base", |i| tree.links()[i].name.as_str());
            name.to_owned()
        };
        let bare = all().filter(|link| of(*link).is_empty());
        let bare = bare.map(|link| escape(&name(link)));
        let mut space = DesignSpace {
            points: named.collect(),
            pairs: Vec::new(),
            up: match size > 0.0 {
                true => times(-1.0 / size, &gravity),
                false => [0.0, 0.0, 1.0],
            },
            floor: limits.floor,
            boxed: limits.bounds.is_some(),
            bare: bare.collect(),
        };
        let distance = limits.distance.unwrap_or(DISTANCE);
        let apart = |quantity, index, name: &str| {
            BoundedQuantity::between(quantity, index, name, "m", [distance, f64::INFINITY])
        };
        let mut channels = Vec::new();
        for (i, point) in space.points.iter().enumerate() {
            if let Some([low, high]) = limits.bounds {
                for (k, axis) in ["x", "y", "z"].iter().enumerate() {
                    let (name, span) = (format!("{} along {axis}", point.name), [low[k], high[k]]);
                    let of = Quantity::PointPosition;
                    channels.push(BoundedQuantity::between(of, 3 * i + k, &name, "m", span));
                }
            }
            if limits.floor.is_some() {
                channels.push(apart(Quantity::Height, i, &point.name));
            }
        }
        let links: Vec<Option<usize>> = [None].into_iter().chain(all()).collect();
        for (i, a) in links.iter().enumerate() {
            for b in &links[i + 1..] {
                let neighbours = b.is_some_and(|b| tree.links()[b].parent == *a);
                let let_touch = limits.touching.iter().any(|[one, other]| {
                    let named = (link(one), link(other));
                    named == (*a, *b) || named == (*b, *a)
                });
                let (one, other) = (of(*a), of(*b));
                if neighbours || let_touch || one.is_empty() || other.is_empty() {
                    continue;
                }
                let names = [name(*a), name(*b)];
                let shown = format!("{} to {}", escape(&names[0]), escape(&names[1]));
                channels.push(apart(Quantity::Distance, space.pairs.len(), &shown));
                space.pairs.push(LinkPair { names, one, other });
            }
        }
        (space, channels)
    }

    /// The value of a channel of places where the links' frames are `frames` \[m\].
    pub(super) fn value(&self, quantity: Quantity, index: usize, frames: &[Frame]) -> f64 {
        let place = |point: &Point| {
            let (rotation, origin) = point.link.map_or(BASE, |link| frames[link]);
            add(&origin, &turn(&rotation, &point.xyz))
        };
        match quantity {
            Quantity::PointPosition => place(&self.points[index / 3])[index % 3],
            Quantity::Height => {
                let height = dot(&place(&self.points[index]), &self.up);
                height - self.floor.unwrap_or(0.0)
            }
            _ => {
                let LinkPair { one, other, .. } = &self.pairs[index];
                let pairs = one.iter().flat_map(|a| other.iter().map(move |b| (a, b)));
                let apart = pairs.map(|(a, b)| a.distance(b, frames));
                apart.fold(f64::INFINITY, f64::min)
            }
        }
    }

    /// What nobody looked at, in one sentence; whether it looked along the way to the first point.
    pub(super) fn not_checked(&self, way: bool) -> String {
        let mut parts = Vec::new();
        match &self.bare[..] {
            [] => {}
            _ if self.pairs.is_empty() => {
                parts.push("collisions of the robot with itself".to_owned());
            }
            bare => parts.push(format!(
                "collisions of {} with other links (no capsule)",
                bare.join(", ")
            )),
        }
        let names: Vec<&str> = self.points.iter().map(|point| &*point.name).collect();
        let walls = match (self.floor.is_some(), self.boxed) {
            (true, true) => "floor and box",
            (true, false) => "floor",
            (false, true) => "box",
            (false, false) => "",
        };
        match walls {
            "" if self.pairs.is_empty() && !self.bare.is_empty() => {
                parts = vec!["collisions with itself or around it".to_owned()];
            }
            "" => parts.push("collisions with what stands around it".to_owned()),
            walls => parts.push(format!(
                "what stands around the robot, but for {walls} at {}",
                names.join(", ")
            )),
        }
        if !way {
            parts.push("the path to the first point".to_owned());
        }
        format!("NOT CHECKED: {}.", parts.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two links of 1 m and 0.5 m that turn about y on a post of 0.5 m.
    const ARM: &str = "[robot]\nmodel = \"serial\"\n\
        [[robot.link]]\njoint = \"q1\"\nxyz = [0.0, 0.0, 0.5]\naxis = [0.0, 1.0, 0.0]\n\
        [[robot.link]]\njoint = \"q2\"\nxyz = [1.0, 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]\n\
        [limits]\nfloor = 0.1\nbox = [[-1.0, -1.0, 0.0], [1.2, 1.0, 2.0]]\ndistance = 0.03\n\
        [[limits.point]]\nname = \"tip\"\nlink = \"link_2\"\nxyz = [0.5, 0.0, 0.0]\n\
        [[limits.capsule]]\nlink = \"base\"\nfrom = [0.0, 0.0, 0.0]\nto = [0.0, 0.0, 0.3]\nradius = 0.1\n\
        [[limits.capsule]]\nlink = \"link_1\"\nfrom = [0.1, 0.0, 0.0]\nto = [0.9, 0.0, 0.0]\nradius = 0.06\n\
        [[limits.capsule]]\nlink = \"link_2\"\nfrom = [0.0, 0.0, 0.0]\nto = [0.5, 0.0, 0.0]\nradius = 0.05\n";

    fn file(text: &str) -> RobotFile {
        RobotFile::parse("arm.toml", text).expect("a robot file")
    }

    #[test]
    fn places_and_distances_of_two_links_are_those_of_trigonometry() {
        let robot = file(ARM).robot();
        let (space, channels) = DesignSpace::of(&file(ARM), &robot);
        let names: Vec<&str> = channels.iter().map(|c| c.name.as_str()).collect();
        let axes = ["tip along x", "tip along y", "tip along z"];
        // neighbours touch, so that one pair is left
        assert_eq!(names, [&axes[..], &["tip", "base to link_2"]].concat());
        assert_eq!((channels[0].lower, channels[0].upper), (-1.0, 1.2));
        assert_eq!((channels[3].lower, channels[4].lower), (0.03, 0.03));
        for q in [[0.0, 0.0], [0.4, -1.1], [-0.8, 2.9], [-1.2, 2.4]] {
            let (a, b): (f64, f64) = (q[0], q[0] + q[1]);
            let elbow = [a.cos(), 0.5 - a.sin()];
            let tip = [elbow[0] + 0.5 * b.cos(), elbow[1] - 0.5 * b.sin()];
            let frames = frames(robot.tree(), &q);
            let value = |k: usize| space.value(channels[k].quantity, channels[k].index, &frames);
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{q:?}: {a} {b}");
            close(value(0), tip[0]);
            close(value(1), 0.0);
            close(value(2), tip[1]);
            close(value(3), tip[1] - 0.1);
            // both pieces lie in the plane y = 0: the least over points of one of the distance to the other
            let to_post = |s: f64| {
                let x = elbow[0] + s * (tip[0] - elbow[0]);
                let z = elbow[1] + s * (tip[1] - elbow[1]);
                x.hypot(z - z.clamp(0.0, 0.3))
            };
            let least = (0..=100_000).map(|k| to_post(f64::from(k) * 1e-5));
            let least = least.fold(f64::INFINITY, f64::min);
            assert!(
                (value(4) - (least - 0.15)).abs() < 1e-5,
                "{q:?}: {}",
                value(4)
            );
        }
    }

    #[test]
    fn links_that_overlap_in_every_pose_are_found_and_others_are_not() {
        assert!(always_touching(&file(ARM)).is_empty());
        // a ball at the shoulder inside the post: about the first joint's axis, so that no pose parts them
        let thick = ARM.replace("to = [0.0, 0.0, 0.3]", "to = [0.0, 0.0, 0.6]");
        let ball = thick.replace(
            "[[robot.link]]\njoint = \"q2\"",
            "[[robot.link]]\njoint = \"qm\"\n[[robot.link]]\njoint = \"q2\"",
        );
        let ball = ball.replace("link = \"link_2\"", "link = \"link_3\"");
        let ball = format!(
            "{ball}[[limits.capsule]]\nlink = \"link_2\"\nfrom = [0.0, 0.0, 0.0]\nto = [0.0, 0.0, 0.0]\nradius = 0.1\n"
        );
        let found = always_touching(&file(&ball));
        assert_eq!(found, [["base".to_owned(), "link_2".to_owned()]]);
        let let_touch = ball.replace("floor =", "touching = [[\"link_2\", \"base\"]]\nfloor =");
        assert!(always_touching(&file(&let_touch)).is_empty());
    }

    #[test]
    fn what_nobody_checks_is_shown_by_what_is_declared() {
        let shown = |text: &str, way| {
            let file = file(text);
            DesignSpace::of(&file, &file.robot()).0.not_checked(way)
        };
        assert_eq!(
            shown(ARM, true),
            "NOT CHECKED: what stands around the robot, but for floor and box at tip."
        );
        let bare = ARM.split("[limits]").next().unwrap_or_default();
        assert_eq!(
            shown(bare, false),
            "NOT CHECKED: collisions with itself or around it; the path to the first point."
        );
    }
}
