//! The folder that `identify` writes into.

use std::path::Path;

use super::{CliError, Context, files};
use cft_ident_files::config::ModelFile;

/// The folder of the results, and the files that are in it.
pub(super) struct StageFolder<'a> {
    path: &'a Path,
    context: &'a Context,
    pub files: Vec<String>,
}

impl<'a> StageFolder<'a> {
    pub fn new(path: &'a Path, context: &'a Context) -> Self {
        Self {
            path,
            context,
            files: Vec::new(),
        }
    }

    pub fn write(&mut self, name: &str, text: &str) -> Result<(), CliError> {
        self.context.write_text(&self.path.join(name), text)?;
        self.files.push(name.to_owned());
        Ok(())
    }

    pub fn write_model(&mut self, name: &str, model: &ModelFile) -> Result<(), CliError> {
        files::write_model(&self.path.join(name), model, self.context)?;
        self.files.push(name.to_owned());
        Ok(())
    }
}
