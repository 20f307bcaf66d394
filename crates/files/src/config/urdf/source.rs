//! A URDF in which inertials and joint friction are replaced, and every other byte stays as it is written.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::parts::clean_name;
use super::{no_xml, xml};
use crate::config::ConfigError;

/// What is to stand in a URDF.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct UrdfEdits {
    /// `<inertial>` elements by link.
    pub inertials: BTreeMap<String, String>,
    /// Links whose inertia is in another one: theirs goes.
    pub bare: BTreeSet<String>,
    /// `<dynamics>` elements by joint.
    pub dynamics: BTreeMap<String, String>,
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
    let tree = xml::Tree::parse(&plain).map_err(|wrong| no_xml(file, wrong))?;
    let root = tree.root();
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    for element in root.children() {
        let name = element.attribute("name").unwrap_or_default();
        let (kind, anew) = match element.name() {
            "link" => ("inertial", with.inertials.get(name)),
            "joint" => ("dynamics", with.dynamics.get(&*clean_name(name))),
            _ => continue,
        };
        let goes = anew.is_some() || (kind == "inertial" && with.bare.contains(name));
        if !goes {
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
    fn only_inertials_and_dynamics_change() {
        let text = "<?xml version=\"1.0\"?>\n<robot name=\"r\">\n  <!-- <link name=\"a\"/> kept -->\n  \
                    <link name=\"a\"/>\n  <link name=\"b\"><visual><mesh name='x>y'/></visual><inertial>old</inertial></link>\n  \
                    <link name=\"tool\"><inertial>lumped</inertial></link>\n  \
                    <joint name=\"j\" type=\"revolute\"><dynamics damping=\"9\"/><limit/></joint>\n</robot>\n";
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
            notes: vec!["a -- b".to_owned()],
        };
        let wanted = "<?xml version=\"1.0\"?>\n<!--\n  a - - b\n-->\n<robot name=\"r\">\n  \
                      <!-- <link name=\"a\"/> kept -->\n  \
                      <link name=\"a\">\n    <inertial>1</inertial>\n  </link>\n  \
                      <link name=\"b\"><visual><mesh name='x>y'/></visual><inertial>2</inertial></link>\n  \
                      <link name=\"tool\"></link>\n  \
                      <joint name=\"j\" type=\"revolute\"><dynamics friction=\"3\"/><limit/></joint>\n</robot>\n";
        assert_eq!(replaced("r.urdf", text, &with).unwrap(), wanted);
    }
}
