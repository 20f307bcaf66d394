//! A diagnosis that ends with a fault of the data.

use serde_json::{Value, json};

use crate::diagnose::Suspicion;
use crate::identify::LoggedRobot;

/// A fault of the data.
#[derive(Debug, Clone)]
pub struct DataFault {
    pub kind: String,
    pub channel: Option<String>,
    pub effect: String,
    pub remedy: String,
}

/// A torque channel that the model knows otherwise, as a fault.
pub fn wrong_channel(machine: &LoggedRobot, found: Suspicion) -> DataFault {
    let names = machine.robot.joint_names();
    let (joint, effect, remedy) = match found {
        Suspicion::Turned { joint } => (
            joint,
            format!(
                "the torque of {} has the other sign than the model's",
                names[joint]
            ),
            "set `torque_scale` of the joint to its negative in [log], or correct the log",
        ),
        Suspicion::Exchanged { joint, with } => (
            joint,
            format!(
                "the torques of {} and {} have changed places",
                names[joint], names[with]
            ),
            "exchange the two torque columns in [log]",
        ),
    };
    DataFault {
        kind: crate::effect::wrong_sign_or_order::ENTRY.name.to_owned(),
        channel: Some(names[joint].clone()),
        effect,
        remedy: remedy.to_owned(),
    }
}

/// The JSON fields of a command that ends with a fault of the data.
pub fn json(fault: &DataFault) -> Value {
    json!({
        "verdict": "data-fault",
        "steps": [],
        "before": null,
        "after": null,
        "unexplained": [],
        "candidates": [],
        "processing": null,
        "faults": [{
            "kind": fault.kind,
            "channel": fault.channel,
            "effect": fault.effect,
            "remedy": fault.remedy,
        }],
    })
}

/// The same for a person.
pub fn text(fault: &DataFault) -> String {
    format!(
        "The data are at fault ({}): {}.\n  {}\n",
        fault.kind, fault.effect, fault.remedy
    )
}
