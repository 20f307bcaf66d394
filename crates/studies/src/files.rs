//! Logs, URDFs and robot files as a laboratory would have them, and the truth beside them in a file of its own.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::chain::{Chain, standard};
use crate::drive::Run;
use crate::machine::{Drive, Kind, Machine};
use crate::plant::Bodies;
use crate::space::Matrix;
use crate::study::StudyError;
use crate::uncatalogued::temperature;

pub fn write(path: &Path, text: &str) -> Result<(), StudyError> {
    std::fs::write(path, text).map_err(|source| StudyError::File {
        path: path.to_owned(),
        source,
    })
}

pub fn read(path: &Path) -> Result<String, StudyError> {
    std::fs::read_to_string(path).map_err(|source| StudyError::File {
        path: path.to_owned(),
        source,
    })
}

/// `t,q_<joint>,..,tau_<joint>,..` with nine digits, as data loggers write.
pub fn log_text(machine: &Machine, run: &Run) -> String {
    let n = machine.plant.joints;
    let mut text = String::from("time");
    for kind in ["q", "tau"] {
        for name in &machine.names {
            let _ = write!(text, ",{kind}_{name}");
        }
    }
    for name in machine.names.iter().filter(|_| machine.is_warm()) {
        let _ = write!(text, ",warmth_{name}");
    }
    text.push('\n');
    for (row, t) in run.t.iter().enumerate() {
        let _ = write!(text, "{t:.4}");
        for values in [&run.q[row], &run.tau[row]] {
            for value in &values[..n] {
                let _ = write!(text, ",{value:.8e}");
            }
        }
        for _ in (0..n).filter(|_| machine.is_warm()) {
            let _ = write!(text, ",{:.3}", temperature(*t));
        }
        text.push('\n');
    }
    text
}

/// The robot file that `new` would leave, with its questions answered.
/// A motion as `excite --samples` writes it: t, then positions, speeds and accelerations of the joints.
pub fn read_path(path: &Path, joints: usize) -> Result<crate::path::Path, StudyError> {
    let text = read(path)?;
    let mut of = vec![Vec::new(); joints];
    let mut times = Vec::new();
    for (line, row) in text.lines().enumerate().skip(1) {
        let numbers: Result<Vec<f64>, _> = row.split(',').map(str::parse).collect();
        let numbers = numbers.ok().filter(|n| n.len() == 1 + 3 * joints);
        let Some(x) = numbers else {
            return Err(StudyError::Line {
                path: path.to_owned(),
                line: line + 1,
                message: format!("has no time and three numbers for each of {joints} joints"),
            });
        };
        times.push(x[0]);
        for (j, points) in of.iter_mut().enumerate() {
            points.push((x[1 + j], x[1 + joints + j], x[1 + 2 * joints + j]));
        }
    }
    let step = match times[..] {
        [first, second, ..] => second - first,
        _ => {
            return Err(StudyError::Line {
                path: path.to_owned(),
                line: 1,
                message: "has fewer than two rows".to_owned(),
            });
        }
    };
    Ok(crate::path::Path::of_points(of, step))
}

pub fn robot_text(machine: &Machine, rate_hz: f64, urdf: &str, more: &str) -> String {
    let mut text = String::from("[robot]\n");
    match &machine.chain {
        Some(_) => {
            let _ = write!(text, "model = \"serial\"\nurdf = \"{urdf}\"\n");
        }
        None if machine.kind == Kind::Cft => {
            text.push_str("model = \"cft\"\nsetup = \"tuedacs\"\nparameters = 12\n");
        }
        None => {
            let kind = if machine.slides(0) {
                "prismatic"
            } else {
                "revolute"
            };
            let name = &machine.names[0];
            let _ = write!(
                text,
                "model = \"single-joint\"\njoint = \"{name}\"\nkind = \"{kind}\"\n"
            );
        }
    }
    text.push_str(more);
    text.push_str(
        "\n[friction]\nlaw = \"viscous-coulomb\"\nfitted_with_inertias = true\noffset = true\n\n\
         [log]\ntime = \"time\"\ntorque_is = \"joint\"\ntorque_held = false\n\n[log.joint]\n",
    );
    for name in &machine.names {
        let warm = match machine.is_warm() {
            true => format!(", temperature = \"warmth_{name}\""),
            false => String::new(),
        };
        let _ = writeln!(
            text,
            "{name} = {{ position = \"q_{name}\", torque = \"tau_{name}\"{warm} }}"
        );
    }
    let cutoff = (rate_hz / 12.5).min(20.0);
    let _ = write!(text, "\n[filter]\ncutoff_hz = {cutoff:?}\n");
    let kind = |joint: usize| match machine.drive {
        Drive::Harmonic => "harmonic",
        Drive::BallScrew if machine.slides(joint) => "screw",
        _ if machine.plant.drives[joint].is_some_and(|drive| drive.gap > 0.0) => "geared",
        _ => "direct",
    };
    for (i, name) in machine.names.iter().enumerate() {
        let _ = write!(text, "\n[drive.{name}]\nkind = \"{}\"\n", kind(i));
    }
    text
}

