//! Which rows do what: pieces of time that are fitted, that judge, and that are held out, with gaps between them that
//! a filter's memory does not bridge.

use std::ops::Range;

use crate::effect::stationary_joints;
use crate::judge::LogRows;
use crate::motion::{ParallelFilters, Stretch};
use crate::robot::Robot;

/// What a log is given for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogRole {
    /// Fitted; parts may be set aside.
    Train,
    /// Never fitted: judges what is added.
    Holdout,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    pub stretch: usize,
    /// Rows of the stretch after filter and decimation.
    pub rows: Range<usize>,
    pub role: LogRole,
}

/// A span of time that was set aside, for the report.
#[derive(Debug, Clone, PartialEq)]
pub struct SetAside {
    pub log: usize,
    pub from_s: f64,
    pub to_s: f64,
}

#[derive(Debug, Clone, Default)]
pub struct DataSplit {
    pub pieces: Vec<Piece>,
    pub set_aside: Vec<SetAside>,
    /// Whether each joint is stationary, `[stretch][joint]`: such rows say nothing of its friction, and have no error of motion.
    pub stationary: Vec<Vec<bool>>,
    /// Time from row to row along each stretch \[s\].
    pub step_s: Vec<f64>,
}

/// Parts that are held out, about, over all training logs.
const PARTS: usize = 3;
/// Share of the training rows that is held out, where no log is given for it.
const HOLDOUT_SHARE: f64 = 0.2;
/// Length of a piece in periods of the cut-off: several correlation times of the filtered residual.
const PIECE_PERIODS: f64 = 2.5;
/// Rows that part pieces of different use, in periods of the cut-off.
const GAP_PERIODS: f64 = 1.0;

impl DataSplit {
    /// Divides stretches; `roles` by log.
    pub fn of(
        robot: &Robot,
        stretches: &[Stretch],
        roles: &[LogRole],
        (filters, cutoff_hz): (&ParallelFilters, f64),
    ) -> Self {
        let mut split = DataSplit {
            stationary: stationary_joints(robot, stretches),
            ..DataSplit::default()
        };
        let rows_of = |s: &Stretch| filters.of(s).rows(s.len());
        let train = stretches.iter().filter(|s| roles[s.log] == LogRole::Train);
        let total: usize = train.map(rows_of).sum();
        let given = roles.contains(&LogRole::Holdout);
        for (index, stretch) in stretches.iter().enumerate() {
            let parallel = filters.of(stretch);
            let dt = stretch.dt * parallel.decimation as f64;
            let rows = rows_of(stretch);
            let length = ((PIECE_PERIODS / cutoff_hz / dt).ceil() as usize).max(4);
            let gap = ((GAP_PERIODS / cutoff_hz / dt).ceil() as usize).max(1);
            let role = roles[stretch.log];
            split.step_s.push(dt);
            if role != LogRole::Train || given {
                split.cut(index, 0..rows, role, length);
                continue;
            }
            let mut start = 0;
            let train = |split: &mut DataSplit, range: Range<usize>| {
                if range.len() > 2 * gap {
                    split.cut(index, range, LogRole::Train, length);
                }
            };
            for aside in held_out(rows, rows as f64 / total.max(1) as f64) {
                train(&mut split, start..aside.start.saturating_sub(gap));
                split.cut(index, aside.clone(), LogRole::Holdout, length);
                let time = |row: usize| stretch.own_time(parallel.sample_of(row));
                split.set_aside.push(SetAside {
                    log: stretch.log,
                    from_s: time(aside.start),
                    to_s: time(aside.end),
                });
                start = (aside.end + gap).min(rows);
            }
            train(&mut split, start..rows);
        }
        split
    }

    fn cut(&mut self, stretch: usize, range: Range<usize>, role: LogRole, length: usize) {
        let count = (range.len() / length).max(1);
        for i in 0..count {
            let at = |i: usize| range.start + i * range.len() / count;
            if at(i) < at(i + 1) {
                self.pieces.push(Piece {
                    stretch,
                    rows: at(i)..at(i + 1),
                    role,
                });
            }
        }
    }

