//! The weights that a URDF's inertials give the joints, beside the torques that a log has: currents and torques of
//! motors are another number of times as large.

use crate::cli::{CliError, Context};
use cft_ident_core::number;
use cft_ident_core::robot::Robot;
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{Block, LogSpec, Reader, escape};

/// Rows that are looked at, and every how many of the log's.
const MAX_ROWS: usize = 20_000;
const EVERY: usize = 5;
/// Correlation of torque and weight from which the torque is one of gravity.
const ALIKE: f64 = 0.8;
/// Inertials are seldom right, but not wrong by this factor.
const OFF: f64 = 3.0;

/// Sums of one joint: rows, torque, weight, and their products.
#[derive(Clone, Copy, Default)]
struct WeightSums {
    n: f64,
    tau: f64,
    g: f64,
    tau_tau: f64,
    g_g: f64,
    tau_g: f64,
}

impl WeightSums {
    fn add(&mut self, tau: f64, g: f64) {
        self.n += 1.0;
        self.tau += tau;
        self.g += g;
        self.tau_tau += tau * tau;
        self.g_g += g * g;
        self.tau_g += tau * g;
    }

    /// Torque per weight, where the torque goes with the weight.
    fn slope(&self) -> Option<f64> {
        let g_g = self.g_g - self.g * self.g / self.n;
        let tau_tau = self.tau_tau - self.tau * self.tau / self.n;
        let tau_g = self.tau_g - self.tau * self.g / self.n;
        let alike = tau_g > ALIKE * (g_g * tau_tau).sqrt() && g_g > 1e-6 * self.n;
        alike.then(|| tau_g / g_g)
    }
}

/// The robot's weights by its file; `None` where a link has no inertial.
fn parameters(file: &RobotFile, robot: &Robot) -> Option<Vec<f64>> {
    let map = robot.standard_map();
    let mut standard = Vec::with_capacity(map.columns());
    for link in file.robot.link.iter().take(map.links.len()) {
        standard.extend(link.inertial.as_ref()?.body().standard());
    }
    if standard.len() != 10 * map.links.len() {
        return None;
    }
    standard.resize(map.columns(), 0.0);
    let row = |row: usize| {
        let of = map.matrix.row(row);
        of.iter().zip(&standard).map(|(m, s)| m * s).sum()
    };
    Some((0..map.matrix.nrows()).map(row).collect())
}

/// What is to be said of torques that the weights do not go with.
pub(super) fn warning(
    file: &RobotFile,
    spec: &LogSpec,
    context: &Context,
) -> Result<Option<String>, CliError> {
    let robot = file.robot();
    let Some(theta) = parameters(file, &robot) else {
        return Ok(None);
    };
    let n = robot.joints();
    let rest = vec![0.0; n];
    let mut y = vec![0.0; n * theta.len()];
    let mut sums = vec![WeightSums::default(); n];
    let Ok(mut reader) = Reader::open(spec, &file.layout()) else {
        return Ok(None);
    };
    let (mut block, mut rows) = (Block::default(), 0);
    while rows < MAX_ROWS && reader.read(&mut block).unwrap_or(false) {
        context.check()?;
        for row in (0..block.len()).step_by(EVERY) {
            let part = row * n..(row + 1) * n;
            let (Some(q), Some(tau)) = (block.q.get(part.clone()), block.tau.get(part)) else {
                return Ok(None);
            };
            robot.regressor(q, &rest, &rest, &mut y);
            for (j, sums) in sums.iter_mut().enumerate() {
                let own = &y[j * theta.len()..(j + 1) * theta.len()];
                sums.add(tau[j], own.iter().zip(&theta).map(|(y, x)| y * x).sum());
            }
            rows += 1;
        }
    }
    let names = robot.joint_names().iter();
    let off = names.zip(&sums).filter_map(|(name, sums)| {
        let slope = sums.slope()?;
        let times = if slope < 1.0 { 1.0 / slope } else { slope };
        (times > OFF).then_some((name, slope, times))
    });
    let mut off: Vec<(&String, f64, f64)> = off.collect();
    off.sort_by(|a, b| b.2.total_cmp(&a.2));
    Ok(off.first().map(|(name, slope, times)| {
        let times = number::significant(*times, 2);
        let than = match *slope < 1.0 {
            true => format!("ask for {times} times the logged torque"),
            false => format!("are 1/{times} of the logged torque"),
        };
        format!(
            "the weights of the URDF's inertials {than} of {}: are these torques of motors (torque_is = \"motor\"), currents in A (torque_is = \"current\"), or in another unit?",
            escape(name)
        )
    }))
}
