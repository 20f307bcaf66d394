//! What the encoders' steps change in the fit.
//!
//! A rounding error depends on the position alone, so on a periodic motion it is the same in every
//! period, no residual shows it, and no covariance of residuals holds it. Here the measured motion
//! is smoothed and rounded again on grids that are shifted by parts of a step; the scatter of the
//! fits is the part of the uncertainty that the encoders make.

use nalgebra::DMatrix;

use super::accumulate::BlockFactors;
use super::columns::RegressorColumns;
use super::robust::Weigher;
use super::solve::Fit;
use super::two_pass::two_passes;
use crate::block::Block;
use crate::motion::{self, FilterSettings, RunError};
use crate::robot::Robot;

/// Number of shifted grids.
pub const GRIDS: u32 = 6;

/// Shifts of a grid as parts of a step per motor: multiples of irrational numbers, spread evenly without chance.
fn shifts(grid: u32) -> [f64; 4] {
    const TURNS: [f64; 4] = [
        0.618_033_988_7,
        0.414_213_562_4,
        0.732_050_807_6,
        0.236_067_977_5,
    ];
    TURNS.map(|turn| (turn * f64::from(grid + 1)).fract())
}

/// Reduces a log whose smoothed positions are rounded anew on a shifted grid. `None` where the
/// robot's encoders are not known.
///
/// # Errors
/// Those of the source and of [`motion::run`].
pub fn accumulate_shifted<E: Send>(
    robot: &Robot,
    columns: &RegressorColumns,
    weigher: Option<&mut Weigher>,
    settings: &FilterSettings,
    grid: u32,
    source: &mut (dyn FnMut(&mut Block) -> Result<bool, E> + Send),
) -> Result<Option<BlockFactors>, RunError<E>> {
    if robot.transmission().encoder_steps().is_none() {
        return Ok(None);
    }
    let n = columns.joints;
    let shift = shifts(grid);
    let smooth = FilterSettings {
        decimation: Some(1),
        ..settings.clone()
    };
    let (_, (factors, _)) = two_passes(
        |outlet| {
            motion::run(
                source,
                n,
                &smooth,
                None,
                n,
                &|s, out| out.copy_from_slice(s.tau),
                &mut |row| {
                    outlet.row(|block| {
                        block.t.push(row.t);
                        let at = block.q.len();
                        block.q.extend_from_slice(row.q);
                        robot
                            .transmission()
                            .round_at_encoders(&mut block.q[at..], &shift);
                        block.tau.extend_from_slice(row.raw);
                    });
                },
            )
        },
        |blocks| super::accumulate_weighted(robot, columns, weigher, settings, blocks),
    )?;
    Ok(Some(factors))
}

/// Adds the scatter of the fits on shifted grids to a fit's covariance.
pub fn add_scatter(fit: &mut Fit, shifted: &[Fit]) {
    let k = shifted.len();
    if k < 2 {
        return;
    }
    let u = fit.theta.len();
    let mut mean = fit.theta.clone() * 0.0;
    for other in shifted {
        mean += &other.theta / k as f64;
    }
    let mut scatter = DMatrix::zeros(u, u);
    for other in shifted {
        let d = &other.theta - &mean;
        scatter.ger(1.0 / (k - 1) as f64, &d, &d, 1.0);
    }
    fit.covariance += scatter;
}
