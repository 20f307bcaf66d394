//! `saturation`: the logged torque of a joint stops at a limit.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::saturation::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![site.scale],
    build: |site, _, values| {
        let (joint, limit) = (site.joint(), values[0]);
        BuiltLaw::log(false, move |log| {
            for torque in log.torques(joint) {
                *torque = torque.clamp(-limit, limit);
            }
        })
    },
};
