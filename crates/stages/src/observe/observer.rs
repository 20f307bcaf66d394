//! From rows to external torques.

use crate::band::Directions;
use cft_ident_core::effect::{AugmentedModel, SampledModel};
use cft_ident_core::math::causal::{CausalSections, delay_samples};
use cft_ident_core::math::sos::SosFilter;
use cft_ident_core::motion::{CausalMotion, FilterSettings, MotionError, MotionSample};
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
    /// Variance of the model's torque by its parameters, as far as the observer knows of it \[N^2 or Nm^2\].
    pub variance: &'a [f64],
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub a: &'a [f64],
    /// Nothing went before it, or a gap.
    pub begins: bool,
}

/// Observes one log or stream.
pub struct Observer {
    motion: CausalMotion,
    model: AugmentedModel,
    uncertain: Option<Directions>,
    cutoff_hz: f64,
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
    /// Samples since the stretch began.
    count: usize,
    tau: Vec<f64>,
    /// External torques, then speeds.
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
            cutoff_hz: settings.cutoff_hz,
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
        let (core, model, cutoff) = (&mut self.core, &self.model, self.cutoff_hz);
        let (uncertain, temperatures) = (&mut self.uncertain, &self.temperatures);
        let mut failed = None;
        self.motion.push(rows, last, &mut |dt, sample| {
            if failed.is_some() {
                return;
            }
            if core.is_none() {
                match ObserverCore::design(model, cutoff, dt) {
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
    fn design(model: &AugmentedModel, cutoff_hz: f64, dt: f64) -> Result<Self, MotionError> {
        let n = model.model.robot.joints();
        let sos = SosFilter::butterworth(ORDER, cutoff_hz, 1.0 / dt)?;
        let late = TorqueDelay::of(model, dt);
        let lead = late.as_ref().map_or(0, |late| late.lead);
        Ok(Self {
            plant: SampledModel::new(model.clone(), dt),
            settle: sos.settle_samples(SETTLED),
            delay_s: dt * (delay_samples(&sos) + lead as f64),
            smooth: CausalSections::new(Some(&sos), 2 * n),
            late,
            count: 0,
            tau: vec![0.0; n],
            row: vec![0.0; 2 * n],
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
        let (external, speed) = self.row.split_at_mut(n);
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
        self.smooth.step(&mut self.row);
        let settled = self.settle + self.late.as_ref().map_or(0, |late| late.size);
        if self.count <= settled {
            return;
        }
        if let Some(directions) = uncertain {
            directions.variances(motion, &mut self.variance);
        }
        out(&ExternalTorques {
            t: sample.t,
            external: &self.row[..n],
            speed: &self.row[n..],
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
    use cft_ident_core::robot::model::{JointFriction, Model};
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
}
