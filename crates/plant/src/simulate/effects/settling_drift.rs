//! `settling-drift`: a torque that approaches `level` from the begin of the log, d(torque)/dt = (level - torque)/T.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::settling_drift::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.2 * site.scale, 10.0],
    build: |site, _, values| {
        let (level, rate) = (values[0], 1.0 / values[1]);
        BuiltLaw::torque(site, move |m| level - level * (-rate * m.t).exp())
    },
};
