//! From the rows of a log to poses that were held.

use cft_ident_core::block::Block;
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{Layout, LogSpec, Provenance, Reader, escape};

use super::HELD;
use super::error::HeldError;

/// A pose that was held.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldPose {
    /// Its number among the held poses of all logs, from 1.
    pub number: usize,
    /// When it began \[s\].
    pub t: f64,
    pub rows: usize,
    /// Mean positions \[m or rad\].
    pub q: Vec<f64>,
    /// Mean torques in the unit of the channels; NaN where a sign is not known.
    pub tau: Vec<f64>,
    /// 1 where the joint came from below, -1 from above, 0 where it is not known.
    pub side: Vec<f64>,
}

/// Held poses of some logs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeldLog {
    pub poses: Vec<HeldPose>,
    /// Whether each row of the log is a pose.
    pub rows_are_poses: bool,
    /// Joints whose torque is never below zero, though it has no sign of its own.
    pub unsigned: Vec<bool>,
    /// LoggedRows of all logs.
    pub rows: usize,
}

impl HeldLog {
    /// Poses that joint `j` reached from a side.
    pub(super) fn count_poses_from_side(&self, j: usize, side: f64) -> usize {
        let poses = self.poses.iter();
        poses.filter(|pose| pose.side[j] == side).count()
    }
}

/// LoggedRows of a log in one piece.
struct LoggedRows {
    n: usize,
    t: Vec<f64>,
    q: Vec<f64>,
    tau: Vec<f64>,
}

impl LoggedRows {
    fn read(spec: &LogSpec, layout: &Layout) -> Result<(Self, Provenance), HeldError> {
        let mut reader = Reader::open(spec, layout)?;
        let mut all = Self {
            n: layout.positions.len(),
            t: Vec::new(),
            q: Vec::new(),
            tau: Vec::new(),
        };
        let mut block = Block::default();
        while reader.read(&mut block)? {
            all.t.extend(&block.t);
            all.q.extend(&block.q);
            all.tau.extend(&block.tau);
        }
        all.t.extend(&block.t);
        all.q.extend(&block.q);
        all.tau.extend(&block.tau);
        Ok((all, reader.provenance()?))
    }

    fn q(&self, row: usize) -> &[f64] {
        &self.q[row * self.n..(row + 1) * self.n]
    }

    /// How far each position may go and stand still.
    fn still(&self) -> Vec<f64> {
        let of = |j: usize| {
            let values = || (0..self.t.len()).map(|row| self.q(row)[j]);
            let (low, high) = values().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
            let mut steps: Vec<f64> = (1..self.t.len())
                .map(|row| (self.q(row)[j] - self.q(row - 1)[j]).abs())
                .filter(|step| *step > 0.0)
                .collect();
            steps.sort_by(f64::total_cmp);
            let grain = steps.get(steps.len() / 20).copied().unwrap_or(0.0);
            (HELD.steps * grain)
                .min(0.02 * (high - low))
                .max(HELD.range * (high - low))
        };
        (0..self.n).map(of).collect()
    }

    /// Whether rows leap from pose to pose.
    fn are_poses(&self) -> bool {
        let rows = self.t.len();
        let span = |j: usize| {
            let values = || (0..rows).map(|row| self.q(row)[j]);
            values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
        };
        let far = |row: &usize| {
            (0..self.n).any(|j| (self.q(*row)[j] - self.q(*row - 1)[j]).abs() > 0.05 * span(j))
        };
        2 * (1..rows).filter(far).count() > rows
    }

    /// Runs of rows in which every joint stands.
    fn holds(&self) -> Vec<(usize, usize)> {
        let still = self.still();
        let mut out = Vec::new();
        let mut from = 0;
        while from < self.t.len() {
            let mut low = self.q(from).to_vec();
            let mut high = low.clone();
            let mut to = from + 1;
            while to < self.t.len() {
                let q = self.q(to);
                let stands = (0..self.n).all(|j| {
                    low[j] = low[j].min(q[j]);
                    high[j] = high[j].max(q[j]);
                    high[j] - low[j] <= still[j]
                });
                if !stands {
                    break;
                }
                to += 1;
            }
            let long = to - from >= HELD.rows && self.t[to - 1] - self.t[from] >= HELD.seconds;
            if long {
                out.push((from, to));
                from = to;
            } else {
                from += 1;
            }
        }
        out
    }
}

