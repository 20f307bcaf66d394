//! Every option of every command with every kind of input: it is used, or refused by a sentence that names it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use cft_ident::cli::CommandLine;
use clap::{Arg, ArgAction, CommandFactory};

use super::{done, faults, options_of, run};
use crate::hostile_bench::{Bench, slide_log};

/// Kinds of logs and of models, by the files that stand for them.
const LOGS: [&str; 5] = ["good.csv", "good.csv@0..60%", "part.cfi", "good.mcap", "-"];
const MODELS: [&str; 5] = [
    "model.toml",
    "refined.toml",
    "drive.toml",
    "tool.toml",
    "hand.toml",
];

/// Commands with their inputs: `LOG` and `MODEL` stand for each kind.
const LINES: [(&str, &str); 16] = [
    ("inspect", "LOG -r slide.toml"),
    ("convert", "LOG out.csv -r slide.toml"),
    ("friction", "LOG -r slide.toml -o out.toml"),
    ("lsq", "LOG -r slide.toml -o out.toml"),
    ("validate", "LOG -m MODEL"),
    ("reduce", "LOG -r slide.toml -o out.cfi"),
    ("diagnose", "LOG -m MODEL"),
    ("track", "part.cfi"),
    ("compare", "MODEL other.toml LOG"),
    ("payload", "LOG -m MODEL"),
    ("show", "MODEL"),
    ("torque", "LOG -m MODEL -o out.csv"),
    ("watch", "LOG -m MODEL"),
    ("simulate", "-r slide.toml -m MODEL --seconds 2 -o out.csv"),
    ("excite", "-m MODEL --joint slide -o out.toml"),
    ("export", "-m MODEL --c out.h"),
];
/// Commands that take none of these inputs.
const WITHOUT: [&str; 6] = ["identify", "drive", "tool", "new", "example", "generate"];
/// Options that change a result only where the data ask for it, there is more than one joint, or the model has effects.
const IDLE: [(&str, &str); 7] = [
    ("", "as-declared"),
    ("", "fix-setup"),
    ("", "joint"),
    ("convert", "drop-rows"),
    ("diagnose", "named-only"),
    ("friction", "model"),
    ("export", "without-effects"),
];

/// What an option of a command, or of any, is given, and what it needs beside it.
const VALUES: &[(&str, &str, &str, &str)] = &[
    ("", "leave-out", "--leave-out 1..2s", ""),
    ("excite", "robot", "--robot slide.toml --margin 0.2", ""),
    ("", "model", "--model friction.toml", ""),
    ("diagnose", "hold-friction", "--hold-friction", ""),
    ("", "hold-friction", "--hold-friction", "-m friction.toml"),
    ("", "fit-gains", "--fit-gains", ""),
    ("", "open-loop", "--open-loop=0.5", ""),
    ("", "estimator", "--estimator ols", ""),
    ("", "max-relative-error", "--max-relative-error 1e-9", ""),
    ("", "holdout", "--holdout other.csv", ""),
    ("", "candidates", "--candidates own.toml", ""),
    ("", "accept", "--accept delay:slide", ""),
    (
        "export",
        "false-alarms",
        "--false-alarms 500",
        "--observer 500",
    ),
    ("", "false-alarms", "--false-alarms 500", ""),
    ("", "unloaded", "--unloaded other.csv", ""),
    ("", "seed", "--seed 7", ""),
    ("", "topic", "--topic /joint_states", ""),
    ("", "static", "--static", ""),
];

/// The words of an option of a command and what it needs beside it.
fn words(command: &str, arg: &Arg) -> Option<(String, &'static str)> {
    let name = arg.get_long()?;
    let own = |(of, known, ..): &&(&str, &str, &str, &str)| {
        (of.is_empty() || *of == command) && *known == name
    };
    if let Some((_, _, words, needs)) = VALUES.iter().find(own) {
        return Some(((*words).to_owned(), needs));
    }
    if matches!(arg.get_action(), ArgAction::SetTrue) {
        return Some((format!("--{name}"), ""));
    }
    // a file to be written, by the ending that its name of the value shows
    let value = arg.get_value_names()?.first()?.to_string();
    let ending = value
        .split(['|', ' '])
        .next()?
        .rsplit_once('.')?
        .1
        .to_owned();
    Some((format!("--{name} written.{ending}"), ""))
}

/// A folder with each kind of input.
fn inputs() -> Bench {
    let bench = Bench::new();
    let at = bench.folder();
    bench.file("good.csv", slide_log(5000, |_, _, _| {}));
    done(at, "lsq good.csv -r slide.toml -o model.toml");
    bench.file(
        "other.csv",
        slide_log(1500, |k, q, _| *q += 1e-5 * f64::from(k % 7)),
    );
    done(at, "convert good.csv good.mcap -r slide.toml");
    done(at, "reduce good.csv -r slide.toml -o part.cfi");
    done(at, "friction other.csv -r slide.toml -o friction.toml");
    done(at, "lsq other.csv -r slide.toml -o other.toml");
    done(
        at,
        "diagnose good.csv -m model.toml --accept asymmetric-friction:slide -o refined.toml",
    );
    done(at, "example wrist -o w");
    done(at, "tool w/wrist.csv -o tool.toml");
    bench.file(
        "drive.toml",
        "[drive]\nkind = \"sts3215\"\n\n[[parameter]]\nname = \"armature\"\n",
    );
    let text = bench.text("model.toml");
    let hand = text.split("[contents]").next().unwrap();
    let parameters: String = text
        .split("[[parameter]]")
        .skip(1)
        .map(|p| {
            let own = p.split("\n\n").next().unwrap();
            format!("[[parameter]]{own}\n\n")
        })
        .collect();
    bench.file(
        "hand.toml",
        format!(
            "{}\n{parameters}",
            hand.split("[[parameter]]").next().unwrap()
        ),
    );
    bench.file(
        "own.toml",
        "[[candidate]]\nname = \"grip\"\nformulas = { c = \"v * abs(v)\" }\nunits = { c = \"N s^2/m^2\" }\n",
    );
    bench
}

