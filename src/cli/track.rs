//! `cft-ident track`: the parameters of robots over their logs.

use std::ffi::OsStr;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{CliError, Context, Outcome, arguments, files, outputs};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::stages;
use cft_ident_stages::identify::{
    self, ReducedLogs, RobotSources, TrackSource, Tracked, is_reduced,
};

const EXAMPLE: &str = "\
Example:
  cft-ident track a.cfi b.cfi --report course.html
  cft-ident track a.cfi b.cfi -o course.csv --json course.json";

/// Follow the parameters of robots over their logs: courses, changes, and robots that differ.
///
/// Takes reduced logs, each fitted by itself, or models. A robot's files are in a folder of its own, whose name is
/// the robot's; files of one folder are one robot. Logs are followed in order of their clocks, and where
/// those overlap in the order given.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Reduced logs or model files
    #[arg(required = true, value_name = "PART.cfi|MODEL.toml")]
    pub files: Vec<PathBuf>,
    /// Write the courses: robot, parameter, joint, log, time, estimate, value, each with its deviation
    #[arg(short, long, value_name = "OUT.csv")]
    pub output: Option<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let outputs = outputs::listed(args.output.as_deref(), &[], args.report.as_deref());
    context.check_outputs(args.files.iter().map(PathBuf::as_path), outputs)?;
    let found = identify::track(&robots(args, context)?, &context.control)?;
    let document = JsonDocument::new("track", &found.inputs, &found.notes, &found)?;
    let mut report = stages::track::track(&found);
    stages::track::origin(&mut report.page(), &found, &context.command);
    context.check()?;
    if let Some(path) = &args.output {
        context.write_text(path, &csv(&found))?;
    }
    if let Some(path) = &args.report {
        context.write_text(path, &report.html())?;
    }
    Ok(Outcome::new(report.text_for(context.screen), document))
}

/// The robots: files of one folder are one, in the order in which folders come.
fn robots(args: &Args, context: &Context) -> Result<Vec<RobotSources>, CliError> {
    let mut folders: Vec<PathBuf> = Vec::new();
    let mut robots: Vec<RobotSources> = Vec::new();
    for (number, path) in args.files.iter().enumerate() {
        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
        let place = match folders.iter().position(|known| *known == folder) {
            Some(place) => place,
            None => {
                let name = folder.file_name().map(|name| name.to_string_lossy());
                robots.push(RobotSources {
                    name: name.map_or("robot".to_owned(), |name| name.into_owned()),
                    sources: Vec::new(),
                });
                folders.push(folder);
                folders.len() - 1
            }
        };
        let sources = &mut robots[place].sources;
        let named = |end: &OsStr| end.eq_ignore_ascii_case("cfi");
        if is_reduced(path) || path.extension().is_some_and(named) {
            let file = sources.last().map_or(0, |_| number);
            let logs = ReducedLogs::load(path)?;
            sources.extend(logs.logs().iter().map(|log| TrackSource::Part {
                log: log.clone(),
                file,
            }));
            continue;
        }
        let given = files::model(path, context)?;
        sources.push(TrackSource::Model {
            name: given.name,
            file: Box::new(given.value.file),
            provenance: given.provenance,
        });
    }
    // one robot is no fleet: its folder says nothing of it
    if let [robot] = robots.as_mut_slice() {
        robot.name = "robot".to_owned();
    }
    Ok(robots)
}

/// The courses as text; a field stays empty where nothing is known.
fn csv(found: &Tracked) -> String {
    let mut text = String::from(
        "robot,parameter,joint,unit,log,time_s,estimate,estimate_std,value,value_std\n",
    );
    // a field with a comma or a quote is quoted
    let field = |name: &str| match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    };
    let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:?}"));
    for robot in &found.robots {
        for p in &robot.parameters {
            for (k, log) in robot.logs.iter().enumerate() {
                let _ = writeln!(
                    text,
                    "{},{},{},{},{},{:?},{},{},{},{}",
                    field(&robot.name),
                    field(&p.name),
                    field(p.joint.as_deref().unwrap_or_default()),
                    field(&p.unit),
                    field(log),
                    p.times[k],
                    number(p.estimates[k]),
                    number(p.estimates_std[k]),
                    number(p.values[k]),
                    number(p.std[k]),
                );
            }
        }
    }
    text
}
