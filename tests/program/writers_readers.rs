//! Whatever a command writes, every other command takes, on measured machines: models of all commands that write some,
//! by all commands that read one. A refusal is one that the machine or the kind of the model calls for, by name; and a
//! model that is validated on held-out data has the error that its diagnosis stated.

use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::measured_support::{run, shared};

/// A machine with a log to fit and one to hold out.
struct Machine {
    robot: &'static str,
    fit: String,
    held: String,
    /// What is run first.
    before: String,
    /// Models, and the command that writes each.
    writers: Vec<[&'static str; 2]>,
    /// Why files of links, simulations and payloads are refused, where this machine has none.
    no_links: Option<&'static str>,
    no_payload: bool,
}

/// Models of most machines; the first two are followed in time.
const WRITERS: [[&str; 2]; 4] = [
    ["early.toml", "lsq HELD -r ROBOT -o early.toml"],
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
    "excite -m MODEL --for weak --harmonics 2 --periods 2 -o motion.toml --samples motion.csv",
    "simulate -r ROBOT -m MODEL --seconds 4 -o simulated.csv",
    "export -m MODEL --c x.h --observer 200",
    "export -m MODEL --rust x.rs",
    "export -m MODEL --ros2-control x.yaml",
    "export -m MODEL --urdf x.urdf",
    "export -m MODEL --mjcf x.xml",
    "export -m MODEL --sdf x.sdf",
    "export -m MODEL --usd x.usda",
    "track early.toml fit.toml",
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
            "FIT" => self.fit.clone(),
            "HELD" => self.held.clone(),
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
                    // a fit with negative friction wants more torque at rest than its log ever had
                    let at_rest = self.no_payload && line.starts_with("excite");
                    // a fit that misses its own log foresees more torque than that log reached
                    let narrow = line.starts_with("excite") && said.contains("widen that limit");
                    assert!(
                        reason.is_some_and(|reason| said.contains(reason))
                            || narrow
                            || at_rest && said.contains("at rest already"),
                        "{line} of {model}: {said}"
                    );
                    if narrow {
                        self.read_with_wider_limits(folder, line, model);
                    }
                }
                status => panic!("{line} of {model}: {status:?} {said}"),
            }
        }
        for [made, line] in AFTER {
            // a motor that turns one way comes to the end of its simulated travel at once
            let short = made == "simulated.csv" && self.no_links.is_some();
            if folder.join(made).exists() && !short {
                let output = self.run(folder, line, model);
                let said = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{line} after {model}: {said}");
                std::fs::remove_file(folder.join(made)).ok();
            }
        }
    }

    /// The advice of a refused motion, followed: torques that no file bounds may be ten times what the log reached.
    fn read_with_wider_limits(&self, folder: &Path, line: &str, model: &str) {
        let text = std::fs::read_to_string(folder.join(model)).unwrap();
        let mut wide: toml::Table = text.parse().unwrap();
        let held = wide["held_out"].as_array().unwrap().clone();
        let limits = wide
            .entry("limits")
            .or_insert_with(|| toml::Table::new().into());
        let limits = limits.as_table_mut().unwrap();
        for joint in held {
            let limits = limits
                .entry(joint["joint"].as_str().unwrap())
                .or_insert_with(|| toml::Table::new().into());
            let wide = 10.0 * joint["torque_seen"].as_float().unwrap();
            let limits = limits.as_table_mut().unwrap();
            limits.entry("torque").or_insert_with(|| wide.into());
        }
        std::fs::write(folder.join("wide.toml"), wide.to_string()).unwrap();
        let output = self.run(folder, line, "wide.toml");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success(),
            "{line} of {model}, wide limits: {said}"
        );
    }

    fn every_writer_and_reader(&self) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let first = [self.before.as_str()]
            .into_iter()
            .filter(|line| !line.is_empty());
        let writers = self.writers.iter().map(|[_, line]| *line);
        for line in first.chain(writers) {
            let output = self.run(path, line, "");
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{line}: {said}");
        }
        // friction alone gives no torque; it is read by the fits here
        let models = self.writers.iter().map(|[model, _]| *model);
        for model in models.filter(|model| !matches!(*model, "friction.toml" | "early.toml")) {
            self.read(path, model);
        }
        self.stated_errors(path);
    }

    /// Held-out errors that a diagnosis states are those of `validate`, as given and after.
    fn stated_errors(&self, folder: &Path) {
        let line = "diagnose FIT -m fit.toml --holdout HELD -o refined.toml";
        let stated = run(folder, &self.words(line, ""));
        // where held-out data took an effect out, what is written has errors of its own
        let after = match stated["written"].is_null() {
            true => "after",
            false => "written",
        };
        for (model, when) in [("fit.toml", "before"), ("refined.toml", after)] {
            let found = run(folder, &self.words("validate HELD -m MODEL", model));
            let error = |of: &Value| of["overall"]["mean_relative_error"].as_f64().unwrap();
            let (stated, found) = (error(&stated[when]["holdout"]), error(&found));
            assert!(
                (found / stated - 1.0).abs() < 0.02,
                "{} {when}: stated {stated}, validated {found}",
                self.fit
            );
        }
    }
}

