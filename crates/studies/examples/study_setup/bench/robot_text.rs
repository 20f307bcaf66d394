//! Changes of a robot file, and a URDF from the links of one.

use std::fmt::Write as _;

use toml::{Table, Value};

/// Names of the joints of a serial robot's links.
pub fn joint_names(robot: &Table) -> Vec<String> {
    let named = |link: &Value| Some(link.get("joint")?.as_str()?.to_owned());
    links(robot).iter().filter_map(named).collect()
}

fn links(robot: &Table) -> &[Value] {
    let links = robot["robot"].get("link").and_then(Value::as_array);
    links.map_or(&[], Vec::as_slice)
}

/// A table below another one, made where it is absent.
pub fn below<'a>(table: &'a mut Table, name: &str) -> &'a mut Table {
    let entry = table
        .entry(name)
        .or_insert_with(|| Value::Table(Table::new()));
    entry.as_table_mut().expect("a table")
}

/// Takes the columns of velocities out: the logs of the bench have none.
pub fn forget_velocities(robot: &mut Table) {
    for (_, channels) in below(below(robot, "log"), "joint") {
        if let Some(channels) = channels.as_table_mut() {
            channels.remove("velocity");
        }
    }
}

/// Declares another direction of gravity.
pub fn declare_gravity(robot: &mut Table, gravity: [f64; 3]) {
    let vector = gravity.map(Value::Float).to_vec();
    below(robot, "robot").insert("gravity".to_owned(), Value::Array(vector));
}

/// Declares the torque channels as currents without saying what an ampere is.
pub fn declare_currents(robot: &mut Table, joints: &[super::machines::Joint]) {
    let log = below(robot, "log");
    log.insert("torque_is".to_owned(), "current".into());
    for joint in joints {
        let channels = below(below(log, "joint"), &joint.name);
        channels.remove("torque_scale");
        channels.insert("position".to_owned(), joint.position.clone().into());
        channels.insert("torque".to_owned(), joint.torque.clone().into());
        channels.insert("torque_unit".to_owned(), "A".into());
    }
}

/// An angle as it is written with so many decimals.
fn rounded(angle: f64, decimals: i32) -> f64 {
    let size = 10f64.powi(decimals);
    (angle * size).round() / size
}

/// Writes the angles of all links with so many decimals; false where that changes nothing.
pub fn round_angles(robot: &mut Table, decimals: i32) -> bool {
    let mut changed = false;
    let section = below(robot, "robot");
    let Some(links) = section.get_mut("link").and_then(Value::as_array_mut) else {
        return false;
    };
    let mut round = |value: &mut Value| {
        if let Value::Float(angle) = value {
            let new = rounded(*angle, decimals);
            changed |= new != *angle;
            *angle = new;
        }
    };
    for link in links {
        for key in ["alpha", "theta"] {
            if let Some(value) = link.get_mut(key) {
                round(value);
            }
        }
        if let Some(rpy) = link.get_mut("rpy").and_then(Value::as_array_mut) {
            rpy.iter_mut().for_each(&mut round);
        }
    }
    changed
}

/// The links of a robot file as a URDF whose angles have so many decimals, and the robot file that
/// names it; nothing where it has no links of its own.
pub fn with_urdf(robot: &Table, decimals: usize) -> Option<(Table, String)> {
    if links(robot).is_empty() {
        return None;
    }
    let mut urdf = "<robot name=\"machine\">\n  <link name=\"base_link\"/>\n".to_owned();
    let mut parent = "base_link".to_owned();
    for (n, link) in links(robot).iter().enumerate() {
        let joint = link.get("joint")?.as_str()?;
        let (xyz, rpy, axis) = placement(link);
        let child = format!("part_{}", n + 1);
        let lengths = xyz.map(|x| format!("{x}")).join(" ");
        let angles = rpy.map(|x| format!("{x:.decimals$}")).join(" ");
        let axis = axis.map(|x| format!("{x}")).join(" ");
        let _ = write!(
            urdf,
            "  <link name=\"{child}\"/>\n  <joint name=\"{joint}\" type=\"revolute\">\n    \
             <parent link=\"{parent}\"/><child link=\"{child}\"/>\n    \
             <origin xyz=\"{lengths}\" rpy=\"{angles}\"/><axis xyz=\"{axis}\"/>\n    \
             <limit lower=\"-100\" upper=\"100\" effort=\"1e6\" velocity=\"1000\"/>\n  </joint>\n"
        );
        parent = child;
    }
    urdf += "</robot>\n";
    let mut robot = robot.clone();
    let section = below(&mut robot, "robot");
    section.remove("link");
    section.insert("urdf".to_owned(), "machine.urdf".into());
    Some((robot, urdf))
}

/// Origin and axis of a link as URDF has them; a row of modified Denavit-Hartenberg parameters turns
/// about x first.
fn placement(link: &Value) -> ([f64; 3], [f64; 3], [f64; 3]) {
    let number = |key: &str| link.get(key).and_then(Value::as_float).unwrap_or(0.0);
    let vector = |key: &str| {
        let values = link.get(key)?.as_array()?;
        Some([0, 1, 2].map(|i| values[i].as_float().unwrap_or(0.0)))
    };
    let axis = vector("axis").unwrap_or([0.0, 0.0, 1.0]);
    if vector("xyz").is_some() || vector("rpy").is_some() {
        let none = [0.0; 3];
        return (
            vector("xyz").unwrap_or(none),
            vector("rpy").unwrap_or(none),
            axis,
        );
    }
    let (a, alpha, d) = (number("a"), number("alpha"), number("d"));
    assert_eq!(
        number("theta"),
        0.0,
        "roll, pitch and yaw of such a row are not written here"
    );
    let (sin, cos) = alpha.sin_cos();
    ([a, -d * sin, d * cos], [alpha, 0.0, 0.0], axis)
}

/// Kinds of findings about rows that the tool acts upon unless it is told to keep the rows.
const KEPT: [&str; 9] = [
    "spike",
    "stuck-channel",
    "saturation",
    "clipping",
    "repeated-rows",
    "sample-and-hold",
    "position-step",
    "wrapped-encoder",
    "stall",
];

/// Says that no row is to be left out or mended.
pub fn keep_every_row(robot: &mut Table) {
    let kinds = KEPT.iter().map(|kind| Value::from(*kind)).collect();
    below(robot, "log").insert("keep".to_owned(), Value::Array(kinds));
}
