//! What was right of what the tool said of a case. Whether a fault matters is judged from plain least
//! squares, with the set-up as it is declared.

use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};

use super::cases::Case;
use super::faults::{Fault, Given, shown};
use super::fit::{Fit, rows};
use super::machines::Machine;
use super::names;
use super::robot_text;
use super::table::Table;
use super::tool::{Done, run, run_with};

/// The machine with nothing wrong, fitted.
pub struct Clean {
    pub machine: Machine,
    pub fit: Fit,
    /// Text of its model file.
    model: String,
}

impl Clean {
    /// Fits it.
    pub fn new(machine: Machine) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path();
        let words = write(&machine, &Given::right(&machine), folder);
        let (done, fit) = fitted(&machine, &machine.logs, folder, &words, "--as-declared", "");
        let fit = fit.unwrap_or_else(|| panic!("{}: {}", machine.name, done.message));
        let model = std::fs::read_to_string(folder.join("m.toml")).expect("it was written");
        Self {
            machine,
            fit,
            model,
        }
    }
}

/// Writes robot file, URDF, friction and logs, and gives the words of `lsq` for them.
fn write(machine: &Machine, given: &Given, folder: &Path) -> Vec<String> {
    let text = toml::to_string(&given.robot).expect("a robot file");
    std::fs::write(folder.join("robot.toml"), text).expect("the robot file is written");
    if let Some((name, text)) = &given.urdf {
        std::fs::write(folder.join(name), text).expect("the URDF is written");
    }
    let mut words = vec!["lsq".to_owned()];
    for (n, log) in given.logs.iter().enumerate() {
        let name = format!("log{}.csv", n + 1);
        log.write(&folder.join(&name), |t| match given.epoch {
            Some(unit) => unit.written(t),
            None => t.to_string(),
        });
        words.push(name);
    }
    words.extend(["-r", "robot.toml"].map(str::to_owned));
    if let Some(friction) = &machine.friction {
        std::fs::write(folder.join("friction.toml"), friction).expect("the model is written");
        words.extend(["-m", "friction.toml"].map(str::to_owned));
    }
    words
}

/// Runs `lsq` with an option and a value of it, and reads its fit.
fn fitted(
    machine: &Machine,
    logs: &[Table],
    folder: &Path,
    words: &[String],
    option: &str,
    value: &str,
) -> (Done, Option<Fit>) {
    let model = folder.join("m.toml");
    let _ = std::fs::remove_file(&model);
    let mut all: Vec<&str> = words.iter().map(String::as_str).collect();
    all.extend(["-o", "m.toml"]);
    let options = [option, value];
    let done = run_with(
        folder,
        &all,
        &options[..if value.is_empty() { 1 } else { 2 }],
    );
    let fit = Fit::read(machine, logs, &done, &model);
    (done, fit)
}

/// What a row says of a case.
pub fn is(row: &Value, key: &str) -> bool {
    row[key].as_bool() == Some(true)
}

/// Whether all that is asked of the tool was met: the truth told first, and the mended file right; or
/// the truth told as one of two that these data do not tell apart, of which the mended file has one.
pub fn met(row: &Value) -> bool {
    let alone = is(row, "first") && is(row, "fixed");
    is(row, "named") && is(row, "right_joint") && (alone || is(row, "tied"))
}

/// Judges a case: its row in the results; nothing where this machine cannot have the fault.
pub fn judge(clean: &Clean, case: &Case) -> Option<Value> {
    let folder = tempfile::tempdir().expect("a folder");
    match case {
        Case::Clean(from, to) => Some(right(&clean.machine.span(*from, *to), folder.path())),
        Case::CleanJoint(joint) => Some(right_alone(&clean.machine, *joint, folder.path())),
        Case::Names(style) => names::judge(&clean.machine, &clean.fit, *style, folder.path()),
        Case::Fault(fault) => wrong(clean, fault, folder.path()),
    }
}