/// The URDF of the drawing: the machine's links are up to 15 % heavier or lighter.
pub fn urdf_text(machine: &Machine) -> Option<String> {
    let Bodies::Chain(chain) = &machine.nominal else {
        return None;
    };
    let mut text = String::from("<robot name=\"arm\">\n<link name=\"base\"/>\n");
    for (i, link) in chain.links.iter().enumerate() {
        let [c, m] = [link.centre, of_rows(&link.inertia)];
        let inertia = &link.inertia;
        let _ = writeln!(
            text,
            "<link name=\"l{}\"><inertial><origin xyz=\"{} {} {}\"/><mass value=\"{}\"/><inertia ixx=\"{}\" \
             iyy=\"{}\" izz=\"{}\" ixy=\"{}\" ixz=\"{}\" iyz=\"{}\"/></inertial></link>",
            i + 1,
            c[0],
            c[1],
            c[2],
            link.mass,
            m[0],
            m[1],
            m[2],
            inertia[0][1],
            inertia[0][2],
            inertia[1][2],
        );
    }
    for (i, (link, range)) in chain.links.iter().zip(&machine.ranges).enumerate() {
        let parent = if i == 0 {
            "base".to_owned()
        } else {
            format!("l{i}")
        };
        let kind = if link.slides { "prismatic" } else { "revolute" };
        let [x, y, z] = link.xyz;
        let [r, p, w] = link.rpy;
        let (low, high) = (
            range.centre - 1.6 * range.half,
            range.centre + 1.6 * range.half,
        );
        let _ = writeln!(
            text,
            "<joint name=\"{}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"l{}\"/><origin \
             xyz=\"{x} {y} {z}\" rpy=\"{r} {p} {w}\"/><axis xyz=\"0 0 1\"/><limit lower=\"{low}\" \
             upper=\"{high}\" effort=\"400\" velocity=\"{}\"/></joint>",
            machine.names[i],
            i + 1,
            2.0 * range.speed,
        );
    }
    text.push_str("</robot>\n");
    Some(text)
}

fn of_rows(m: &Matrix) -> [f64; 3] {
    [m[0][0], m[1][1], m[2][2]]
}

/// What no estimator sees.
pub fn truth(machine: &Machine) -> Value {
    let n = machine.plant.joints;
    let links = machine.chain.as_ref().map(|chain| {
        let of = |link| {
            let pairs = standard(link).map(|(name, value)| (name.to_owned(), json!(value)));
            Value::Object(pairs.into_iter().collect())
        };
        chain.links.iter().map(of).collect::<Vec<_>>()
    });
    json!({
        "kind": machine.kind,
        "drive": machine.drive,
        "inertia": single(machine),
        "theta": theta(machine),
        "links": links,
        "friction": machine.plant.friction,
        "offset": machine.plant.offset[..n],
        "added": machine.plant.added,
    })
}

fn single(machine: &Machine) -> Option<f64> {
    (machine.kind == Kind::Single).then_some(machine.inertia[0])
}

/// The CFT robot's inertial parameters.
pub fn theta(machine: &Machine) -> Option<[f64; 12]> {
    match &machine.plant.bodies {
        Bodies::Cft(cft) => Some(cft.theta),
        _ => None,
    }
}

