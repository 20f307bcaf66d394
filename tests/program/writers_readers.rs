//! Whatever a command writes, every other command takes, on measured machines: models of all commands that write some,
//! by all commands that read one. A refusal is one that the machine or the kind of the model calls for, by name; and a
//! model that is validated on held-out data has the error that its diagnosis stated.

use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::measured_support::{run, shared};

/// A machine with a log, which is divided into a part to fit and one to hold out.
struct Machine {
    robot: &'static str,
    log: String,
    /// Why files of links, simulations and payloads are refused, where this machine has none.
    no_links: Option<&'static str>,
    no_payload: bool,
    /// Writers besides those of every machine.
    more: &'static [[&'static str; 2]],
}

/// Models of every machine, and the command that writes each.
const WRITERS: [[&str; 2]; 3] = [
    ["fit.toml", "lsq FIT -r ROBOT -o fit.toml"],
    [
        "plain.toml",
        "lsq FIT -r ROBOT --unconstrained -o plain.toml",
    ],
    [
        "refined.toml",
        "diagnose FIT -m fit.toml --holdout HELD -o refined.toml",
    ],
];

/// What takes a model.
const READERS: [&str; 17] = [
    "validate HELD -m MODEL -o residual.csv",
    "show MODEL --report show.html",
    "torque HELD -m MODEL -o tau.csv",
    "watch HELD -m MODEL -o external.csv",
    "compare fit.toml MODEL HELD",
    "diagnose FIT -m MODEL -o again.toml",
    "payload FIT -m MODEL -o loaded.toml",
    "excite -m MODEL --for weak --starts 1 --evaluations 20 --periods 2 -o motion.toml --samples motion.csv",
    "simulate -r ROBOT -m MODEL --seconds 4 -o simulated.csv",
    "export -m MODEL --c x.h --observer 200",
    "export -m MODEL --rust x.rs",
    "export -m MODEL --ros2-control x.yaml",
    "export -m MODEL --urdf x.urdf",
    "export -m MODEL --mjcf x.xml",
    "export -m MODEL --sdf x.sdf",
    "export -m MODEL --usd x.usda",
    "track early.toml late.toml",
];

/// What takes what the readers wrote.
const AFTER: [[&str; 2]; 7] = [
    ["again.toml", "show again.toml"],
    ["again.toml", "validate HELD -m again.toml"],
    ["loaded.toml", "show loaded.toml"],
    ["loaded.toml", "validate HELD -m loaded.toml"],
    ["motion.toml", "torque motion.toml -m MODEL -o along.csv"],
    ["x.toml", "validate HELD -m x.toml"],
    ["simulated.csv", "validate simulated.csv -m MODEL"],
];

impl Machine {
    fn words(&self, line: &str, model: &str) -> Vec<String> {
        let word = |word: &str| match word {
            "FIT" => format!("{}@0..70%", self.log),
            "HELD" => format!("{}@70..100%", self.log),
            "ROBOT" => self.robot.to_owned(),
            "MODEL" => model.to_owned(),
            word => word.to_owned(),
        };
        line.split(' ').map(word).collect()
    }

    fn run(&self, folder: &Path, line: &str, model: &str) -> Output {
        let mut command = assert_cmd::Command::cargo_bin("cft-ident").unwrap();
        let output = command
            .current_dir(folder)
            .args(self.words(line, model))
            .arg("-q")
            .output();
        output.unwrap()
    }

