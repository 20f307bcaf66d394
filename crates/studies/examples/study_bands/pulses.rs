//! How small a pulse of torque is found.
//!
//! What an observer shows is linear in a torque that is added to the measured one: the response to a pulse of size 1 is
//! computed once, and the smallest size that is found at a place of a log is where response and what was there
//! without it reach the threshold together.

use cft_ident::effect::AugmentedModel;
use cft_ident::log::Block;
use cft_ident::motion::FilterSettings;
use cft_ident::observe::Observer;
use cft_ident::robot::model::{JointFriction, Model};
use cft_ident::robot::{JointKind, Robot};
use serde_json::{Value, json};

/// Durations \[s\].
pub const DURATIONS: [f64; 4] = [0.05, 0.2, 0.5, 2.0];
/// Pulses along a log.
const PLACES: usize = 60;

/// Smallest sizes over places and signs, by duration; and delays of pulses half as large again.
#[derive(Default)]
pub struct Pulses {
    smallest: [Vec<f64>; 4],
    delays: [Vec<f64>; 4],
}

/// What an observer shows of a torque that is on from 0 for so many seconds, from 0 to a second later.
pub fn shown(
    torque: &dyn Fn(f64) -> f64,
    seconds: f64,
    step: f64,
    settings: &FilterSettings,
) -> Vec<f64> {
    let model = AugmentedModel::plain(Model {
        robot: Robot::single_joint("q", JointKind::Revolute),
        theta: vec![0.0],
        friction: vec![JointFriction::None],
        offset: vec![0.0],
    });
    let mut observer = Observer::new(model, settings).expect("filters");
    let mut block = Block::default();
    let lead = 4.0;
    let rows = ((lead + seconds + 1.0) / step) as usize;
    for k in 0..rows {
        let t = k as f64 * step - lead;
        block.t.push(t);
        block.q.push(0.0);
        let on = t >= -1e-9 && t < seconds - 1e-9;
        block.tau.push(if on { torque(t.max(0.0)) } else { 0.0 });
    }
    let mut out = Vec::new();
    let mut take = |o: &cft_ident::observe::ExternalTorques| {
        if o.t >= -1e-9 {
            out.push(o.external[0]);
        }
    };
    observer.push(&block, true, &mut take).expect("samples");
    out
}

/// The value that the share `p` of the numbers lies at or below; none of none.
pub fn quantile(x: &[f64], p: f64) -> Option<f64> {
    let mut x = x.to_vec();
    x.sort_by(f64::total_cmp);
    x.get(((p * x.len() as f64).ceil() as usize).max(1) - 1)
        .copied()
}

impl Pulses {
    /// Takes a log: times, external torques, and thresholds.
    pub fn take(&mut self, rows: &[(f64, f64, f64)], settings: &FilterSettings) {
        if rows.len() < 2 {
            return;
        }
        let (first, last) = (rows[0].0, rows[rows.len() - 1].0);
        let step = (last - first) / (rows.len() - 1) as f64;
        for (i, seconds) in DURATIONS.into_iter().enumerate() {
            let shape = shown(&|_| 1.0, seconds, step, settings);
            let room = rows.len().saturating_sub(shape.len());
            if room == 0 {
                continue;
            }
            for place in 0..PLACES {
                let at = place * room / PLACES;
                for sign in [-1.0, 1.0] {
                    let size = |k: usize| {
                        let (_, external, limit) = rows[at + k];
                        // an alarm that is on without the pulse finds nothing
                        let missing = limit - sign * external;
                        (shape[k] > 1e-3).then(|| missing.max(0.0) / shape[k])
                    };
                    let sizes = (0..shape.len()).filter_map(size);
                    let smallest = sizes.fold(f64::INFINITY, f64::min);
                    self.smallest[i].push(smallest);
                    let found = (0..shape.len())
                        .find(|k| size(*k).is_some_and(|size| size <= 1.5 * smallest));
                    self.delays[i].extend(found.map(|k| k as f64 * step));
                }
            }
        }
    }

    pub fn summary(&self) -> Value {
        let each = DURATIONS.iter().zip(&self.smallest).zip(&self.delays);
        let each = each.map(|((seconds, sizes), delays)| {
            json!({"seconds": seconds, "size": quantile(sizes, 0.95), "delay_s": quantile(delays, 0.5)})
        });
        each.collect()
    }
}

/// Rows of a machine's joints.
pub fn rows(machine: &Value) -> Vec<Value> {
    let joints = machine["pulses"].as_array().into_iter().flatten();
    let row = |of: &Value| {
        let mut row = json!({"machine": machine["key"], "joint": of["joint"]});
        for (i, seconds) in DURATIONS.iter().enumerate() {
            row[format!("{seconds} s")] = of["smallest"][i]["size"].clone();
        }
        let delay = of["smallest"][1]["delay_s"].as_f64();
        row["delay, 0.2 s at 1.5 times that [ms]"] = json!(delay.map(|s| (1e3 * s).round() as i64));
        row
    };
    joints.map(row).collect()
}

/// Rows of the simulated robot: the median over its minutes.
pub fn of_minutes(minutes: &[Value]) -> Vec<Value> {
    let middle = minutes.len() / 2;
    let joints = minutes
        .first()
        .map_or(0, |m| m["pulses"].as_array().map_or(0, Vec::len));
    let mut merged = Vec::new();
    for j in 0..joints {
        let of = |i: usize, key: &str| {
            let mut x: Vec<f64> = (minutes.iter())
                .filter_map(|m| m["pulses"][j]["smallest"][i][key].as_f64())
                .collect();
            x.sort_by(f64::total_cmp);
            x.get(middle.min(x.len().saturating_sub(1))).copied()
        };
        let smallest: Vec<Value> = (0..DURATIONS.len())
            .map(|i| json!({"size": of(i, "size"), "delay_s": of(i, "delay_s")}))
            .collect();
        let joint = &minutes[0]["pulses"][j]["joint"];
        merged.push(json!({"joint": joint, "smallest": smallest}));
    }
    rows(&json!({"key": "CFT, simulated", "pulses": merged}))
}
