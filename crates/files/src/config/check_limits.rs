//! What `[limits]` may say of points and links.

use super::document::{TomlDocument, near_and_all};
use super::limits::link_of;
use super::serial_section::BASE;
use super::{ConfigError, RobotFile};

/// Most capsules: a motion is looked through for every pair of links.
pub(super) const MOST_CAPSULES: usize = 64;
const MOST_POINTS: usize = 64;

/// Checks what `[limits]` says of points and links.
pub(super) fn check(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    let limits = &file.limits;
    if !limits.knows_places() {
        return Ok(());
    }
    let robot = file.robot();
    if !robot.knows_links() {
        return Err(document.value(
            &["limits"],
            "speaks of points or links, and a single joint has no places of them",
            "delete floor, box, distance, touching, point and capsule; `position` bounds the joint",
        ));
    }
    for (key, count, most) in [
        ("point", limits.point.len(), MOST_POINTS),
        ("capsule", limits.capsule.len(), MOST_CAPSULES),
    ] {
        if count > most {
            let problem = format!("stands more than {most} times");
            return Err(document.value(&["limits", key], &problem, "keep those that matter"));
        }
    }
    if let Some([low, high]) = limits.bounds
        && low.iter().zip(&high).any(|(low, high)| low >= high)
    {
        let remedy = "write the low corner first: box = [[-1.0, -1.0, 0.0], [1.0, 1.0, 1.5]]";
        return Err(document.value(&["limits", "box"], "is empty", remedy));
    }
    document.positive(&["limits", "distance"], limits.distance)?;
    for (key, given) in [
        ("floor", limits.floor.is_some()),
        ("box", limits.bounds.is_some()),
    ] {
        if given && limits.point.is_empty() {
            return Err(document.value(
                &["limits", key],
                "holds for points, and there is none",
                "add [[limits.point]] tables: name, link and xyz of the flange, the elbow ..",
            ));
        }
    }
    let known = |path: &[&str], link: &str| match link_of(robot.tree(), link) {
        Some(_) => Ok(()),
        None => {
            let links = robot.tree().links().iter().map(|link| link.name.as_str());
            let remedy = near_and_all(link, links.chain([BASE]), "the links are");
            Err(document.value(path, "is no link of this robot", &remedy))
        }
    };
    for (i, point) in limits.point.iter().enumerate() {
        let i = i.to_string();
        document.plain_name(&["limits", "point", &i, "name"], &point.name)?;
        known(&["limits", "point", &i, "link"], &point.link)?;
    }
    for (i, capsule) in limits.capsule.iter().enumerate() {
        let i = i.to_string();
        known(&["limits", "capsule", &i, "link"], &capsule.link)?;
        document.positive(&["limits", "capsule", &i, "radius"], capsule.radius)?;
    }
    for link in limits.touching.iter().flatten() {
        known(&["limits", "touching"], link)?;
    }
    Ok(())
}
