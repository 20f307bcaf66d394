//! Joints that no log has and that stand still: fixed where they are.

use std::collections::BTreeMap;

use super::UrdfPlace;
use super::parts::{Joint, UrdfJointKind, UrdfParts};
use crate::config::ConfigError;
use cft_ident_core::robot::tree::space::{
    about, add, of_roll_pitch_yaw, product, roll_pitch_yaw, times, turn,
};
use cft_ident_logs::log::{escape, list, nearest};

impl UrdfParts {
    /// Fixes joints at positions \[m or rad\], and those that mimic them.
    ///
    /// # Errors
    /// A name that is no moving joint's, and a position that is no number.
    pub(super) fn hold(
        &mut self,
        held: &BTreeMap<String, f64>,
        place: &UrdfPlace,
    ) -> Result<(), ConfigError> {
        let mut held = held.clone();
        for (name, position) in &held {
            self.check(name, *position, place)?;
        }
        // a joint may mimic one that mimics another
        for _ in 0..self.joints.len() {
            let before = held.len();
            for joint in &self.joints {
                if let Some(mimic) = &joint.mimic
                    && let Some(position) = held.get(&mimic.joint)
                {
                    let own = mimic.multiplier * position + mimic.offset;
                    held.entry(joint.name.clone()).or_insert(own);
                }
            }
            if held.len() == before {
                break;
            }
        }
        for joint in &mut self.joints {
            if let Some(position) = held.get(&joint.name) {
                joint.fix(*position);
            }
        }
        Ok(())
    }

    fn check(&self, name: &str, position: f64, place: &UrdfPlace) -> Result<(), ConfigError> {
        let moves = |joint: &&Joint| joint.kind != UrdfJointKind::Fixed;
        let names = || {
            self.joints
                .iter()
                .filter(moves)
                .map(|joint| joint.name.as_str())
        };
        let what = format!("held {}", escape(name));
        if !names().any(|other| other == name) {
            let near = nearest(name, names());
            let near = near.map(|near| format!("did you mean `{}`? ", escape(near)));
            let remedy = format!("{}it has {}", near.unwrap_or_default(), list(names()));
            return Err(place.wrong(1, &what, "is no moving joint of this URDF", &remedy));
        }
        match position.is_finite() {
            true => Ok(()),
            false => Err(place.wrong(1, &what, "is no position", "give metres or radians")),
        }
    }
}

impl Joint {
    /// Fixes it at a position \[m or rad\].
    fn fix(&mut self, position: f64) {
        let turned = of_roll_pitch_yaw(&self.rpy);
        match self.kind {
            UrdfJointKind::Prismatic => {
                let slid = turn(&turned, &times(position, &self.axis));
                self.xyz = add(&self.xyz, &slid);
            }
            // what is not turned is kept to the last digit
            UrdfJointKind::Revolute | UrdfJointKind::Continuous if position != 0.0 => {
                self.rpy = roll_pitch_yaw(&product(&turned, &about(&self.axis, position)));
            }
            _ => {}
        }
        (self.kind, self.mimic) = (UrdfJointKind::Fixed, None);
    }
}
