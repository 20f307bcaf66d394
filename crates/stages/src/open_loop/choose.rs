//! What a fit to the motion of one axis has: how long its windows are, and which friction it adds, both by blocks of
//! the logs that are set aside one after the other and simulated from begin to end.

use cft_ident_core::explain::Explain;
use nalgebra::DMatrix;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::fit::{POSITIONS, RunSpan, WindowFit, apart, errors, fit, rms, windows};
use super::numbers::{Columns, columns, numbers};
use cft_ident_core::effect::{
    AugmentedModel, EffectPlace, Family, LAWS, Law, LogCoverage, ModelEffect, Role, ShapeSearch,
};
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_core::motion::Stretch;
use cft_ident_core::number;

/// Blocks that are set aside one after the other.
pub const BLOCKS: usize = 4;
/// Shortest windows that are tried \[s\]; the next are twice as long each.
const SHORTEST_S: f64 = 0.25;
/// Share of the error on blocks set aside that friction must take away to be added.
const MIN_GAIN: f64 = 0.1;
/// Least samples of a window.
const MIN_WINDOW_SAMPLES: usize = 20;
/// Every sample of a block set aside.
const ALL: usize = usize::MAX;

/// Why no fit is made.
#[derive(Debug, Clone, PartialEq, Explain, thiserror::Error)]
pub enum AxisError {
    /// Blocks that are set aside hold no window.
    #[explain(
        format!(
            "windows of {window_s} s do not fit into a quarter of the logs, which is set aside to check the fit ({} s): give longer logs, or --open-loop=SECONDS with fewer seconds",
            number::significant(*block_s, 3)
        )
    )]
    TooShort { window_s: f64, block_s: f64 },
    /// The motion that the model of the torques makes is none.
    #[explain(
        "the motion simulated from the torques goes astray with the numbers that least squares finds: look at mass and viscous friction, which must be above 0, with `lsq` without --open-loop"
    )]
    Astray,
    /// Somebody stopped it.
    #[explain("interrupted")]
    Stopped,
}

/// One model that was tried on blocks set aside.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TriedAxis {
    /// Length of its windows \[s\].
    pub window_s: f64,
    /// Effect that it adds to the model before it.
    pub effect: Option<&'static str>,
    /// Root mean square of the positions' errors on the blocks [m or rad]; none where a motion goes astray.
    pub held_out: Option<f64>,
    /// It was taken.
    pub taken: bool,
}

/// Errors of simulated positions, root mean squares [m or rad].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct PositionErrors {
    /// In the windows of the fit.
    pub windows: f64,
    /// Of blocks, from begin to end.
    pub blocks: f64,
}

/// A model of one axis fitted to its motion.
#[derive(Debug, Clone)]
pub struct AxisFit {
    pub model: AugmentedModel,
    /// Of all its numbers: inertial parameters, viscous, Coulomb, offset, then shape and coefficients of each effect.
    pub covariance: DMatrix<f64>,
    /// Which of them were moved.
    pub free: Vec<usize>,
    /// Length of the windows \[s\].
    pub window_s: f64,
    /// Windows, which overlap.
    pub windows: usize,
    /// Windows that do not.
    pub apart: f64,
    /// Of the model before.
    pub before: PositionErrors,
    /// After; blocks are those of fits without them.
    pub after: PositionErrors,
    pub ending: IterationEnding,
    /// Steps of the last fit.
    pub steps: usize,
    pub tried: Vec<TriedAxis>,
}

