//! `cft-ident convert`: a log in another form, every number as it was.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::{CliError, Context, Outcome, arguments, columns, columns_of, names_of, paths_of};
use cft_ident_core::number;
use cft_ident_logs::log::{
    Block, Instant, JointTemperatures, Layout, LogSection, LogSpec, Provenance, RawBlock,
    RawReader, Reader, escape,
};
use cft_ident_logs::mapping::ClockColumn;
use cft_ident_logs::output::{LogForm, LogWriter};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_stages::identify::{RobotSetup, repeated_files};

const EXAMPLE: &str = "\
Example:
  cft-ident convert unseen.csv unseen.mcap
  cft-ident convert unseen.csv joints.csv.zst -r configs/cft.toml
  cft-ident convert bag_0.mcap bag_1.mcap run.csv.gz
  cft-ident convert unseen.csv unseen.parquet";

/// Write logs in another form: CSV or MCAP, each also compressed with gzip or zstd, or Parquet.
///
/// Numbers stay as they are, to the last bit; time becomes seconds. In MCAP the columns q_, dq_ and
/// tau_ of the joints are sensor_msgs/msg/JointState on /joint_states; others are on topics of their
/// own. In Parquet each is a column, times of dates are stamps in nanoseconds. Several logs become one, in the order of time. With a robot file the channels that it names
/// are written, as joint positions and torques in SI units.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs, in the order of time; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "IN")]
    pub logs: Vec<LogSpec>,
    /// Log to write: .csv or .mcap, and .gz or .zst after it; or .parquet
    #[arg(value_name = "OUT", value_parser = arguments::log_file)]
    pub output: PathBuf,
    /// Robot file, or a built-in one such as configs/cft.toml: write its joint channels
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: Option<String>,
    /// Topic to write, where a recording holds the joint states of several machines
    #[arg(
        hide_short_help = true,
        long,
        value_name = "NAME",
        conflicts_with = "robot"
    )]
    pub topic: Option<String>,
    /// Leave out rows without a time, or with more or fewer fields than the header names, and go on
    #[arg(hide_short_help = true, long)]
    pub drop_rows: bool,
}

/// A log that was converted.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Converted")]
pub struct ConvertedLog {
    /// Names of the columns, the time first.
    columns: Vec<String>,
    /// Rows.
    samples: u64,
    /// Durations of the logs together \[s\].
    duration_s: f64,
    /// Name of the log that was written.
    file: Option<String>,
}

struct Target<'a> {
    path: &'a Path,
    writer: Option<LogWriter>,
    columns: Vec<String>,
    origin: Instant,
    last: f64,
    rows: u64,
    without_time: u64,
}

impl Target<'_> {
    /// Begins the log, or goes on with it where it has the same columns.
    fn begin(&mut self, spec: &LogSpec, columns: Vec<String>) -> Result<(), CliError> {
        let log = escape(&spec.name());
        for (index, name) in columns.iter().enumerate() {
            if columns[..index].contains(name) {
                let text = format!("{log}: two columns are called `{}`", escape(name));
                return Err(CliError::input(text)
                    .hint("rename one of them: what is converted is found again by its name"));
            }
        }
        if self.writer.is_none() {
            self.writer = Some(LogWriter::create(self.path, &columns)?);
            self.columns = columns;
        } else if self.columns != columns {
            let text = format!("{log}: its columns are not those of the logs before it");
            return Err(CliError::input(text).hint("convert it by itself"));
        }
        Ok(())
    }

    /// Appends a row whose time is counted from `origin`.
    fn row(
        &mut self,
        (spec, first): (&LogSpec, bool),
        (origin, t): (Instant, f64),
        values: impl Iterator<Item = f64>,
    ) -> Result<(), CliError> {
        let Some(writer) = &mut self.writer else {
            return Ok(());
        };
        if !t.is_finite() {
            self.without_time += 1;
            return Ok(());
        }
        if self.rows == 0 {
            self.origin = origin;
            writer.set_origin(origin);
        }
        let t = match origin == self.origin {
            true => t,
            false => origin.later(t).since(self.origin),
        };
        if first && self.rows > 0 && t <= self.last {
            let (log, end) = (escape(&spec.name()), self.last);
            let text =
                format!("{log}: it begins at {t} s, before the log ahead of it ends at {end} s");
            return Err(CliError::input(text)
                .hint("give the logs in the order of time, or convert them one by one"));
        }
        self.last = t;
        self.rows += 1;
        writer.row(std::iter::once(t).chain(values))?;
        Ok(())
    }
}

fn as_it_stands(
    spec: &LogSpec,
    args: &Args,
    target: &mut Target<'_>,
    warnings: &mut Vec<String>,
    context: &Context,
) -> Result<Provenance, CliError> {
    let section = LogSection {
        topic: args.topic.clone(),
        ..LogSection::default()
    };
    let mut log = RawReader::open_plain(spec, &section)?;
    let name = escape(&spec.name());
    let (time, seconds) = match log.is_recording() {
        true => (0, 1.0),
        false => {
            let time = ClockColumn::find(&mut log)?;
            (time.place, time.seconds)
        }
    };
    log.set_time(time, seconds);
    let others: Vec<usize> = (0..log.names().len()).filter(|k| *k != time).collect();
    let named = others.iter().map(|column| log.names()[*column].clone());
    target.begin(spec, std::iter::once("t".to_owned()).chain(named).collect())?;
    let mut block = RawBlock::default();
    let mut first = true;
    while log.read(&mut block)? {
        context.check()?;
        for (k, t) in block.t.iter().enumerate() {
            let values = others.iter().map(|column| block.columns[*column][k]);
            target.row((spec, first), (log.origin(), *t), values)?;
            first = false;
        }
    }
    let lost = log.malformed();
    let fields = "more or fewer fields than the header names";
    if lost > 0 && args.drop_rows {
        warnings.push(format!("{name}: {lost} rows with {fields} are left out"));
    } else if lost > 0 {
        return Err(
            CliError::input(format!("{name}: {lost} rows have {fields}"))
                .hint("complete or delete these rows; write decimal points, not commas")
                .hint("or leave them out: --drop-rows"),
        );
    }
    warnings.extend(log.warnings().iter().map(|text| format!("{name}: {text}")));
    for column in others {
        let (words, column) = (log.words(column), escape(&log.names()[column]));
        if words > 0 {
            warnings.push(format!(
                "{name}: {words} fields of `{column}` are words and are left out: only numbers are kept"
            ));
        }
    }
    Ok(log.provenance()?)
}

