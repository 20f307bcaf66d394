//! Smooth positions, velocities and accelerations at every row of one record in memory.

use std::ops::Range;

use super::MotionError;
use super::position_filter::PositionFilter;
use super::settings::{FilterSettings, edge};
use super::time_base::{Event, SampleClock, TimeBase, interpolate};
use super::window::step_of;
use crate::block::Block;

/// Motion at the rows of a record; matrices are `k x joints` row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct FullRateMotion {
    /// Sampling step (s).
    pub dt: f64,
    /// Smoothed positions [m or rad].
    pub q: Vec<f64>,
    /// Velocities [m/s or rad/s].
    pub v: Vec<f64>,
    /// Accelerations [m/s2 or rad/s2].
    pub a: Vec<f64>,
    /// Rows at which the position filter had enough of the record on both sides.
    pub settled: Range<usize>,
}

/// Rows of a record between gaps, as these settings have them.
///
/// # Errors
/// [`MotionError::TooFewSamples`], [`MotionError::Time`].
pub fn segments(t: &[f64], settings: &FilterSettings) -> Result<Vec<Range<usize>>, MotionError> {
    let clock = SampleClock::of(t)?;
    let mut found = Vec::new();
    let mut start = 0;
    for k in 1..t.len() {
        if clock.splits(t[k] - t[k - 1], settings) {
            found.push(start..k);
            start = k;
        }
    }
    found.push(start..t.len());
    Ok(found)
}

/// Smooths and differentiates positions `q`, `k x joints` row-major, at times `t` (s) of one record
/// without gaps, with the position filter of `settings`. Rows at uneven times are smoothed on an
/// even grid and read off it again.
///
/// # Errors
/// [`MotionError::Shape`], [`MotionError::Gap`], and what [`super::run()`] answers to times and
/// settings; [`crate::math::MathError::TooShort`] for a record that the filter cannot run over.
pub fn full_rate(
    t: &[f64],
    q: &[f64],
    joints: usize,
    settings: &FilterSettings,
) -> Result<FullRateMotion, MotionError> {
    if joints == 0 || q.len() != t.len() * joints {
        return Err(MotionError::Shape {
            channel: "q",
            values: q.len(),
            rows: t.len(),
            joints,
        });
    }
    let clock = SampleClock::of(t)?;
    let (grid_t, mut grid_q) = even_grid(t, q, joints, settings, clock)?;
    let dt = step_of(&grid_t, clock.dt);
    let cutoffs = settings.position_cutoffs_hz(1.0 / dt);
    let filter = PositionFilter::design(settings.q_order, cutoffs, 1.0 / dt)?;
    if let Some(filter) = &filter {
        filter.run(&mut grid_q, joints)?;
    }
    let mut v = vec![0.0; grid_q.len()];
    let mut a = vec![0.0; grid_q.len()];
    settings
        .differences
        .apply(&grid_q, joints, dt, &mut v, &mut a);
    if grid_t != t {
        grid_q = at_rows(t, &grid_t, &grid_q, joints);
        v = at_rows(t, &grid_t, &v, joints);
        a = at_rows(t, &grid_t, &a, joints);
    }
    let edge = edge(settings, filter.as_ref(), dt)? as f64 * dt;
    let from = t.partition_point(|x| *x < t[0] + edge);
    let to = t.partition_point(|x| *x <= t[t.len() - 1] - edge);
    Ok(FullRateMotion {
        dt,
        q: grid_q,
        v,
        a,
        settled: from..to.max(from),
    })
}

/// Times and positions at equal steps.
fn even_grid(
    t: &[f64],
    q: &[f64],
    joints: usize,
    settings: &FilterSettings,
    clock: SampleClock,
) -> Result<(Vec<f64>, Vec<f64>), MotionError> {
    let mut base = TimeBase::new(joints, settings, None)?;
    base.use_clock(clock);
    base.push(&Block {
        t: t.to_vec(),
        q: q.to_vec(),
        tau: vec![0.0; q.len()],
        ..Block::default()
    })?;
    let (mut grid_t, mut grid_q) = (Vec::with_capacity(t.len()), Vec::with_capacity(q.len()));
    let mut gap = None;
    let mut ended = None;
    base.drain(true, &mut |event| match event {
        Event::Sample { t, q, .. } => {
            if let (None, Some(before)) = (gap, ended) {
                gap = Some((before, t));
            }
            grid_t.push(t);
            grid_q.extend_from_slice(q);
        }
        Event::End => ended = ended.or(grid_t.last().copied()),
    })?;
    match gap {
        Some((from, to)) => Err(MotionError::Gap { from, to }),
        None => Ok((grid_t, grid_q)),
    }
}

/// Values `x` on the grid, read off at the times of the rows by the cubic through four points.
fn at_rows(t: &[f64], grid: &[f64], x: &[f64], joints: usize) -> Vec<f64> {
    let mut out = vec![0.0; t.len() * joints];
    let mut above = 0;
    for (row, &time) in out.chunks_exact_mut(joints).zip(t) {
        while above < grid.len() && grid[above] < time {
            above += 1;
        }
        let first = above.saturating_sub(2).min(grid.len().saturating_sub(4));
        let nodes = &grid[first..grid.len().min(first + 4)];
        interpolate(nodes, &x[first * joints..], time, row);
    }
    out
}
