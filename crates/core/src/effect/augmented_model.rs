//! A model with effects: what torque it reconstructs along whole stretches.

use super::scene::{EffectScene, TiltTorques};
use super::{EffectPlace, ModelEffect};
use crate::motion::Stretch;
use crate::robot::model::Model;

/// A model and what was added to it.
#[derive(Debug, Clone, PartialEq)]
pub struct AugmentedModel {
    pub model: Model,
    pub effects: Vec<ModelEffect>,
}

/// Torques along one stretch, `[joint][sample]`.
#[derive(Debug, Clone, Default)]
pub struct StretchTorques {
    /// Model and effects, before any shift in time.
    pub hat: Vec<Vec<f64>>,
    /// Inertial part alone.
    pub load: Vec<Vec<f64>>,
    /// Direction of each joint's friction where an effect makes it smooth; else empty.
    pub direction: Vec<Vec<f64>>,
    /// What effects have asked of these inertial parameters already.
    pub tilt: TiltTorques,
}

impl AugmentedModel {
    /// A model to which nothing was added.
    pub fn plain(model: Model) -> Self {
        AugmentedModel {
            model,
            effects: Vec::new(),
        }
    }

    /// Whether an effect takes a temperature.
    pub fn takes_temperatures(&self) -> bool {
        self.effects.iter().any(|e| !e.temperatures().is_empty())
    }

    /// Torque before shifts, and load torque.
    pub fn torques(&self, stretch: &Stretch) -> StretchTorques {
        let n = self.model.robot.joints();
        let samples = stretch.len();
        let mut load = vec![vec![0.0; samples]; n];
        let mut hat = vec![vec![0.0; samples]; n];
        let (robot, theta) = (&self.model.robot, &self.model.theta);
        let mut inertial = vec![0.0; n];
        let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for k in 0..samples {
            stretch.at(k, &mut q, &mut v, &mut a);
            robot.torque(theta, &q, &v, &a, &mut inertial);
            for (j, inertial) in inertial.iter().enumerate() {
                load[j][k] = *inertial;
                hat[j][k] = inertial + self.model.friction[j].torque(v[j]) + self.model.offset[j];
            }
        }
        // a gain multiplies what the plain model gives: effects see that, and not one another
        let plain = hat.clone();
        let direction: Vec<Vec<f64>> = (0..n).map(|j| self.direction(stretch, j)).collect();
        let tilt = TiltTorques::new();
        let scene = EffectScene {
            robot: &self.model.robot,
            theta: &self.model.theta,
            laws: &self.model.friction,
            stretch,
            hat: &plain,
            load: &load,
            direction: &direction,
            tilt: Some(&tilt),
        };
        let mut extra = vec![0.0; samples];
        for effect in &self.effects {
            for (j, hat) in hat.iter_mut().enumerate() {
                if effect.place.touches(j) {
                    effect.torque(&scene, j, &mut extra);
                    for (x, y) in hat.iter_mut().zip(&extra) {
                        *x += y;
                    }
                }
            }
        }
        StretchTorques {
            hat,
            load,
            direction,
            tilt,
        }
    }

    /// Direction of a joint's friction where an effect makes smooth what jumps; else empty.
    pub(super) fn direction(&self, stretch: &Stretch, j: usize) -> Vec<f64> {
        let mut own = self
            .effects
            .iter()
            .filter(|e| e.place == EffectPlace::Joint(j));
        let smooth = own.find_map(|e| Some((e.law.direction?, &e.shape)));
        match smooth.filter(|_| self.model.friction[j].jumps()) {
            Some((of, shape)) => stretch.v[j].iter().map(|v| of(shape, *v)).collect(),
            None => Vec::new(),
        }
    }

    /// Time by which the torque of joint `joint` is late \[s\].
    pub fn shift(&self, joint: usize) -> f64 {
        self.effects.iter().map(|e| e.shift(joint)).sum()
    }

    /// Reconstructed torque, `[joint][sample]`, shifts included.
    pub fn reconstruct(&self, stretch: &Stretch) -> Vec<Vec<f64>> {
        self.late(self.torques(stretch).hat, stretch.dt)
    }

    /// Measured less reconstructed torque, `[joint][sample]`, where the latter is known before shifts.
    pub fn residual(&self, stretch: &Stretch, torques: &StretchTorques) -> Vec<Vec<f64>> {
        let mut residual = self.late(torques.hat.clone(), stretch.dt);
        for (e, tau) in residual.iter_mut().zip(&stretch.tau) {
            for (e, tau) in e.iter_mut().zip(tau) {
                *e = tau - *e;
            }
        }
        residual
    }

    /// Torques of all joints, shifted.
    fn late(&self, mut hat: Vec<Vec<f64>>, dt: f64) -> Vec<Vec<f64>> {
        for (j, channel) in hat.iter_mut().enumerate() {
            shifted(channel, self.shift(j) / dt);
        }
        hat
    }
}

/// x(t - d) in place, d in samples, by cubic interpolation; constant beyond the ends.
pub fn shifted(x: &mut [f64], d: f64) {
    if d == 0.0 || x.len() < 4 || !d.is_finite() {
        return;
    }
    let old = x.to_vec();
    let last = old.len() as isize - 1;
    let at = |i: isize| old[i.clamp(0, last) as usize];
    // x(k - d) with k - d = k + whole + part
    let whole = (-d).floor();
    let part = -d - whole;
    let whole = whole as isize;
    let weights = [
        -part * (part - 1.0) * (part - 2.0) / 6.0,
        (part + 1.0) * (part - 1.0) * (part - 2.0) / 2.0,
        -(part + 1.0) * part * (part - 2.0) / 2.0,
        (part + 1.0) * part * (part - 1.0) / 6.0,
    ];
    for (k, x) in x.iter_mut().enumerate() {
        let first = (k as isize).saturating_add(whole).saturating_sub(1);
        let terms = weights.iter().enumerate();
        *x = terms
            .map(|(m, w)| w * at(first.saturating_add(m as isize)))
            .sum();
    }
}

#[cfg(test)]
mod tests {
    use super::shifted;

    #[test]
    fn a_shift_is_exact_for_cubics_and_of_the_right_sign() {
        let f = |t: f64| 0.3 * t * t * t - t * t + 2.0 * t - 1.0;
        for d in [-2.4, -0.3, 0.7, 1.0, 3.25] {
            let mut x: Vec<f64> = (0..40).map(|k| f64::from(k) * 0.1).map(f).collect();
            shifted(&mut x, d);
            for k in 8..32 {
                let wanted = f((f64::from(k) - d) * 0.1);
                assert!((x[k as usize] - wanted).abs() < 1e-12, "{d} {k}");
            }
        }
    }
}