fn of_robot(
    spec: &LogSpec,
    setup: &RobotSetup,
    target: &mut Target<'_>,
    warnings: &mut Vec<String>,
    context: &Context,
) -> Result<Provenance, CliError> {
    let mut reader = Reader::open_until(spec, &setup.file.layout(), &|| context.interrupted())?;
    let joints = setup.robot.joint_names();
    let n = joints.len();
    let kinds = &["q", "tau", "dq"][..if reader.has_velocities() { 3 } else { 2 }];
    let mut columns = columns_of(kinds, joints);
    let warm = setup.file.temperature_layout();
    let warm = warm.map_or(Vec::new(), |(joints, _)| joints);
    columns.extend(warm.iter().map(|j| format!("temperature_{}", joints[*j])));
    target.begin(spec, columns)?;
    let mut block = Block::default();
    let mut first = true;
    let mut courses = None;
    while reader.read(&mut block)? {
        context.check()?;
        let origin = reader.origin();
        if courses.is_none() {
            let read = |(joints, layout): (Vec<usize>, Layout)| {
                JointTemperatures::read(spec, (&joints, &layout), origin)
            };
            courses = setup.file.temperature_layout().map(read).transpose()?;
        }
        for (k, t) in block.t.iter().enumerate() {
            let parts = [&block.q, &block.tau, &block.dq].map(|x| x.get(k * n..(k + 1) * n));
            let values = parts.into_iter().flatten().flatten().copied();
            let values = values.chain(warm.iter().filter_map(|j| courses.as_ref()?.at(*j, *t)));
            target.row((spec, first), (origin, *t), values)?;
            first = false;
        }
    }
    warnings.extend(reader.warnings());
    Ok(reader.provenance()?)
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    context.check_outputs(paths_of(&args.logs), [&*args.output])?;
    let setup = args.robot.as_deref().map(RobotSetup::load).transpose()?;
    let mut target = Target {
        path: &args.output,
        writer: None,
        columns: Vec::new(),
        origin: Instant::default(),
        last: f64::NEG_INFINITY,
        rows: 0,
        without_time: 0,
    };
    let bar = context.progress("converting", Some(args.logs.len() as u64));
    let file = setup.as_ref().map(|setup| &setup.file);
    let mut warnings = file.map_or(Vec::new(), |file| file.notes.0.clone());
    let (layout, mut provenance) = (file.map(|file| file.layout()), Vec::new());
    let repeated = repeated_files(&args.logs, layout.as_ref());
    warnings.extend(repeated.iter().map(ToString::to_string));
    for spec in &args.logs {
        provenance.push(match &setup {
            None => as_it_stands(spec, args, &mut target, &mut warnings, context)?,
            Some(setup) => of_robot(spec, setup, &mut target, &mut warnings, context)?,
        });
        bar.advance(1);
    }
    drop(bar);
    let logs = names_of(&args.logs).join(", ");
    if target.rows == 0 {
        return Err(CliError::input(format!("{logs}: no row has a time"))
            .hint("check the time column, and the span"));
    }
    let lost = target.without_time;
    if lost > 0 && !args.drop_rows {
        let all = lost + target.rows;
        let text = format!("{logs}: {lost} of {all} rows have no time and would be lost");
        return Err(CliError::input(text)
            .hint("give them a time, or delete them")
            .hint("or leave them out: --drop-rows"));
    }
    if lost > 0 {
        warnings.push(format!("{lost} rows without a time are left out"));
    }
    let recording = LogForm::of(&args.output).is_some_and(LogForm::is_recording);
    if recording && setup.is_none() {
        for name in &target.columns {
            if let Some(unit) = columns::unit_of_joint(name) {
                warnings.push(format!(
                    "`{}` is in {unit}, but others who open the recording take positions for rad or m and torques for Nm or N: give a robot file with -r to write SI units",
                    escape(name)
                ));
            }
        }
    }
    context.check()?;
    let duration: f64 = provenance.iter().map(|p| p.duration_s).sum();
    let name = args.output.file_name();
    let result = ConvertedLog {
        columns: target.columns,
        samples: target.rows,
        duration_s: duration,
        file: name.map(|name| name.to_string_lossy().into_owned()),
    };
    let document = JsonDocument::new("convert", &provenance, &warnings, &result)?;
    if let Some(writer) = target.writer {
        context.files.add_log(writer)?;
    }
    let written = format!("written: {}", args.output.display());
    let all = format!(
        "{} rows of {} columns, {} s\n{written}\n",
        result.samples,
        result.columns.len(),
        number::significant(duration, 5),
    );
    Ok(Outcome::new(context.text(all, &written), document))
}
