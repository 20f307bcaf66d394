//! Runs in one table, as episodes of a data set or tests of a stand: what parts them, and times that go on.

use crate::log::names::escape;
use crate::log::time::{Instant, RowTime};

/// Time between the last row of a run and the first of the next, where their own times do not part them \[s\]: longer
/// than any filter reaches.
const BETWEEN_RUNS_S: f64 = 10.0;
/// Steps that a run has at least, where nothing but its time says that it is one, and that pass at least between tests
/// that words name.
const MIN_STEPS: i128 = 10;
/// Runs whose beginnings are kept.
const MAX_RUNS: usize = 1 << 16;

/// What a column says of runs.
#[derive(Debug, Clone, Copy, PartialEq)]
enum RunMark {
    /// Its number is that of the run.
    Run,
    /// It counts the rows of a run.
    Step,
    /// It is set in the last row of a run.
    Last,
    /// It is set in the first row of a run.
    First,
}

const MARKS: [(RunMark, &str); 4] = [
    (
        RunMark::Run,
        "episode episodes episode_index episode_id episode_idx episode_number trial trial_id trial_index trial_no run \
         run_id run_index run_no segment segment_id segment_index rollout rollout_id rollout_index trajectory_id \
         traj_id traj_index demo demo_id",
    ),
    (
        RunMark::Step,
        "step steps step_index step_id timestep time_step frame_index frame_id step_idx env_step",
    ),
    (
        RunMark::Last,
        "done dones terminal terminals timeout timeouts truncated truncation truncations terminated terminations \
         is_last is_terminal",
    ),
    (RunMark::First, "is_first"),
];

/// A column that says something of runs, and its number in the row before.
#[derive(Debug, Clone)]
struct MarkColumn {
    mark: RunMark,
    place: usize,
    name: String,
    /// Numbers of the last row and of the one before it.
    before: [f64; 2],
    parts: bool,
}

impl MarkColumn {
    /// Whether the row with this number begins a run, by this column alone.
    fn begins(&mut self, number: f64) -> bool {
        let [before, last] = self.before;
        let begins = match self.mark {
            RunMark::Run => number != last,
            RunMark::Step => number < last,
            RunMark::Last => last != 0.0 && before == 0.0,
            RunMark::First => number != 0.0 && last == 0.0,
        };
        self.before = [last, number];
        // a row without a number says nothing
        begins && last.is_finite() && number.is_finite()
    }
}

/// The runs of a table, so far.
#[derive(Debug, Clone, Default)]
pub(super) struct TableRuns {
    marks: Vec<MarkColumn>,
    /// The first time, the first step, and the time of the last row, as logged.
    first: Option<Instant>,
    step: i128,
    last: Option<Instant>,
    /// Time of the last row as it is handed out, and what is added to those of this run \[s\].
    end: f64,
    shift_s: f64,
    rows: u64,
    missing: u64,
    /// Times at which runs begin, but for the first.
    pub(super) seams: Vec<RowTime>,
    by_time: bool,
    /// A column of words that change where time leaps.
    by_words: Option<String>,
    shifted: bool,
}

impl TableRuns {
    /// Finds the columns that say which rows are of one run.
    pub(super) fn new(names: &[String]) -> Self {
        let mark = |(place, name): (usize, &String)| {
            let lower = name.to_lowercase();
            let lists = |all: &str| all.split_whitespace().any(|one| one == lower);
            let (mark, _) = MARKS.iter().find(|(_, all)| lists(all))?;
            Some(MarkColumn {
                mark: *mark,
                place,
                name: name.clone(),
                before: [f64::NAN; 2],
                parts: false,
            })
        };
        Self {
            marks: names.iter().enumerate().filter_map(mark).collect(),
            ..Self::default()
        }
    }

