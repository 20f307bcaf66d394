//! `quantisation`: the logged torque of a joint is rounded to whole steps.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::quantisation::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.1 * site.scale],
    build: |site, _, values| {
        let (joint, step) = (site.joint(), values[0]);
        BuiltLaw::log(false, move |log| {
            for torque in log.torques(joint) {
                *torque = (*torque / step).round() * step;
            }
        })
    },
};
