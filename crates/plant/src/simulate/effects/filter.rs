//! `filter`: the logged torque or position has passed a first-order lag.
//!
//! dy/dt = 2 pi cutoff (x - y) with the input straight from row to row and the output settled at the first
//! row, solved exactly.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::filter::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![10.0, 1.0],
    build: |site, _, values| {
        let (joint, torque) = (site.joint(), values[1] != 0.0);
        let rate = std::f64::consts::TAU * values[0];
        BuiltLaw::log(false, move |log| {
            let mut before: Option<(f64, f64, f64)> = None;
            for (t, value) in log.channel(joint, torque) {
                let x = *value;
                if let Some((last_t, last_x, last_y)) = before {
                    let turn = rate * (t - last_t);
                    let kept = (-turn).exp();
                    // A ramp is followed at its own slope, late by 1/rate.
                    let lag = (x - last_x) / turn;
                    *value = (x - lag) + (last_y - (last_x - lag)) * kept;
                }
                before = Some((t, x, *value));
            }
        })
    },
};
