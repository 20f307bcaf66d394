//! From rows to external torques.

use crate::band::Directions;
use cft_ident_core::effect::{AugmentedModel, SampledModel};
use cft_ident_core::math::causal::{CausalSections, delay_samples};
use cft_ident_core::math::sos::SosFilter;
use cft_ident_core::motion::{CausalMotion, FilterSettings, MotionError, MotionSample};
use cft_ident_core::robot::model::JointFriction;
use cft_ident_logs::log::{Block, JointTemperatures};

/// Order of the last low-pass.
pub(super) const ORDER: usize = 2;
/// Time constants after which it has forgotten its start.
pub(super) const SETTLED: f64 = 6.0;
/// Points that a torque between two samples is interpolated from.
const NODES: usize = 4;

/// External torques of one sample; what they are of lies [`Observer::delay_s`] before its time.
#[derive(Debug, Clone, Copy)]
pub struct ExternalTorques<'a> {
    /// Time of the newest row \[s\].
    pub t: f64,
    /// \[N or Nm\]
    pub external: &'a [f64],
    /// Moduli of the speeds behind the same filter [m/s or rad/s].
    pub speed: &'a [f64],
    /// Variance of the model's torque by its parameters, as far as the observer knows of it, and by friction near a
    /// standstill \[N^2 or Nm^2\].
    pub variance: &'a [f64],
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub a: &'a [f64],
    /// Nothing went before it, or a gap.
    pub begins: bool,
}

/// How far friction may be from its law near a standstill: there it is any torque up to its Coulomb level.
#[derive(Debug, Clone)]
pub(super) struct StandstillDoubt {
    /// Deviation of a torque that is anything up to the Coulomb level, of each joint whose law jumps at rest [N or Nm]; 0
    /// of others.
    pub deviations: Vec<f64>,
    /// Response of the position filter, within which the speed near a standstill is not known \[s\].
    pub reach_s: f64,
}

impl StandstillDoubt {
    /// Of a model behind a position filter at a sampling step \[s\].
    pub fn of(model: &AugmentedModel, settings: &FilterSettings, step_s: f64) -> Self {
        let level = |law: &JointFriction| law.coulomb().filter(|_| law.jumps());
        let laws = model.model.friction.iter();
        let deviation = |law: &JointFriction| level(law).unwrap_or(0.0).abs() / 3f64.sqrt();
        StandstillDoubt {
            deviations: laws.map(deviation).collect(),
            reach_s: 1.0 / settings.plain_q_cutoff_hz(1.0 / step_s),
        }
    }

    /// All of it where joint `j` stands, and none of it from so far on that it stood or will stand beyond the
    /// filter's response [N or Nm].
    fn at(&self, j: usize, v: f64, a: f64) -> f64 {
        let within = self.reach_s * a.abs() + f64::MIN_POSITIVE;
        self.deviations[j] * (1.0 - v.abs() / within).max(0.0)
    }
}

/// Observes one log or stream.
pub struct Observer {
    motion: CausalMotion,
    model: AugmentedModel,
    uncertain: Option<Directions>,
    settings: FilterSettings,
    core: Option<ObserverCore>,
    first: Option<f64>,
    temperatures: JointTemperatures,
}

struct ObserverCore {
    plant: SampledModel,
    smooth: CausalSections,
    settle: usize,
    delay_s: f64,
    late: Option<TorqueDelay>,
    doubt: StandstillDoubt,
    /// Samples since the stretch began.
    count: usize,
    tau: Vec<f64>,
    /// External torques, then speeds, then doubts of friction.
    row: Vec<f64>,
    variance: Vec<f64>,
}

/// Torques of the last samples, where the model's come late or early.
pub(super) struct TorqueDelay {
    /// Samples by which the torque of each joint is late.
    pub by: Vec<f64>,
    /// Samples that are waited for.
    pub lead: usize,
    /// Samples that are kept.
    pub size: usize,
    measured: Vec<f64>,
    model: Vec<f64>,
}

