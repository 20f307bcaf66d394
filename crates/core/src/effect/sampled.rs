//! A model with effects one sample after the other, as rows arrive.

use super::{AugmentedModel, EffectScene, Role};
use crate::motion::Stretch;

/// A model, and what its effects keep from sample to sample.
#[derive(Debug, Clone)]
pub struct SampledModel {
    model: AugmentedModel,
    /// Of one sample.
    stretch: Stretch,
    hat: Vec<Vec<f64>>,
    load: Vec<Vec<f64>>,
    direction: Vec<Vec<f64>>,
    plain: Vec<f64>,
    /// Of each effect, joint after joint.
    kept: Vec<Vec<f64>>,
    out: Vec<f64>,
}

impl SampledModel {
    /// For samples `dt` seconds apart.
    pub fn new(model: AugmentedModel, dt: f64) -> Self {
        let n = model.model.robot.joints();
        let one = || vec![vec![0.0]; n];
        let kept = model.effects.iter();
        let kept = kept.map(|e| vec![f64::NAN; n * e.law.remembered()]);
        let kept = kept.collect();
        let most = model.effects.iter().map(|e| e.law.linear.len()).max();
        Self {
            stretch: Stretch {
                dt,
                t: vec![0.0],
                q: one(),
                v: one(),
                a: one(),
                tau: one(),
                temperature: vec![vec![f64::NAN]; n],
                ..Stretch::default()
            },
            hat: one(),
            load: one(),
            direction: vec![Vec::new(); n],
            plain: vec![0.0; n],
            kept,
            out: vec![0.0; most.unwrap_or(0)],
            model,
        }
    }

    /// The model.
    pub fn model(&self) -> &AugmentedModel {
        &self.model
    }

    /// Takes `dt` seconds as the time since the sample before, for the samples from here on.
    pub fn set_interval(&mut self, dt: f64) {
        self.stretch.dt = dt;
    }

    /// Says that the next sample begins a stretch.
    pub fn begin(&mut self) {
        self.kept.iter_mut().for_each(|kept| kept.fill(f64::NAN));
    }

    /// Takes the temperature of every joint \[degC\], for the samples from here on; what is not known is no number.
    pub fn set_temperatures(&mut self, of: impl Fn(usize) -> Option<f64>) {
        for (j, x) in self.stretch.temperature.iter_mut().enumerate() {
            x[0] = of(j).unwrap_or(f64::NAN);
        }
    }

