//! Writes the tables of README.md and docs anew from the results in docs/results:
//! `cargo run -p cft-ident-studies --example docs_tables`. With `--check` it writes nothing and fails where one differs.
//!
//! A table stands between `<!-- table: KIND FILE... -->` and `<!-- end of table -->`; the kinds are
//! in `tables.rs`, figures of results in `figures.rs`. The results are made by `docs/generate`, or by the command that they name.

mod arms;
mod blocks;
mod drives;
mod figures;
mod formulas;
mod simulators;
mod tables;

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let root = Path::new(cft_ident_support::ROOT);
    let check = std::env::args().any(|word| word == "--check");
    let mut failed = false;
    for path in blocks::documents(root) {
        let shown = path.strip_prefix(root).unwrap_or(&path).display();
        let done = std::fs::read_to_string(&path)
            .map_err(|error| error.to_string())
            .and_then(|old| Ok((blocks::rewritten(&old, &tables::render)?, old)))
            .and_then(|(new, old)| match (new == old, check) {
                (true, _) => Ok("is up to date"),
                (false, true) => Err("differs from docs/results".to_owned()),
                (false, false) => std::fs::write(&path, new)
                    .map(|()| "is written anew")
                    .map_err(|error| error.to_string()),
            });
        match done {
            Ok(what) => println!("{shown} {what}"),
            Err(problem) => {
                eprintln!("{shown}: {problem}");
                failed = true;
            }
        }
    }
    for (name, svg) in figures::all(root) {
        let path = root.join("docs/figures").join(name);
        let same = std::fs::read_to_string(&path).is_ok_and(|old| old == svg);
        if !same && (check || std::fs::write(&path, svg).is_err()) {
            eprintln!("docs/figures/{name}: differs from docs/results, or cannot be written");
            failed = true;
        }
    }
    ExitCode::from(u8::from(failed))
}