impl Observer {
    /// An observer by a model; `settings` are those of its robot.
    pub fn new(model: AugmentedModel, settings: &FilterSettings) -> Result<Self, MotionError> {
        Ok(Self {
            motion: CausalMotion::new(model.model.robot.joints(), settings)?,
            model,
            uncertain: None,
            settings: settings.clone(),
            core: None,
            first: None,
            temperatures: JointTemperatures::default(),
        })
    }

    /// The same observer, which knows how uncertain the parameters make the model's torque.
    #[must_use]
    pub fn with_uncertain(self, directions: Directions) -> Self {
        Self {
            uncertain: Some(directions),
            ..self
        }
    }

    /// Takes the temperatures of the log that it observes.
    pub fn set_temperatures(&mut self, temperatures: JointTemperatures) {
        self.temperatures = temperatures;
    }

    /// Time by which external torques are late, once the sampling step is known \[s\].
    pub fn delay_s(&self) -> Option<f64> {
        Some(self.motion.delay_s()? + self.core.as_ref()?.delay_s)
    }

    /// Sampling step, once known \[s\].
    pub fn step_s(&self) -> Option<f64> {
        self.motion.step_s()
    }

    /// Takes rows and hands out the external torques that they determine, none before the sampling step is known
    /// (256 rows) and filters have settled. With `last`, all that is left.
    pub fn push(
        &mut self,
        rows: &Block,
        last: bool,
        out: &mut dyn FnMut(&ExternalTorques),
    ) -> Result<(), MotionError> {
        self.first = self.first.or(rows.t.first().copied());
        let first = self.first.unwrap_or(0.0);
        let (core, model, settings) = (&mut self.core, &self.model, &self.settings);
        let (uncertain, temperatures) = (&mut self.uncertain, &self.temperatures);
        let mut failed = None;
        self.motion.push(rows, last, &mut |dt, sample| {
            if failed.is_some() {
                return;
            }
            if core.is_none() {
                match ObserverCore::design(model, settings, dt) {
                    Ok(designed) => *core = Some(designed),
                    Err(error) => failed = Some(error),
                }
            }
            if let Some(core) = core {
                let t = sample.motion.t;
                core.plant.set_temperatures(|j| temperatures.at(j, t));
                core.take(first, &sample.motion, sample.begins, uncertain, out);
            }
        })?;
        failed.map_or(Ok(()), Err)
    }
}

impl ObserverCore {
    fn design(
        model: &AugmentedModel,
        settings: &FilterSettings,
        dt: f64,
    ) -> Result<Self, MotionError> {
        let n = model.model.robot.joints();
        let sos = SosFilter::butterworth(ORDER, settings.cutoff_hz, 1.0 / dt)?;
        let late = TorqueDelay::of(model, dt);
        let lead = late.as_ref().map_or(0, |late| late.lead);
        Ok(Self {
            plant: SampledModel::new(model.clone(), dt),
            settle: sos.settle_samples(SETTLED),
            delay_s: dt * (delay_samples(&sos) + lead as f64),
            smooth: CausalSections::new(Some(&sos), 3 * n),
            late,
            doubt: StandstillDoubt::of(model, settings, dt),
            count: 0,
            tau: vec![0.0; n],
            row: vec![0.0; 3 * n],
            variance: vec![0.0; n],
        })
    }

