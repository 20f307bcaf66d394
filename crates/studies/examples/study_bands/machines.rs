//! Measured machines in three rotations.

use std::path::Path;

use cft_ident::config::ModelFile;
use cft_ident::identify::{
    Control, Dataset, GivenModel, Log, LsqSettings, RobotSetup, RowSource, ValidateSettings,
    WatchSettings, lsq, validate, watch,
};
use cft_ident::log::LogSpec;
use cft_ident::motion::FilterSettings;
use serde_json::{Value, json};

use super::forces::{Forces, Shown};
use super::pulses::Pulses;

pub struct Machine {
    pub name: &'static str,
    robot: &'static str,
    /// One log, of which thirds are scored, or three.
    logs: &'static [&'static str],
}

pub const ALL: &[Machine] = &[
    Machine {
        name: "EMPS",
        robot: "configs/emps.toml",
        logs: &["emps/emps_id.csv"],
    },
    Machine {
        name: "Panda",
        robot: "configs/panda.toml",
        logs: &["panda/panda_exciting.csv"],
    },
    Machine {
        name: "UR10",
        robot: "configs/ur10.toml",
        logs: &["ur10/ur10_exciting.csv"],
    },
    Machine {
        name: "TX40",
        robot: "configs/tx40.toml",
        logs: &["tx40/tx40_joint.csv"],
    },
    Machine {
        name: "KR300",
        robot: "configs/kr300.toml",
        logs: &["kr300/A.csv", "kr300/B.csv", "kr300/C.csv"],
    },
];

fn log(text: &str) -> Log {
    let spec: LogSpec = text.parse().expect("a span");
    Log::from(spec)
}

impl Machine {
    /// The logs to fit and to score of a rotation.
    fn rotation(&self, at: usize) -> (Vec<Log>, Vec<Log>) {
        let path = |name: &str| format!("../shared/data/{name}");
        if let [one] = self.logs {
            let third = |i: usize| format!("{}@{}..{}%", path(one), 33 * i, [33, 66, 100][i]);
            let fitted = (0..3).filter(|i| *i != at).map(|i| log(&third(i)));
            return (fitted.collect(), vec![log(&third(at))]);
        }
        let fitted = (0..3)
            .filter(|i| *i != at)
            .map(|i| log(&path(self.logs[i])));
        (fitted.collect(), vec![log(&path(self.logs[at]))])
    }

    /// All three rotations; none where the data are not there.
    pub fn study(&self) -> Option<Value> {
        if !Path::new("../shared/data").join(self.logs[0]).exists() {
            eprintln!("{}: no data, skipped", self.name);
            return None;
        }
        let machine = RobotSetup::load(self.robot).expect("a robot file");
        let mut scored = Scored::new(machine.robot.joints());
        let control = Control::default();
        for rotation in 0..3 {
            let (fitted, unseen) = self.rotation(rotation);
            let found = lsq(
                &Dataset::read(&machine, &fitted, &Control::default())
                    .expect("logs that can be read"),
                &LsqSettings::default(),
                &control,
            )
            .expect("a fit");
            let model = found.model(&machine, None);
            scored.score(&model, &unseen);
        }
        Some(scored.summary(machine.robot.joint_names()))
    }
}

/// What a model leaves of logs that it did not see.
pub struct Scored {
    /// Of each joint: samples, those inside the band, sum of half widths.
    band: Vec<[f64; 3]>,
    errors: Vec<Vec<f64>>,
    /// Half width over that of the constant band which would have held 95 % of a log, joint by joint.
    widths: Vec<f64>,
    /// Samples of external torques, and those beyond the 99 % torque.
    beyond: [f64; 2],
    pub alarms: u64,
    pub watched_s: f64,
    pub pulses: Vec<Pulses>,
    forces: Forces,
}

impl Scored {
    pub fn new(joints: usize) -> Self {
        Scored {
            band: vec![[0.0; 3]; joints],
            errors: vec![Vec::new(); joints],
            widths: Vec::new(),
            beyond: [0.0; 2],
            alarms: 0,
            watched_s: 0.0,
            pulses: (0..joints).map(|_| Pulses::default()).collect(),
            forces: Forces::default(),
        }
    }

