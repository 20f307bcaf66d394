//! Joints of a URDF that a log has no columns of and that stand before those it has: a stand, a rail, a torso.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::super::typed;
use super::Args;
use cft_ident_core::robot::JointKind;
use cft_ident_files::config::serial_section::LinkSection;
use cft_ident_files::config::{ChainRequest, ConfigError, UrdfChain};
use cft_ident_logs::log::list;
use cft_ident_logs::mapping::{JointColumns, Mapping, UrdfJoint};

/// Such joints, each at 0.
pub(super) fn before_arm(chain: &UrdfChain, mapping: &Mapping) -> BTreeMap<String, f64> {
    let lacking = |joint: &&JointColumns| joint.position.is_none() && joint.torque.is_none();
    let lacking: BTreeSet<&str> = (mapping.joints.iter().filter(lacking))
        .map(|joint| joint.joint.as_str())
        .collect();
    let mut carrying = BTreeSet::new();
    for link in &chain.links {
        if link
            .joint
            .as_deref()
            .is_none_or(|joint| lacking.contains(joint))
        {
            continue;
        }
        let mut at = Some(link);
        while let Some(link) = at {
            carrying.extend(link.joint.as_deref());
            at = before(chain, link);
        }
    }
    let held = carrying.intersection(&lacking);
    held.map(|joint| ((*joint).to_owned(), 0.0)).collect()
}

/// The moving link that another one hangs on.
fn before<'a>(chain: &'a UrdfChain, link: &'a LinkSection) -> Option<&'a LinkSection> {
    let place = chain
        .links
        .iter()
        .position(|other| std::ptr::eq(other, link))?;
    match &link.parent {
        Some(parent) => (chain.links.iter()).find(|other| other.name.as_ref() == Some(parent)),
        None => chain.links.get(place.checked_sub(1)?),
    }
}

/// What is to be looked at.
pub(super) fn check(held: &BTreeMap<String, f64>) -> Option<String> {
    let names = list(held.keys().map(String::as_str));
    (!held.is_empty()).then(|| {
        format!(
            "{names} has no columns and carries joints that have: `held` in [robot] takes it to stand still at 0; write where it stood, in rad or m"
        )
    })
}

pub(super) fn chain_of(
    urdf: &Path,
    tip: Option<&str>,
    held: &BTreeMap<String, f64>,
) -> Result<UrdfChain, ConfigError> {
    UrdfChain::load(urdf, &ChainRequest::new(tip, held))
}

pub(super) fn has_columns(joint: &JointColumns) -> bool {
    joint.position.is_some() && joint.torque.is_some()
}

/// The command that ends the arm at the last joint that was logged, where the joints up to there are those of the log: a
/// gripper, wheels or a head that were not logged.
pub(super) fn arm_alone(
    chain: &UrdfChain,
    mapping: &Mapping,
    held: &BTreeMap<String, f64>,
    args: &Args,
) -> Option<String> {
    let logged: Vec<&str> = mapping
        .joints
        .iter()
        .filter(|joint| has_columns(joint))
        .map(|joint| joint.joint.as_str())
        .collect();
    let last = *logged
        .last()
        .filter(|_| logged.len() < mapping.joints.len())?;
    let of_last = |link: &&LinkSection| link.joint.as_deref() == Some(last);
    let tip = chain.links.iter().find(of_last)?.name.as_ref()?;
    let (urdf, log) = (args.urdf.as_ref()?, args.log.as_ref()?);
    let arm = chain_of(urdf, Some(tip), held).ok()?;
    let joints: Vec<UrdfJoint> = joints_of(&arm);
    let same = joints.iter().map(|joint| joint.name.as_str()).eq(logged);
    same.then(|| {
        format!(
            "cft-ident new {}-arm --urdf {} --tip {tip} --log {}",
            args.name.display(),
            typed::quoted(&urdf.to_string_lossy()),
            typed::quoted(&log.to_string())
        )
    })
}

pub(super) fn joints_of(chain: &UrdfChain) -> Vec<UrdfJoint> {
    let of = |link: &LinkSection| {
        let name = link.joint.clone()?;
        let limits = chain.limits.iter().find(|(joint, _)| *joint == name);
        Some(UrdfJoint {
            kind: link.kind.unwrap_or(JointKind::Revolute),
            torque: limits.and_then(|(_, limits)| limits.torque),
            position: limits.and_then(|(_, limits)| limits.position),
            name,
        })
    };
    chain.links.iter().filter_map(of).collect()
}
