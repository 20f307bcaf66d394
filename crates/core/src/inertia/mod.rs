//! Inertial parameters by least squares on the inverse-dynamics regressor, eq. (39)-(42).
//!
//! Rows come filtered and decimated from `motion`; `columns` says what stands in them,
//! `accumulate` folds them into R factors, `solve` fits by a `solution`, `covariance` says how sure it is, `standstill` whether rows at rest count, and
//! `departure` how far friction departs from its law (from sums `by_speed`), `late` what a torque that is logged late changes. `robust`,
//! `refine` (from a `law_start`) and `instruments` (along motions of `closed_loop`) are estimators that read the logs
//! several times; `condense` makes of a log what a file of reduced logs holds, one R factor and `scores`; `essential`
//! and `feasible` work on the R factor of a fit, `gains` finds what one unit of each torque channel is at its joint.

pub mod accumulate;
pub mod between_logs;
pub mod by_speed;
pub mod closed_loop;
pub mod columns;
mod condense;
mod covariance;
pub use covariance::bandwidth;
pub mod departure;
pub mod encoder;
pub mod essential;
pub mod feasible;
pub mod gains;
pub mod instruments;
pub mod jumps;
pub mod late;
pub mod law_start;
pub mod left_out;
pub mod refine;
pub mod robust;
pub mod scores;
pub mod solution;
pub mod solve;
pub mod standstill;
mod two_pass;
pub mod verdict;

use crate::block::Block;
use crate::motion::{self, FilterSettings, RunError, Summary};
use crate::robot::Robot;

use accumulate::{BlockFactors, RowAccumulator};
use columns::RegressorColumns;
use robust::RowWeigher;

/// Length of the blocks whose scores make the covariance, to begin with [s]: short beside their correlation.
const BLOCK_SECONDS: f64 = 0.05;

/// Reads one log and reduces its filtered, decimated rows to block factors. Those of several logs merge.
///
/// # Errors
/// Those of the source and of [`motion::run`].
pub fn accumulate<E>(
    robot: &Robot,
    columns: &RegressorColumns,
    settings: &FilterSettings,
    source: &mut dyn FnMut(&mut Block) -> Result<bool, E>,
) -> Result<(BlockFactors, Summary), RunError<E>> {
    accumulate_weighted(robot, columns, None, settings, source)
}

/// The same with each row weighted by its residual, where a weigher is given.
///
/// # Errors
/// Those of the source and of [`motion::run`].
pub fn accumulate_weighted<E>(
    robot: &Robot,
    columns: &RegressorColumns,
    mut weigher: Option<&mut RowWeigher>,
    settings: &FilterSettings,
    source: &mut dyn FnMut(&mut Block) -> Result<bool, E>,
) -> Result<(BlockFactors, Summary), RunError<E>> {
    let mut factors = RowAccumulator::new(columns.clone(), BLOCK_SECONDS);
    let settings = FilterSettings {
        thin: settings.weighs_rests && columns.are_smooth(),
        ..columns.with_rests(settings)
    };
    let summary = motion::run(
        source,
        columns.joints,
        &settings,
        None,
        columns.channels(),
        &|s, out| {
            columns.fill(robot, s.q, s.v, s.a, s.tau, out);
            columns.fill_torque_rates(s, out);
            columns.weigh(s, out);
        },
        &mut |row| {
            let channels = match &mut weigher {
                Some(weigher) => weigher.weigh(columns, row.filtered),
                None => row.filtered,
            };
            factors.at(row.t);
            factors.add(row.segment, row.step, channels);
        },
    )?;
    Ok((factors.finish(), summary))
}

/// Adds to a fit's covariance what another processing of the same logs changes in its parameters.
/// Smoothing errs in the same way at every reversal of a periodic motion, which no residual shows.
pub fn add_processing(fit: &mut solve::Fit, other: &solve::Fit) {
    let change = &other.theta - &fit.theta;
    fit.covariance.ger(1.0, &change, &change, 1.0);
}
