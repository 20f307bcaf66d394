//! `cft-ident payload`: the body on the last link, from a log with it and a model without it.

use std::path::PathBuf;

use super::{CliError, Context, Outcome, files, logs_of, names_of, paths_of};
use cft_ident_core::number;
use cft_ident_logs::log::{LogSpec, escape};
use cft_ident_report::report::json::Document;
use cft_ident_report::report::table::{Align, Table};
use cft_ident_stages::identify::{
    self, Dataset, Number95, Payload, PayloadReading, PayloadVerdict,
};
use cft_ident_tool::tool::{CarriedBody, RobotController};

const EXAMPLE: &str = "\
Example:
  cft-ident payload loaded.csv -m empty.toml
  cft-ident payload loaded.csv -m empty.toml -o loaded.toml";

/// Find mass, centre of gravity and inertia of what the last link carries, with 95 % intervals.
///
/// The model is that of the arm without the load. Friction and offsets of the joints are free, and the body is one
/// that can exist. It is found twice: with the gains of the torque channels as the model has them, and with a gain
/// error of each joint free, for currents.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident payload [OPTIONS] -m MODEL.toml LOG...")]
pub struct Args {
    /// Logs with the load; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Model file of the arm without the load
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Model file to write, with the load as an effect: the given model, byte for byte, where no load is seen, where
    /// free gains contradict it, or where it makes the error of a joint larger
    #[arg(short, long, value_name = "LOADED.toml")]
    pub output: Option<PathBuf>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs = paths_of(&args.logs).chain([&*args.model]);
    context.check_outputs(inputs, args.output.as_deref())?;
    let given = files::model(&args.model, context)?.value;
    let data = Dataset::new(&given.machine(), &logs_of(&args.logs));
    let found = identify::payload(&data, &given, &context.control)?;
    let brief = sentences(&found).join("\n");
    let tables = text_of(&found, &names_of(&args.logs).join(", "));
    let mut text = format!("{brief}\n\n{tables}");
    if found.loaded(&given.file).is_some() {
        text += &format!("\n{}", controller_lines(&found));
    }
    if let Some(path) = &args.output {
        let (model, how) = match found.loaded(&given.file) {
            Some(loaded) => (loaded.to_toml()?, ""),
            None => (files::text(&args.model)?, ", the given model byte for byte"),
        };
        context.write_text(path, &model)?;
        text += &format!("written: {}{how}\n", path.display());
    }
    Ok(Outcome::new(
        context.text(text, &brief),
        Document::new("payload", &found.inputs, &found.warnings, &found)?,
    ))
}

fn shown(x: &Number95) -> String {
    match (x.value, x.interval_95) {
        (Some(value), Some([low, high])) => {
            // digits as far as the interval says something
            let half = (high - low) / 2.0;
            let [value, low, high] = [value, low, high].map(|x| number::value_and_std(x, half).0);
            format!("{value} ({low} .. {high})")
        }
        _ => number::ABSENT.to_owned(),
    }
}

fn sentences(found: &Payload) -> Vec<String> {
    let mass = |gains_free: bool| {
        let reading = found.readings.iter().find(|of| of.gains_free == gains_free);
        reading.map_or(number::ABSENT.to_owned(), |of| {
            format!("{} kg", shown(&of.mass))
        })
    };
    let (held, free) = (mass(false), mass(true));
    let said = match found.verdict {
        PayloadVerdict::Seen => format!(
            "payload: {held} with the gains of the torque channels as the model has them, {free} with a gain error of every joint free"
        ),
        PayloadVerdict::NotApartFromGains => format!(
            "payload: {held} if the gains of the torque channels are those of the model\nthese data cannot tell the mass apart from the gains: {free} with a gain error of every joint free; a log of wider motion of all joints, the arm stretched out and folded, lifted against gravity, does"
        ),
        PayloadVerdict::GainsContradict => format!(
            "the gains of the torque channels are not those of the model, or the log is not of this arm: {held} with them, {free} with a gain error of every joint free"
        ),
        PayloadVerdict::NoneSeen if is_above_zero(found) => format!(
            "no payload seen: {held} with the gains of the torque channels as the model has them, which explain the log without a body\nonly with a gain error of every joint free would it be {free}: these data do not tell such gains apart from a body"
        ),
        PayloadVerdict::NoneSeen => format!(
            "no payload seen: {held}; with a gain error of every joint free: {free}"
        ),
        PayloadVerdict::NotDetermined => "these data do not determine the mass: log a motion that lifts the last link against gravity, or moves it fast".to_owned(),
    };
    let worse = found.readings.iter().filter_map(made_worse);
    worse.chain(said.lines().map(str::to_owned)).collect()
}

