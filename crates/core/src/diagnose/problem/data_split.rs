//! Which rows do what: pieces of time for fitting, for cross-validation, for the veto and for the
//! holdout, with gaps between them that a filter's memory does not bridge.

use std::ops::Range;

use crate::motion::{ParallelFilters, Stretch};

/// What a log is given for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogRole {
    /// Fitted; parts may be set aside.
    Train,
    /// May veto a step, and nothing else.
    Veto,
    /// Looked at once, after everything is decided.
    Holdout,
}

/// What the rows of a piece are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowRole {
    /// Fitted, and left out in turn in cross-validation: the fold.
    Fold(usize),
    /// Fitted, but in no fold: it parts two of them.
    Between,
    Veto,
    Holdout,
    /// Cut out: an episode in time that no law of motion repeats.
    Cut,
}

impl RowRole {
    /// Whether the rows are fitted.
    pub fn fitted(self) -> bool {
        matches!(self, RowRole::Fold(_) | RowRole::Between)
    }
}

/// A piece of one stretch.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    pub stretch: usize,
    /// Rows of the stretch after filter and decimation.
    pub rows: Range<usize>,
    pub role: RowRole,
}

/// A span of time that was set aside, for the report.
#[derive(Debug, Clone, PartialEq)]
pub struct SetAside {
    pub log: usize,
    pub role: LogRole,
    pub from_s: f64,
    pub to_s: f64,
}

/// All pieces.
#[derive(Debug, Clone, Default)]
pub struct DataSplit {
    pub pieces: Vec<Piece>,
    pub folds: usize,
    pub set_aside: Vec<SetAside>,
    /// Whether the rows of each joint count for nothing along each stretch, `[stretch][joint]`: of a stationary
    /// joint, which do not determine its friction, and of all where the log is held out.
    pub ignored: Vec<Vec<bool>>,
    /// Whether each joint is stationary along each stretch, whatever the stretch is for: it has no error that a
    /// law of motion answers for.
    pub stationary: Vec<Vec<bool>>,
}

/// Folds of the cross-validation, about.
const FOLDS: usize = 10;
/// Parts that are set aside for each purpose, about, over all training logs.
const PARTS: usize = 3;
/// Share of the training rows that may veto, where no log is given for it.
const VETO_SHARE: f64 = 0.12;
/// Share of the training rows that is the holdout, where no log is given for it.
const HOLDOUT_SHARE: f64 = 0.2;
/// Length of a piece in periods of the cut-off: several correlation times of the filtered residual.
const PIECE_PERIODS: f64 = 2.5;
/// Rows that part pieces of different use, in periods of the cut-off.
const GAP_PERIODS: f64 = 1.0;

impl DataSplit {
    /// Divides stretches; `roles` by log.
    pub fn of(
        stretches: &[Stretch],
        roles: &[LogRole],
        filters: &ParallelFilters,
        cutoff_hz: f64,
    ) -> Self {
        let mut split = DataSplit::default();
        let given = |role| roles.contains(&role);
        let rows_of = |s: &Stretch| filters.of(s).rows(s.len());
        let total: usize = stretches
            .iter()
            .filter(|s| roles[s.log] == LogRole::Train)
            .map(rows_of)
            .sum();
        for (index, stretch) in stretches.iter().enumerate() {
            let rows = rows_of(stretch);
            let parallel = filters.of(stretch);
            let dt = stretch.dt * parallel.decimation as f64;
            let piece = ((PIECE_PERIODS / cutoff_hz / dt).ceil() as usize).max(4);
            let gap = ((GAP_PERIODS / cutoff_hz / dt).ceil() as usize).max(1);
            let cut =
                |split: &mut DataSplit, range: Range<usize>, role: &dyn Fn(usize) -> RowRole| {
                    let count = (range.len() / piece).max(1);
                    for i in 0..count {
                        let from = range.start + i * range.len() / count;
                        let to = range.start + (i + 1) * range.len() / count;
                        if from < to {
                            split.pieces.push(Piece {
                                stretch: index,
                                rows: from..to,
                                role: role(from),
                            });
                        }
                    }
                };
            match roles[stretch.log] {
                LogRole::Veto => cut(&mut split, 0..rows, &|_| RowRole::Veto),
                LogRole::Holdout => cut(&mut split, 0..rows, &|_| RowRole::Holdout),
                LogRole::Train => {
                    let share = rows as f64 / total.max(1) as f64;
                    let aside =
                        set_aside(rows, share, !given(LogRole::Veto), !given(LogRole::Holdout));
                    let mut fitted = Vec::new();
                    let mut start = 0;
                    for (range, role) in &aside {
                        fitted.push(start..range.start.saturating_sub(gap).max(start));
                        start = (range.end + gap).min(rows);
                        let kind = match role {
                            LogRole::Veto => RowRole::Veto,
                            _ => RowRole::Holdout,
                        };
                        cut(&mut split, range.clone(), &|_| kind);
                        let time = |row: usize| stretch.own_time(parallel.sample_of(row));
                        split.set_aside.push(SetAside {
                            log: stretch.log,
                            role: *role,
                            from_s: time(range.start),
                            to_s: time(range.end),
                        });
                    }
                    fitted.push(start..rows);
                    fitted.retain(|r| r.len() > 2 * gap);
                    let folds = ((FOLDS as f64 * share).round() as usize).max(1);
                    split.folds(index, &fitted, folds, gap, piece);
                }
            }
        }
        split
    }

