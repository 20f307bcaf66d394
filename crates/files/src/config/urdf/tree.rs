//! From links and joints to moving links: fixed joints are lumped, mimic joints follow.

use std::collections::{BTreeMap, BTreeSet};

use super::link::{Body, Link};
use super::parts::{Joint, UrdfJointKind, UrdfParts, instead_of};
use super::seat::{LinkSeat, is_held};
use super::{CollisionShape, UrdfChain, UrdfPlace, turned};
use crate::config::ConfigError;
use crate::config::document::is_plain_name;
use crate::config::robot_file::CoordinateLimits;
use crate::config::serial_section::{
    BASE, FollowsSection, FrameSection, InertialSection, LinkSection, MOST_LINKS,
};
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::tree::space::{
    UNTURNED, Vector, add, of_roll_pitch_yaw, product, roll_pitch_yaw, turn,
};
use cft_ident_logs::log::{escape, list};

/// A moving link that is being gathered.
struct MovingLink<'a> {
    joint: &'a Joint,
    section: LinkSection,
    bodies: Vec<Body>,
}

/// The moving links of a URDF, up to `tip` where one is named.
pub(super) fn chain(
    parts: &UrdfParts,
    tip: Option<&str>,
    place: &UrdfPlace,
) -> Result<UrdfChain, ConfigError> {
    let named = parts.links.iter().enumerate();
    let index: BTreeMap<&str, usize> = named.map(|(i, link)| (link.name.as_str(), i)).collect();
    let (before, behind) = joints_of_links(parts, &index, place)?;
    let (moves, root) = match tip {
        None => (vec![true; parts.joints.len()], root(parts, &before, place)?),
        Some(tip) => path_to(parts, &index, &before, tip, place)?,
    };
    let mut reached = vec![false; parts.links.len()];
    let mut moving: Vec<MovingLink> = Vec::new();
    let mut fixed: Vec<(&str, LinkSeat)> = Vec::new();
    let mut collisions = Vec::new();
    // links to visit, the next one last; a link stands here once, for it has one joint before it
    let mut next: Vec<(Option<usize>, usize, LinkSeat)> = vec![(None, root, LinkSeat::at(None))];
    while let Some((joint, link, parent)) = next.pop() {
        let seat = match joint.map(|j| &parts.joints[j]) {
            None => parent,
            Some(held) if is_held(joint, parent, &moves, parts) => parent.behind_held(held),
            Some(joint) => sit(joint, &parts.links[link].name, parent, &mut moving, place)?,
        };
        let body = parts.links[link].body.as_ref();
        // a frame that says that it weighs nothing has no part in the link that carries it
        let weighs = |body: &&Body| body.mass != 0.0 || body.inertia != [[0.0; 3]; 3];
        if let (Some(on), Some(body)) = (seat.on, body.filter(weighs)) {
            moving[on].bodies.push(Body {
                mass: body.mass,
                centre: add(&seat.origin, &turn(&seat.rotation, &body.centre)),
                inertia: turned(&seat.rotation, &body.inertia),
            });
        }
        let on = hangs_on(&moving, seat.on);
        let shapes = parts.links[link].shapes.iter().filter(|_| !seat.held);
        collisions.extend(shapes.map(|shape| CollisionShape {
            of: parts.links[link].name.clone(),
            on: on.clone(),
            shape: (shape.as_ref()).map(|shape| shape.seen_from(&seat.rotation, &seat.origin)),
        }));
        let is_fixed = joint.is_some_and(|j| parts.joints[j].kind == UrdfJointKind::Fixed);
        if is_fixed && seat.on.is_some() && !seat.held {
            fixed.push((&parts.links[link].name, seat));
        }
        reached[link] = true;
        for &(j, child) in behind[link].iter().rev() {
            // what hangs beside the chain belongs to the link that carries it, and the base is no link
            if moves[j] || seat.on.is_some() {
                next.push((Some(j), child, seat));
            }
        }
    }
    if tip.is_none()
        && let Some(lost) = reached.iter().position(|reached| !reached)
    {
        return Err(circle(&parts.links[lost], place));
    }
    if moving.is_empty() {
        return Err(parts.links[root].wrong(
            place,
            "has no moving joint behind it",
            "give at least one revolute, continuous or prismatic joint, or a `tip` behind one",
        ));
    }
    // link by link, so that the order of an exported file is that of its source
    fixed.sort_by_key(|(_, seat)| seat.on);
    let frames = frames(&fixed, &moving);
    Ok(UrdfChain {
        notes: notes(parts, place),
        collisions,
        ..finish(moving, frames, place)?
    })
}

