//! Mass and centre of what an arm carries, from a model of the empty arm and a log of the loaded one.
//!
//! ```text
//! cft-ident example ur10
//! cft-ident lsq ur10/ur10.csv@0..70% -r ur10/ur10.toml -o empty.toml
//! cargo run --release --example payload -- empty.toml ur10/ur10.csv@70..100%
//! ```
//!
//! This arm carries nothing in either part of its log: give a log of yours with its load.

use std::error::Error;
use std::path::Path;

use cft_ident::config::ModelFile;
use cft_ident::identify::{Control, Dataset, GivenModel, Log, payload};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, log] = &arguments[..] else {
        return Err("give MODEL.toml LOG".into());
    };
    let empty = GivenModel::new(name, ModelFile::load(Path::new(name))?);
    let data = Dataset::read(
        &empty.setup(),
        &[Log::File(log.parse()?)],
        &Control::default(),
    )?;

    let found = payload(&data, &empty, &Control::default())?;
    for reading in &found.readings {
        println!(
            "on {}, gains of the torques {}:",
            found.link,
            match reading.gains_free {
                false => "as the model has them",
                true => "free",
            }
        );
        let names = ["mass", "x", "y", "z"];
        for (name, number) in names
            .iter()
            .zip(std::iter::once(&reading.mass).chain(&reading.centre))
        {
            match (number.value, number.std) {
                (Some(value), Some(std)) => {
                    println!("  {name} = {value:.3} ± {:.3} {}", 1.96 * std, number.unit)
                }
                _ => println!("  {name}: these data do not determine it"),
            }
        }
    }
    Ok(())
}
