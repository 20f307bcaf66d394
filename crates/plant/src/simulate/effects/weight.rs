//! `weight`: the moment of a point mass on a lever.

use super::{Built, Effect, PlantLaw, PlantState};
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
        Built::plant(Weight {
            joint: site.joint(),
            moment: values[0].hypot(values[1]),
            level: values[0].atan2(values[1]),
        })
    },
};

#[derive(Debug)]
struct Weight {
    joint: usize,
    /// Mass times gravity times lever [Nm].
    moment: f64,
    /// Where the lever is level [rad].
    level: f64,
}

impl Effect for Weight {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        torque[self.joint] += self.moment * (motion.q[self.joint] - self.level).cos();
    }
}