/// Reads logs of held poses. Signs of currents that have none are those of the side on which a joint hangs off its
/// command, where the robot file says `sign = "hang"`.
pub fn read_held(
    logs: &[LogSpec],
    file: &RobotFile,
) -> Result<(HeldLog, Vec<Provenance>), HeldError> {
    let layout = file.layout();
    let hang = file.log.sign.is_some();
    let names = file.joint_names();
    let mut out = HeldLog::default();
    let mut inputs = Vec::new();
    let mut all_poses = true;
    for spec in logs {
        let log = escape(&spec.name());
        let (rows, provenance) = LoggedRows::read(spec, &layout)?;
        inputs.push(provenance);
        let command = match hang {
            false => None,
            true => {
                let unnamed = names.iter().find(|joint| {
                    file.log
                        .joint
                        .get(*joint)
                        .is_none_or(|of| of.reference.is_none())
                });
                let Some(layout) = file.reference_layout().filter(|_| unnamed.is_none()) else {
                    return Err(HeldError::NoCommand {
                        log,
                        joint: escape(unnamed.unwrap_or(&names[0])),
                    });
                };
                Some(LoggedRows::read(spec, &layout)?.0)
            }
        };
        out.rows += rows.t.len();
        let single = rows.are_poses();
        all_poses &= single;
        let holds = match single {
            true => (0..rows.t.len()).map(|row| (row, row + 1)).collect(),
            false => rows.holds(),
        };
        let still = rows.still();
        let mut before: Option<(usize, Vec<f64>)> = None;
        for (from, to) in holds {
            let settled = from + (HELD.settling * (to - from) as f64) as usize;
            let mean = |x: &[f64], j: usize| {
                let sum: f64 = (settled..to).map(|row| x[row * rows.n + j]).sum();
                sum / (to - settled) as f64
            };
            let q: Vec<f64> = (0..rows.n).map(|j| mean(&rows.q, j)).collect();
            let mut tau: Vec<f64> = (0..rows.n).map(|j| mean(&rows.tau, j)).collect();
            if let Some(command) = &command {
                for j in 0..rows.n {
                    let off = mean(&command.q, j) - q[j];
                    tau[j] = match off.abs() > still[j].min(1e-2) / HELD.steps {
                        true => tau[j].abs() * off.signum(),
                        false => f64::NAN,
                    };
                }
            }
            // the last row far enough away says from where a joint came
            let side = (0..rows.n).map(|j| {
                let back = before.as_ref().map_or(0, |(row, _)| *row);
                let away = 2.0 * still[j];
                let far = (back..from)
                    .rev()
                    .find(|row| (q[j] - rows.q(*row)[j]).abs() > away);
                match (far, &before) {
                    (Some(row), _) => (q[j] - rows.q(row)[j]).signum(),
                    (None, Some((_, side))) => side[j],
                    (None, None) => 0.0,
                }
            });
            let side: Vec<f64> = side.collect();
            before = Some((from, side.clone()));
            out.poses.push(HeldPose {
                number: out.poses.len() + 1,
                t: rows.t[from],
                rows: to - from,
                q,
                tau,
                side,
            });
        }
        if hang {
            for (j, joint) in names.iter().enumerate() {
                if out.poses.iter().all(|pose| pose.tau[j].is_nan()) {
                    return Err(HeldError::NeverHangs {
                        log,
                        joint: escape(joint),
                    });
                }
            }
        }
    }
    out.rows_are_poses = all_poses;
    out.unsigned = (0..names.len())
        .map(|j| {
            let all = || {
                out.poses
                    .iter()
                    .map(|pose| pose.tau[j])
                    .filter(|x| x.is_finite())
            };
            all().count() > 0 && all().all(|x| x >= 0.0) && all().any(|x| x > 0.0)
        })
        .collect();
    if out.poses.len() < HELD.poses {
        return Err(HeldError::TooFew {
            logs: logs
                .iter()
                .map(|spec| escape(&spec.name()))
                .collect::<Vec<_>>()
                .join(", "),
            poses: out.poses.len(),
            least: HELD.poses,
        });
    }
    Ok((out, inputs))
}
