//! `wrong-sign-or-order`: the logged torque of a joint has the other sign, or is that of another joint.
//!
//! `sign=1` turns the sign, `swap` is the number of the joint, counted from one, whose torque channel changes
//! places with this one's.

use super::{Built, Fault, LoggedChannels, PlantLaw};
use crate::simulate::SimulateError;
use cft_ident_core::effect::wrong_sign_or_order::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![1.0, 0.0],
    build: |site, machine, values| {
        let (sign, swap) = (values[0], values[1]);
        let refuse = |key: &str, value: f64, rule: String| SimulateError::EffectNumber {
            effect: ENTRY.name.to_owned(),
            key: key.to_owned(),
            value,
            rule,
        };
        if sign != 0.0 && sign != 1.0 {
            return Err(refuse("sign", sign, "must be 1 (turned) or 0".to_owned()));
        }
        let own = (site.joint() + 1) as f64;
        let known = (1..=machine.joints()).any(|number| number as f64 == swap);
        if swap != 0.0 && (!known || swap == own) {
            let rule = format!(
                "must be the number of another joint, 1 to {}, or 0",
                machine.joints()
            );
            return Err(refuse("swap", swap, rule));
        }
        Built::log(WrongSignOrOrder {
            joint: site.joint(),
            turned: sign == 1.0,
            other: (swap > 0.0).then(|| swap as usize - 1),
        })
    },
};

#[derive(Debug)]
struct WrongSignOrOrder {
    joint: usize,
    turned: bool,
    other: Option<usize>,
}

impl Fault for WrongSignOrOrder {
    fn apply(&self, log: &mut LoggedChannels) {
        if self.turned {
            for torque in log.torques(self.joint) {
                *torque = -*torque;
            }
        }
        if let Some(other) = self.other {
            for row in log.torque.chunks_exact_mut(log.joints.max(1)) {
                row.swap(self.joint, other);
            }
        }
    }
}