    fn take(
        &mut self,
        first: f64,
        sample: &MotionSample,
        begins: bool,
        uncertain: &mut Option<Directions>,
        out: &mut dyn FnMut(&ExternalTorques),
    ) {
        let n = self.tau.len();
        if begins {
            self.plant.begin();
            self.smooth.reset();
            self.count = 0;
        }
        let motion = [sample.q, sample.v, sample.a];
        self.plant.torque(sample.t - first, motion, &mut self.tau);
        self.count += 1;
        let (external, rest) = self.row.split_at_mut(n);
        let (speed, doubt) = rest.split_at_mut(n);
        match &mut self.late {
            None => {
                let torques = sample.tau.iter().zip(&self.tau);
                (external.iter_mut().zip(torques)).for_each(|(x, (tau, model))| *x = tau - model);
            }
            Some(late) => {
                late.keep(self.count, sample.tau, &self.tau);
                if self.count < late.size {
                    return;
                }
                late.residual(self.count, external);
            }
        }
        for (speed, v) in speed.iter_mut().zip(sample.v) {
            *speed = v.abs();
        }
        for (j, doubt) in doubt.iter_mut().enumerate() {
            *doubt = self.doubt.at(j, sample.v[j], sample.a[j]);
        }
        self.smooth.step(&mut self.row);
        let settled = self.settle + self.late.as_ref().map_or(0, |late| late.size);
        if self.count <= settled {
            return;
        }
        match uncertain {
            Some(directions) => directions.variances(motion, &mut self.variance),
            None => self.variance.fill(0.0),
        }
        for (variance, doubt) in self.variance.iter_mut().zip(&self.row[2 * n..]) {
            *variance += doubt * doubt;
        }
        out(&ExternalTorques {
            t: sample.t,
            external: &self.row[..n],
            speed: &self.row[n..2 * n],
            variance: &self.variance,
            q: sample.q,
            v: sample.v,
            a: sample.a,
            begins: self.count == settled + 1,
        });
    }
}

impl TorqueDelay {
    /// For the shifts of a model; none where it has none.
    pub(super) fn of(model: &AugmentedModel, dt: f64) -> Option<Self> {
        let joints = 0..model.model.robot.joints();
        let by: Vec<f64> = joints.map(|j| model.shift(j) / dt).collect();
        by.iter().any(|d| *d != 0.0).then(|| TorqueDelay::new(by))
    }

    fn new(by: Vec<f64>) -> Self {
        let early = by.iter().fold(0.0f64, |m, d| m.max(-d)).ceil() as usize;
        let late = by.iter().fold(0.0f64, |m, d| m.max(*d)).ceil() as usize;
        // the last node of the interpolation lies two samples ahead
        let lead = early + NODES / 2;
        let size = lead + late + NODES;
        let n = by.len();
        Self {
            by,
            lead,
            size,
            measured: vec![0.0; n * size],
            model: vec![0.0; n * size],
        }
    }

    fn keep(&mut self, count: usize, measured: &[f64], model: &[f64]) {
        let n = self.by.len();
        let at = count % self.size * n;
        self.measured[at..at + n].copy_from_slice(measured);
        self.model[at..at + n].copy_from_slice(model);
    }

