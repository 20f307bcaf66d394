//! An MJCF in which inertials, armatures and joint friction are replaced: geoms, meshes, names, actuators and every
//! other byte stay as they are written.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{no_xml, xml};
use crate::config::ConfigError;
use cft_ident_logs::log::{escape, list};

/// What is to stand in a body, by the joint that moves it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MjcfJoint {
    /// `<inertial>` of the body.
    pub inertial: String,
    /// Attributes of the joint with their values.
    pub attributes: Vec<(&'static str, String)>,
    /// Where the body stands in the one around it \[m\].
    pub origin: [f64; 3],
}

/// Numbers of frames that differ by less are one: such files have six digits.
const SIX_DIGITS: f64 = 2e-5;

/// The text of an MJCF with the replacements in it, and lines of a comment at its head; `file` names it in errors.
///
/// # Errors
/// [`ConfigError::Syntax`] where it is no well-formed XML, [`ConfigError::Kind`] where it is no MJCF of this robot.
pub fn replaced_in_mjcf(
    file: &str,
    text: &str,
    joints: &BTreeMap<String, MjcfJoint>,
    notes: &[String],
) -> Result<String, ConfigError> {
    // comments become as many spaces, so that places are those of the text
    let plain = xml::without_comments(text);
    let tree = xml::Tree::parse(&plain).map_err(|wrong| no_xml(file, wrong))?;
    let root = tree.root();
    let other = |found: &'static str, remedy: String| ConfigError::Kind {
        file: file.to_owned(),
        found,
        wanted: "an MJCF of this robot",
        remedy,
    };
    if root.name() != "mujoco" {
        let remedy = "give the file whose root is <mujoco>".to_owned();
        return Err(other("another XML file", remedy));
    }
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    let mut found: Vec<&str> = Vec::new();
    let mut all: Vec<&str> = Vec::new();
    for body in root.descendants().filter(|e| e.name() == "body") {
        for joint in body.children().filter(|e| e.name() == "joint") {
            let name = joint.attribute("name").unwrap_or_default();
            all.push(name);
            let Some(with) = joints.get(name) else {
                continue;
            };
            found.push(name);
            if let Some(place) = body.attribute("pos")
                && let Some(problem) = elsewhere(place, with.origin)
            {
                return Err(other(
                    "an MJCF with other frames",
                    format!(
                        "body of joint {name}: {problem}; identify with a URDF of the same frames"
                    ),
                ));
            }
            match body.child("inertial") {
                Some(old) => edits.push((old.range(), with.inertial.clone())),
                None => {
                    let end = xml::tag_end(&plain, body.range().start);
                    edits.push((end..end, format!("\n{}", with.inertial)));
                }
            }
            let begin = joint.range().start;
            let tag = begin..xml::tag_end(&plain, begin);
            let mut anew = plain[tag.clone()].to_owned();
            for (attribute, value) in &with.attributes {
                anew = with_attribute(&anew, attribute, value);
            }
            edits.push((tag, anew));
        }
    }
    let missing: Vec<&str> = joints.keys().map(String::as_str).collect();
    let missing: Vec<&str> = missing.into_iter().filter(|j| !found.contains(j)).collect();
    if !missing.is_empty() {
        let remedy = format!(
            "it lacks the joints {}; it has {}; name the model's joints as it does by `name` in [log.joint]",
            escape(&list(missing)),
            escape(&list(all))
        );
        return Err(other("an MJCF of another robot", remedy));
    }
    let head = root.range().start;
    let lines = notes.iter().map(|line| line.replace("--", "- -"));
    let comment: String = lines.map(|line| format!("  {line}\n")).collect();
    edits.push((head..head, format!("<!--\n{comment}-->\n")));
    edits.sort_by_key(|(range, _)| range.start);
    let mut out = text.to_owned();
    for (range, anew) in edits.into_iter().rev() {
        out.replace_range(range, &anew);
    }
    Ok(out)
}

/// What is wrong with the place of a body, in words.
fn elsewhere(place: &str, origin: [f64; 3]) -> Option<String> {
    let there: Vec<f64> = place
        .split_whitespace()
        .filter_map(|x| x.parse().ok())
        .collect();
    let off = there.len() != 3
        || there
            .iter()
            .zip(origin)
            .any(|(a, b)| (a - b).abs() > SIX_DIGITS);
    off.then(|| format!("its place is {} m and not {origin:?} m", escape(place)))
}

/// A tag with an attribute set: in the place of the old value, or behind the others.
fn with_attribute(tag: &str, name: &str, value: &str) -> String {
    let old = tag.match_indices(name).find_map(|(at, _)| {
        let begins = tag[..at].ends_with(|c: char| c.is_ascii_whitespace());
        let rest = tag[at + name.len()..].trim_start();
        let rest = rest.strip_prefix('=')?.trim_start();
        let quote = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let length = rest[1..].find(quote)?;
        let start = tag.len() - rest.len() + 1;
        begins.then_some(start..start + length)
    });
    let mut out = tag.to_owned();
    match old {
        Some(range) => out.replace_range(range, value),
        None => {
            let end = out
                .trim_end_matches('>')
                .trim_end_matches('/')
                .trim_end()
                .len();
            out.insert_str(end, &format!(" {name}=\"{value}\""));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joints() -> BTreeMap<String, MjcfJoint> {
        let of = MjcfJoint {
            inertial: "<inertial mass=\"2\"/>".into(),
            attributes: vec![("damping", "3.0".into()), ("armature", "0.5".into())],
            origin: [0.0, 0.0, 0.1],
        };
        BTreeMap::from([("j".to_owned(), of)])
    }

    #[test]
    fn geoms_and_names_stay_and_inertia_and_friction_change() {
        let text = "<mujoco>\n<worldbody>\n<body name=\"a\" pos=\"0 0 0.1\"><!-- kept --><inertial mass=\"9\" pos=\"0 0 0\"/>\n\
                    <joint name=\"j\" damping='1' axis=\"0 0 1\"/><geom type=\"mesh\" mesh=\"m\"/>\n</body></worldbody></mujoco>\n";
        let wanted = "<!--\n  n\n-->\n<mujoco>\n<worldbody>\n<body name=\"a\" pos=\"0 0 0.1\"><!-- kept --><inertial mass=\"2\"/>\n\
                      <joint name=\"j\" damping='3.0' axis=\"0 0 1\" armature=\"0.5\"/><geom type=\"mesh\" mesh=\"m\"/>\n</body></worldbody></mujoco>\n";
        let notes = ["n".to_owned()];
        let got = replaced_in_mjcf("a.xml", text, &joints(), &notes).unwrap();
        assert_eq!(got, wanted);
    }

    #[test]
    fn another_robot_and_other_frames_are_refused() {
        for (text, words) in [
            ("<robot/>", "another XML file"),
            (
                "<mujoco><worldbody><body><joint name=\"k\"/></body></worldbody></mujoco>",
                "lacks the joints j",
            ),
            (
                "<mujoco><worldbody><body pos=\"0 0 0.2\"><joint name=\"j\"/></body></worldbody></mujoco>",
                "its place is 0 0 0.2 m",
            ),
        ] {
            let error = replaced_in_mjcf("a.xml", text, &joints(), &[]).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}
