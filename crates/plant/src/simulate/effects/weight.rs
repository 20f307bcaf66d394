//! `weight`: the moment of a point mass on a lever.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::weight::ENTRY;
use cft_ident_core::explain::ErrorText;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.0, 0.3 * site.scale],
    build: |site, _, values| {
        if !site.turns {
            return Err(site.refuse(
                ENTRY.name,
                ErrorText::new("its lever turns about an axis, and this joint slides")
                    .remedy("use `torque-offset`"),
            ));
        }
        // mass times gravity times lever [Nm], and where the lever is level [rad]
        let (moment, level) = (values[0].hypot(values[1]), values[0].atan2(values[1]));
        BuiltLaw::torque(site, move |m| moment * (m.q - level).cos())
    },
};