/// The joint before each link, and the joints behind it with the links that they carry.
type JointsOfLinks = (Vec<Option<usize>>, Vec<Vec<(usize, usize)>>);

fn joints_of_links(
    parts: &UrdfParts,
    index: &BTreeMap<&str, usize>,
    place: &UrdfPlace,
) -> Result<JointsOfLinks, ConfigError> {
    let mut before: Vec<Option<usize>> = vec![None; parts.links.len()];
    let mut behind: Vec<Vec<(usize, usize)>> = vec![Vec::new(); parts.links.len()];
    for (j, joint) in parts.joints.iter().enumerate() {
        let (Some(&parent), Some(&child)) = (
            index.get(joint.parent.as_str()),
            index.get(joint.child.as_str()),
        ) else {
            // the names were looked up before
            continue;
        };
        if let Some(other) = before[child] {
            return Err(joint.wrong(
                place,
                &format!(
                    "moves the link `{}`, which hangs on joint `{}` already",
                    escape(&joint.child),
                    escape(&parts.joints[other].name)
                ),
                "a closed loop is no tree: cut it, and let the dependent joints follow (mimic)",
            ));
        }
        before[child] = Some(j);
        behind[parent].push((j, child));
    }
    Ok((before, behind))
}

/// The frames that are fixed to moving links. A name that a moving link has taken gets an ending.
fn frames(fixed: &[(&str, LinkSeat)], moving: &[MovingLink]) -> Vec<FrameSection> {
    let links = moving.iter().filter_map(|m| m.section.name.as_deref());
    let mut taken: BTreeSet<String> = links.map(str::to_owned).collect();
    taken.insert(BASE.to_owned());
    let mut frames = Vec::with_capacity(fixed.len());
    for (name, seat) in fixed {
        let Some(link) = seat.on.and_then(|on| moving[on].section.name.clone()) else {
            continue;
        };
        let mut name = (*name).to_owned();
        while !taken.insert(name.clone()) {
            name.push_str("_frame");
        }
        frames.push(FrameSection {
            name,
            link,
            xyz: seat.origin,
            rpy: seat.rpy.unwrap_or_else(|| roll_pitch_yaw(&seat.rotation)),
        });
    }
    frames
}

/// The error for links that hang on each other in a circle.
fn circle(link: &Link, place: &UrdfPlace) -> ConfigError {
    link.wrong(
        place,
        "hangs on itself through its joints",
        "cut the circle: one link must be the root, which is no joint's child",
    )
}

/// Which joints are on the way to the link `tip`, and the root that the way begins at.
fn path_to(
    parts: &UrdfParts,
    index: &BTreeMap<&str, usize>,
    before: &[Option<usize>],
    tip: &str,
    place: &UrdfPlace,
) -> Result<(Vec<bool>, usize), ConfigError> {
    let Some(&end) = index.get(tip) else {
        let remedy = instead_of(tip, &parts.links);
        let what = format!("tip {}", escape(tip));
        return Err(place.wrong(1, &what, "is no link of this URDF", &remedy));
    };
    let mut on_the_way = vec![false; parts.joints.len()];
    let mut at = end;
    while let Some(joint) = before[at] {
        if on_the_way[joint] {
            return Err(circle(&parts.links[end], place));
        }
        on_the_way[joint] = true;
        match index.get(parts.joints[joint].parent.as_str()) {
            Some(parent) => at = *parent,
            None => break,
        }
    }
    Ok((on_the_way, at))
}

/// The link that no joint moves.
fn root(
    parts: &UrdfParts,
    before: &[Option<usize>],
    place: &UrdfPlace,
) -> Result<usize, ConfigError> {
    let roots: Vec<usize> = (0..before.len()).filter(|l| before[*l].is_none()).collect();
    match roots[..] {
        [root] => Ok(root),
        [] => Err(circle(&parts.links[0], place)),
        [first, second, ..] => Err(parts.links[second].wrong(
            place,
            &format!(
                "is a second root beside `{}`",
                escape(&parts.links[first].name)
            ),
            "join the two by a fixed joint, or name the `tip` of the chain that is meant",
        )),
    }
}