/// Fits a model without effects to the motion of one axis, in windows of `window` seconds or of a chosen length.
pub fn fit_axis(
    start: &AugmentedModel,
    stretches: &[Stretch],
    (window, offset): (Option<f64>, bool),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<AxisFit, AxisError> {
    let trial = Trial {
        stretches,
        cover: LogCoverage::of(&start.model.robot, stretches, 0.0),
        offset,
        stop,
    };
    let block_s = (0..BLOCKS).flat_map(|b| trial.block(b));
    let block_s = block_s.map(|(s, from, to)| (to - from - 1) as f64 * stretches[s].dt);
    let block_s = block_s.fold(0.0, f64::max);
    let dt = stretches.iter().map(|s| s.dt).fold(0.0, f64::max);
    let shortest = window.unwrap_or(SHORTEST_S);
    if shortest > block_s || shortest < MIN_WINDOW_SAMPLES as f64 * dt {
        let window_s = shortest.max(MIN_WINDOW_SAMPLES as f64 * dt);
        return Err(AxisError::TooShort { window_s, block_s });
    }
    let doubled = std::iter::successors(Some(shortest), |s| Some(2.0 * s));
    let lengths: Vec<f64> = match window {
        Some(length) => vec![length],
        None => doubled.take_while(|s| *s <= block_s).collect(),
    };
    let mut tried = Vec::new();
    let mut model = start.clone();
    let mut chosen = trial.best_length(start, &lengths, &mut tried)?;
    loop {
        let mut best: Option<(WindowChoice, AugmentedModel)> = None;
        for rival in trial.rivals(&model) {
            let effect = rival.effects.last().map(ModelEffect::name);
            let found = trial.tried((&rival, &rival), (chosen.length, effect), &mut tried)?;
            let least = best.as_ref().map(|(best, _)| best.error);
            let better = |found: &WindowChoice| least.is_none_or(|least| found.error < least);
            best = found.filter(better).map(|found| (found, rival)).or(best);
        }
        let enough = (1.0 - MIN_GAIN) * chosen.error;
        let Some((found, rival)) = best.filter(|(best, _)| best.error < enough) else {
            break;
        };
        tried[found.at].taken = true;
        model = rival;
        chosen = match lengths.len() {
            1 => found,
            _ => trial.best_length(&model, &lengths, &mut tried)?,
        };
    }
    let all = trial.whole();
    let windows = windows(stretches, &all, chosen.length);
    let columns = trial.columns(&model);
    let fitted = trial
        .fit(&chosen.near, &columns, (&all, chosen.length), true)?
        .ok_or(AxisError::Astray)?;
    let of_start = |windows: &[RunSpan], positions| {
        let errors = errors(start, stretches, windows, positions);
        errors.map(|errors| rms(&errors)).ok_or(AxisError::Astray)
    };
    let blocks: Vec<RunSpan> = (0..BLOCKS).flat_map(|b| trial.block(b)).collect();
    Ok(AxisFit {
        window_s: chosen.length,
        free: columns.free,
        apart: apart(&windows, stretches, chosen.length),
        before: PositionErrors {
            windows: of_start(&windows, POSITIONS)?,
            blocks: of_start(&blocks, ALL)?,
        },
        after: PositionErrors {
            windows: fitted.rms,
            blocks: chosen.error,
        },
        windows: windows.len(),
        model: fitted.model,
        covariance: fitted.covariance,
        ending: fitted.ending,
        steps: fitted.steps,
        tried,
    })
}

/// A model with a length of windows, tried on blocks set aside.
struct WindowChoice {
    /// On blocks set aside.
    error: f64,
    length: f64,
    /// The model of a fit to all.
    near: AugmentedModel,
    /// Its place among those that were tried.
    at: usize,
}

struct Trial<'a> {
    stretches: &'a [Stretch],
    cover: LogCoverage,
    offset: bool,
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl Trial<'_> {
    fn whole(&self) -> Vec<RunSpan> {
        let each = self.stretches.iter().enumerate();
        each.map(|(s, stretch)| (s, 0, stretch.len())).collect()
    }

    /// One of the blocks: a quarter of each stretch.
    fn block(&self, block: usize) -> Vec<RunSpan> {
        let at = |of: &Stretch, b: usize| b * (of.len() - 1) / BLOCKS;
        let each = self.stretches.iter().enumerate();
        let spans = each.map(|(s, of)| (s, at(of, block), at(of, block + 1) + 1));
        spans
            .filter(|(_, from, to)| to - from >= MIN_WINDOW_SAMPLES)
            .collect()
    }

    /// What is before and behind one of the blocks.
    fn without(&self, block: usize) -> Vec<RunSpan> {
        let sides =
            |(s, from, to): RunSpan| [(s, 0, from + 1), (s, to - 1, self.stretches[s].len())];
        let mut out: Vec<RunSpan> = self.block(block).into_iter().flat_map(sides).collect();
        out.retain(|(_, from, to)| to - from >= MIN_WINDOW_SAMPLES);
        out
    }

    /// Which numbers of a model may move.
    fn columns(&self, model: &AugmentedModel) -> Columns {
        let mut held = vec![false; numbers(model).len()];
        let inertial = model.model.theta.len();
        held[inertial + 2] = !self.offset;
        columns(model, self.stretches, &held)
    }

    fn fit(
        &self,
        model: &AugmentedModel,
        columns: &Columns,
        (spans, length): (&[RunSpan], f64),
        with_covariance: bool,
    ) -> Result<Option<WindowFit>, AxisError> {
        if (self.stop)() {
            return Err(AxisError::Stopped);
        }
        let windows = windows(self.stretches, spans, length);
        let (stretches, windows) = (self.stretches, &windows);
        Ok(fit(model, stretches, windows, columns, with_covariance))
    }

    /// Error on each block of a fit to the others, and the model of a fit to all; none where a motion goes astray.
    fn held_out(
        &self,
        (model, near): (&AugmentedModel, &AugmentedModel),
        length: f64,
    ) -> Result<Option<(f64, AugmentedModel)>, AxisError> {
        let columns = self.columns(model);
        // a start that is near saves steps, and changes no result
        let Some(near) = self.fit(near, &columns, (&self.whole(), length), false)? else {
            return Ok(None);
        };
        let near = near.model;
        let of_block = |block: usize| -> Result<Option<Vec<f64>>, AxisError> {
            let fitted = self.fit(&near, &columns, (&self.without(block), length), false)?;
            let held = self.block(block);
            Ok(fitted.and_then(|f| errors(&f.model, self.stretches, &held, ALL)))
        };
        let found: Result<Vec<_>, AxisError> = (0..BLOCKS).into_par_iter().map(of_block).collect();
        let found: Option<Vec<Vec<f64>>> = found?.into_iter().collect();
        Ok(found.map(|errors| (rms(&errors.concat()), near)))
    }

    /// The least error on blocks over lengths of windows, and that length, each from the model that the one before found.
    fn best_length(
        &self,
        model: &AugmentedModel,
        lengths: &[f64],
        tried: &mut Vec<TriedAxis>,
    ) -> Result<WindowChoice, AxisError> {
        let mut best: Option<WindowChoice> = None;
        let mut near = model.clone();
        for length in lengths {
            let Some(found) = self.tried((model, &near), (*length, None), tried)? else {
                continue;
            };
            near = found.near.clone();
            if best.as_ref().is_none_or(|best| found.error < best.error) {
                best = Some(found);
            }
        }
        let chosen = best.ok_or(AxisError::Astray)?;
        tried[chosen.at].taken = true;
        Ok(chosen)
    }

    /// Tries a model on blocks set aside, as one that adds `effect`.
    fn tried(
        &self,
        models: (&AugmentedModel, &AugmentedModel),
        (length, effect): (f64, Option<&'static str>),
        tried: &mut Vec<TriedAxis>,
    ) -> Result<Option<WindowChoice>, AxisError> {
        let found = self.held_out(models, length)?;
        let at = tried.len();
        tried.push(TriedAxis {
            window_s: length,
            effect,
            held_out: found.as_ref().map(|(error, _)| *error),
            taken: false,
        });
        Ok(found.map(|(error, near)| WindowChoice {
            error,
            length,
            near,
            at,
        }))
    }

    /// The model with one more effect: friction that is a law of speed, each from the shape that the torques determine best.
    fn rivals(&self, model: &AugmentedModel) -> Vec<AugmentedModel> {
        let of_speed = |law: &&&Law| {
            let entry = law.entry;
            entry.friction
                && entry.families.contains(&Family::Velocity)
                && entry.role == Role::Columns
                && entry.search != ShapeSearch::Orders
                && law.memory.is_none()
                && law.varied.is_none()
                && !model.effects.iter().any(|e| e.name() == entry.name)
        };
        let place = EffectPlace::Joint(0);
        let laws = LAWS.iter().filter(of_speed).filter(|law| {
            let places = law.places(&model.model.robot, &model.model.friction);
            places.contains(&place)
        });
        let best = laws.filter_map(|law| {
            let starts = law.starts_on(&self.cover, place).ok()?;
            let with = starts.into_iter().map(|shape| {
                let mut with = model.clone();
                let linear = vec![0.0; law.linear.len()];
                with.effects
                    .push(ModelEffect::new(law, place, shape, linear));
                let left = self.columns(&with).left;
                (with, left)
            });
            with.min_by(|a, b| a.1.total_cmp(&b.1))
        });
        best.map(|(with, _)| with).collect()
    }
}