    /// Torque of every joint, before shifts, `since` seconds after the begin of the log.
    pub fn torque(&mut self, since: f64, [q, v, a]: [&[f64]; 3], tau: &mut [f64]) {
        let model = &self.model.model;
        let n = tau.len();
        let s = &mut self.stretch;
        (s.began, s.t[0]) = (since, since);
        for j in 0..n {
            (s.q[j][0], s.v[j][0], s.a[j][0]) = (q[j], v[j], a[j]);
        }
        model.robot.torque(&model.theta, q, v, a, &mut self.plain);
        for j in 0..n {
            self.load[j][0] = self.plain[j];
            tau[j] = self.plain[j] + model.friction[j].torque(v[j]) + model.offset[j];
            self.hat[j][0] = tau[j];
        }
        for (j, direction) in self.direction.iter_mut().enumerate() {
            *direction = self.model.direction(&self.stretch, j);
        }
        let scene = EffectScene {
            robot: &model.robot,
            theta: &model.theta,
            laws: &model.friction,
            stretch: &self.stretch,
            hat: &self.hat,
            load: &self.load,
            direction: &self.direction,
            tilt: None,
        };
        for (i, effect) in self.model.effects.iter().enumerate() {
            if effect.law.entry.role == Role::Shift {
                continue;
            }
            for (j, tau) in tau.iter_mut().enumerate() {
                if !effect.place.touches(j) {
                    continue;
                }
                let out = &mut self.out[..effect.linear.len()];
                out.fill(0.0);
                let size = self.kept[i].len() / n;
                let kept = &mut self.kept[i][j * size..(j + 1) * size];
                effect.at(&scene, (j, 0), kept, out);
                let terms = out.iter().zip(&effect.linear);
                *tau += terms.map(|(x, c)| c * x).sum::<f64>();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect;
    use crate::effect::ModelEffect;
    use crate::effect::formula::{FormulaDefinition, FormulaShape};
    use crate::robot::friction::ViscousCoulomb;
    use crate::robot::model::{JointFriction, Model};
    use crate::robot::{JointKind, Robot};

    /// A formula of the user's own in all that hangs on the way before.
    fn remembers(robot: &Robot) -> ModelEffect {
        let of = |name: &str, unit: &str, text: &str| [name, unit, text].map(str::to_owned);
        let scale = |name: &str| FormulaShape {
            name: name.to_owned(),
            unit: "rad".to_owned(),
            range: [0.001, 1.0],
        };
        let definition = FormulaDefinition {
            name: "remembers".to_owned(),
            coefficients: vec![
                of("c1", "Nm", "play * abs(q) + exp(-since_reversal / 0.1)"),
                of("c2", "Nm", "dahl - play"),
            ],
            shapes: vec![scale("way"), scale("width")],
            ..FormulaDefinition::default()
        };
        let law = effect::own::law(&definition, robot).unwrap();
        let place = effect::EffectPlace::Joint(0);
        ModelEffect::new(law, place, vec![0.05, 0.1], vec![0.3, 0.2])
    }

    #[test]
    fn sample_by_sample_effects_give_the_torques_of_whole_stretches() {
        let robot = Robot::single_joint("q1", JointKind::Revolute);
        let law = ViscousCoulomb {
            viscous: 0.4,
            coulomb: 1.3,
        };
        let add = |text: &str| {
            let mut words = text.split(' ');
            let name = words.next().unwrap();
            let keys = words.filter_map(|word| word.split_once('='));
            let keys = keys.map(|(key, x)| (key.to_owned(), x.parse().unwrap()));
            effect::read(&robot, name, Some("q1"), &keys.collect()).unwrap()
        };
        let model = AugmentedModel {
            model: Model {
                robot: robot.clone(),
                theta: vec![0.8],
                friction: vec![JointFriction::ViscousCoulomb(law)],
                offset: vec![0.1],
            },
            effects: vec![
                add("presliding sigma0=300 sigma1=0.2 fc=1.1"),
                add("backlash gap=0.02 c=0.3"),
                add("warm-up k=-0.2 T=3"),
                add("ripple order=6 sin=0.2 cos=-0.1"),
                add("load-friction mu_c=0.1 mu_v=0.02 w=50"),
                add("gain k=0.05"),
                add("empirical signal=5 from=0 to=0.4 m_1=0 m_2=0.1 m_3=0.2 m_4=0.2 m_5=0.1 m_6=0"),
                remembers(&robot),
            ],
        };
        let dt = 1e-3;
        let t: Vec<f64> = (0..4000).map(|k| f64::from(k) * dt).collect();
        let of = |f: fn(f64) -> f64| vec![t.iter().map(|t| f(*t)).collect::<Vec<f64>>()];
        let stretch = Stretch {
            dt,
            began: 0.25,
            q: of(|t| 0.5 * (3.0 * t).sin()),
            v: of(|t| 1.5 * (3.0 * t).cos()),
            a: of(|t| -4.5 * (3.0 * t).sin()),
            tau: vec![vec![0.0; t.len()]],
            t,
            ..Stretch::default()
        };
        let whole = model.torques(&stretch).hat;
        let mut sampled = SampledModel::new(model, dt);
        sampled.begin();
        let mut tau = [0.0];
        for k in 0..stretch.len() {
            let [q, v, a] = [&stretch.q, &stretch.v, &stretch.a].map(|x| [x[0][k]]);
            let since = stretch.began + dt * k as f64;
            sampled.torque(since, [&q, &v, &a], &mut tau);
            assert!((tau[0] - whole[0][k]).abs() < 1e-12, "{k}");
        }
    }
}