    /// Takes a row: its time, which a log of a given rate has none of its own for, its numbers, and the name of a
    /// column in which another word stands than in the row before; the time that it is handed out with.
    pub(super) fn take<'a>(
        &mut self,
        stamp: RowTime,
        even: bool,
        number: impl Fn(usize) -> Option<f64>,
        other_word: impl Fn() -> Option<&'a str>,
    ) -> RowTime {
        let mut marked = false;
        for column in &mut self.marks {
            let value = number(column.place).unwrap_or(f64::NAN);
            let last = column.before[1];
            let begins = column.begins(value);
            column.parts |= begins;
            marked |= begins;
            if column.mark == RunMark::Step && value > last + 1.0 {
                self.missing += (value - last - 1.0) as u64;
            }
        }
        let now = stamp.instant();
        let (first, last) = (*self.first.get_or_insert(now), self.last.replace(now));
        self.rows += 1;
        let Some(last) = last else {
            self.end = stamp.instant().seconds();
            return stamp;
        };
        if self.rows == 2 {
            self.step = now.0 - first.0;
        }
        let anew =
            now < last && now.0 <= first.0 + self.step && last.0 - first.0 > MIN_STEPS * self.step;
        // tests of one file: words name them, and time leaps between them
        let leaps = !even && self.step > 0 && now.0 - last.0 > MIN_STEPS * self.step;
        if leaps && let Some(name) = other_word() {
            marked = true;
            self.by_words.get_or_insert_with(|| name.to_owned());
        }
        let begins = match even {
            true => marked,
            false => (now <= last && marked) || anew,
        };
        if begins {
            self.by_time |= !marked;
            self.shifted = true;
            self.shift_s = self.end + BETWEEN_RUNS_S - now.seconds();
        }
        let shifted = self.shifted(stamp);
        if (begins || marked) && self.seams.len() < MAX_RUNS {
            self.seams.push(shifted);
        }
        self.end = shifted.instant().seconds();
        shifted
    }

    fn shifted(&self, stamp: RowTime) -> RowTime {
        match stamp {
            _ if !self.shifted => stamp,
            RowTime::Seconds(t) => RowTime::Seconds(t + self.shift_s),
            RowTime::Exact(instant) => RowTime::Exact(instant.plus(self.shift_s)),
        }
    }

    /// How many runs there were, and what parts them.
    pub(super) fn in_words(&self) -> Option<String> {
        let marks = self.marks.iter().filter(|column| column.parts);
        let mut parted: Vec<String> = marks
            .map(|column| &column.name)
            .chain(&self.by_words)
            .map(|name| format!("`{}`", escape(name)))
            .collect();
        if self.by_time {
            parted.push("times that begin anew".to_owned());
        }
        let steps = self
            .marks
            .iter()
            .any(|column| column.mark == RunMark::Step && column.parts);
        let missing = match self.missing {
            _ if !steps => String::new(),
            0 => ", none of them missing".to_owned(),
            many => format!(", {many} more are missing"),
        };
        let apart = match self.shifted {
            true => format!("; they follow one another {BETWEEN_RUNS_S} s apart"),
            false => String::new(),
        };
        (!self.seams.is_empty()).then(|| {
            format!(
                "{} runs of {} rows{missing}, parted by {}{apart}",
                self.seams.len() + 1,
                self.rows,
                parted.join(", ")
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(names: &str, rows: &[(f64, &[f64])], even: bool) -> (Vec<f64>, TableRuns) {
        let names: Vec<String> = names.split(',').map(str::to_owned).collect();
        let mut runs = TableRuns::new(&names);
        let each = rows.iter().map(|(t, row)| {
            let stamp = RowTime::Seconds(*t);
            let out = runs.take(stamp, even, |place| row.get(place).copied(), || None);
            out.instant().seconds()
        });
        (each.collect(), runs)
    }

    #[test]
    fn a_counter_of_runs_or_of_steps_or_a_flag_of_the_end_parts_a_table() {
        let t = [0.0, 0.1, 0.2, 0.3];
        for (names, marks) in [
            ("episode", [0.0, 0.0, 1.0, 1.0]),
            ("step", [0.0, 1.0, 0.0, 1.0]),
            ("timeouts", [0.0, 1.0, 0.0, 0.0]),
            ("is_first", [1.0, 0.0, 1.0, 0.0]),
        ] {
            let rows = [0, 1, 2, 3].map(|k| (t[k], &marks[k..=k]));
            let (found, runs) = times(names, &rows, true);
            assert!(
                (found[2] - 10.1).abs() < 1e-9 && (found[3] - 10.2).abs() < 1e-9,
                "{names}"
            );
            assert!(runs.in_words().unwrap().starts_with("2 runs of 4 rows"));
        }
        let rows = [0, 1, 2, 3].map(|k| (t[k], &[7.0][..]));
        assert_eq!(times("q", &rows, true).0, t);
    }

    #[test]
    fn a_time_that_begins_anew_parts_a_table_and_one_that_runs_back_does_not() {
        let rows = |back: f64| -> Vec<(f64, &[f64])> {
            let times = (0..60).map(|k| 0.1 * f64::from(k) - if k < 30 { 0.0 } else { back });
            times.map(|t| (t, &[][..])).collect()
        };
        let (found, runs) = times("q", &rows(3.0), false);
        assert!(found.is_sorted() && runs.seams.len() == 1);
        assert!((found[30] - 12.9).abs() < 1e-9);
        let (found, runs) = times("q", &rows(1.0), false);
        assert!(!found.is_sorted() && runs.seams.is_empty());
    }
}