/// Where the link behind a joint sits; a joint that moves begins a moving link.
fn sit<'a>(
    joint: &'a Joint,
    link: &str,
    parent: LinkSeat,
    moving: &mut Vec<MovingLink<'a>>,
    place: &UrdfPlace,
) -> Result<LinkSeat, ConfigError> {
    // an origin that nothing was lumped into is kept to the last digit
    let unmoved = parent.rotation == UNTURNED && parent.origin == [0.0; 3];
    let here = LinkSeat {
        on: parent.on,
        rotation: product(&parent.rotation, &of_roll_pitch_yaw(&joint.rpy)),
        origin: add(&parent.origin, &turn(&parent.rotation, &joint.xyz)),
        rpy: unmoved.then_some(joint.rpy),
        held: parent.held,
    };
    let kind = match joint.kind {
        UrdfJointKind::Fixed => return Ok(here),
        UrdfJointKind::Revolute | UrdfJointKind::Continuous => JointKind::Revolute,
        UrdfJointKind::Prismatic => JointKind::Prismatic,
        UrdfJointKind::Floating | UrdfJointKind::Planar => {
            return Err(joint.wrong(
                place,
                "is floating or planar, and its torques cannot be logged",
                "make it fixed where the base stands still, or part it into revolute and prismatic joints",
            ));
        }
    };
    if !is_plain_name(&joint.name) {
        return Err(joint.wrong(
            place,
            "is no name for a joint",
            "use letters, digits, `_`, `-` and `.`, at most 64",
        ));
    }
    let at = moving.len();
    if at >= MOST_LINKS {
        return Err(joint.wrong(
            place,
            &format!("is one of more than {MOST_LINKS} that move"),
            "name the `tip` of the chain that was measured",
        ));
    }
    let (xyz, rpy) = match unmoved {
        true => (joint.xyz, joint.rpy),
        false => (here.origin, roll_pitch_yaw(&here.rotation)),
    };
    let section = LinkSection {
        name: Some(unused(link, moving)),
        parent: (parent.on != at.checked_sub(1)).then(|| hangs_on(moving, parent.on)),
        joint: joint.mimic.is_none().then(|| joint.name.clone()),
        kind: (kind == JointKind::Prismatic).then_some(kind),
        xyz: Some(xyz),
        rpy: (rpy != [0.0; 3]).then_some(rpy),
        axis: (joint.axis != [0.0, 0.0, 1.0]).then_some(joint.axis),
        ..LinkSection::default()
    };
    moving.push(MovingLink {
        joint,
        section,
        bodies: Vec::new(),
    });
    Ok(LinkSeat::at(Some(at)))
}

/// The name of a moving link, or of the base.
fn hangs_on(moving: &[MovingLink], on: Option<usize>) -> String {
    match on {
        None => BASE.to_owned(),
        Some(on) => moving[on].section.name.clone().unwrap_or_default(),
    }
}

/// The name of a link; `base` is taken by what stands still.
fn unused(link: &str, moving: &[MovingLink]) -> String {
    let is = |name: &str, m: &MovingLink| m.section.name.as_deref() == Some(name);
    let taken = |name: &str| name == BASE || moving.iter().any(|m| is(name, m));
    let mut name = link.to_owned();
    while taken(&name) {
        name.push_str("_link");
    }
    name
}

/// What was taken otherwise than it is written.
fn notes(parts: &UrdfParts, place: &UrdfPlace) -> Vec<String> {
    let renamed = parts.renamed.first().map(|_| {
        let names = parts.renamed.iter().map(String::as_str);
        format!(
            "{}: joints {} are written with `_` for what is no letter, digit, `_`, `-` or `.`; `name` in [log.joint] says what messages call them",
            place.file,
            list(names)
        )
    });
    let impossible = parts.impossible.as_ref();
    let impossible = impossible.map(|text| format!("{}: {text}", place.file));
    let shown = parts.changes.in_words(place.file).into_iter();
    shown.chain(renamed).chain(impossible).collect()
}

