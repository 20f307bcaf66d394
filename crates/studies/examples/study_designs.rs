//! Condition numbers that designs reach within each set-up's limits, beside Table 3 of the report:
//! N = 4, 0.4 Hz, 4000 revolutions per minute of every motor, 10 V, what `excite` does by default.
//!
//! `cargo run -p cft-ident-studies --example study_designs -- [FOLDER]` writes into FOLDER the summary that
//! docs/results/studies.md is generated from. It takes a minute or two on two cores.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use cft_ident::config::{RobotFile, Trajectory};
use cft_ident::excite::information::InformationFactors;
use cft_ident::excite::machine::ForeseenRobot;
use cft_ident::excite::search::{DesignTask, design};
use cft_ident::excite::series::Series;
use cft_ident::excite::usage::{along_period, worst};
use cft_ident::excite::{Criterion, machine, series_of};
use serde_json::{Value, json};

/// Share of every limit that is left free, starts and seed: the defaults of `excite`.
const RESERVE: f64 = 0.05;
const STARTS: usize = 16;
const SEED: u64 = 1;

fn main() {
    let folder = std::env::args().nth(1);
    let folder = PathBuf::from(folder.unwrap_or_else(|| "docs/results".into()));
    let mut rows = Vec::new();
    for (name, file) in [
        ("TUeDACS", "configs/cft.toml"),
        ("dSPACE", "configs/cft-dspace.toml"),
    ] {
        let robot = RobotFile::load(Path::new(file)).expect("comes with the tool");
        let machine = machine(&robot, None).expect("a machine");
        let table_3 = table_3(&machine);
        rows.push(row(
            &machine,
            &table_3,
            json!({
                "limits": name, "criterion": "none: Table 3", "offsets": "the report's",
            }),
        ));
        for free in [true, false] {
            for criterion in [Criterion::Condition, Criterion::ConditionNormalised] {
                let before = processor_seconds();
                let task = DesignTask {
                    criterion: criterion.clone(),
                    fundamental_hz: 0.4,
                    harmonics: 4,
                    offsets: offsets(&machine, &table_3, free),
                    reserve: RESERVE,
                    prior: None,
                    starts: STARTS,
                    evaluations: None,
                    seed: SEED,
                };
                let found = design(&machine, &task, &|_| {}, &AtomicBool::new(false));
                let found = found.expect("a design");
                let mut line = row(
                    &machine,
                    &found.series,
                    json!({
                        "limits": name,
                        "criterion": match criterion {
                            Criterion::Condition => "condition",
                            _ => "condition-normalised",
                        },
                        "offsets": if free { "chosen" } else { "the report's" },
                    }),
                );
                line["evaluations"] = found.evaluations.into();
                line["processor seconds"] = format!("{:.1}", processor_seconds() - before).into();
                eprintln!("{line}");
                rows.push(line);
            }
        }
    }
    let document = json!({
        "study": "condition numbers of designs and of Table 3",
        "command": "cargo run -p cft-ident-studies --example study_designs",
        "rows": rows,
    });
    let path = folder.join("study_designs.json");
    std::fs::write(&path, format!("{document:#}\n")).expect("the summary is written");
}

/// Time that this process has had of all processors \[s\]: elapsed time would be that of whatever else
/// runs. 0 where the system does not tell.
fn processor_seconds() -> f64 {
    const TICKS_PER_SECOND: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let behind_name = text.rsplit(')').next().unwrap_or_default();
    let fields: Vec<&str> = behind_name.split_whitespace().collect();
    let ticks = |k: usize| fields.get(k).and_then(|f| f.parse::<f64>().ok());
    // fields 14 and 15 of the line, user and system
    (ticks(11).unwrap_or(0.0) + ticks(12).unwrap_or(0.0)) / TICKS_PER_SECOND
}

fn table_3(machine: &ForeseenRobot) -> Series {
    let file = Trajectory::load(Path::new("configs/table3.toml")).expect("comes with the tool");
    let Trajectory::Fourier(file) = file else {
        panic!("Table 3 is a Fourier series");
    };
    series_of(machine, &file).expect("fits the machine")
}

/// The printed offsets, where the limits allow them: that of x_c4 lies outside dSPACE's.
fn offsets(machine: &ForeseenRobot, table_3: &Series, free: bool) -> Vec<Option<f64>> {
    let allowed = |i: usize, offset: f64| {
        let mut all = machine.channels.iter();
        let position = all.find(|c| c.quantity.name() == "position" && c.index == i);
        position.is_none_or(|c| (c.lower..=c.upper).contains(&offset))
    };
    let printed = table_3.offset.iter().copied().enumerate();
    printed
        .map(|(i, offset)| (!free && allowed(i, offset)).then_some(offset))
        .collect()
}

fn row(machine: &ForeseenRobot, series: &Series, mut line: Value) -> Value {
    let information = InformationFactors::of_period(machine, series, 250).expect("reachable");
    for (name, criterion) in [
        ("J_k raw", Criterion::Condition),
        ("J_k normalised", Criterion::ConditionNormalised),
    ] {
        let value = information.value(machine, &criterion, None);
        line[name] = format!("{:.2}", value.expect("finite")).into();
    }
    let used = worst(&along_period(machine, &machine.channels, series));
    line["largest use of a limit"] = format!("{:.0} %", 100.0 * used).into();
    line["evaluations"] = Value::Null;
    line["processor seconds"] = Value::Null;
    line
}
