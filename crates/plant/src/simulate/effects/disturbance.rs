//! `disturbance`: somebody pushes, a torque c from the time `at` on for `seconds`.
//!
//! The torque jumps in time: the step across an edge is refused by the error control until it is so short
//! that the edge does not show.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::disturbance::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![5.0, 0.5, 0.5 * site.scale],
    build: |site, _, values| {
        let (pushed, c) = (values[0]..values[0] + values[1], values[2]);
        BuiltLaw::torque(site, move |m| if pushed.contains(&m.t) { c } else { 0.0 })
    },
};
