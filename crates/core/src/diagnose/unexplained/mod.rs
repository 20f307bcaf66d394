//! What of the torque's residual is above its noise, before and after.

pub mod dependence;
pub mod errors;
pub mod evidence;
pub mod map;
pub mod noise_floor;
pub mod period;
pub mod signal;

use self::errors::{JointErrors, UseErrors};

/// What stays unexplained on one joint, on fitted or on unseen logs, whichever is more.
#[derive(Debug, Clone, Copy)]
pub struct UnexplainedResidual {
    /// Fraction of the torque's power that is residual above the noise floor.
    pub share: f64,
    /// Power of the residual over that of the floor; none where the torque was filtered before it was logged,
    /// so that nothing beyond the band shows its noise.
    pub over_floor: Option<f64>,
}

impl UnexplainedResidual {
    /// Whether it is more than noise makes, and worth a name.
    pub fn is_structure(&self) -> bool {
        self.over_floor.is_none_or(|over| over > STRUCTURED) && self.share > NEGLIGIBLE
    }

    /// Whether so much is left that something is missing.
    pub fn matters(&self) -> bool {
        self.is_structure() && self.share > MATTERS * MATTERS
    }
}

/// Residual power over the floor's from which on a residual is called structured.
pub const STRUCTURED: f64 = 2.0;
/// Share of the torque's power below which structure is not worth a name.
pub const NEGLIGIBLE: f64 = 2e-6;

/// Part of the torque that is left above the noise from which on something is missing. Half: the filter's own error is
/// a finding; twice: a drift of a twentieth of the torque is none.
const MATTERS: f64 = 0.02;

/// Power of a torque's noise over its own below which it is that of rounding, and no noise.
const NO_NOISE: f64 = 1e-10;

/// How much of each joint's residual is above the noise floor.
fn above(noise: &[f64], found: &UseErrors) -> Vec<UnexplainedResidual> {
    let of_joint = |(e, noise): (&JointErrors, &f64)| {
        let residual = e.power;
        let torque = residual / (e.headline() * e.headline());
        UnexplainedResidual {
            share: ((residual - noise) / torque).max(0.0),
            over_floor: (*noise > NO_NOISE * torque).then(|| residual / noise),
        }
    };
    found.joints.iter().zip(noise).map(of_joint).collect()
}

/// What is unexplained on fitted logs, or on unseen ones with their own noise where that is more.
pub fn unexplained(
    train: &UseErrors,
    noise: &[f64],
    unseen: Option<(&UseErrors, Vec<f64>)>,
) -> Vec<UnexplainedResidual> {
    let train = above(noise, train);
    let Some((holdout, noise)) = unseen else {
        return train;
    };
    let pairs = train.into_iter().zip(above(&noise, holdout)).zip(&noise);
    // a joint that rests there has no floor
    let more =
        |((train, unseen), noise): ((UnexplainedResidual, UnexplainedResidual), &f64)| match *noise
            > 0.0
        {
            true if unseen.share > train.share => unseen,
            _ => train,
        };
    pairs.map(more).collect()
}

/// Structure after over structure before, per joint.
pub fn part_unexplained(noise: &[f64], before: &UseErrors, after: &UseErrors) -> Vec<f64> {
    let shares = above(noise, before).into_iter().zip(above(noise, after));
    shares
        .map(|(before, after)| after.share / before.share.max(f64::MIN_POSITIVE))
        .collect()
}

/// Nearly normal noise.
#[cfg(test)]
fn normal(seed: u64) -> impl FnMut() -> f64 {
    use rand::{RngExt, SeedableRng};
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    move || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0
}
