//! The simulated CFT robot: a model of twenty minutes, and minutes that it did not see.

use cft_ident::config::{ModelFile, RobotFile};
use cft_ident::identify::{Control, Dataset, Log, LsqSettings, RobotSetup, lsq};
use cft_ident::motion::ZeroOrderHold;
use cft_ident::robot::cft::LaboratorySetup;
use cft_ident::simulate::CftTruth;
use cft_ident::simulate::cft::follow;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::machines::{Scored, list};
use super::study::{along, block, noisy, series};

/// Minutes that the model is fitted to: by how many alarms a rate is learnt, by so many it is known.
const FITTED: u64 = 20;

pub struct Campaign {
    machine: RobotSetup,
    model: ModelFile,
}

/// A minute of the campaign's motion at phases of its own.
fn minute(machine: &RobotSetup, seed: u64) -> Log {
    let motion = series("configs/cft-excitation.toml").at_random_phase(seed);
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let run = follow(&truth, &[], along(motion), &noisy(60.0, seed)).expect("a run");
    let mut block = block(&run);
    ZeroOrderHold::new(4).centre(&machine.robot, &mut block);
    Log::of_rows(&format!("minute {seed}"), &block.t, &block.q, &block.tau).expect("a log")
}

impl Campaign {
    pub fn new() -> Self {
        let mut file = RobotFile::load("configs/cft.toml".as_ref()).expect("a robot file");
        file.friction.fitted_with_inertias = true;
        let machine = RobotSetup::new("configs/cft.toml", file);
        let logs: Vec<Log> = (0..FITTED)
            .into_par_iter()
            .map(|seed| minute(&machine, 1_000_000 + seed))
            .collect();
        let settings = LsqSettings::default();
        let found = lsq(
            &Dataset::read(&machine, &logs, &Control::default()).expect("logs that can be read"),
            &settings,
            &Control::default(),
        )
        .expect("a fit");
        let model = found.model(&machine, None);
        Campaign { machine, model }
    }

    /// A minute that the model did not see.
    pub fn minute(&self, seed: u64) -> Value {
        let log = minute(&self.machine, seed);
        let mut scored = Scored::new(4);
        scored.score(&self.model, &[log]);
        scored.summary(self.machine.robot.joint_names())
    }
}

/// All minutes as one machine; none of no minutes.
pub fn merged(minutes: &[Value]) -> Option<Value> {
    if minutes.is_empty() {
        return None;
    }
    let joints = minutes.first().map_or(0, |m| list(&m["coverage"]).len());
    let total = |of: &dyn Fn(&Value) -> f64| minutes.iter().map(of).sum::<f64>();
    let samples: Vec<f64> = (0..joints)
        .map(|j| total(&|m| list(&m["samples"])[j]))
        .collect();
    let coverage: Vec<f64> = (0..joints)
        .map(|j| total(&|m| list(&m["coverage"])[j] * list(&m["samples"])[j]) / samples[j])
        .collect();
    let widths: Vec<f64> = minutes.iter().flat_map(|m| list(&m["widths"])).collect();
    let beyond = [0, 1].map(|i| total(&|m| list(&m["beyond"])[i]));
    Some(json!({
        "key": "CFT, simulated",
        "coverage": coverage,
        "samples": samples,
        "widths": widths,
        "beyond": beyond,
        "alarms": total(&|m| m["alarms"].as_f64().unwrap_or(0.0)) as u64,
        "watched_s": total(&|m| m["watched_s"].as_f64().unwrap_or(0.0)),
    }))
}
