//! `studies coverage|clean|planted|kinds|formula|nulls|rotations|setup|next|payload [--tool CFT-IDENT] [--label NAME] [--runs N] [--only TEXT] [--results FOLDER]`
//! makes the runs of a study that are not yet in FOLDER/independent_STUDY.jsonl: a study goes on where it was stopped.
//! `--keep FOLDER` records nothing and leaves the files of the last run there. `studies tables` writes the tables of
//! docs/results/independent.md anew from all runs; `studies speed` says how long the plants take.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use cft_ident_studies::study::{Rows, StudyError};
use cft_ident_studies::tool::Tool;
use cft_ident_studies::{
    clean, coverage, drive, files, formula, kinds, machine, next_motion, nulls, page, path,
    payload, planted, rotations, setup,
};
use serde_json::Value;

struct Asked {
    words: Vec<String>,
    tool: PathBuf,
    label: String,
    runs: Option<u64>,
    only: String,
    results: PathBuf,
    keep: Option<PathBuf>,
}

fn asked() -> Result<Asked, String> {
    let mut asked = Asked {
        words: Vec::new(),
        tool: std::env::var_os("CFT_IDENT").map_or_else(|| "cft-ident".into(), PathBuf::from),
        label: "this build".to_owned(),
        runs: None,
        only: String::new(),
        results: "docs/results".into(),
        keep: None,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(word) = arguments.next() {
        if !word.starts_with("--") {
            asked.words.push(word);
            continue;
        }
        let value = arguments.next().ok_or(format!("{word} needs a value"))?;
        match word.as_str() {
            "--tool" => asked.tool = value.into(),
            "--label" => asked.label = value,
            "--runs" => {
                asked.runs = Some(
                    value
                        .parse()
                        .map_err(|_| format!("--runs {value}: no number"))?,
                )
            }
            "--only" => asked.only = value,
            "--results" => asked.results = value.into(),
            "--keep" => asked.keep = Some(value.into()),
            _ => {
                return Err(format!(
                    "{word}: no option; there are --tool, --label, --runs, --only, --results, --keep"
                ));
            }
        }
    }
    Ok(asked)
}

fn main() -> ExitCode {
    let done = asked().and_then(|asked| run(&asked).map_err(|error| error.to_string()));
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("studies: {message}");
            ExitCode::from(2)
        }
    }
}

