//! `cft-ident payload`: the body on the last link, from a log with it and a model without it.

use std::path::PathBuf;

use super::{CliError, Context, Outcome, arguments, files, logs_of, names_of, paths_of, written};
use cft_ident_core::number;
use cft_ident_logs::log::{LogSpec, escape};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::sections::provenance;
use cft_ident_report::report::table::{CellAlignment, Table};
use cft_ident_report::report::{
    FigureTone, FoundLine, Report, VerdictFigure, VerdictHeadline, torques_off,
};
use cft_ident_stages::identify::{
    self, CarriedSpan, Dataset, IntervalNumber, Payload, PayloadReading, PayloadVerdict,
    TouchedSpan,
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
    /// Write the same as a page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs = paths_of(&args.logs).chain([&*args.model]);
    let outputs = args.output.iter().chain(&args.report).map(|path| &**path);
    context.check_outputs(inputs, outputs)?;
    let given = files::model(&args.model, context)?.value;
    let data = Dataset::read(&given.setup(), &logs_of(&args.logs), &context.control)?;
    let found = identify::payload(&data, &given, &context.control)?;
    let mut report = report(&found, &names_of(&args.logs).join(", "));
    if found.loaded(&given.file).is_some() {
        for line in controller_lines(&found).lines() {
            report.everywhere().line(line);
        }
    }
    if let Some(path) = &args.report {
        let page = &mut report.page();
        let of = (&given.file.robot, &context.command);
        provenance::section(page, of.0, &found.inputs, &[], None, of.1);
        context.write_text(path, &report.html())?;
        written(&mut report, path);
    }
    if let Some(path) = &args.output {
        let how = match found.loaded(&given.file) {
            Some(loaded) => {
                files::write_model(path, &loaded, context)?;
                ""
            }
            None => {
                context.write_text(path, &files::text(&args.model)?)?;
                ", the given model byte for byte"
            }
        };
        let line = format!("written: {}{how}", path.display());
        report.terminal().line(&line);
    }
    Ok(Outcome::new(
        report.text_for(context.screen),
        JsonDocument::new("payload", &found.inputs, &found.notes, &found)?,
    ))
}

/// A gain error as percent; nothing is known of one whose interval holds a gain of zero.
fn gain(x: &IntervalNumber) -> String {
    match (x.value, x.interval_95) {
        (Some(value), Some([low, high])) if low > -1.0 => {
            let [value, low, high] = [value, low, high].map(|x| format!("{:+.1}", 100.0 * x));
            format!("{value} % ({low} .. {high})")
        }
        _ => "not determined".to_owned(),
    }
}