    /// Rows of every log with a role, as the judge divides them; joints rest up to these speeds.
    pub(crate) fn logs(
        &self,
        (stretches, filters, rest_speed): (&[Stretch], &ParallelFilters, &[f64]),
        role: LogRole,
    ) -> Vec<LogRows> {
        let mut logs: Vec<LogRows> = Vec::new();
        for piece in self.pieces.iter().filter(|p| p.role == role) {
            let (stretch, rows) = (piece.stretch, piece.rows.clone());
            let moves = self.stationary[stretch].iter().map(|still| !still);
            let log = stretches[stretch].log;
            let of = &stretches[stretch];
            let parallel = filters.of(of);
            let counts = rows.clone().map(|row| {
                let k = parallel.sample_of(row);
                let mut joints = of.v.iter().zip(rest_speed);
                joints.any(|(v, rest)| v.get(k).is_some_and(|v| v.abs() > *rest))
            });
            let counts: Vec<bool> = counts.collect();
            match logs.last_mut().filter(|l| l.log == log) {
                Some(own) => {
                    let follows =
                        |(s, r): &&mut (usize, Range<usize>)| *s == stretch && r.end == rows.start;
                    match own.pieces.last_mut().filter(follows) {
                        Some((_, last)) => last.end = rows.end,
                        None => own.pieces.push((stretch, rows)),
                    }
                    (own.moves.iter_mut().zip(moves)).for_each(|(all, own)| *all |= own);
                    own.counts.extend(counts);
                }
                None => logs.push(LogRows {
                    log,
                    pieces: vec![(stretch, rows)],
                    step_s: self.step_s[stretch],
                    moves: moves.collect(),
                    counts,
                }),
            }
        }
        // where nothing moves at all every row is as good as another
        if logs.iter().all(|log| !log.counts.contains(&true)) {
            logs.iter_mut().for_each(|log| log.counts.fill(true));
        }
        logs
    }

    pub(crate) fn rows_of(&self, role: LogRole) -> usize {
        let pieces = self.pieces.iter().filter(|p| p.role == role);
        pieces.map(|p| p.rows.len()).sum()
    }

    /// Whether joint `j` is stationary along a stretch.
    pub(crate) fn is_stationary(&self, stretch: usize, j: usize) -> bool {
        self.stationary.get(stretch).is_some_and(|joints| joints[j])
    }
}

/// Ranges of a stretch that are held out, in order: spread over it, so that one quiet part does not stand for the whole.
fn held_out(rows: usize, share: f64) -> Vec<Range<usize>> {
    let parts = ((PARTS as f64 * share).round() as usize).max(1);
    let range = |i: usize| {
        let (from, to) = (i * rows / parts, (i + 1) * rows / parts);
        let length = (to - from) as f64;
        let first = from + (0.75 * length) as usize;
        first..(first + (HOLDOUT_SHARE * length) as usize).min(to)
    };
    let all = (0..parts).map(range);
    all.filter(|range| !range.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::FilterSettings;
    use crate::robot::JointKind;

    fn split(roles: &[LogRole]) -> (DataSplit, Vec<Stretch>, ParallelFilters) {
        let wave: Vec<f64> = (0..30_000).map(|k| (1e-3 * f64::from(k)).sin()).collect();
        let stretch = |log| Stretch {
            log,
            dt: 1e-3,
            t: (0..30_000).map(|k| f64::from(k) * 1e-3).collect(),
            q: vec![wave.clone()],
            ..Stretch::default()
        };
        let stretches: Vec<Stretch> = (0..roles.len()).map(stretch).collect();
        let filters = ParallelFilters::design(&FilterSettings::default(), &stretches).unwrap();
        let robot = Robot::single_joint("slide", JointKind::Prismatic);
        let split = DataSplit::of(&robot, &stretches, roles, (&filters, 10.0));
        (split, stretches, filters)
    }

    #[test]
    fn no_row_has_two_uses_and_other_uses_keep_their_distance() {
        let (split, stretches, filters) = split(&[LogRole::Train]);
        for (i, a) in split.pieces.iter().enumerate() {
            let later = split.pieces[i + 1..].iter();
            for b in later.filter(|b| b.stretch == a.stretch) {
                let distance = b.rows.start.saturating_sub(a.rows.end);
                assert!(a.rows.end <= b.rows.start, "{a:?} {b:?}");
                assert!(a.role == b.role || distance >= 9, "{a:?} {b:?}");
            }
        }
        assert_eq!(split.set_aside.len(), 3);
        let held = split.rows_of(LogRole::Holdout) as f64;
        let fitted = split.rows_of(LogRole::Train) as f64;
        assert!((0.15..0.3).contains(&(held / fitted)), "{held} {fitted}");
        let logs = split.logs((&stretches, &filters, &[0.0]), LogRole::Train);
        assert_eq!((logs.len(), logs[0].pieces.len()), (1, 4));
    }

    #[test]
    fn logs_that_are_held_out_leave_the_training_logs_whole() {
        let (split, stretches, filters) = split(&[LogRole::Train, LogRole::Holdout]);
        assert!(split.set_aside.is_empty());
        let logs = split.logs((&stretches, &filters, &[0.0]), LogRole::Train);
        assert_eq!(logs[0].pieces.len(), 1);
        assert!(logs[0].pieces[0].1.len() > 2900);
    }
}
