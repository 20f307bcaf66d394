//! `stuck-channel`: a channel shows its last value from the time `at` on for `seconds`.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::stuck_channel::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![5.0, 1.0, 1.0],
    build: |site, _, values| {
        let (joint, torque) = (site.joint(), values[2] != 0.0);
        let stuck = values[0]..values[0] + values[1];
        BuiltLaw::log(false, move |log| {
            let mut last = None;
            for (t, value) in log.channel(joint, torque) {
                match last {
                    Some(last) if stuck.contains(&t) => *value = last,
                    _ => last = Some(*value),
                }
            }
        })
    },
};