    /// Measured less the model's torque `lead` samples ago, the latter shifted: cubic interpolation.
    fn residual(&self, count: usize, out: &mut [f64]) {
        let n = self.by.len();
        let at = |back: usize| (count + self.size - back) % self.size * n;
        for (j, (out, by)) in out.iter_mut().zip(&self.by).enumerate() {
            // `back` samples before the newest, of which `part` lies between the second and the third node
            let back = self.lead as f64 + by;
            let whole = back.floor();
            let p = 1.0 - (back - whole);
            let oldest = whole as usize + 2;
            let y = [0, 1, 2, 3].map(|m| self.model[at(oldest - m) + j]);
            let weights = [
                -p * (p - 1.0) * (p - 2.0) / 6.0,
                (p + 1.0) * (p - 1.0) * (p - 2.0) / 2.0,
                -(p + 1.0) * p * (p - 2.0) / 2.0,
                (p + 1.0) * p * (p - 1.0) / 6.0,
            ];
            let model: f64 = y.iter().zip(weights).map(|(y, w)| y * w).sum();
            *out = self.measured[at(self.lead) + j] - model;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cft_ident_core::robot::friction::ViscousCoulomb;
    use cft_ident_core::robot::model::Model;
    use cft_ident_core::robot::{JointKind, Robot};

    fn model() -> AugmentedModel {
        AugmentedModel::plain(Model {
            robot: Robot::single_joint("q1", JointKind::Revolute),
            theta: vec![0.8],
            friction: vec![JointFriction::None],
            offset: vec![0.1],
        })
    }

    /// A sine and its torque, which comes late; from 3 s on something pushes.
    fn rows(late: f64) -> Block {
        let mut block = Block::default();
        for k in 0..6000 {
            let t = f64::from(k) * 1e-3;
            block.t.push(t);
            block.q.push(0.3 * (4.0 * t).sin());
            let own = -0.8 * 0.3 * 16.0 * (4.0 * (t - late)).sin() + 0.1;
            block.tau.push(own + if t >= 3.0 { 2.0 } else { 0.0 });
        }
        block
    }

    /// Observes such a motion; the delay.
    fn check(model: AugmentedModel, late: f64) -> f64 {
        let mut observer = Observer::new(model, &FilterSettings::default()).unwrap();
        let mut found = Vec::new();
        let push = &mut |o: &ExternalTorques| found.push((o.t, o.external[0]));
        observer.push(&rows(late), true, push).unwrap();
        let delay = observer.delay_s().unwrap();
        for (t, x) in &found {
            match t - delay {
                t if t < 2.9 => assert!(x.abs() < 2e-3, "{t} {x}"),
                t if t > 3.2 => assert!((x - 2.0).abs() < 2e-3, "{t} {x}"),
                _ => {}
            }
        }
        // half of the step is reached when the delay says
        let half = found.iter().find(|(_, x)| *x > 1.0).unwrap().0;
        assert!((half - 3.0 - delay).abs() < 0.01, "{half} {delay}");
        delay
    }

    #[test]
    fn a_push_is_found_with_its_size_and_the_stated_delay() {
        let delay = check(model(), 0.0);
        assert!((0.02..0.05).contains(&delay), "{delay}");
    }

    #[test]
    fn a_model_whose_torque_is_late_or_early_is_compared_at_its_time() {
        for late in [0.0035, -0.0042] {
            let mut of = model();
            let values = [("d".to_owned(), late)].into_iter().collect();
            let delay = cft_ident_core::effect::read(&of.model.robot, "delay", Some("q1"), &values);
            of.effects.push(delay.unwrap());
            check(of, late);
        }
    }

    #[test]
    fn where_a_joint_hesitates_its_friction_is_in_doubt_and_elsewhere_it_is_not() {
        let coulomb = ViscousCoulomb {
            viscous: 0.0,
            coulomb: 3.0,
        };
        let mut of = model();
        of.model.friction = vec![JointFriction::ViscousCoulomb(coulomb)];
        // the speed touches zero once a second and goes on, where friction falls within 5 mrad/s
        let mut block = Block::default();
        let whole = std::f64::consts::TAU;
        for k in 0..6000 {
            let t = f64::from(k) * 1e-3;
            let (v, a) = (1.0 + (whole * t).cos(), -whole * (whole * t).sin());
            block.t.push(t);
            block.q.push(t + (whole * t).sin() / whole);
            block.tau.push(0.8 * a + 0.1 + 3.0 * (v / 5e-3).tanh());
        }
        let mut observer = Observer::new(of, &FilterSettings::default()).unwrap();
        let mut found = Vec::new();
        let push = &mut |o: &ExternalTorques| found.push((o.t, o.external[0], o.variance[0]));
        observer.push(&block, true, push).unwrap();
        let delay = observer.delay_s().unwrap();
        let mut most = 0.0f64;
        for (t, external, variance) in found {
            most = most.max(external.abs());
            // beside the doubt, what the filter rings after it: a few percent
            let most = 0.06 + 2.0 * 3f64.sqrt() * variance.sqrt();
            assert!(external.abs() < most, "{t} {external}");
            let since = (t - delay - 0.5).rem_euclid(1.0);
            if (0.3..0.7).contains(&since) {
                assert!(variance.sqrt() < 0.02, "{t} {variance}");
            }
        }
        assert!(most > 0.5, "{most}");
    }
}