    /// Divides the fitted ranges of one stretch into contiguous folds with gaps between.
    fn folds(
        &mut self,
        stretch: usize,
        fitted: &[Range<usize>],
        folds: usize,
        gap: usize,
        piece: usize,
    ) {
        let total: usize = fitted.iter().map(Range::len).sum();
        let length = (total / folds).max(1);
        for range in fitted {
            let count = ((range.len() as f64 / length as f64).round() as usize).max(1);
            for i in 0..count {
                let from = range.start + i * range.len() / count;
                let to = range.start + (i + 1) * range.len() / count;
                let first = if i == 0 { from } else { (from + gap).min(to) };
                let last = if i + 1 == count {
                    to
                } else {
                    to.saturating_sub(gap).max(first)
                };
                let mut push = |rows: Range<usize>, role| {
                    if !rows.is_empty() {
                        self.pieces.push(Piece {
                            stretch,
                            rows,
                            role,
                        });
                    }
                };
                push(from..first, RowRole::Between);
                let pieces = ((last - first) / piece).max(1);
                for k in 0..pieces {
                    let a = first + k * (last - first) / pieces;
                    let b = first + (k + 1) * (last - first) / pieces;
                    push(a..b, RowRole::Fold(self.folds));
                }
                push(last..to, RowRole::Between);
                self.folds += 1;
            }
        }
    }

    /// Rows that are fitted.
    pub(crate) fn fitted_rows(&self) -> usize {
        self.rows_where(RowRole::fitted)
    }

    /// Whether the rows of joint `j` along a stretch count for nothing.
    pub(crate) fn ignores(&self, stretch: usize, j: usize) -> bool {
        self.ignored.get(stretch).is_some_and(|joints| joints[j])
    }

    /// Whether joint `j` is stationary along a stretch, whatever the stretch is for.
    pub(crate) fn is_stationary(&self, stretch: usize, j: usize) -> bool {
        self.stationary.get(stretch).is_some_and(|joints| joints[j])
    }

    /// Whether nothing of a stretch is fitted or may veto.
    pub fn idle(&self, stretch: usize) -> bool {
        self.ignored
            .get(stretch)
            .is_some_and(|joints| joints.iter().all(|i| *i))
    }

    /// Rows that are fitted to joint `j`.
    pub(crate) fn fitted_rows_of(&self, j: usize) -> usize {
        let pieces = self.pieces.iter().filter(|p| p.role.fitted());
        let moving = pieces.filter(|p| !self.ignores(p.stretch, j));
        moving.map(|p| p.rows.len()).sum()
    }

    /// Rows of the pieces whose role is asked for.
    pub(crate) fn rows_where(&self, wanted: impl Fn(RowRole) -> bool) -> usize {
        let pieces = self.pieces.iter().filter(|p| wanted(p.role));
        pieces.map(|p| p.rows.len()).sum()
    }
}

/// Ranges of a stretch that are set aside, in order. They are spread over it, so that one quiet part
/// does not stand for the whole.
fn set_aside(rows: usize, share: f64, veto: bool, holdout: bool) -> Vec<(Range<usize>, LogRole)> {
    let parts = ((PARTS as f64 * share).round() as usize).max(1);
    let mut out = Vec::new();
    for i in 0..parts {
        let (from, to) = (i * rows / parts, (i + 1) * rows / parts);
        let length = (to - from) as f64;
        let range = |begin: f64, share: f64| {
            let first = from + (begin * length) as usize;
            first..(first + (share * length) as usize).min(to)
        };
        if veto {
            out.push((range(0.35, VETO_SHARE), LogRole::Veto));
        }
        if holdout {
            out.push((range(0.75, HOLDOUT_SHARE), LogRole::Holdout));
        }
    }
    out.retain(|(range, _)| !range.is_empty());
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::FilterSettings;

    fn stretch(log: usize, seconds: f64) -> Stretch {
        let samples = (seconds * 1000.0) as usize;
        Stretch {
            log,
            dt: 1e-3,
            t: (0..samples).map(|k| k as f64 * 1e-3).collect(),
            ..Stretch::default()
        }
    }

    fn split(roles: &[LogRole]) -> DataSplit {
        let stretches: Vec<Stretch> = (0..roles.len()).map(|l| stretch(l, 30.0)).collect();
        let filters = ParallelFilters::design(&FilterSettings::default(), &stretches).unwrap();
        DataSplit::of(&stretches, roles, &filters, 10.0)
    }

    #[test]
    fn no_row_has_two_uses_and_other_uses_keep_their_distance() {
        for roles in [
            vec![LogRole::Train],
            vec![LogRole::Train, LogRole::Train, LogRole::Holdout],
            vec![LogRole::Train, LogRole::Veto, LogRole::Holdout],
        ] {
            let split = split(&roles);
            for (i, a) in split.pieces.iter().enumerate() {
                for b in split.pieces[i + 1..]
                    .iter()
                    .filter(|b| b.stretch == a.stretch)
                {
                    let apart = a.rows.end <= b.rows.start || b.rows.end <= a.rows.start;
                    assert!(apart, "{a:?} {b:?}");
                    let uses = [a.role, b.role];
                    let aside = uses.iter().filter(|r| r.fitted()).count() == 1;
                    if aside {
                        let distance = b
                            .rows
                            .start
                            .abs_diff(a.rows.end)
                            .min(a.rows.start.abs_diff(b.rows.end));
                        assert!(distance >= 9, "{a:?} {b:?}");
                    }
                }
            }
            assert!((8..=14).contains(&split.folds), "{}", split.folds);
        }
    }

    #[test]
    fn logs_that_are_given_for_a_use_leave_the_training_logs_whole() {
        let split = split(&[LogRole::Train, LogRole::Veto, LogRole::Holdout]);
        assert!(split.set_aside.is_empty());
        let fitted = split.fitted_rows();
        assert!(
            split
                .pieces
                .iter()
                .all(|p| p.role.fitted() == (p.stretch == 0))
        );
        assert!(fitted > 2900, "{fitted}");
    }
}
