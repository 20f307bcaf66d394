//! How small a force on the last link is found: J'f is added to the measured torques.

use cft_ident::motion::FilterSettings;
use cft_ident::robot::Robot;
use cft_ident::robot::tree::pose::origins;
use serde_json::{Value, json};

use super::pulses::{DURATIONS, quantile, shown};

/// Poses along a log.
const PLACES: usize = 30;
/// Steps by which the Jacobian is differenced [m or rad].
const STEP: f64 = 1e-6;
const DIRECTIONS: [&str; 3] = ["x", "y", "z"];

/// Smallest sizes over poses and signs, and delays of forces half as large again, by direction and duration.
#[derive(Default)]
pub struct Forces {
    smallest: [[Vec<f64>; 4]; 3],
    delays: [[Vec<f64>; 4]; 3],
}

/// One sample of what an observer shows.
pub struct Shown {
    pub t: f64,
    pub q: Vec<f64>,
    pub external: Vec<f64>,
    /// The threshold of each joint [N or Nm].
    pub limit: Vec<f64>,
}

/// Torque of each joint by a force of 1 N at the origin of the last link's frame, along a direction of the base.
fn torques(robot: &Robot, q: &[f64], direction: usize) -> Vec<f64> {
    let tree = robot.tree();
    let last = tree.links().len() - 1;
    let at = |j: usize, by: f64| {
        let mut q = q.to_vec();
        q[j] += by;
        origins(tree, &q)[last][direction]
    };
    let of = |j: usize| (at(j, STEP) - at(j, -STEP)) / (2.0 * STEP);
    (0..q.len()).map(of).collect()
}

impl Forces {
    /// Takes a log.
    pub fn take(&mut self, robot: &Robot, rows: &[Shown], settings: &FilterSettings) {
        let [Some(first), Some(last)] = [rows.first(), rows.last()] else {
            return;
        };
        let step = (last.t - first.t) / (rows.len().max(2) - 1) as f64;
        for (i, seconds) in DURATIONS.into_iter().enumerate() {
            let long = ((seconds + 1.0) / step) as usize;
            let room = rows.len().saturating_sub(long);
            for place in 0..PLACES.min(room) {
                let rows = &rows[place * room / PLACES..];
                for direction in 0..DIRECTIONS.len() {
                    self.push(robot, rows, (direction, i), (seconds, step), settings);
                }
            }
        }
    }

    /// A push from the first of these rows on, with both signs.
    fn push(
        &mut self,
        robot: &Robot,
        rows: &[Shown],
        (direction, i): (usize, usize),
        (seconds, step): (f64, f64),
        settings: &FilterSettings,
    ) {
        let count = (seconds / step).ceil() as usize + 1;
        let along = rows.iter().take(count);
        let along: Vec<Vec<f64>> = along.map(|row| torques(robot, &row.q, direction)).collect();
        let joints = 0..robot.joints();
        let shapes: Vec<Vec<f64>> = joints
            .map(|j| {
                let of = |t: f64| along[((t / step).round() as usize).min(along.len() - 1)][j];
                shown(&of, seconds, step, settings)
            })
            .collect();
        for sign in [-1.0, 1.0] {
            // the force by which a joint reaches its threshold at a sample
            let size = |k: usize| {
                let each = shapes.iter().zip(&rows[k].external).zip(&rows[k].limit);
                let each = each.map(|((shape, external), limit)| {
                    let pushed = sign * shape[k];
                    let missing = match pushed > 0.0 {
                        true => limit - external,
                        false => limit + external,
                    };
                    match pushed.abs() > 1e-4 {
                        true => missing.max(0.0) / pushed.abs(),
                        false => f64::INFINITY,
                    }
                });
                each.fold(f64::INFINITY, f64::min)
            };
            let samples = shapes[0].len().min(rows.len());
            let smallest = (0..samples).map(size).fold(f64::INFINITY, f64::min);
            self.smallest[direction][i].push(smallest);
            let found = (0..samples).find(|k| size(*k) <= 1.5 * smallest);
            self.delays[direction][i].extend(found.map(|k| k as f64 * step));
        }
    }

    pub fn summary(&self) -> Value {
        let direction = |d: usize| {
            let each = (0..DURATIONS.len()).map(|i| {
                json!({
                    "size": quantile(&self.smallest[d][i], 0.95),
                    "delay_s": quantile(&self.delays[d][i], 0.5),
                })
            });
            each.collect::<Vec<_>>()
        };
        json!((0..DIRECTIONS.len()).map(direction).collect::<Vec<_>>())
    }
}

/// Rows of a machine's directions.
pub fn rows(machine: &Value) -> Vec<Value> {
    let each = machine["forces"].as_array().into_iter().flatten();
    let row = |(of, direction): (&Value, &str)| {
        let mut row = json!({"machine": machine["key"], "along": direction});
        for (i, seconds) in DURATIONS.iter().enumerate() {
            row[format!("{seconds} s [N]")] = of[i]["size"].clone();
        }
        let delay = of[1]["delay_s"].as_f64();
        row["delay, 0.2 s at 1.5 times that [ms]"] = json!(delay.map(|s| (1e3 * s).round() as i64));
        row
    };
    // none on a single axis
    let pushed = each
        .zip(DIRECTIONS)
        .filter(|(of, _)| !of[0]["size"].is_null());
    pushed.map(row).collect()
}
