//! Every log that is given as unseen: rows that made the model, and rows that are fitted or watched, are refused in all
//! commands alike.

use std::fs;

use cft_ident::cli::CommandLine;
use clap::CommandFactory;

use super::{done, options_of, run};
use crate::hostile_bench::Bench;

/// Options that take logs as unseen.
const UNSEEN: [(&str, &str); 4] = [
    ("diagnose", "holdout"),
    ("drive", "holdout"),
    ("tool", "holdout"),
    ("watch", "unloaded"),
];
/// Options that take logs which are read as any.
const READ: [(&str, &str); 3] = [("identify", "log"), ("new", "log"), ("simulate", "volts")];

#[test]
fn rows_that_made_a_model_or_are_given_twice_are_refused_as_unseen_by_every_command_that_takes_such()
 {
    for command in CommandLine::command().get_subcommands() {
        let name = command.get_name();
        for arg in options_of(name) {
            let takes = arg
                .get_value_names()
                .is_some_and(|names| names.iter().any(|n| n == "LOG"));
            let option = arg.get_long().unwrap();
            let known = UNSEEN.iter().chain(&READ).any(|of| *of == (name, option));
            assert!(!takes || known, "{name} --{option} takes a log as what?");
        }
    }
    let bench = Bench::new();
    let at = bench.folder();
    done(at, "example wrist -o w");
    done(at, "example servo -o s");
    let servo = fs::read_dir(at.join("s"))
        .unwrap()
        .map(|e| e.unwrap().path());
    let servo = servo.filter(|path| path.extension().is_some_and(|end| end == "json"));
    let servo = servo.min().unwrap().to_str().unwrap().to_owned();
    fs::copy(at.join("good.csv"), at.join("copy.csv")).unwrap();
    let refused = [
        (
            "diagnose",
            "diagnose other.csv -m model.toml --holdout good.csv".to_owned(),
        ),
        (
            "diagnose",
            "diagnose other.csv -m model.toml --holdout copy.csv@0..50%".to_owned(),
        ),
        (
            "diagnose",
            "diagnose other.csv -m model.toml --holdout other.csv@0..50%".to_owned(),
        ),
        (
            "watch",
            "watch other.csv -m model.toml --unloaded good.csv".to_owned(),
        ),
        (
            "watch",
            "watch other.csv@50..100% -m model.toml --unloaded other.csv@90..95%".to_owned(),
        ),
        (
            "tool",
            "tool w/wrist.csv -o out.toml --holdout w/wrist.csv".to_owned(),
        ),
        (
            "tool",
            "tool w/wrist.csv@0..60% -o out.toml --holdout w/wrist.csv@50..100%".to_owned(),
        ),
        (
            "drive",
            format!("drive {servo} -o out.toml --holdout {servo}"),
        ),
    ];
    for (command, line) in &refused {
        let ended = run(at, line);
        assert_eq!(ended.status, Some(3), "{line}: {}", ended.stderr);
        let said = ended.stderr.contains("rows") && ended.stderr.contains("hint: ");
        assert!(said, "{line}: {}", ended.stderr);
        assert!(UNSEEN.iter().any(|(known, _)| known == command));
        assert!(!at.join("out.toml").exists(), "{line}");
    }
    for (command, _) in UNSEEN {
        assert!(refused.iter().any(|(own, _)| *own == command), "{command}");
    }
    done(
        at,
        "watch other.csv@0..50% -m model.toml --unloaded other.csv@50..100%",
    );
    done(
        at,
        "diagnose other.csv@0..50% -m model.toml --holdout other.csv@50..100%",
    );
    done(
        at,
        "tool w/wrist.csv@0..60% -o tool.toml --holdout w/wrist.csv@60..100%",
    );
}
