//! How far estimates have been moved by what no covariance of the residual tells: the filter and the noise of the
//! positions, judged by doing either once more, and friction at rest, of which the law says too much.

use nalgebra::DVector;

use super::fit::{Fitted, Ground, Inverse, fit, inertial_of, value};
use super::rows::near_rests;
use crate::motion::{MotionError, Stretch};

/// How far the unknowns move where the motion goes through the position filter once more: to leading order
/// what the filter's own distortion, at reversals above all, has made of them. Zero without such a filter.
///
/// # Errors
/// [`MotionError`] of the filters.
pub fn by_smoothing(at: &Fitted, ground: &Ground) -> Result<DVector<f64>, MotionError> {
    let none = DVector::zeros(at.base.unknowns.len());
    let mut again = Vec::with_capacity(ground.stretches.len());
    for (i, stretch) in ground.stretches.iter().enumerate() {
        if ground.plan.idle(i) {
            again.push(stretch.clone());
            continue;
        }
        match ground.parallel.twice(stretch)? {
            Some(stretch) => again.push(stretch),
            None => return Ok(none),
        }
    }
    refitted(at, &along(at, ground, &again)?)
}

/// How far the unknowns move in a fit where the positions get noise of their own level once more: to leading order
/// what that noise, a regressor's, has made of them already. A resonance within reach of the band feels it most.
/// What is of first order in the noise is left out, for the residual's covariance holds it.
///
/// # Errors
/// [`MotionError`] of the filters.
pub fn by_noise(at: &Fitted, ground: &Ground) -> Result<DVector<f64>, MotionError> {
    let mut pair = [Vec::new(), Vec::new()];
    for (i, stretch) in ground.stretches.iter().enumerate() {
        let [more, less] = match ground.plan.idle(i) {
            true => [stretch.clone(), stretch.clone()],
            false => ground.parallel.noisier(stretch, i as u64)?,
        };
        pair[0].push(more);
        pair[1].push(less);
    }
    let [more, less] = &pair;
    let moved = refitted(at, &along(at, ground, more)?)? + refitted(at, &along(at, ground, less)?)?;
    Ok(0.5 * moved)
}

/// How far rows near a reversal or a rest have pulled the unknowns, on joints whose friction law jumps there:
/// friction at rest takes any torque up to its limit, and where the speed is nearly none the law says too much.
/// As the unknowns rest where all rows together pull them nowhere, it is what those rows pull against the others.
pub fn by_rests(at: &Fitted, ground: &Ground, cutoff_hz: f64) -> DVector<f64> {
    let unknowns = &at.base.unknowns;
    let mut pull = DVector::zeros(unknowns.len());
    for (i, (stretch, rows)) in ground.stretches.iter().zip(&at.base.stretches).enumerate() {
        for j in (0..stretch.joints()).filter(|j| !ground.plan.holds(i, *j)) {
            let near = near_rests(&at.model, stretch, ground.parallel, cutoff_hz, j);
            let weight = at.weights[j] * at.weights[j];
            let pieces = ground.plan.pieces.iter();
            let fitted = pieces.filter(|p| p.stretch == i && p.role.fitted());
            for row in fitted.flat_map(|p| p.rows.clone()).filter(|row| near[*row]) {
                let e = weight * rows.residual[j][row];
                for (column, &u) in rows.columns[j].iter().zip(&unknowns.columns[j]) {
                    pull[u] += column[row] * e;
                }
            }
        }
    }
    Inverse::of(&at.normal).solve(&pull)
}

/// The same ground with other stretches.
fn along<'a>(
    at: &Fitted,
    ground: &Ground<'a>,
    stretches: &'a [Stretch],
) -> Result<Ground<'a>, MotionError> {
    Ok(Ground {
        inertial: inertial_of(
            &at.model.model.robot,
            stretches,
            ground.parallel,
            &ground.plan,
        )?,
        stretches,
        plan: ground.plan.clone(),
        cover: ground.cover.clone(),
        ..*ground
    })
}

/// How far a fit on other ground moves the unknowns.
fn refitted(at: &Fitted, ground: &Ground) -> Result<DVector<f64>, MotionError> {
    let other = fit(&at.model, ground)?.model;
    let list = at.base.unknowns.list.iter();
    let moved = list.map(|u| value(&other, *u) - value(&at.model, *u));
    Ok(DVector::from_iterator(at.base.unknowns.len(), moved))
}