    pub fn score(&mut self, model: &ModelFile, logs: &[Log]) {
        let given = GivenModel::new("model", model.clone());
        let machine = given.setup();
        let control = Control::default();
        let (data, tried) = (
            Dataset::read(&machine, logs, &Control::default()).expect("logs that can be read"),
            ValidateSettings::of(&given),
        );
        let mut band = vec![[0.0; 3]; self.band.len()];
        // times and positions, by which forces act
        let mut positions: Vec<(f64, Vec<f64>)> = Vec::new();
        let errors = &mut self.errors;
        errors.iter_mut().for_each(Vec::clear);
        validate(&data, &tried, &control, &mut |r, _| {
            positions.push((r.t, r.q.to_vec()));
            for (j, band) in band.iter_mut().enumerate() {
                let error = (r.measured[j] - r.reconstructed[j]).abs();
                band[0] += 1.0;
                band[1] += f64::from(u8::from(error <= r.half_width[j]));
                band[2] += r.half_width[j];
                errors[j].push(error);
            }
        })
        .expect("a validation");
        for (j, errors) in errors.iter_mut().enumerate() {
            errors.sort_by(f64::total_cmp);
            let constant = errors[(0.95 * errors.len() as f64) as usize];
            self.widths.push(band[j][2] / band[j][0] / constant);
            for (sum, x) in self.band[j].iter_mut().zip(band[j]) {
                *sum += x;
            }
        }
        for log in logs {
            let settings = WatchSettings {
                per_hour: 60.0,
                unloaded: &[],
            };
            let input = RowSource::Log(log.clone());
            let mut rows: Vec<(f64, Vec<f64>, Vec<f64>)> = Vec::new();
            let found = watch(&given, input, &settings, &control, &mut |line| {
                for (j, held) in model.held_out.iter().enumerate() {
                    self.beyond[0] += 1.0;
                    let beyond = line.external[j].abs() > line.std[j] * held.external_99;
                    self.beyond[1] += f64::from(u8::from(beyond));
                }
                rows.push((line.t, line.external.to_vec(), line.std.to_vec()));
                true
            })
            .expect("a watch");
            self.alarms += found.alarms.len() as u64;
            self.watched_s += found.duration_s;
            let excesses = model.excesses.as_ref().expect("excesses");
            let threshold = excesses.threshold(60.0);
            let settings = FilterSettings {
                q_cutoff_hz: Some(excesses.position_cutoff_hz),
                ..machine.settings()
            };
            if machine.robot.joints() > 1 {
                let limits: Vec<f64> = (model.held_out.iter())
                    .map(|held| threshold * held.external_99)
                    .collect();
                let shown = rows.iter().map(|(t, external, std)| {
                    let at = positions.partition_point(|(own, _)| own < t);
                    Shown {
                        t: *t,
                        q: positions[at.min(positions.len() - 1)].1.clone(),
                        external: external.clone(),
                        limit: std.iter().zip(&limits).map(|(s, x)| s * x).collect(),
                    }
                });
                let shown: Vec<Shown> = shown.collect();
                self.forces.take(&machine.robot, &shown, &settings);
            }
            for (j, pulses) in self.pulses.iter_mut().enumerate() {
                let limit = threshold * model.held_out[j].external_99;
                let of = rows.iter().map(|(t, x, std)| (*t, x[j], limit * std[j]));
                pulses.take(&of.collect::<Vec<_>>(), &settings);
            }
        }
    }

    pub fn summary(&self, joints: &[String]) -> Value {
        let pulses = joints.iter().zip(&self.pulses);
        let pulses = pulses.map(|(joint, of)| json!({"joint": joint, "smallest": of.summary()}));
        json!({
            "coverage": self.band.iter().map(|b| b[1] / b[0]).collect::<Vec<_>>(),
            "samples": self.band.iter().map(|b| b[0]).collect::<Vec<_>>(),
            "widths": self.widths,
            "beyond": self.beyond,
            "alarms": self.alarms,
            "watched_s": self.watched_s,
            "pulses": pulses.collect::<Vec<_>>(),
            "forces": self.forces.summary(),
        })
    }
}

pub fn list(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().into_iter().flatten();
    numbers.filter_map(Value::as_f64).collect()
}

pub fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

fn percent(x: f64) -> String {
    format!("{:.1} %", 100.0 * x)
}

/// A row of the table of bands.
pub fn band_row(machine: &Value) -> Value {
    let (coverage, samples) = (list(&machine["coverage"]), list(&machine["samples"]));
    let all = coverage
        .iter()
        .zip(&samples)
        .map(|(c, n)| c * n)
        .sum::<f64>()
        / samples.iter().sum::<f64>();
    let least = coverage.iter().copied().fold(1.0, f64::min);
    let most = coverage.iter().copied().fold(0.0, f64::max);
    json!({
        "machine": machine["key"],
        "inside the 95 % band": percent(all),
        "joints, least": percent(least),
        "joints, most": percent(most),
        "mean width over that of the constant band in hindsight": mean(&list(&machine["widths"])),
    })
}

/// A row of the table of external torques.
pub fn watch_row(machine: &Value) -> Value {
    let beyond = list(&machine["beyond"]);
    let hours = machine["watched_s"].as_f64().unwrap_or(f64::NAN) / 3600.0;
    let alarms = machine["alarms"].as_f64().unwrap_or(f64::NAN);
    json!({
        "machine": machine["key"],
        "beyond the 99 % torque": format!("{:.2} %", 100.0 * beyond[1] / beyond[0]),
        "watched [s]": 3600.0 * hours,
        "alarms": machine["alarms"],
        "alarms an hour where 60 are stated": alarms / hours,
    })
}
