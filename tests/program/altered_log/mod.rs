//! Simulated logs that a test alters, and what `inspect` says of them.
#![allow(dead_code)]

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use cft_ident::config::RobotFile;
use cft_ident::config::model_file::{ModelFile, ModelProvenance};
use cft_ident::simulate::{Experiment, Order, simulate};
use serde_json::Value;

/// A log as columns.
#[derive(Debug, Clone)]
pub struct Log {
    pub names: Vec<String>,
    pub columns: Vec<Vec<f64>>,
}

impl Log {
    /// The CFT robot, with what its robot file says of encoders and noise: joint channels alone.
    pub fn simulated(experiment: Experiment, seconds: f64) -> Self {
        let joint = |name: &str| name.contains("q_") || name.contains("tau_");
        Self::with(experiment, seconds, &joint)
    }

    /// The same with its motors' positions and volts alone.
    pub fn simulated_raw(seconds: f64) -> Self {
        let raw = |name: &str| name.starts_with("x_c") || name.starts_with("u_");
        Self::with(Experiment::Usual, seconds, &raw)
    }

    fn with(experiment: Experiment, seconds: f64, wanted: &dyn Fn(&str) -> bool) -> Self {
        let robot = RobotFile::load(Path::new("configs/cft.toml")).unwrap();
        let log = simulate(&Order {
            robot: &robot,
            model: None,
            experiment,
            seconds: Some(seconds),
            effects: Vec::new(),
            seed: 11,
        })
        .unwrap();
        let kept: Vec<usize> = (0..log.header.len())
            .filter(|j| log.header[*j] == "t" || wanted(&log.header[*j]))
            .collect();
        Self {
            names: kept.iter().map(|j| log.header[*j].clone()).collect(),
            columns: kept
                .iter()
                .map(|j| log.rows().map(|row| row[*j]).collect())
                .collect(),
        }
    }

    pub fn column(&mut self, name: &str) -> &mut Vec<f64> {
        let index = self.names.iter().position(|known| known == name);
        &mut self.columns[index.expect(name)]
    }

    pub fn add(&mut self, name: &str, column: Vec<f64>) {
        self.names.push(name.to_owned());
        self.columns.push(column);
    }

    /// Removes some rows.
    pub fn drain(&mut self, rows: std::ops::Range<usize>) {
        for column in &mut self.columns {
            column.drain(rows.clone());
        }
    }

    pub fn write(&self, path: &Path) {
        let mut file = BufWriter::new(File::create(path).unwrap());
        writeln!(file, "{}", self.names.join(",")).unwrap();
        for k in 0..self.columns[0].len() {
            let row: Vec<String> = self.columns.iter().map(|c| format!("{:?}", c[k])).collect();
            writeln!(file, "{}", row.join(",")).unwrap();
        }
    }

    /// What `inspect` says of it by a model.
    pub fn inspected_by(&self, model: &Path) -> Value {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        self.write(&path);
        inspect_with(
            &path.to_string_lossy(),
            Some(("-m", &model.to_string_lossy())),
        )
    }

    /// What `inspect` says of it, with the robot file or without.
    pub fn inspected(&self, robot: Option<&str>) -> Value {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        self.write(&path);
        inspect(&path.to_string_lossy(), robot)
    }
}

/// Writes the model that the simulated logs are of.
pub fn write_model(path: &Path) {
    let robot = RobotFile::load(Path::new("configs/cft.toml")).unwrap();
    let truth = simulate(&Order {
        robot: &robot,
        model: None,
        experiment: Experiment::Usual,
        seconds: Some(0.1),
        effects: Vec::new(),
        seed: 11,
    });
    let model = ModelFile {
        estimates: Vec::new(),
        estimate_covariance: None,
        friction_prior: Vec::new(),
        held_out: Vec::new(),
        excesses: None,
        robot: robot.clone(),
        parameters: truth.unwrap().truth.parameters,
        covariance: None,
        residual_std: BTreeMap::new(),
        effects: Vec::new(),
        links: Vec::new(),
        drive_inertia: Default::default(),
        candidates: Vec::new(),
        provenance: ModelProvenance::default(),
    };
    std::fs::write(path, model.to_toml().unwrap()).unwrap();
}

/// The JSON document of `inspect`.
pub fn inspect(log: &str, robot: Option<&str>) -> Value {
    inspect_with(log, robot.map(|robot| ("-r", robot)))
}

fn inspect_with(log: &str, known: Option<(&str, &str)>) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("found.json");
    let mut line = vec!["cft-ident", "inspect", log, "-q", "--json"];
    let json_text = json.to_string_lossy().into_owned();
    line.push(&json_text);
    if let Some((option, file)) = known {
        line.extend([option, file]);
    }
    let exit = cft_ident::cli::run(
        line.into_iter().map(Into::into),
        Arc::new(AtomicBool::new(false)),
    );
    assert_eq!(exit.code(), 0, "{log}");
    serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap()
}

/// A fault in short: severity, kind, channel, from and to.
pub type Short = (String, String, String, f64, f64);

/// The faults that are more than worth knowing.
pub fn faults(found: &Value) -> Vec<Short> {
    let all = found["faults"].as_array().unwrap().iter();
    all.filter(|fault| fault["severity"] != "info")
        .map(|fault| {
            let text = |key: &str| fault[key].as_str().unwrap_or("").to_owned();
            let number = |key: &str| fault[key].as_f64().unwrap();
            assert!(
                !text("effect").is_empty() && !text("remedy").is_empty(),
                "{fault}"
            );
            (
                text("severity"),
                text("kind"),
                text("channel"),
                number("from_s"),
                number("to_s"),
            )
        })
        .collect()
}

/// Asserts that exactly these faults were found, spans to 2 ms.
pub fn assert_faults(found: &Value, expected: &[(&str, &str, &str, f64, f64)]) {
    let all = faults(found);
    let same = all.len() == expected.len()
        && all.iter().zip(expected).all(|(a, b)| {
            (a.0.as_str(), a.1.as_str(), a.2.as_str()) == (b.0, b.1, b.2)
                && (a.3 - b.3).abs() < 2e-3
                && (a.4 - b.4).abs() < 2e-3
        });
    assert!(same, "found {all:#?}\nexpected {expected:#?}");
}
