//! The text of an MJCF with the files that it includes in the places where it includes them.

use std::path::{Path, PathBuf};

use super::urdf::{no_xml, xml};
use crate::config::{ConfigError, text};
use cft_ident_logs::log::{escape, shown};

/// Files in files. Descriptions of robots have two or three levels; half is enough for most, twice only delays the word that
/// a file includes itself.
const DEEPEST: usize = 16;

/// An MJCF as one text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MjcfText {
    pub text: String,
    /// Files that it includes.
    pub included: Vec<PathBuf>,
}

/// Reads an MJCF and what it includes, from its own folder or from that of the file which includes it.
///
/// # Errors
/// [`ConfigError::Read`] and [`ConfigError::Syntax`] of any of them.
pub fn mjcf_text(path: &Path) -> Result<MjcfText, ConfigError> {
    let mut included = Vec::new();
    let folder = path.parent().unwrap_or(Path::new(""));
    let text = flat(path, folder, 0, &mut included)?;
    Ok(MjcfText { text, included })
}

fn flat(
    path: &Path,
    folder: &Path,
    depth: usize,
    included: &mut Vec<PathBuf>,
) -> Result<String, ConfigError> {
    let file = shown(path);
    let whole = text(path)?;
    let plain = xml::without_comments(&whole);
    let tree = xml::XmlTree::parse(&plain).map_err(|wrong| no_xml(&file, wrong))?;
    let includes = tree.root().descendants().filter(|e| e.name() == "include");
    let mut pieces = Vec::new();
    for include in includes {
        let wrong = |problem: &str, remedy: &str| ConfigError::Value {
            file: file.clone(),
            line: include.line(),
            key: "<include>".to_owned(),
            problem: problem.to_owned(),
            remedy: remedy.to_owned(),
        };
        let Some(name) = include.attribute("file") else {
            return Err(wrong("has no file", "add file=\"...\""));
        };
        if depth >= DEEPEST {
            let problem = format!("of {} is the {DEEPEST}th in one another", escape(name));
            return Err(wrong(&problem, "let no file include itself"));
        }
        let beside = path.parent().unwrap_or(Path::new("")).join(name);
        let first = folder.join(name);
        let inner = if first.exists() { first } else { beside };
        let anew = flat(&inner, folder, depth + 1, included)?;
        included.push(inner.clone());
        pieces.push((include.range(), inside(&anew, &shown(&inner))?));
    }
    let mut out = whole.clone();
    for (range, anew) in pieces.into_iter().rev() {
        out.replace_range(range, &anew);
    }
    Ok(out)
}

/// What stands in the root of a text.
fn inside(text: &str, file: &str) -> Result<String, ConfigError> {
    let plain = xml::without_comments(text);
    let tree = xml::XmlTree::parse(&plain).map_err(|wrong| no_xml(file, wrong))?;
    let whole = tree.root().range();
    let begin = xml::tag_end(&plain, whole.start);
    let end = plain[whole.clone()]
        .rfind("</")
        .map_or(begin, |at| whole.start + at);
    Ok(text[begin..end.max(begin)].to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_included_stands_in_its_place_and_a_circle_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        std::fs::create_dir(folder.path().join("parts")).unwrap();
        write(
            "a.xml",
            "<mujoco><!-- <include/> --><include file=\"parts/b.xml\"/><actuator/></mujoco>",
        );
        write(
            "parts/b.xml",
            "<?xml version=\"1.0\"?>\n<mujocoinclude><worldbody/><include file='c.xml'/></mujocoinclude>",
        );
        write("parts/c.xml", "<mujoco>\n<sensor/></mujoco>");
        let found = mjcf_text(&folder.path().join("a.xml")).unwrap();
        assert_eq!(
            found.text,
            "<mujoco><!-- <include/> --><worldbody/>\n<sensor/><actuator/></mujoco>"
        );
        assert_eq!(found.included.len(), 2);
        write(
            "parts/c.xml",
            "<mujoco><include file=\"parts/b.xml\"/></mujoco>",
        );
        let error = mjcf_text(&folder.path().join("a.xml")).unwrap_err();
        assert!(
            error.to_string().contains("let no file include itself"),
            "{error}"
        );
        write(
            "parts/b.xml",
            "<mujoco><include file=\"gone.xml\"/></mujoco>",
        );
        let error = mjcf_text(&folder.path().join("a.xml")).unwrap_err();
        assert!(error.to_string().contains("gone.xml"), "{error}");
    }
}