/// Lumps the bodies and lets mimic joints follow.
fn finish(
    mut moving: Vec<MovingLink>,
    frames: Vec<FrameSection>,
    place: &UrdfPlace,
) -> Result<UrdfChain, ConfigError> {
    let joints: BTreeMap<&str, &Joint> = (moving.iter())
        .map(|m| (m.joint.name.as_str(), m.joint))
        .collect();
    let follows = moving
        .iter()
        .map(|m| followed(m.joint, &joints, &moving, place));
    let follows = follows.collect::<Result<Vec<_>, _>>()?;
    let mut limits = Vec::new();
    for (m, follows) in moving.iter_mut().zip(follows) {
        m.section.inertial = lumped(&m.bodies, m.joint, place)?;
        m.section.follows = follows;
        if m.joint.limits != CoordinateLimits::default() && m.joint.mimic.is_none() {
            limits.push((m.joint.name.clone(), m.joint.limits.clone()));
        }
    }
    Ok(UrdfChain {
        links: moving.into_iter().map(|m| m.section).collect(),
        limits,
        frames,
        collisions: Vec::new(),
        notes: Vec::new(),
    })
}

/// The coordinate of a mimic joint as a function of an independent joint.
fn followed(
    joint: &Joint,
    joints: &BTreeMap<&str, &Joint>,
    moving: &[MovingLink],
    place: &UrdfPlace,
) -> Result<Option<FollowsSection>, ConfigError> {
    let (mut at, mut factor, mut offset) = (joint, 1.0, 0.0);
    // a mimic joint may follow another one; a circle of them is longer than there are joints
    for _ in 0..=moving.len() {
        let Some(mimic) = &at.mimic else {
            let linear = [(at.name.clone(), factor)].into();
            return Ok(joint.mimic.is_some().then(|| FollowsSection {
                offset,
                linear,
                sine: Vec::new(),
            }));
        };
        offset += factor * mimic.offset;
        factor *= mimic.multiplier;
        let Some(target) = joints.get(mimic.joint.as_str()) else {
            let names = moving.iter().filter(|m| m.joint.mimic.is_none());
            return Err(joint.wrong(
                place,
                &format!(
                    "mimics `{}`, which is no moving joint of this chain",
                    escape(&mimic.joint)
                ),
                &format!(
                    "let it mimic one of {}",
                    list(names.map(|m| m.joint.name.as_str()).take(20))
                ),
            ));
        };
        at = target;
    }
    Err(joint.wrong(
        place,
        "mimics itself through other joints",
        "let one joint of the circle be independent: delete its <mimic>",
    ))
}

/// The bodies of a moving link as one.
fn lumped(
    bodies: &[Body],
    joint: &Joint,
    place: &UrdfPlace,
) -> Result<Option<InertialSection>, ConfigError> {
    let one = match bodies {
        [] => return Ok(None),
        [body] => *body,
        bodies => {
            let mass: f64 = bodies.iter().map(|b| b.mass).sum();
            let moment = |k: usize| bodies.iter().map(|b| b.mass * b.centre[k]).sum::<f64>();
            let centre: Vector = match mass == 0.0 {
                true => [0.0; 3],
                false => std::array::from_fn(|k| moment(k) / mass),
            };
            let mut inertia = [[0.0; 3]; 3];
            for body in bodies {
                let d: Vector = std::array::from_fn(|k| body.centre[k] - centre[k]);
                let square: f64 = d.iter().map(|x| x * x).sum();
                for (r, row) in inertia.iter_mut().enumerate() {
                    for (c, x) in row.iter_mut().enumerate() {
                        let own = if r == c { square } else { 0.0 };
                        *x += body.inertia[r][c] + body.mass * (own - d[r] * d[c]);
                    }
                }
            }
            Body {
                mass,
                centre,
                inertia,
            }
        }
    };
    let i = &one.inertia;
    let section = InertialSection {
        mass: one.mass,
        centre: one.centre,
        inertia: [i[0][0], i[0][1], i[0][2], i[1][1], i[1][2], i[2][2]],
    };
    let mut numbers = section.centre.iter().chain(&section.inertia);
    if !section.mass.is_finite() || !numbers.all(|x| x.is_finite()) {
        return Err(place.wrong(
            joint.line,
            &format!("link {}", escape(&joint.child)),
            "has inertials beyond the range of numbers",
            "give its mass in kg and its sizes in m",
        ));
    }
    Ok(Some(section))
}
