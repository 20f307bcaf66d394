//! `filter`: the logged torque or position has passed a first-order lag.
//!
//! dy/dt = 2 pi cutoff (x - y) with the input straight from row to row and the output settled at the first
//! row, solved exactly.

use super::{Built, Fault, Key, Kind, Log, Places, Unit};
use crate::simulate::SimulateError;

pub const KIND: Kind = Kind {
    name: "filter",
    family: "data",
    places: Places::Joints,
    keys: &[
        Key::shape("cutoff", Unit::Fixed("Hz"), |_| 10.0),
        // 1 the torque, 0 the position.
        Key::shape("torque", Unit::Fixed("1"), |_| 1.0),
    ],
    build: |site, _, values| {
        if values[0] <= 0.0 {
            return Err(SimulateError::EffectNumber {
                effect: KIND.name.to_owned(),
                key: "cutoff".to_owned(),
                value: values[0],
                rule: "must be above 0 Hz".to_owned(),
            });
        }
        Built::log(Filter {
            joint: site.joint(),
            rate: std::f64::consts::TAU * values[0],
            torque: values[1] != 0.0,
        })
    },
};

#[derive(Debug)]
struct Filter {
    joint: usize,
    /// 1/s.
    rate: f64,
    torque: bool,
}

impl Fault for Filter {
    fn apply(&self, log: &mut Log) {
        let mut before: Option<(f64, f64, f64)> = None;
        for (t, value) in log.channel(self.joint, self.torque) {
            let x = *value;
            if let Some((last_t, last_x, last_y)) = before {
                let turn = self.rate * (t - last_t);
                let kept = (-turn).exp();
                // A ramp is followed at its own slope, late by 1/rate.
                let lag = (x - last_x) / turn;
                *value = (x - lag) + (last_y - (last_x - lag)) * kept;
            }
            before = Some((t, x, *value));
        }
    }
}