/// Whether the mass with free gains is above zero.
fn is_above_zero(found: &Payload) -> bool {
    let mut free = found.readings.iter().filter(|of| of.gains_free);
    let low = |of: &PayloadReading| of.mass.interval_95.is_some_and(|[low, _]| low > 0.0);
    free.any(low)
}

/// The lines that controllers take, where a body was found.
fn controller_lines(found: &Payload) -> String {
    let Some(reading) = found.readings.first() else {
        return String::new();
    };
    let centre = reading.centre.each_ref().map(|c| c.value);
    let (Some(mass), [Some(x), Some(y), Some(z)]) = (reading.mass.value, centre) else {
        return String::new();
    };
    let all = reading.inertia.each_ref().map(|of| of.value);
    let inertia = all
        .iter()
        .all(Option::is_some)
        .then(|| all.map(Option::unwrap_or_default));
    let body = CarriedBody {
        mass,
        centre: [x, y, z],
        inertia,
    };
    let link = escape(&found.link);
    let mut out = format!(
        "for the controller, in the frame of {link} (move the centre into that of the flange first):\n"
    );
    for controller in RobotController::ALL {
        let lines = controller.body(&body).replace('\n', "\n          ");
        out += &format!("  {:<7} {lines}\n", controller.name());
    }
    out
}

/// A warning where the body of a reading makes the error of a joint larger.
fn made_worse(reading: &PayloadReading) -> Option<String> {
    let worse: Vec<String> = reading
        .worse()
        .map(|of| {
            let (before, after) = (number::percent(of.before), number::percent(of.after));
            format!("{} {before} -> {after}", escape(&of.joint))
        })
        .collect();
    let how = match reading.gains_free {
        false => "",
        true => " beside free gains",
    };
    (!worse.is_empty()).then(|| {
        format!(
            "warning: the body{how} makes errors larger: {}. The model is not that of this arm without a load, or its gains changed: do not use the mass before `validate` on a log without a load is as good as it was",
            worse.join(", ")
        )
    })
}

fn text_of(found: &Payload, logs: &str) -> String {
    let caption = format!(
        "body on {} by {}, in the frame of that link, with 95 % intervals",
        escape(&found.link),
        escape(logs)
    );
    let mut table = Table::new(&[
        ("", Align::Left),
        ("gains as in the model", Align::Left),
        ("gain errors free", Align::Left),
        ("unit", Align::Left),
    ])
    .caption(&caption);
    if let [as_given, free] = &found.readings[..] {
        let mut row = |name: &str, a: &Number95, b: &Number95| {
            table.row([name, &shown(a), &shown(b), &a.unit]);
        };
        row("mass", &as_given.mass, &free.mass);
        let names = ["x", "y", "z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];
        let [all_given, all_free] = [as_given, free].map(|of| of.centre.iter().chain(&of.inertia));
        for (name, (a, b)) in names.into_iter().zip(all_given.zip(all_free)) {
            row(name, a, b);
        }
    }
    let mut errors = Table::new(&[
        ("joint", Align::Left),
        ("error as given", Align::Decimal),
        ("with the body", Align::Decimal),
        ("and gains", Align::Decimal),
        ("gain error", Align::Left),
    ]);
    if let [as_given, free] = &found.readings[..] {
        for ((a, b), gain) in as_given.joints.iter().zip(&free.joints).zip(&free.gains) {
            errors.row([
                a.joint.as_str(),
                &number::percent(a.before),
                &number::percent(a.after),
                &number::percent(b.after),
                &shown(&gain.error),
            ]);
        }
    }
    format!("{table}\n{errors}")
}