    /// Why a reader may refuse this model, in words of its message.
    fn reason(&self, line: &str, model: &str) -> Option<&'static str> {
        let links = ["--urdf", "--mjcf", "--sdf", "--usd"];
        let of_links = links.iter().any(|word| line.contains(word));
        let simulates = line.starts_with("simulate") || line.contains("--ros2-control");
        match line.split(' ').next() {
            Some("payload") if self.no_payload => Some("in too few numbers"),
            Some("excite") => Some("every parameter of the model is identified"),
            Some("export") if of_links && self.no_links.is_some() => self.no_links,
            // a plain fit may be of bodies that cannot exist
            Some("export") if of_links && model == "plain.toml" => Some("can be no body"),
            Some("simulate") if model == "plain.toml" && self.no_links.is_none() => {
                Some("no physical robot")
            }
            _ if simulates && (model == "plain.toml" || self.no_links.is_some()) => {
                Some("no machine")
            }
            _ => None,
        }
    }

    /// Everything that this model goes into.
    fn read(&self, folder: &Path, model: &str) {
        for line in READERS {
            let output = self.run(folder, line, model);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            match output.status.code() {
                Some(0) => {}
                Some(3) => {
                    let reason = self.reason(line, model);
                    assert!(
                        reason.is_some_and(|reason| said.contains(reason)),
                        "{line} of {model}: {said}"
                    );
                }
                status => panic!("{line} of {model}: {status:?} {said}"),
            }
        }
        for [made, line] in AFTER {
            if folder.join(made).exists() {
                let output = self.run(folder, line, model);
                let said = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{line} after {model}: {said}");
                std::fs::remove_file(folder.join(made)).ok();
            }
        }
    }

    fn every_writer_and_reader(&self) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let write = |line: &str| {
            let output = self.run(path, line, "");
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{line}: {said}");
        };
        for part in ["early", "late"] {
            let span = if part == "early" {
                "0..50%"
            } else {
                "50..100%"
            };
            let log = format!("{}@{span}", self.log);
            let words = ["lsq", &log, "-r", self.robot, "-o", &format!("{part}.toml")];
            run(path, &words);
        }
        let writers: Vec<&[&str; 2]> = WRITERS.iter().chain(self.more).collect();
        for [_, line] in &writers {
            write(line);
        }
        for [model, _] in &writers {
            if *model != "friction.toml" {
                self.read(path, model);
            }
        }
        self.stated_errors(path);
    }

    /// Held-out errors that a diagnosis states are those of `validate`, as given and after.
    fn stated_errors(&self, folder: &Path) {
        let line = "diagnose FIT -m fit.toml --holdout HELD -o refined.toml";
        let stated = run(folder, &self.words(line, ""));
        for (model, when) in [("fit.toml", "before"), ("refined.toml", "after")] {
            let found = run(folder, &self.words("validate HELD -m MODEL", model));
            let error = |of: &Value| of["overall"]["mean_relative_error"].as_f64().unwrap();
            let (stated, found) = (error(&stated[when]["holdout"]), error(&found));
            assert!(
                (found / stated - 1.0).abs() < 0.02,
                "{} {when}: stated {stated}, validated {found}",
                self.log
            );
        }
    }
}

fn machine(robot: &'static str, log: &str) -> Option<Machine> {
    Some(Machine {
        robot,
        log: shared(log)?.to_str()?.to_owned(),
        no_links: None,
        no_payload: false,
        more: &[],
    })
}

#[test]
fn what_is_written_of_a_ur10_every_command_takes() {
    if let Some(machine) = machine("configs/ur10.toml", "ur10/ur10_exciting.csv") {
        machine.every_writer_and_reader();
    }
}

#[test]
#[ignore = "the same of another arm; the slow tier runs it"]
fn what_is_written_of_a_panda_every_command_takes() {
    if let Some(machine) = machine("configs/panda.toml", "panda/panda_exciting.csv") {
        machine.every_writer_and_reader();
    }
}

#[test]
#[ignore = "fits to the motion take long; the slow tier runs it"]
fn what_is_written_of_an_axis_every_command_takes() {
    if let Some(machine) = machine("configs/emps.toml", "emps/emps_id.csv") {
        let more = &[
            ["friction.toml", "friction FIT -r ROBOT -o friction.toml"],
            [
                "known.toml",
                "lsq FIT -r ROBOT -m friction.toml -o known.toml",
            ],
            [
                "motion-fit.toml",
                "lsq FIT -r ROBOT --open-loop -o motion-fit.toml",
            ],
        ];
        let no_payload = true;
        Machine {
            no_payload,
            more,
            ..machine
        }
        .every_writer_and_reader();
    }
}

#[test]
fn what_is_written_of_a_motor_every_command_takes() {
    if let Some(machine) = machine("configs/bldc.toml", "bldc-cogging/speed_test1.txt") {
        Machine {
            no_links: Some("cannot hold an inertia in A"),
            no_payload: true,
            ..machine
        }
        .every_writer_and_reader();
    }
}