fn wrong(clean: &Clean, fault: &Fault, folder: &Path) -> Option<Value> {
    let started = Instant::now();
    let machine = &clean.machine;
    let resting = |percent: usize| super::rows::resting(machine, percent, folder, &clean.model);
    let given = fault.make(machine, &resting)?;
    let words = write(machine, &given, folder);
    // speeds of the unchanged logs, for the friction's power: an encoder that wraps has none of its own
    let logs = &machine.logs;
    let (mended, fit) = fitted(machine, logs, folder, &words, "--fix-setup", "mended.toml");
    // nothing was put right: the fit is that of the set-up as it is declared
    let kept = mended.status == 0 && !folder.join("mended.toml").exists();
    let declared = match fault.in_rows() {
        true => as_it_stands(machine, &given, folder, &words).1,
        false if kept => fit.clone(),
        false => fitted(machine, logs, folder, &words, "--as-declared", "").1,
    };
    let (matters, why) = match fault {
        // inertias of a model in A are told in kg
        Fault::Gains => (true, "units".to_owned()),
        _ => matters(fault, &clean.fit, declared.as_ref()),
    };
    let mut setup = mended.document["setup"].clone();
    let mut kinds = Vec::new();
    if mended.status != 0 || fault.in_rows() {
        let found = inspected(&words, folder);
        if setup.is_null() {
            setup = found["setup"].clone();
        }
        kinds = rows(&found["faults"])
            .iter()
            .filter_map(|f| f["kind"].as_str().map(str::to_owned))
            .collect();
    }
    let (distance, parameter) = fit.as_ref().map_or((f64::INFINITY, String::new()), |fit| {
        fit.distance(&clean.fit)
    });
    let entries = rows(&setup);
    let heard = Heard::of(fault, machine, entries, &kinds, &mended);
    Some(json!({
        "matters": matters,
        "why": why,
        "error_unchanged": clean.fit.error(),
        "error_declared": declared.as_ref().map(Fit::error),
        "named": heard.named,
        "sure": entries.iter().any(|entry| is(entry, "sure")),
        "first": heard.first,
        "tied": heard.tied,
        "right_joint": heard.right_joint,
        "fixed": match fault {
            // what an ampere is must be given: the fit that is refused is right
            Fault::Gains => mended.status == 3,
            _ => distance <= fault.allowed(),
        },
        "distance": distance,
        "parameter": parameter,
        "status": mended.status,
        "setup": shown(&setup),
        "kinds": kinds,
        "said": if mended.status == 0 { String::new() } else { mended.message },
        "seconds": started.elapsed().as_secs_f64(),
    }))
}

/// Whether a fault matters, and by what. Errors are those of a torque channel, whichever joint it is taken for.
fn matters(fault: &Fault, clean: &Fit, declared: Option<&Fit>) -> (bool, String) {
    let Some(declared) = declared else {
        return (true, "no fit".to_owned());
    };
    let moved = (0..declared.errors.len())
        .map(|j| {
            (
                clean.errors[fault.torque_of(j, clean.errors.len())],
                declared.errors[j],
            )
        })
        .map(|(before, after)| (after - before).abs() / before)
        .fold(0.0, f64::max);
    let new = |what: &&String| !clean.impossible.contains(what);
    let impossible: Vec<&String> = declared.impossible.iter().filter(new).collect();
    let why = match impossible.first() {
        Some(what) => format!("error {moved:+.2}, negative {what}"),
        None => format!("error {moved:+.2}"),
    };
    // an error that is no number is no fit either
    (moved.is_nan() || moved > 0.1 || !impossible.is_empty(), why)
}

/// The fit with rows as they stand in the file: what the tool would mend is kept.
fn as_it_stands(
    machine: &Machine,
    given: &Given,
    folder: &Path,
    words: &[String],
) -> (Done, Option<Fit>) {
    let mut robot = given.robot.clone();
    robot_text::keep_every_row(&mut robot);
    let text = toml::to_string(&robot).expect("a robot file");
    std::fs::write(folder.join("kept.toml"), text).expect("the robot file is written");
    let kept: Vec<String> = words
        .iter()
        .map(|word| match word.as_str() {
            "robot.toml" => "kept.toml".to_owned(),
            word => word.to_owned(),
        })
        .collect();
    fitted(machine, &machine.logs, folder, &kept, "--as-declared", "")
}

/// What `inspect` says of the logs.
fn inspected(words: &[String], folder: &Path) -> Value {
    let logs = words.iter().filter(|word| word.starts_with("log"));
    let mut inspect = vec!["inspect"];
    inspect.extend(logs.map(String::as_str));
    inspect.extend(["-r", "robot.toml"]);
    run(folder, &inspect).document
}

/// What `inspect` says of a fault of the set-up; nothing where this machine cannot have it.
pub fn heard(machine: &Machine, fault: &Fault, folder: &Path) -> Option<Heard> {
    let given = fault.make(machine, &|_| None)?;
    let found = inspected(&write(machine, &given, folder), folder);
    let silent = Done {
        status: 0,
        document: Value::Null,
        message: String::new(),
    };
    let entries = rows(&found["setup"]);
    Some(Heard::of(fault, machine, entries, &[], &silent))
}

/// What `inspect` says of the set-up of a machine in which nothing is wrong.
pub fn heard_of_right(machine: &Machine, folder: &Path) -> Vec<Value> {
    let found = inspected(&write(machine, &Given::right(machine), folder), folder);
    rows(&found["setup"]).to_vec()
}

