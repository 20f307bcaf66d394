//! `wrong-sign-or-order`: the logged torque of a joint has the other sign, or is that of another joint.
//!
//! `sign=1` turns the sign, `swap` is the number of the joint, counted from one, whose torque channel changes
//! places with this one's.

use super::{BuiltLaw, PlantLaw};
use crate::simulate::SimulateError;
use cft_ident_core::effect::wrong_sign_or_order::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![1.0, 0.0],
    build: |site, machine, values| {
        let (joint, sign, swap) = (site.joint(), values[0], values[1]);
        let refuse = |key, value, rule: &str| SimulateError::number(ENTRY.name, key, value, rule);
        if sign != 0.0 && sign != 1.0 {
            return Err(refuse("sign", sign, "must be 1 (turned) or 0"));
        }
        if swap != 0.0 && machine.other_joint(joint, swap).is_none() {
            let known = machine.joints();
            let rule = format!("must be the number of another joint, 1 to {known}, or 0");
            return Err(refuse("swap", swap, &rule));
        }
        let other = machine.other_joint(joint, swap);
        BuiltLaw::log(false, move |log| {
            if sign == 1.0 {
                for torque in log.torques(joint) {
                    *torque = -*torque;
                }
            }
            if let Some(other) = other {
                for row in log.torque.chunks_exact_mut(log.joints.max(1)) {
                    row.swap(joint, other);
                }
            }
        })
    },
};
