//! The manual pages, for those who package the tool.

use std::path::PathBuf;

use clap::CommandFactory;
use clap_mangen::Man;
use serde_json::json;

use crate::cli::{CliError, CommandLine, Context, Outcome};
use cft_ident_report::report::json::{JsonDocument, NO_WARNINGS};

/// Write the manual pages, cft-ident.1 and one for each command, into a folder.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Folder, which must be there
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    if !args.folder.is_dir() {
        return Err(
            CliError::output(format!("{} is no folder", args.folder.display()))
                .hint(format!("make it first: mkdir -p {}", args.folder.display())),
        );
    }
    let mut all = CommandLine::command();
    // options of every command are written into each
    all.build();
    let mut pages = vec![("cft-ident".to_owned(), all.clone())];
    for command in all.get_subcommands() {
        let name = format!("cft-ident-{}", command.get_name());
        if command.get_name() != "help" {
            pages.push((name, command.clone()));
        }
    }
    let mut written = Vec::new();
    for (name, command) in pages {
        let mut page = Vec::new();
        let file = format!("{name}.1");
        Man::new(command)
            .title(&name)
            .date("")
            .render(&mut page)
            .map_err(|error| CliError::output(format!("{file}: {error}")))?;
        context.write_text(&args.folder.join(&file), &String::from_utf8_lossy(&page))?;
        written.push(file);
    }
    let text = format!("written: {}\n", written.join(", "));
    let result = json!({"files": written});
    Ok(Outcome::new(
        text,
        JsonDocument::new("generate", &[], &NO_WARNINGS, &result)?,
    ))
}