/// The true value of a parameter of the declared model, by its name or grouping.
pub fn declared(machine: &Machine, name: &str, joint: Option<&str>) -> Option<f64> {
    let at = joint.and_then(|joint| machine.names.iter().position(|n| n == joint));
    match (name, at) {
        ("viscous", Some(i)) => Some(machine.plant.friction[i].viscous),
        ("coulomb", Some(i)) => Some(machine.plant.friction[i].coulomb),
        ("offset", Some(i)) => Some(machine.plant.offset[i]),
        ("inertia" | "mass", _) => single(machine),
        _ => match name.strip_prefix("theta_") {
            Some(number) => {
                let number: usize = number.parse().ok()?;
                theta(machine)?.get(number.checked_sub(1)?).copied()
            }
            None => grouped(machine.chain.as_ref()?, name),
        },
    }
}

/// A model file with the true values in place of the fitted ones, where a parameter has one.
pub fn with_truth(machine: &Machine, model: &str) -> String {
    let parts: Vec<&str> = model.split("[[parameter]]").collect();
    let put = |part: &str| {
        let text_of = |key: &str| {
            let line = part.lines().find_map(|line| line.strip_prefix(key))?;
            line.trim().strip_prefix("= \"")?.strip_suffix('"')
        };
        let truth = text_of("name").and_then(|name| {
            let by = |name| declared(machine, name, text_of("joint"));
            by(name).or_else(|| by(text_of("meaning")?))
        });
        let Some(truth) = truth else {
            return part.to_owned();
        };
        let line = |line: &str| match line.starts_with("value = ") {
            true => format!("value = {truth:?}\n"),
            false => format!("{line}\n"),
        };
        // only the parameter's own lines, up to the next table
        let end = part.find("\n[").unwrap_or(part.len());
        let own: String = part[..end].lines().map(line).collect();
        format!("{own}{}", &part[end..])
    };
    let whole: Vec<String> = parts[..1]
        .iter()
        .map(|part| (*part).to_owned())
        .chain(parts[1..].iter().map(|part| put(part)))
        .collect();
    whole.join("[[parameter]]")
}

/// Value of a base parameter from its grouping, `Izz1 + Iyy2 - 0.09 m3`, with the true links; None where a name is
/// no link's.
pub fn grouped(chain: &Chain, grouping: &str) -> Option<f64> {
    let (mut total, mut sign, mut factor) = (0.0, 1.0, 1.0);
    for word in grouping.split_whitespace() {
        match word {
            "+" => sign = 1.0,
            "-" => sign = -1.0,
            _ => match word.parse::<f64>() {
                Ok(number) => factor = number,
                Err(_) => {
                    total += sign * factor * named(chain, word)?;
                    (sign, factor) = (1.0, 1.0);
                }
            },
        }
    }
    Some(total)
}

fn named(chain: &Chain, word: &str) -> Option<f64> {
    let (sign, word) = word
        .strip_prefix('-')
        .map_or((1.0, word), |rest| (-1.0, rest));
    let digits = word.find(|c: char| c.is_ascii_digit())?;
    let link: usize = word[digits..].parse().ok()?;
    let all = standard(chain.links.get(link.checked_sub(1)?)?);
    let found = all.iter().find(|(name, _)| *name == &word[..digits])?;
    Some(sign * found.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arms;

    #[test]
    fn groupings_are_read_with_signs_and_factors() {
        let chain = arms::arm3();
        let of = |link: usize, name: &str| {
            standard(&chain.links[link])
                .iter()
                .find(|p| p.0 == name)
                .map_or(0.0, |p| p.1)
        };
        let expected = of(0, "Izz") + of(1, "Iyy") - 0.09 * of(2, "m");
        assert_eq!(grouped(&chain, "Izz1 + Iyy2 - 0.09 m3"), Some(expected));
        assert_eq!(grouped(&chain, "-Ia2"), Some(-0.25));
        assert_eq!(grouped(&chain, "Izz9"), None);
    }

    #[test]
    fn a_model_file_takes_the_true_values() {
        let chance = &mut crate::chance::Chance::of("files", 0);
        let law = crate::machine::LawKind::Coulomb;
        let machine = Machine::draw(Kind::Single, Drive::Direct, law, 0.0, chance);
        let text = "[robot]\nvalue = 1.0\n\n[[parameter]]\nname = \"viscous\"\njoint = \"q1\"\nvalue = 2.0\n\n\
                    [covariance]\nvalue = 3.0\n";
        let truth = machine.plant.friction[0].viscous;
        let expected = text.replace("value = 2.0", &format!("value = {truth:?}"));
        assert_eq!(
            with_truth(&machine, text).replace("\n\n", "\n"),
            expected.replace("\n\n", "\n")
        );
    }
}
