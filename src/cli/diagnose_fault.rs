//! A diagnosis that ends with a fault of the data, as it is told.

use serde_json::{Value, json};

use crate::identify::DataFault;

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
