//! A URDF in which inertials and joint friction are replaced, and every other byte stays as it is written.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::parts::clean_name;
use super::{no_xml, xml};
use crate::config::ConfigError;

/// The inertial of a link that weighs nothing. PyBullet gives one without inertial a kilogram.
pub const WEIGHTLESS: &str = "<inertial><mass value=\"0\"/><inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial>";

/// What is to stand in a URDF.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct UrdfEdits {
    /// `<inertial>` elements by link.
    pub inertials: BTreeMap<String, String>,
    /// Links whose inertia is in another one: theirs becomes none.
    pub bare: BTreeSet<String>,
    /// `<dynamics>` elements by joint.
    pub dynamics: BTreeMap<String, String>,
    /// Links whose joints follow others, in whose friction theirs is: their `<dynamics>` goes.
    pub following: BTreeSet<String>,
    /// Lines of a comment at the head.
    pub notes: Vec<String>,
}

/// The text of a URDF with the replacement in it; `file` names it in errors.
///
/// # Errors
/// [`ConfigError::Syntax`] where it is no well-formed XML.
pub fn replaced(file: &str, text: &str, with: &UrdfEdits) -> Result<String, ConfigError> {
    // comments become as many spaces, so that places are those of the text
    let plain = xml::without_comments(text);
    let tree = xml::XmlTree::parse(&plain).map_err(|wrong| no_xml(file, wrong))?;
    let root = tree.root();
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    let joints = root.children().filter(|e| e.name() == "joint");
    let fixed = joints.filter(|joint| joint.attribute("type") == Some("fixed"));
    let fixed: BTreeSet<&str> = fixed
        .filter_map(|joint| joint.child("child")?.attribute("link"))
        .collect();
    let weightless = WEIGHTLESS.to_owned();
    for element in root.children() {
        let name = element.attribute("name").unwrap_or_default();
        let bare = with.bare.contains(name)
            || (fixed.contains(name) && element.child("inertial").is_none());
        let (kind, anew) = match element.name() {
            "link" => {
                let anew = with.inertials.get(name);
                ("inertial", anew.or(bare.then_some(&weightless)))
            }
            "joint" => ("dynamics", with.dynamics.get(&*clean_name(name))),
            _ => continue,
        };
        let child = element.child("child").and_then(|e| e.attribute("link"));
        let follows = kind == "dynamics" && child.is_some_and(|link| with.following.contains(link));
        if anew.is_none() && !follows {
            continue;
        }
        let old: Vec<Range<usize>> = element
            .children()
            .filter(|child| child.name() == kind)
            .map(|child| child.range())
            .collect();
        let mut left = anew;
        for range in old {
            edits.push((range, left.take().cloned().unwrap_or_default()));
        }
        if let Some(anew) = left {
            let whole = element.range();
            let end = xml::tag_end(&plain, whole.start);
            edits.push(match plain[..end].ends_with("/>") {
                true => (
                    end - 2..end,
                    format!(">\n    {anew}\n  </{}>", element.name()),
                ),
                false => (end..end, format!("\n    {anew}")),
            });
        }
    }
    let head = root.range().start;
    let lines = with.notes.iter().map(|line| line.replace("--", "- -"));
    let comment: String = lines.map(|line| format!("  {line}\n")).collect();
    edits.push((head..head, format!("<!--\n{comment}-->\n")));
    edits.sort_by_key(|(range, _)| range.start);
    let mut out = text.to_owned();
    for (range, anew) in edits.into_iter().rev() {
        out.replace_range(range, &anew);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_are_fixed_say_that_they_weigh_nothing_and_the_root_says_nothing() {
        let text = "<robot name=\"r\"><link name=\"base\"/><link name=\"a\"><inertial>own</inertial></link><link name=\"tcp\"/>\
                    <joint name=\"f\" type=\"fixed\"><parent link=\"base\"/><child link=\"a\"/></joint>\
                    <joint name=\"g\" type=\"fixed\"><parent link=\"a\"/><child link=\"tcp\"/></joint></robot>";
        let found = replaced("r.urdf", text, &UrdfEdits::default()).unwrap();
        let tcp = format!("<link name=\"tcp\">\n    {WEIGHTLESS}\n  </link>");
        assert!(found.contains(&tcp), "{found}");
        assert!(found.contains("<link name=\"base\"/>") && found.contains("own"));
    }

    #[test]
    fn only_inertials_and_dynamics_change() {
        let text = "<?xml version=\"1.0\"?>\n<robot name=\"r\">\n  <!-- <link name=\"a\"/> kept -->\n  \
                    <link name=\"a\"/>\n  <link name=\"b\"><visual><mesh name='x>y'/></visual><inertial>old</inertial></link>\n  \
                    <link name=\"tool\"><inertial>lumped</inertial></link>\n  \
                    <joint name=\"j\" type=\"revolute\"><dynamics damping=\"9\"/><limit/></joint>\n  \
                    <joint name=\"k\" type=\"revolute\"><child link=\"right\"/><dynamics damping=\"9\"/></joint>\n</robot>\n";
        let with = UrdfEdits {
            inertials: BTreeMap::from([
                ("a", "<inertial>1</inertial>"),
                ("b", "<inertial>2</inertial>"),
            ])
            .into_iter()
            .map(|(k, v)| (k.to_owned(), v.to_owned()))
            .collect(),
            bare: BTreeSet::from(["tool".to_owned()]),
            dynamics: BTreeMap::from([("j".to_owned(), "<dynamics friction=\"3\"/>".to_owned())]),
            following: BTreeSet::from(["right".to_owned()]),
            notes: vec!["a -- b".to_owned()],
        };
        let wanted = "<?xml version=\"1.0\"?>\n<!--\n  a - - b\n-->\n<robot name=\"r\">\n  \
                      <!-- <link name=\"a\"/> kept -->\n  \
                      <link name=\"a\">\n    <inertial>1</inertial>\n  </link>\n  \
                      <link name=\"b\"><visual><mesh name='x>y'/></visual><inertial>2</inertial></link>\n  \
                      <link name=\"tool\">NONE</link>\n  \
                      <joint name=\"j\" type=\"revolute\"><dynamics friction=\"3\"/><limit/></joint>\n  \
                      <joint name=\"k\" type=\"revolute\"><child link=\"right\"/></joint>\n</robot>\n";
        let wanted = wanted.replace("NONE", WEIGHTLESS);
        assert_eq!(replaced("r.urdf", text, &with).unwrap(), wanted);
    }
}
