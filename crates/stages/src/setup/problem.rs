//! A robot file with a sample of its logs, and the rows that a correction makes of them.

use super::LIMITS;
use super::channels::{Carried, Channels, Drive};
use super::correction::Correction;
use super::sample::Sample;
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::judge::{Blocks, PARTS, divide};
use cft_ident_core::robot::Robot;

/// What the robot file knows beside its channels.
#[derive(Debug, Clone, Default)]
pub struct KnownBeforehand {
    /// Largest torque of each joint \[N or N m\].
    pub torque: Vec<Option<f64>>,
    /// Least and greatest position of each joint \[m or rad\].
    pub position: Vec<Option<[f64; 2]>>,
    /// Gear ratios and factors that stand in the file.
    pub ratios: Vec<f64>,
    /// Inertial parameters by the file's own masses.
    pub inertial: Option<Vec<f64>>,
}

/// A robot file and a sample of its logs.
pub struct Problem<'a> {
    pub robot: &'a Robot,
    /// The same robot in another gravity \[m/s^2\]; none where the file declares no gravity.
    pub in_gravity: Option<&'a (dyn Fn([f64; 3]) -> Option<Robot> + Sync)>,
    pub channels: Channels,
    /// Friction terms of each joint.
    pub columns: &'a RegressorColumns,
    pub sample: Sample,
    pub known: KnownBeforehand,
    pub(super) blocks: Blocks,
    /// Joints that move, and whose torques are not all zero.
    pub(super) moving: Vec<bool>,
}

impl<'a> Problem<'a> {
    /// A robot, the channels of its logs, its friction terms, a sample and what the file knows.
    pub fn new(
        robot: &'a Robot,
        in_gravity: Option<&'a (dyn Fn([f64; 3]) -> Option<Robot> + Sync)>,
        (channels, columns): (Channels, &'a RegressorColumns),
        sample: Sample,
        known: KnownBeforehand,
    ) -> Self {
        // a motor behind a linkage is no joint
        let linked = channels.drive == Drive::Motors;
        Self {
            blocks: divide(&sample.logs(), 1.0, (PARTS.parts, PARTS.blocks_per_part)),
            moving: joints_that_move(&sample, linked),
            robot,
            in_gravity,
            channels,
            columns,
            sample,
            known,
        }
    }

    /// Every how many rows make few of them.
    pub(super) fn few(&self) -> usize {
        self.sample.len().div_ceil(LIMITS.rows / 5).max(1)
    }

    /// Whether the place of a joint's zero shows.
    pub(super) fn has_zeros(&self) -> bool {
        self.robot.knows_links() && self.channels.drive != Drive::Motors
    }

    /// Channels whose signs and units are asked for.
    pub(super) fn channels_that_move(&self) -> Vec<usize> {
        (0..self.moving.len()).filter(|j| self.moving[*j]).collect()
    }

    /// Joints that are beyond the limits of the robot file under a correction.
    pub(super) fn beyond_limits(&self, by: &Correction) -> Vec<usize> {
        if self.known.position.iter().all(Option::is_none) {
            return Vec::new();
        }
        let n = self.robot.joints();
        let mut carried = Carried::new(n);
        let mut beyond = vec![false; n];
        for k in 0..self.sample.len() {
            if !(self.channels).carry(self.robot, self.sample.row(k), by, &mut carried) {
                continue;
            }
            let limits = self.known.position.iter().zip(&carried.q).enumerate();
            for (j, (limits, q)) in limits {
                let off = limits.map_or(0.0, |[low, high]| (low - q).max(q - high));
                beyond[j] |= off > LIMITS.still;
            }
        }
        (0..n).filter(|j| beyond[*j]).collect()
    }

    /// The robot in the gravity of a correction.
    pub(super) fn robot_under(&self, by: &Correction) -> Option<Robot> {
        match by.gravity {
            None => Some(self.robot.clone()),
            Some(gravity) => self.in_gravity.and_then(|robot| robot(gravity)),
        }
    }

    /// Place of the first own term of a joint among the unknowns.
    pub(super) fn first_own(&self, robot: &Robot, j: usize) -> usize {
        robot.parameters().len() + self.columns.own[..j].iter().map(Vec::len).sum::<usize>()
    }
}

/// In a log that moves one joint the others stand still; where several move, one that seems not to may be in thousandths.
fn joints_that_move(sample: &Sample, linked: bool) -> Vec<bool> {
    let n = sample.joints;
    let moved = |j: &usize| sample.travel(*j) > LIMITS.still;
    let alone = n > 1 && (0..n).filter(moved).count() == 1;
    let (torques, speeds) = (sample.rms(|row| row.tau), sample.rms(|row| row.v));
    let moving = |j: usize| linked || torques[j] > 0.0 && speeds[j] > 0.0 && (moved(&j) || !alone);
    (0..n).map(moving).collect()
}