fn run(asked: &Asked) -> Result<(), StudyError> {
    let path = asked
        .tool
        .canonicalize()
        .unwrap_or_else(|_| asked.tool.clone());
    let tool = Tool {
        path,
        label: asked.label.clone(),
    };
    match asked.words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["coverage"] => {
            let cells = coverage::cells();
            let named = cells
                .iter()
                .map(|cell| (cell.name(), cell, cell.usual_runs()));
            all(asked, &tool, "coverage", named, |cell, folder, k| {
                cell.run(&tool, folder, k)
            })
        }
        ["clean"] => {
            let cells = clean::cells();
            let named = cells
                .iter()
                .map(|cell| (cell.name(), cell, clean::USUAL_RUNS));
            all(asked, &tool, "clean", named, |cell, folder, k| {
                cell.run(&tool, folder, k)
            })
        }
        ["planted"] => {
            let members = planted::members();
            let of = |m| planted::SIZES.map(|size| (m, size));
            let cells: Vec<_> = members.iter().flat_map(of).collect();
            let named = cells
                .iter()
                .map(|c| (c.0.cell(c.1), c, planted::USUAL_RUNS));
            all(asked, &tool, "planted", named, |c, folder, k| {
                c.0.run(&tool, folder, c.1, k)
            })
        }
        ["kinds"] => {
            let cells = kinds::cells();
            let named = cells
                .iter()
                .map(|cell| (cell.name(), cell, kinds::USUAL_RUNS));
            all(asked, &tool, "kinds", named, |cell, folder, k| {
                cell.run(&tool, folder, k)
            })
        }
        ["formula"] => {
            let cells: Vec<_> = formula::subjects()
                .into_iter()
                .flat_map(|s| s.cells())
                .collect();
            let named = cells
                .iter()
                .map(|c| (c.0.cell(c.1), c, formula::USUAL_RUNS));
            all(asked, &tool, "formula", named, |c, folder, k| {
                c.0.run(&tool, folder, c.1, k)
            })
        }
        ["setup"] => {
            let cells = setup::cells();
            let named = cells
                .iter()
                .map(|cell| (cell.name().to_owned(), cell, setup::USUAL_RUNS));
            all(asked, &tool, "setup", named, |cell, folder, k| {
                cell.run(&tool, folder, k)
            })
        }
        ["next"] => {
            let cells = next_motion::cells();
            let named = cells
                .iter()
                .map(|cell| (cell.name(), cell, next_motion::USUAL_RUNS));
            all(asked, &tool, "next", named, |cell, folder, k| {
                cell.run(&tool, folder, k)
            })
        }
        ["rotations"] => {
            let cells = rotations::cells();
            let named = cells.iter().map(|cell| (cell.name(), cell, 1));
            all(asked, &tool, "rotations", named, |cell, folder, _| {
                cell.run(&tool, folder)
            })
        }
        ["nulls"] => {
            let cells = nulls::cells();
            let named = cells
                .iter()
                .map(|cell| (cell.name(), cell, nulls::USUAL_RUNS));
            all(asked, &tool, "nulls", named, |cell, folder, k| {
                cell.run(&tool, folder, k)
            })
        }
        ["payload"] => {
            let cells = payload::cells();
            let named = cells
                .iter()
                .map(|cell| (cell.name(), cell, payload::USUAL_RUNS));
            all(asked, &tool, "payload", named, |cell, folder, k| {
                cell.run(&tool, folder, k)
            })
        }
        ["tables"] => tables(&asked.results),
        ["speed"] => {
            speed();
            Ok(())
        }
        _ => {
            eprintln!(
                "usage: studies coverage|clean|planted|kinds|formula|nulls|rotations|setup|next|payload|tables|speed [--tool CFT-IDENT] [--label NAME] [--runs N] [--only TEXT] [--results FOLDER]"
            );
            Ok(())
        }
    }
}

/// Makes what is not there yet of one study.
fn all<'a, C: 'a>(
    asked: &Asked,
    tool: &Tool,
    study: &str,
    cells: impl Iterator<Item = (String, &'a C, u64)>,
    one: impl Fn(&C, &Path, u64) -> Result<Value, StudyError>,
) -> Result<(), StudyError> {
    let mut rows = Rows::open(&asked.results, &format!("independent_{study}"))?;
    for (name, cell, usual) in cells.filter(|cell| cell.0.contains(&asked.only)) {
        let begin = std::time::Instant::now();
        for number in 0..asked.runs.unwrap_or(usual) {
            if let Some(keep) = &asked.keep {
                std::fs::create_dir_all(keep).map_err(|source| StudyError::File {
                    path: keep.clone(),
                    source,
                })?;
                println!("{}", one(cell, keep, number)?);
            } else {
                rows.once(tool, &name, number, |folder| one(cell, folder, number))?;
            }
        }
        eprintln!("{name}: done in {:.0} s", begin.elapsed().as_secs_f64());
    }
    Ok(())
}

fn tables(results: &Path) -> Result<(), StudyError> {
    let page = results.join("independent.md");
    files::write(&page, &page::rendered(&page, results)?)
}

/// How long the plants take for 20 s of motion.
fn speed() {
    for kind in machine::KINDS {
        for at in [machine::Drive::Direct, machine::Drive::Harmonic] {
            let mut chance = cft_ident_studies::chance::Chance::of("speed", 0);
            let drawn =
                machine::Machine::draw(kind, at, machine::LawKind::Coulomb, 0.0, &mut chance);
            let motion = path::Path::new(path::Motion::FastSines, &drawn.ranges, 20.0, &mut chance);
            let begin = std::time::Instant::now();
            let course = drive::Course::of(&drawn, &motion, drive::Controller::Pd, 65_536.0);
            let seconds = begin.elapsed().as_secs_f64();
            println!(
                "{kind:?} {at:?}: {seconds:.3} s at {} steps a second",
                course.steps_per_second()
            );
        }
    }
}
