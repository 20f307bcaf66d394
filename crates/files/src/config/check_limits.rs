//! What `[limits]` may say of points and links.

use super::document::Document;
use super::limits::link_of;
use super::serial_section::BASE;
use super::{ConfigError, RobotFile};
use cft_ident_logs::log::{list, nearest};

/// Most capsules: a motion is looked through for every pair of links.
pub(super) const MOST_CAPSULES: usize = 64;
/// Most points.
const MOST_POINTS: usize = 64;

/// Checks what `[limits]` says of points and links.
pub(super) fn check(file: &RobotFile, document: &Document) -> Result<(), ConfigError> {
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
    for (key, too_many, most) in [
        ("point", limits.point.len() > MOST_POINTS, MOST_POINTS),
        (
            "capsule",
            limits.capsule.len() > MOST_CAPSULES,
            MOST_CAPSULES,
        ),
    ] {
        if too_many {
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
    if let Some(distance) = limits.distance {
        document.positive(&["limits", "distance"], distance)?;
    }
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
            let links = || {
                let names = robot.tree().links().iter().map(|link| link.name.as_str());
                names.chain([BASE])
            };
            let near = nearest(link, links()).map(|near| format!("did you mean `{near}`? "));
            let remedy = format!(
                "{}the links are {}",
                near.unwrap_or_default(),
                list(links())
            );
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
    let links = limits.touching.iter().flatten();
    for link in links {
        known(&["limits", "touching"], link)?;
    }
    Ok(())
}
