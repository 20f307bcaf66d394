//! `studies STUDY [--tool CFT-IDENT] [--label NAME] [--runs N] [--only TEXT] [--results FOLDER]` makes the runs of a
//! study that are not yet in FOLDER/independent_STUDY.jsonl; `studies tables` writes docs/independent.md anew from all
//! of them. `studies keep STUDY CELL RUN FOLDER` leaves the files of one run.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use cft_ident_studies::study::{Rows, StudyError, into_page};
use cft_ident_studies::tool::Tool;
use cft_ident_studies::{coverage, drive, machine, path};

struct Asked {
    words: Vec<String>,
    tool: PathBuf,
    label: String,
    runs: Option<u64>,
    only: String,
    results: PathBuf,
}

fn asked() -> Result<Asked, String> {
    let mut asked = Asked {
        words: Vec::new(),
        tool: std::env::var_os("CFT_IDENT").map_or_else(|| "cft-ident".into(), PathBuf::from),
        label: "this build".to_owned(),
        runs: None,
        only: String::new(),
        results: "docs/results".into(),
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
            "--runs" => asked.runs = Some(value.parse().map_err(|_| format!("--runs {value}: no number"))?),
            "--only" => asked.only = value,
            "--results" => asked.results = value.into(),
            _ => return Err(format!("{word}: no option; there are --tool, --label, --runs, --only, --results")),
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
    let path = asked.tool.canonicalize().unwrap_or_else(|_| asked.tool.clone());
    let tool = Tool {
        path,
        label: asked.label.clone(),
    };
    match asked.words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["coverage"] => {
            let mut rows = Rows::open(&asked.results, "independent_coverage")?;
            for cell in coverage::cells() {
                let name = cell.name();
                if !name.contains(&asked.only) {
                    continue;
                }
                for number in 0..asked.runs.unwrap_or(cell.usual_runs()) {
                    rows.once(&tool, &name, number, |folder| cell.run(&tool, folder, number))?;
                }
                eprintln!("{name}: done");
            }
            Ok(())
        }
        ["tables"] => tables(&asked.results),
        ["cells"] => {
            for cell in coverage::cells() {
                println!("{}", cell.name());
            }
            Ok(())
        }
        ["speed"] => {
            speed();
            Ok(())
        }
        _ => {
            eprintln!("usage: studies coverage|tables|cells|speed [--tool CFT-IDENT] [--label NAME] [--runs N] [--only TEXT] [--results FOLDER]");
            Ok(())
        }
    }
}

fn tables(results: &Path) -> Result<(), StudyError> {
    let page = results.join("../independent.md");
    let rows = Rows::open(results, "independent_coverage")?;
    into_page(&page, "coverage", &coverage::table(&rows))
}

/// How long the plants take for 20 s of motion.
fn speed() {
    for kind in machine::KINDS {
        for at in [machine::Drive::Direct, machine::Drive::Harmonic] {
            let mut chance = cft_ident_studies::chance::Chance::of("speed", 0);
            let drawn = machine::Machine::draw(kind, at, machine::LawKind::Coulomb, 0.0, &mut chance);
            let motion = path::Path::new(path::Motion::FastSines, &drawn.ranges, 20.0, &mut chance);
            let begin = std::time::Instant::now();
            let course = drive::Course::of(&drawn, &motion, drive::Controller::Pd, 65_536.0);
            let seconds = begin.elapsed().as_secs_f64();
            println!("{kind:?} {at:?}: {seconds:.3} s at {} steps a second", course.steps_per_second());
        }
    }
}
