//! `cft-ident generate`: schemas, completions and manual pages, for editors, shells and packagers.

pub mod completions;
pub mod man;
pub mod schema;

use super::{CliError, Context, Outcome};

const EXAMPLE: &str = "\
Example:
  cft-ident generate schema robot > robot.schema.json
  cft-ident generate completions bash \\
    > ~/.local/share/bash-completion/completions/cft-ident
  cft-ident generate man ~/.local/share/man/man1";

/// Write schemas of files and documents, completions of a shell, or manual pages.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    #[command(subcommand)]
    pub what: GeneratedText,
}

/// The texts that can be generated.
#[derive(Debug, Clone, clap::Subcommand)]
pub enum GeneratedText {
    Schema(schema::Args),
    Completions(completions::Args),
    Man(man::Args),
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    match &args.what {
        GeneratedText::Schema(args) => schema::run(args),
        GeneratedText::Completions(args) => completions::run(args),
        GeneratedText::Man(args) => man::run(args, context),
    }
}
