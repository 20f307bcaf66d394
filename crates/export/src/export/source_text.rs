//! A file of the user's that a model is written into, and what came of it.

use std::collections::BTreeMap;

use super::error::ExportError;
use super::source_link::SourceLink;

/// A file of the user's that a model is written into.
#[derive(Debug, Clone, Copy)]
pub struct SourceText<'a> {
    /// Its name in errors.
    pub file: &'a str,
    pub text: &'a str,
    /// What the joints of the model are called there, where they are called otherwise.
    pub names: &'a BTreeMap<String, String>,
    /// Its folder as seen from that of the output, where that is another one.
    pub folder: Option<&'a str>,
}

impl SourceText<'_> {
    /// Refuses the file for what is wrong with it.
    pub(super) fn refused(&self, problem: String, remedy: impl Into<String>) -> ExportError {
        ExportError::OtherSource {
            file: self.file.to_owned(),
            problem,
            remedy: remedy.into(),
        }
    }

    /// What a joint of the model is called among the joints that are there.
    pub(super) fn called<'n>(
        &self,
        joint: &str,
        mut there: impl Iterator<Item = &'n str>,
    ) -> String {
        match self.names.get(joint) {
            Some(name) if !there.any(|other| other == joint) => name.clone(),
            _ => joint.to_owned(),
        }
    }
}

/// A model in a file of the user's.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenSource {
    pub text: String,
    /// Names there of the joints of the model.
    pub joints: Vec<String>,
    /// Positions of joints there that the model holds still.
    pub held: BTreeMap<String, f64>,
    /// Where the links of the model stand there; none of one that is not there.
    pub links: Vec<Option<SourceLink>>,
    /// What was done to it, a line each.
    pub notes: Vec<String>,
}