/// What was heard of the truth.
#[derive(Debug)]
pub struct Heard {
    pub named: bool,
    pub first: bool,
    pub tied: bool,
    pub right_joint: bool,
}

impl Heard {
    fn of(
        fault: &Fault,
        machine: &Machine,
        entries: &[Value],
        kinds: &[String],
        mended: &Done,
    ) -> Self {
        if fault.in_rows() {
            let words = fault.kinds_of_rows();
            let said = mended.said();
            let heard = |word: &&str| kinds.iter().any(|k| k.contains(word)) || said.contains(word);
            let named = match fault {
                Fault::Rest(_) => rows(&mended.document["joints"])
                    .iter()
                    .any(|joint| joint["relative_error_rest"].is_number()),
                _ => words.iter().any(heard),
            };
            return Self {
                named,
                first: named,
                tied: false,
                right_joint: named,
            };
        }
        let first = |entry: &Value| fault.is_shown_by(machine, entry);
        // a hint at something else is no word on the fault
        let entries: Vec<Value> = (entries.iter())
            .filter(|entry| entry["severity"] != "hint" || first(entry))
            .cloned()
            .collect();
        let entries = &entries[..];
        let shown = match entries {
            [] => false,
            // all channels at once may be told one by one
            [entry, ..] if fault.channels() == 1 => first(entry),
            [one] => first(one) && one["joint"].is_null(),
            entries => entries.len() == fault.channels() && entries.iter().all(first),
        };
        let tied = entries.first().is_some_and(|entry| {
            let others = rows(&entry["tied_with"]);
            others.len() == 1 && first(&others[0])
        });
        // what is rounded may be put right where it is read, with a word on it; what lacks is asked for
        let snapped = match fault {
            Fault::Rounded(..) => mended.said().contains("pi"),
            Fault::Gains => mended.message.contains("torque_scale"),
            _ => false,
        };
        let joint = entries.first().is_some_and(|entry| {
            fault.is_of_joint(machine, entry)
                || rows(&entry["tied_with"])
                    .iter()
                    .any(|other| fault.is_of_joint(machine, other))
        });
        Self {
            named: !entries.is_empty() || snapped,
            first: shown || snapped,
            tied,
            right_joint: joint || snapped,
        }
    }
}

/// A machine in which nothing is wrong: what is said of it is false.
fn right(machine: &Machine, folder: &Path) -> Value {
    let started = Instant::now();
    let words = write(machine, &Given::right(machine), folder);
    let all: Vec<&str> = words
        .iter()
        .map(String::as_str)
        .chain(["-o", "m.toml"])
        .collect();
    let done = run(folder, &all);
    let found = inspected(&words, folder);
    row_of_clean(&done, &found, started)
}

/// The one-joint experiment of a joint, simulated.
fn right_alone(machine: &Machine, joint: usize, folder: &Path) -> Value {
    let started = Instant::now();
    let text = toml::to_string(&machine.robot).expect("a robot file");
    std::fs::write(folder.join("robot.toml"), text).expect("the robot file is written");
    let name = machine.joints[joint].name.as_str();
    let words = [
        "simulate",
        "-r",
        "robot.toml",
        "--move",
        name,
        "--seconds",
        "8",
        "-o",
        "log1.csv",
    ];
    let made = run(folder, &words);
    assert_eq!(made.status, 0, "{}", made.message);
    let words = ["friction", "log1.csv", "-r", "robot.toml", "-o", "m.toml"];
    let done = run(folder, &words);
    let found = inspected(&["log1.csv".to_owned()], folder);
    row_of_clean(&done, &found, started)
}

/// Faults of the rows that would cut or mend a right log.
const FALSE_KINDS: [&str; 4] = [
    "wrapped-encoder",
    "position-step",
    "sample-and-hold",
    "stall",
];

fn row_of_clean(done: &Done, found: &Value, started: Instant) -> Value {
    let in_fit = rows(&done.document["setup"]).len();
    let in_look = rows(&found["setup"]).len();
    let kinds: Vec<&str> = rows(&found["faults"])
        .iter()
        .filter_map(|f| f["kind"].as_str())
        .filter(|kind| FALSE_KINDS.iter().any(|word| kind.contains(word)))
        .collect();
    let refused = done.status == 3;
    json!({
        "false": in_fit + in_look > 0 || refused || !kinds.is_empty(),
        "status": done.status,
        "setup": shown(&done.document["setup"]),
        "inspected": shown(&found["setup"]),
        "kinds": kinds,
        "said": if done.status == 0 { String::new() } else { done.message.clone() },
        "seconds": started.elapsed().as_secs_f64(),
    })
}
