//! The unit of times whose header and robot file state none: by the size of the numbers and of their
//! steps.

use std::path::PathBuf;

use super::LogError;
use super::columns::{time_of, unit_of};
use super::layout::Layout;
use super::open::open;
use super::rows::{LogRows, RowStrictness};
use super::section::TimeUnit;
use super::two_clocks::rest_of;

/// Rows by whose times a unit is recognised.
pub(super) const UNIT_ROWS: usize = 1024;
/// Steps of the clocks that logs of robots have [s]: 100 kHz to 1 Hz.
const STEPS_S: [f64; 2] = [1e-5, 1.0];
/// A step in the middle of those that are usual [s].
const USUAL_S: f64 = 2e-3;
/// A step up to this one is in seconds, as the contract has it.
const MAX_STEP_IN_SECONDS_S: f64 = 0.5;
/// Seconds since 1970 of clocks that are set: 2001 to 2096.
const EPOCH_S: [f64; 2] = [1e9, 4e9];
/// Day numbers of the years 2000 to 2100, as a spreadsheet and as MATLAB count them.
const DAY_NUMBERS: [[f64; 2]; 2] = [[36_526.0, 73_051.0], [730_486.0, 767_011.0]];
/// Rows from which a unit is reported.
const MIN_ROWS: usize = 64;

impl TimeUnit {
    /// The unit of these times by their size since 1970, where their step fits it, else by their step alone.
    pub(super) fn of_numbers(times: &[f64]) -> Self {
        let mut steps: Vec<f64> = times
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).abs())
            .collect();
        steps.retain(|step| *step > 0.0 && step.is_finite());
        if steps.len() < MIN_ROWS {
            return Self::Second;
        }
        steps.sort_by(f64::total_cmp);
        let step = steps[steps.len() / 2];
        let all = [
            Self::Second,
            Self::Millisecond,
            Self::Microsecond,
            Self::Nanosecond,
        ];
        let within = |value: f64, [low, high]: [f64; 2]| value >= low && value <= high;
        let possible = |unit: &Self| within(step * unit.in_seconds().1, STEPS_S);
        let first = times.first().copied().unwrap_or(0.0).abs();
        let of_epoch = |unit: &Self| within(first * unit.in_seconds().1, EPOCH_S);
        if let Some(unit) = all.iter().find(|unit| possible(unit) && of_epoch(unit)) {
            return *unit;
        }
        let is_day = DAY_NUMBERS.iter().any(|years| within(first, *years));
        if is_day && !possible(&Self::Second) && possible(&Self::Day) {
            return Self::Day;
        }
        if step <= MAX_STEP_IN_SECONDS_S {
            return Self::Second;
        }
        let off = |unit: &Self| (step * unit.in_seconds().1 / USUAL_S).ln().abs();
        let found = all.iter().filter(|unit| possible(unit));
        let found = found.min_by(|a, b| off(a).total_cmp(&off(b)));
        found.copied().unwrap_or(Self::Second)
    }
}

/// The column of times of a robot's log, where its numbers have to say their unit.
pub(super) fn unstated(rows: &dyn LogRows, layout: &Layout) -> Option<usize> {
    let section = &layout.section;
    let stated =
        section.time_unit.is_some() || section.rate_hz.is_some() || layout.joints.is_empty();
    let column = time_of(rows.names(), &layout.time).filter(|_| !stated)?;
    (!is_stated(rows, column)).then_some(column)
}

/// Whether the name of a column of times states its unit, or its rows carry times of their own.
pub(super) fn is_stated(rows: &dyn LogRows, column: usize) -> bool {
    let name = &rows.names()[column];
    unit_of(name).is_some()
        || TimeUnit::of_suffix(name).is_some()
        || rest_of(rows.names(), column).is_some()
        || rows.is_recording()
}

/// The first numbers of a column; none where it holds dates, which have no unit.
pub(super) fn first_numbers(
    files: &[PathBuf],
    layout: &Layout,
    column: usize,
) -> Result<Option<Vec<f64>>, LogError> {
    let mut rows = open(files, layout, RowStrictness::Record)?.rows;
    let mut numbers = Vec::with_capacity(UNIT_ROWS);
    while numbers.len() < UNIT_ROWS && rows.next()?.is_some() {
        match rows.logged(column) {
            Some(number) => numbers.push(number),
            None => return Ok(None),
        }
    }
    Ok(Some(numbers))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_known_by_the_size_of_times_and_steps() {
        let unit = |first: f64, step: f64| {
            let times: Vec<f64> = (0..200).map(|k| first + f64::from(k) * step).collect();
            TimeUnit::of_numbers(&times)
        };
        for rate in [10.0, 125.0, 500.0, 1000.0, 5000.0] {
            for begin in [0.0, 17.25, 90_000.0, 1.7e9, 1.76e9] {
                assert_eq!(unit(begin, 1.0 / rate), TimeUnit::Second, "{rate} {begin}");
                for (other, size) in [
                    (TimeUnit::Millisecond, 1e-3),
                    (TimeUnit::Microsecond, 1e-6),
                    (TimeUnit::Nanosecond, 1e-9),
                ] {
                    // a step below a millisecond in milliseconds may be seconds as well
                    let (first, step) = (begin / size, 1.0 / rate / size);
                    if step > MAX_STEP_IN_SECONDS_S && (rate > 50.0 || begin >= 1e9) {
                        assert_eq!(unit(first, step), other, "{rate} Hz from {begin} s");
                    }
                }
            }
        }
        for (first, rate) in [(739_740.395_8, 100.0), (46_146.4, 1000.0)] {
            assert_eq!(unit(first, 1.0 / rate / 86_400.0), TimeUnit::Day);
        }
        assert_eq!(unit(46_146.4, 2e-3), TimeUnit::Second);
        // a clock that runs since the machine was switched on, 50 minutes ago
        assert_eq!(unit(3e12, 1e6), TimeUnit::Nanosecond);
    }

    #[test]
    fn few_rows_and_rows_without_times_are_seconds() {
        assert_eq!(TimeUnit::of_numbers(&[0.0, 1.0, 2.0]), TimeUnit::Second);
        assert_eq!(TimeUnit::of_numbers(&[f64::NAN; 200]), TimeUnit::Second);
        assert_eq!(TimeUnit::of_numbers(&[]), TimeUnit::Second);
    }
}
