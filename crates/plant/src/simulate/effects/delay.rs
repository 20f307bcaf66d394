//! `delay`: the logged torque is late by d (early where d is negative).
//!
//! The motor's torque comes from a zero-order hold. The row k of a late log shows what acted, on the mean, between
//! t_k - d and the same time of the next row: a share of a step is a share of two rows. The plant knows
//! nothing of it; the noise of the torque comes after it.

use super::{BuiltLaw, LoggedChannels, PlantLaw};
use cft_ident_core::effect::delay::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![0.005],
    build: |site, _, values| {
        let (joint, d) = (site.joint(), values[0]);
        BuiltLaw::log(true, move |log| delay(log, joint, d))
    },
};

fn delay(log: &mut LoggedChannels, joint: usize, d: f64) {
    let acting: Vec<f64> = log.torques(joint).map(|x| *x).collect();
    let times = log.t;
    let rows = times.len().min(acting.len());
    if rows < 2 {
        return;
    }
    // Mean of what acted; beyond its ends the torque stays what it is there.
    let mean = |from: f64, to: f64| {
        let mut k = times[..rows].partition_point(|t| *t <= from).max(1) - 1;
        let (mut sum, mut at) = (0.0, from);
        while k + 1 < rows && times[k + 1] < to {
            sum += acting[k] * (times[k + 1] - at);
            at = times[k + 1];
            k += 1;
        }
        (sum + acting[k] * (to - at)) / (to - from)
    };
    for (k, late) in log.torques(joint).take(rows).enumerate() {
        // The last row acts as long as the one before it.
        let one = k.min(rows - 2);
        let from = times[k] - d;
        *late = mean(from, from + (times[one + 1] - times[one]));
    }
}
