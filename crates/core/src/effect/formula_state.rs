//! Signals of formulas along a motion, and what those that remember keep from sample to sample.

use super::EffectScene;
use crate::robot::FormulaSignal;
use crate::robot::friction::sign;

/// What one signal keeps: NaN before the first sample of a stretch.
pub(super) struct FormulaState<'a>(pub &'a mut [f64]);

impl FormulaState<'_> {
    /// Numbers that it keeps.
    pub const SIZE: usize = 2;

    /// The signal of a joint at the next sample k, with its scale.
    pub fn next(
        &mut self,
        signal: FormulaSignal,
        scale: f64,
        scene: &EffectScene,
        (joint, k): (usize, usize),
    ) -> f64 {
        let s = scene.stretch;
        let (q, v) = (s.q[joint][k], s.v[joint][k]);
        let begins = self.0[0].is_nan();
        let [own, before] = self.0 else {
            return f64::NAN;
        };
        match signal {
            FormulaSignal::SinceReversal => {
                let turned = !begins && v * *before < 0.0;
                *own = if begins || turned { 0.0 } else { *own + s.dt };
                if v != 0.0 || begins {
                    *before = v;
                }
                *own
            }
            FormulaSignal::Play => {
                let half = 0.5 * scale;
                let from = if begins { q } else { *own };
                *own = from.max(q - half).min(q + half);
                (q - *own) / half
            }
            FormulaSignal::Dahl => {
                let from = if begins { 0.0 } else { *own };
                // one step of constant speed, exactly
                let end = sign(v);
                *own = end + (from - end) * (-v.abs() * s.dt / scale).exp();
                0.5 * (from + *own)
            }
            other => other.at(scene, joint, k),
        }
    }
}

impl FormulaSignal {
    /// Of a joint at sample k; no number for one that remembers.
    pub(super) fn at(self, scene: &EffectScene, joint: usize, k: usize) -> f64 {
        let s = scene.stretch;
        match self {
            Self::Position => s.q[joint][k],
            Self::Speed => s.v[joint][k],
            Self::Acceleration => s.a[joint][k],
            Self::Load => scene.load[joint][k],
            Self::Direction => scene.direction(joint, k),
            Self::Temperature => {
                let known = s.temperature.get(joint).and_then(|x| x.get(k));
                known.copied().unwrap_or(f64::NAN)
            }
            // since the begin of the log, whatever its clock shows
            Self::Time => s.began + k as f64 * s.dt,
            Self::SinceReversal | Self::Play | Self::Dahl => f64::NAN,
        }
    }

    /// Of a joint along a scene, with its scale where it has one.
    pub(crate) fn series(self, scene: &EffectScene, joint: usize, scale: Option<f64>) -> Vec<f64> {
        let mut kept = [f64::NAN; FormulaState::SIZE];
        let mut state = FormulaState(&mut kept);
        let mut next = |k| match self.remembers() {
            true => state.next(self, scale.unwrap_or(1.0), scene, (joint, k)),
            false => self.at(scene, joint, k),
        };
        (0..scene.len()).map(&mut next).collect()
    }
}