/// A number with its interval.
fn shown(x: &IntervalNumber) -> String {
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

/// The mass with both readings of the gains, and what that means.
fn report(found: &Payload, logs: &str) -> Report {
    let mut report = Report::new(&format!("Payload in {}", escape(logs)));
    let mut all = report.everywhere();
    let mass = |gains_free: bool| {
        let reading = found.readings.iter().find(|of| of.gains_free == gains_free);
        match reading.filter(|of| of.mass.value.is_some()) {
            Some(of) => format!("{} kg", shown(&of.mass)),
            None if gains_free => "not determined: errors of the gains look the same".to_owned(),
            None => "not determined: no motion here shows it".to_owned(),
        }
    };
    let figure = |label, value| VerdictFigure {
        label,
        value,
        tone: FigureTone::Plain,
    };
    all.headline(VerdictHeadline {
        figures: vec![
            figure("mass", mass(false)),
            figure("with free gains", mass(true)),
        ],
        of: "value and 95 % interval, with the gains of the torque channels as in the model, and with a gain error of \
             every joint free"
            .to_owned(),
    });
    let (grade, text, next) = match found.verdict {
        PayloadVerdict::Seen => ("confirmed", "a payload, by both", None),
        PayloadVerdict::NotApartFromGains => (
            "not certain",
            "these data cannot tell the mass from an error of the gains; the first number holds if the gains are right",
            Some(
                "Next: log all joints over wider ranges, the arm stretched out and folded, lifted against gravity.",
            ),
        ),
        PayloadVerdict::GainsContradict => (
            "not certain",
            "the two disagree: the gains are not those of the model, or the log is of another arm; the second number \
             holds if only the gains changed",
            Some("Next: `cft-ident validate` on a log without a load."),
        ),
        PayloadVerdict::NoneSeen if is_above_zero(found) => (
            "none",
            "no payload: the gains of the model explain the log without one; with free gains a body would explain it \
             as well, and these data do not tell the two apart",
            None,
        ),
        PayloadVerdict::NoneSeen => (
            "none",
            "no payload; one above the upper end of the interval would show",
            None,
        ),
        PayloadVerdict::Unexplained => (
            "not certain",
            "no payload is seen, and the model leaves many times its usual error: something else acts on the arm, or it is another one",
            Some("Next: `cft-ident inspect` and `cft-ident diagnose` of this log."),
        ),
        PayloadVerdict::NotDetermined => (
            "not determined",
            "these data do not show the mass",
            Some("Next: log a motion that lifts the last link against gravity, or moves it fast."),
        ),
    };
    let mut findings = vec![FoundLine {
        grade,
        text: text.to_owned(),
    }];
    findings.extend(found.carried.iter().map(|span| FoundLine {
        grade: "carried",
        text: carried(span),
    }));
    findings.extend(found.touched.iter().map(|span| FoundLine {
        grade: "touched",
        text: touched(span),
    }));
    if let Some(mass) = &found.mass_with_touched {
        findings.push(FoundLine {
            grade: "with it",
            text: format!(
                "the mass is {} kg, with the gains of the model",
                shown(mass)
            ),
        });
    }
    findings.extend(found.readings.iter().filter_map(made_worse));
    all.found(findings);
    if let Some(next) = next {
        all.next(next, None);
    }
    all.line("");
    let [body, errors] = tables(found, logs);
    all.table(body);
    all.line("");
    all.table(errors);
    report
}

/// When the load is carried, in words.
fn carried(span: &CarriedSpan) -> String {
    let at = |t: f64| number::significant(t, 4);
    let when = match (span.from_s, span.to_s) {
        (Some(from), Some(to)) => format!("from {} to {} s", at(from), at(to)),
        (Some(from), None) => format!("from {} s to the end", at(from)),
        (None, Some(to)) => format!("from the beginning to {} s", at(to)),
        (None, None) => "throughout".to_owned(),
    };
    format!(
        "{when} of {}, and not in the rest of the logs; all numbers are those of the load while it is carried",
        escape(&span.log)
    )
}

/// A part that is left out: when, and what is left there.
fn touched(span: &TouchedSpan) -> String {
    let [from, to] = [span.from_s, span.to_s].map(|t| number::significant(t, 4));
    format!(
        "from {from} to {to} s of {} torques are off, {}, far more than in the rest: a touch? It is left out",
        escape(&span.log),
        torques_off(&span.off)
    )
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

/// Where the body of a reading makes the error of a joint larger; one that is not determined says nothing.
fn made_worse(reading: &PayloadReading) -> Option<FoundLine> {
    reading.mass.value?;
    let worse: Vec<String> = reading
        .worse()
        .map(|of| {
            let (before, after) = (number::percent(of.before), number::percent(of.after));
            format!("{} from {before} to {after}", escape(&of.joint))
        })
        .collect();
    let how = match reading.gains_free {
        false => "",
        true => " with free gains",
    };
    (!worse.is_empty()).then(|| FoundLine {
        grade: "worse",
        text: format!(
            "the body{how} makes errors larger: {}. The model is not that of this arm without a load, or its gains \
             changed: check it with `validate` on a log without a load before you use the mass",
            worse.join(", ")
        ),
    })
}

/// The body, and the errors of the joints with it.
fn tables(found: &Payload, logs: &str) -> [Table; 2] {
    let caption = format!(
        "body on {} by {}, in the frame of that link, with 95 % intervals",
        escape(&found.link),
        escape(logs)
    );
    let mut table = Table::new(&[
        ("", CellAlignment::Left),
        ("gains as in the model", CellAlignment::Left),
        ("gain errors free", CellAlignment::Left),
        ("unit", CellAlignment::Left),
    ])
    .caption(&caption);
    if let [as_given, free] = &found.readings[..] {
        let mut row = |name: &str, a: &IntervalNumber, b: &IntervalNumber| {
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
        ("joint", CellAlignment::Left),
        ("error before", CellAlignment::Decimal),
        ("with the body", CellAlignment::Decimal),
        ("and gains", CellAlignment::Decimal),
        ("gain error", CellAlignment::Left),
    ]);
    if let [as_given, free] = &found.readings[..] {
        for ((a, b), gain) in as_given.joints.iter().zip(&free.joints).zip(&free.gains) {
            errors.row([
                a.joint.as_str(),
                &number::percent(a.before),
                &number::percent(a.after),
                &number::percent(b.after),
                &self::gain(&gain.error),
            ]);
        }
    }
    [table, errors]
}
