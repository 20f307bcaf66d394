//! A rig's log as BAM (Rhoban, better actuator models) writes it: one JSON object, its head and `entries`.

use serde::Deserialize;

use crate::drive::error::DriveError;
use crate::drive::track::{CommandIs, DriveLoad, DriveLog, JointTrack, PendulumRig};

/// What a person gives where a file does not.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RigGiven {
    /// Mass of the rod [kg].
    pub arm_mass: Option<f64>,
    pub kp: Option<f64>,
    pub kd: Option<f64>,
}

/// More than this off the head and the rows are another supply, or another rate. Half: a supply that sags is one; twice:
/// a wrong cell passes.
const OFF: f64 = 0.05;

/// Spread of the steps of a file that was interpolated. A clock that jitters is that of a raw log.
const EVEN: f64 = 1e-6;

#[derive(Deserialize)]
struct RigFile {
    mass: Option<f64>,
    arm_mass: Option<f64>,
    length: Option<f64>,
    kp: Option<f64>,
    kd: Option<f64>,
    vin: Option<f64>,
    offset: Option<f64>,
    sample_rate: Option<f64>,
    dt: Option<f64>,
    motor: Option<String>,
    trajectory: Option<serde_json::Value>,
    entries: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    timestamp: f64,
    position: f64,
    goal_position: f64,
    #[serde(alias = "volts")]
    input_volts: Option<f64>,
    #[serde(default = "yes")]
    torque_enable: bool,
}

fn yes() -> bool {
    true
}

/// Whether bytes look like such a file.
pub fn is_bam(bytes: &[u8]) -> bool {
    let text = &bytes[..bytes.len().min(4096)];
    let has = |word: &[u8]| text.windows(word.len()).any(|w| w == word);
    text.iter().find(|b| !b.is_ascii_whitespace()) == Some(&b'{')
        && (has(b"\"entries\"") || has(b"\"goal_position\"") || has(b"\"arm_mass\""))
}

/// Reads a file.
pub fn read(name: &str, bytes: &[u8], given: &RigGiven) -> Result<DriveLog, DriveError> {
    let wrong = |what: String, remedy: &str| DriveError::File {
        file: name.to_owned(),
        what,
        remedy: remedy.to_owned(),
    };
    let rig: RigFile = serde_json::from_slice(bytes).map_err(|e| {
        wrong(
            format!("is no JSON of a rig: {e}"),
            "a rig's log is an object with mass, length, kp and entries, each with timestamp, position and goal_position",
        )
    })?;
    if rig.entries.len() < 20 {
        let rows = rig.entries.len();
        return Err(wrong(
            format!("holds {rows} entries"),
            "record at least a second of motion",
        ));
    }
    let kp = given.kp.or(rig.kp).ok_or_else(|| {
        wrong(
            "says no kp".to_owned(),
            "give it: --kp, the gain that the firmware had",
        )
    })?;
    let mut findings = Vec::new();
    let t: Vec<f64> = rig.entries.iter().map(|e| e.timestamp).collect();
    if let Some(k) = (1..t.len()).find(|k| t[*k] <= t[k - 1] || t[*k].is_nan()) {
        return Err(wrong(
            format!(
                "entry {k}: the time does not increase ({} after {})",
                t[k],
                t[k - 1]
            ),
            "sort the entries by time and leave copies out",
        ));
    }
    let finite = |e: &Entry| e.position.is_finite() && e.goal_position.is_finite();
    if let Some(k) = rig.entries.iter().position(|e| !finite(e)) {
        return Err(wrong(
            format!("entry {k}: a position is no number"),
            "leave the entry out",
        ));
    }
    let rows = (t.len() - 1) as f64;
    let step = (t[t.len() - 1] - t[0]) / rows;
    let uneven = (1..t.len())
        .map(|k| (t[k] - t[k - 1] - step).abs())
        .fold(0.0, f64::max);
    for (what, head) in [
        ("sample_rate", rig.sample_rate),
        ("dt", rig.dt.map(|dt| 1.0 / dt)),
    ] {
        if let Some(head) = head.filter(|head| (head * step - 1.0).abs() > OFF) {
            findings.push(format!(
                "the head's {what} says {head:.4} Hz, the rows {:.4} Hz: the rows are taken",
                1.0 / step
            ));
        }
    }
    let volts: Vec<f64> = rig.entries.iter().filter_map(|e| e.input_volts).collect();
    let by_rows = volts.len() == rig.entries.len() && volts.iter().all(|v| *v > 0.0);
    let mut supply = Vec::new();
    if by_rows {
        let usual = super::super::track::median(volts.clone());
        if let Some(vin) = rig.vin.filter(|vin| (vin / usual - 1.0).abs() > OFF) {
            findings.push(format!(
                "the head's vin says {vin} V, the rows {usual:.2} V: the rows are taken"
            ));
        }
        supply = volts;
    } else if let Some(vin) = rig.vin {
        supply = vec![vin; rig.entries.len()];
        findings.push(format!(
            "the rows hold no supply: the head's {vin} V are taken"
        ));
    }
    let arm_mass = given.arm_mass.or(rig.arm_mass);
    let load = match (rig.mass, rig.length) {
        (Some(mass), Some(length)) if mass >= 0.0 && length > 0.0 => {
            if arm_mass.is_none() {
                findings.push(
                    "no mass of the rod is given: 0 kg is taken; weigh it and give --arm-mass"
                        .to_owned(),
                );
            }
            DriveLoad::PendulumRig(PendulumRig {
                mass,
                arm_mass: arm_mass.unwrap_or(0.0),
                length,
            })
        }
        _ => {
            findings.push(
                "mass and length are not given: every torque is a ratio to the inertia".to_owned(),
            );
            DriveLoad::Unknown
        }
    };
    let motion = match &rig.trajectory {
        Some(serde_json::Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
        None => name.to_owned(),
    };
    let kd = given.kd.or(rig.kd).unwrap_or(0.0);
    let fact = |name: &str, value: Option<f64>| value.map(|value| (name.to_owned(), value));
    let facts = [
        fact("kp", Some(kp)),
        fact("kd", Some(kd)),
        fact("mass", rig.mass),
        fact("length", rig.length),
        fact("arm_mass", arm_mass),
        fact("vin", rig.vin),
    ];
    let zero = rig.offset.unwrap_or(0.0);
    let track = JointTrack {
        rests: false,
        joint: rig.motor.unwrap_or_else(|| "servo".to_owned()),
        command: rig.entries.iter().map(|e| e.goal_position - zero).collect(),
        position: rig.entries.iter().map(|e| e.position - zero).collect(),
        supply,
        on: match rig.entries.iter().all(|e| e.torque_enable) {
            true => Vec::new(),
            false => rig.entries.iter().map(|e| e.torque_enable).collect(),
        },
        kp,
        kd,
    };
    Ok(DriveLog {
        number: 0,
        name: name.to_owned(),
        motion,
        facts: facts.into_iter().flatten().collect(),
        t,
        command_is: match uneven < EVEN {
            true => CommandIs::Linear,
            false => CommandIs::Held,
        },
        joints: vec![track],
        load,
        findings,
    })
}