/// What a run leaves: its document and the files that it wrote.
type Left = (Option<i32>, String, BTreeMap<String, Vec<u8>>);

fn left(folder: &Path, line: &str, number: usize) -> (Left, String) {
    // each run in a folder of its own, the inputs beside it
    let own = folder.join(format!("run-{number}"));
    fs::create_dir(&own).unwrap();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name();
        if !name.to_string_lossy().starts_with("run-") {
            std::os::unix::fs::symlink(entry.path(), own.join(name)).unwrap();
        }
    }
    let ended = run(&own, line);
    let written = fs::read_dir(&own)
        .unwrap()
        .map(Result::unwrap)
        .filter(|entry| {
            let about = fs::symlink_metadata(entry.path()).unwrap();
            about.is_file()
        });
    let files = written.map(|entry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        (name, fs::read(entry.path()).unwrap())
    });
    let files = files.collect();
    fs::remove_dir_all(&own).unwrap();
    (
        (ended.status, ended.document.to_string(), files),
        ended.stderr,
    )
}

/// What is wrong with an option on an input, where something is.
fn fault(folder: &Path, (base, words, needs): (&str, &str, &str), number: usize) -> Option<String> {
    let without = format!("{base} {needs}");
    let with = format!("{without} {words}");
    let (plain, _) = left(folder, &without, 2 * number);
    let (used, said) = left(folder, &with, 2 * number + 1);
    let name = words
        .split([' ', '='])
        .next()
        .unwrap()
        .trim_start_matches('-');
    let wrong = |what: &str| Some(format!("{with}: {what}: {said}"));
    match (plain.0, used.0) {
        (_, None | Some(101..)) => wrong("a crash"),
        (_, Some(0 | 1)) if used == plain => wrong("taken and not used"),
        // a usage error names what it misses, and a reduced log is named as what it is
        (Some(0 | 1), Some(2)) if !said.contains("--") => wrong("refused without a name"),
        (Some(0 | 1), Some(3..)) if !said.contains(name) && !said.contains("reduced") => {
            wrong("refused without its name")
        }
        (None, _) => wrong("a crash without it"),
        _ => None,
    }
}

#[test]
fn every_option_is_used_on_every_kind_of_input_or_refused_by_its_name() {
    let all = CommandLine::command();
    let mut cases = Vec::new();
    for command in all.get_subcommands().map(clap::Command::get_name) {
        let Some((_, line)) = LINES.iter().find(|(known, _)| *known == command) else {
            assert!(WITHOUT.contains(&command), "`{command}` has no line here");
            continue;
        };
        let logs = if line.contains("LOG") {
            &LOGS[..]
        } else {
            &[""]
        };
        let models = if line.contains("MODEL") {
            &MODELS[..]
        } else {
            &[""]
        };
        let own = all.find_subcommand(command).unwrap();
        for arg in options_of(command) {
            let name = arg.get_long().unwrap();
            let short = arg.get_short().map(|s| format!("-{s} "));
            let there = |text: &str| line.contains(text);
            if IDLE.contains(&("", name))
                || IDLE.contains(&(command, name))
                || there(&format!("--{name} "))
                || short.is_some_and(|s| there(&s))
            {
                continue;
            }
            // an option of another way of the command contradicts its line
            let others = own.get_arg_conflicts_with(&arg);
            if others
                .iter()
                .any(|o| o.get_long().is_some_and(|o| there(&format!("--{o} "))))
            {
                continue;
            }
            let Some((words, needs)) = words(command, &arg) else {
                assert!(
                    matches!(command, "simulate" | "excite" | "export"),
                    "{command} --{name} has no value here"
                );
                continue;
            };
            // each kind of log with the usual model, each kind of model with the usual log
            let of_logs = logs.iter().map(|log| (*log, models[0]));
            let of_models = models.iter().skip(1).map(|model| (logs[0], *model));
            for (log, model) in of_logs.chain(of_models) {
                let base = line.replace("LOG", log).replace("MODEL", model);
                cases.push((format!("{command} {base}"), words.clone(), needs));
            }
        }
    }
    assert!(cases.len() > 150, "{}", cases.len());
    let bench = inputs();
    let numbered: Vec<_> = cases.iter().enumerate().collect();
    let found = faults(&numbered, |(number, (base, words, needs))| {
        fault(bench.folder(), (base, words, needs), *number)
    });
    assert!(
        found.is_empty(),
        "{} of {}: {found:#?}",
        found.len(),
        cases.len()
    );
}
