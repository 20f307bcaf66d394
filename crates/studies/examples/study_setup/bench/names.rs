//! Twelve ways in which recorders name their columns, and what `new` makes of them.

use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};

use super::fit::Fit;
use super::machines::Machine;
use super::robot_text;
use super::tool::run;

/// A way to name columns: `#` is the joint's number, from `first` on, `@` its name.
#[derive(Debug)]
pub struct Style {
    pub time: &'static str,
    pub position: &'static str,
    pub torque: &'static str,
    pub first: usize,
    pub degrees: bool,
}

const fn style(
    time: &'static str,
    position: &'static str,
    torque: &'static str,
    first: usize,
) -> Style {
    Style {
        time,
        position,
        torque,
        first,
        degrees: false,
    }
}

pub const STYLES: [Style; 12] = [
    style("t", "q_#", "tau_#", 1),
    style("time", "q#", "tau#", 0),
    style("time", "positions_#", "efforts_#", 0),
    style("timestamp", "actual_q_#", "actual_torque_#", 0),
    style("time", "joint_#_position", "joint_#_torque", 1),
    style("Time", "pos#", "torque#", 1),
    Style {
        degrees: true,
        ..style("time", "act_pos_mot_deg_#", "act_torque_abs_nm_#", 1)
    },
    style("time", "@_pos", "@_tau", 1),
    style("t", "@.position", "@.effort", 1),
    style("t", "q[#]", "tau[#]", 0),
    style(
        "Time [s]",
        "Position Joint # [rad]",
        "Torque Joint # [Nm]",
        1,
    ),
    style(
        "__time",
        "/joint_states/@/position",
        "/joint_states/@/effort",
        1,
    ),
];

impl Style {
    fn column(&self, pattern: &str, joint: usize, name: &str) -> String {
        let number = (joint + self.first).to_string();
        pattern.replace('#', &number).replace('@', name)
    }
}

/// Maps a log in this style with `new`, and fits with what it wrote.
pub fn judge(machine: &Machine, clean: &Fit, style: usize, folder: &Path) -> Option<Value> {
    let way = &STYLES[style];
    let started = Instant::now();
    let (_, urdf) = match &machine.urdf {
        Some(urdf) => (machine.robot.clone(), urdf.clone()),
        None => robot_text::with_urdf(&machine.robot, 16)?,
    };
    let mut log = machine.logs[0].clone();
    log.names[0] = way.time.to_owned();
    let mut wanted = Vec::new();
    for (j, joint) in machine.joints.iter().enumerate() {
        let position = way.column(way.position, j, &joint.name);
        let torque = way.column(way.torque, j, &joint.name);
        let to_column = if way.degrees {
            57.295_779_513_082_32
        } else {
            1.0
        };
        let column = log.column_mut(&joint.position);
        column
            .iter_mut()
            .for_each(|q| *q *= joint.in_si() * to_column);
        let to_joint = machine.torque_of_column(j);
        log.column_mut(&joint.torque)
            .iter_mut()
            .for_each(|tau| *tau *= to_joint);
        for name in &mut log.names {
            if *name == joint.position {
                name.clone_from(&position);
            } else if *name == joint.torque {
                name.clone_from(&torque);
            }
        }
        wanted.push((joint.name.clone(), position, torque));
    }
    std::fs::write(folder.join("machine.urdf"), urdf).ok()?;
    log.write(&folder.join("log.csv"), |t| t.to_string());
    let _ = std::fs::remove_file(folder.join("new.toml"));
    let words = [
        "new",
        "new.toml",
        "--urdf",
        "machine.urdf",
        "--log",
        "log.csv",
    ];
    let done = run(folder, &words);
    let text = std::fs::read_to_string(folder.join("new.toml")).unwrap_or_default();
    let robot: toml::Table = toml::from_str(&text).unwrap_or_default();
    let right = wanted.iter().all(|(joint, position, torque)| {
        maps(&robot, joint, position, torque, way.degrees).unwrap_or(false)
    });
    let words = ["lsq", "log.csv", "-r", "new.toml", "-o", "new-model.toml"];
    let fit = run(folder, &words);
    let joints = fit.document["joints"].as_array().map_or(0, Vec::len);
    let fitted = fit.status == 0 && joints == machine.joints.len();
    Some(json!({
        "matters": true,
        "error_unchanged": clean.error(),
        "named": done.status == 0 && (right || text.contains("CHECK IT")),
        "first": right,
        "right_joint": right,
        "fixed": right && fitted,
        "said": if right { String::new() } else { done.message },
        "seconds": started.elapsed().as_secs_f64(),
    }))
}

/// Whether the robot file maps these columns to the joint; a column of the tool's own name needs no
/// line.
fn maps(robot: &toml::Table, joint: &str, position: &str, torque: &str, deg: bool) -> Option<bool> {
    let own = toml::Table::new();
    let channels = robot
        .get("log")?
        .get("joint")
        .and_then(|all| all.get(joint));
    let channels = channels.and_then(toml::Value::as_table).unwrap_or(&own);
    let is = |key: &str, plain: &str, wanted: &str| match channels.get(key) {
        Some(toml::Value::String(name)) => name == wanted,
        Some(_) => false,
        None => format!("{plain}_{joint}") == wanted,
    };
    let unit = channels.get("position_unit").and_then(toml::Value::as_str);
    Some(
        is("position", "q", position)
            && is("torque", "tau", torque)
            && (unit == Some("deg")) == deg,
    )
}
