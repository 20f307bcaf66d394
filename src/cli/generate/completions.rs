//! Completion of the command line for a shell.

use clap::CommandFactory;
use clap_complete::Shell;
use serde_json::json;

use crate::cli::{CliError, CommandLine, Outcome};
use cft_ident_report::report::json::{JsonDocument, NO_WARNINGS};

/// Write the completion script of a shell to standard output.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Shell
    #[arg(value_name = "SHELL")]
    pub shell: Shell,
}

pub fn run(args: &Args) -> Result<Outcome, CliError> {
    let mut script = Vec::new();
    clap_complete::generate(
        args.shell,
        &mut CommandLine::command(),
        "cft-ident",
        &mut script,
    );
    let text = String::from_utf8_lossy(&script).into_owned();
    let result = json!({"shell": args.shell.to_string(), "script": text});
    let document = JsonDocument::new("generate", &[], &NO_WARNINGS, &result)?;
    Ok(Outcome::new(text, document))
}