fn machine(robot: &'static str, log: &str) -> Option<Machine> {
    let log = shared(log)?.to_str()?.to_owned();
    Some(Machine {
        robot,
        fit: format!("{log}@0..70%"),
        held: format!("{log}@70..100%"),
        before: String::new(),
        writers: WRITERS.to_vec(),
        no_links: None,
        no_payload: false,
    })
}

#[test]
fn what_is_written_of_a_ur10_every_command_takes() {
    if let Some(machine) = machine("configs/ur10.toml", "ur10/ur10_exciting.csv") {
        machine.every_writer_and_reader();
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

#[test]
#[ignore = "another arm, a minute and more; `cargo test -- --ignored writers_readers`"]
fn what_is_written_of_a_panda_every_command_takes() {
    if let Some(machine) = machine("configs/panda.toml", "panda/panda_exciting.csv") {
        let [fit, held] = ["0..50%", "50..100%"].map(|part| machine.fit.replace("0..70%", part));
        Machine {
            fit,
            held,
            ..machine
        }
        .every_writer_and_reader();
    }
}

#[test]
#[ignore = "another arm, a minute and more; `cargo test -- --ignored writers_readers`"]
fn what_is_written_of_a_pendulum_every_command_takes() {
    if let Some(machine) = machine("arm.toml", "pendulum/055640.csv") {
        let folder = machine.fit.split("055640").next().unwrap();
        let before =
            format!("new arm --urdf {folder}double_pendulum.urdf --log {folder}055903.csv");
        Machine {
            fit: format!("{folder}055640.csv"),
            held: format!("{folder}055903.csv"),
            before,
            ..machine
        }
        .every_writer_and_reader();
    }
}

#[test]
#[ignore = "fits to the motion take a minute and more; `cargo test -- --ignored writers_readers`"]
fn what_is_written_of_an_axis_every_command_takes() {
    if let Some(machine) = machine("configs/emps.toml", "emps/emps_id.csv") {
        let more = [
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
        Machine {
            no_payload: true,
            writers: [&WRITERS[..], &more].concat(),
            ..machine
        }
        .every_writer_and_reader();
    }
}

#[test]
#[ignore = "a whole campaign, a minute and more; `cargo test -- --ignored writers_readers`"]
fn what_is_written_of_the_cft_robot_every_command_takes() {
    let log = |name: &str| format!("run/{name}.csv");
    Machine {
        robot: "configs/cft.toml",
        fit: log("identification"),
        held: log("unseen"),
        before: "identify -o run".to_owned(),
        writers: vec![
            [
                "early.toml",
                "lsq HELD -r ROBOT -m run/friction.toml -o early.toml",
            ],
            [
                "fit.toml",
                "lsq FIT -r ROBOT -m run/friction.toml -o fit.toml",
            ],
            [
                "refined.toml",
                "diagnose FIT -m fit.toml --holdout HELD -o refined.toml",
            ],
        ],
        no_links: Some("a file of links cannot hold"),
        no_payload: true,
    }
    .every_writer_and_reader();
}
