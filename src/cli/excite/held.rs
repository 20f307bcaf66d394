//! `excite --static`: poses to hold for `lsq --static`.

use std::fmt::Write;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use super::ExciteRun;
use crate::cli::{CliError, Outcome};
use cft_ident_logs::log::escape;
use cft_ident_plant::excite::held::{PoseToHold, poses_to_hold};
use cft_ident_report::report::json::{JsonDocument, NO_WARNINGS};
use cft_ident_report::report::table::{CellAlignment, Table};

/// Poses that were chosen.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PosesToHold {
    /// Joints or coordinates, in the order of every vector.
    joints: Vec<String>,
    poses: Vec<HeldPoseOfFile>,
}

/// A pose, and the two from which its joints come to rest \[m or rad\].
#[derive(Debug, Serialize, JsonSchema)]
struct HeldPoseOfFile {
    below: Vec<f64>,
    at: Vec<f64>,
    above: Vec<f64>,
}

/// Seconds for which a pose is held.
const HOLD_S: f64 = 2.0;

fn row(numbers: &[f64]) -> String {
    let all: Vec<String> = numbers.iter().map(|x| format!("{x:.5}")).collect();
    format!("[{}]", all.join(", "))
}

/// The file: a table for each pose.
fn text(joints: &[String], poses: &[PoseToHold]) -> String {
    let mut out = format!(
        "# Poses to hold for `cft-ident lsq --static`, within the limits of the robot file, links apart.\n# Go to `below`, then to `at`, and hold {HOLD_S} s; go to `above`, then to `at`, and hold {HOLD_S} s; log throughout.\njoints = {}\nhold_s = {HOLD_S:?}\n",
        toml::Value::from(joints.to_vec())
    );
    for pose in poses {
        let [below, at, above] = [&pose.below, &pose.at, &pose.above].map(|q| row(q));
        let _ = write!(
            out,
            "\n[[pose]]\nbelow = {below}\nat = {at}\nabove = {above}\n"
        );
    }
    out
}

pub(super) fn run(bench: &ExciteRun, count: usize, path: &Path) -> Result<Outcome, CliError> {
    let poses = poses_to_hold(&bench.machine, count, bench.args.seed)?;
    let joints = bench.machine.coordinate_names();
    bench.context.write_text(path, &text(&joints, &poses))?;
    let mut columns = vec![("pose", CellAlignment::Right)];
    columns.extend(
        joints
            .iter()
            .map(|joint| (joint.as_str(), CellAlignment::Decimal)),
    );
    let shown = path.display();
    let mut table = Table::new(&columns).caption(&format!(
        "{} poses to hold, each reached from both sides, about {:.0} min: {}",
        poses.len(),
        (poses.len() as f64 * 2.0 * (HOLD_S + 2.0) / 60.0).ceil(),
        escape(&shown.to_string())
    ));
    for (k, pose) in poses.iter().enumerate() {
        let mut cells = vec![(k + 1).to_string()];
        cells.extend(pose.at.iter().map(|q| format!("{q:.3}")));
        table.row(cells);
    }
    let next = "next: hold them, log positions and torques (or currents and commands), then\n       cft-ident lsq --static LOG -r ROBOT.toml -o gravity.toml\n";
    let text = format!("{table}{next}");
    let brief = format!("written: {shown}");
    let of_file = |pose: PoseToHold| HeldPoseOfFile {
        below: pose.below,
        at: pose.at,
        above: pose.above,
    };
    let result = PosesToHold {
        joints,
        poses: poses.into_iter().map(of_file).collect(),
    };
    let document = JsonDocument::new("excite-static", &bench.inputs, &NO_WARNINGS, &result)?;
    Ok(Outcome::new(bench.context.text(text, &brief), document))
}
