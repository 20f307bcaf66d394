//! A machine under its controller, and the log that a laboratory would have of it.

use serde::Serialize;

use crate::chain::{JOINTS, Joints};
use crate::chance::Chance;
use crate::machine::Machine;
use crate::path::Path;
use crate::plant::Contact;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Controller {
    Pd,
    Pid,
    /// Computed torque of a model that is 5 % off, and a stiff loop.
    FeedForward,
    /// A loop of 1.5 Hz.
    Slow,
}

pub const CONTROLLERS: [Controller; 4] = [
    Controller::Pd,
    Controller::Pid,
    Controller::FeedForward,
    Controller::Slow,
];

/// What the log sees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sensing {
    /// Rows a second; a whole part of the controller's 1000.
    pub rate_hz: f64,
    /// Torque noise over the torque's rms.
    pub noise: f64,
    /// Half of the noise forgets as slowly as this [s].
    pub memory_s: Option<f64>,
    /// Steps of the encoder over the joint's whole range.
    pub counts: f64,
    /// The logged torque is so late [s].
    pub delay_s: f64,
}

/// A log with the truth beside it.
pub struct Run {
    pub t: Vec<f64>,
    pub q: Vec<Joints>,
    /// As logged.
    pub tau: Vec<Joints>,
    /// Without noise.
    pub clean: Vec<Joints>,
    /// Torque of what was planted, against the motion.
    pub planted: Vec<Joints>,
    pub speed: Vec<Joints>,
    /// Share of rows at which each joint stands still.
    pub still: Vec<f64>,
}

const CONTROL_HZ: f64 = 1000.0;

/// The motion as the machine makes it, before any sensor.
pub struct Course {
    rows: Vec<Row>,
    joints: usize,
    step_hz: f64,
}

struct Row {
    q: Joints,
    v: Joints,
    u: Joints,
    planted: Joints,
}

impl Course {
    /// Drives the machine along a path; encoder steps are the controller's too.
    pub fn of(machine: &Machine, path: &Path, controller: Controller, counts: f64) -> Self {
        let (n, plant) = (machine.plant.joints, &machine.plant);
        let (q, v, _) = path.at(0.0);
        let mut state = plant.at_rest(q);
        state.v = v;
        state.link_v = v;
        for (contact, v) in state.contact.iter_mut().zip(&v[..n]) {
            if *v != 0.0 {
                *contact = Contact::Slides(v.signum());
            }
        }
        let substeps = (machine.step_hz / CONTROL_HZ).round() as usize;
        let h = 1.0 / (CONTROL_HZ * substeps as f64);
        let mut loops = Loops::new(machine, controller);
        let mut before: Option<Joints> = None;
        let ticks = (path.seconds * CONTROL_HZ).floor() as usize;
        let mut rows = Vec::with_capacity(ticks);
        for k in 0..ticks {
            let seen = std::array::from_fn(|i| match machine.step(i, counts) {
                step if i < n && step > 0.0 => (state.q[i] / step).round() * step,
                _ => state.q[i],
            });
            let u = loops.torque(path.at(k as f64 / CONTROL_HZ), &seen, &state.v);
            // the mean of what stands before and after the row: no half step of lag
            let mean = before.map_or(u, |b| std::array::from_fn(|i| 0.5 * (b[i] + u[i])));
            rows.push(Row {
                q: state.q,
                v: state.v,
                u: mean,
                planted: plant.planted(&state),
            });
            for _ in 0..substeps {
                plant.step(&mut state, &u, h);
            }
            before = Some(u);
        }
        Self {
            rows,
            joints: n,
            step_hz: machine.step_hz,
        }
    }

    /// Rms of the torque and of what is planted at a joint.
    pub fn sizes(&self, joint: usize) -> (f64, f64) {
        let rms = |of: &dyn Fn(&Row) -> f64| {
            (self.rows.iter().map(|r| of(r).powi(2)).sum::<f64>() / self.rows.len() as f64).sqrt()
        };
        (rms(&|r| r.u[joint]), rms(&|r| r.planted[joint]))
    }

    pub fn steps_per_second(&self) -> f64 {
        self.step_hz
    }

    /// The log of it.
    pub fn logged(&self, machine: &Machine, sensing: &Sensing, chance: &mut Chance) -> Run {
        let every = (CONTROL_HZ / sensing.rate_hz).round().max(1.0) as usize;
        let picked: Vec<usize> = (0..self.rows.len()).step_by(every).collect();
        let n = self.joints;
        let mut run = Run {
            t: picked.iter().map(|&k| k as f64 / CONTROL_HZ).collect(),
            q: picked.iter().map(|&k| self.rows[k].q).collect(),
            tau: picked
                .iter()
                .map(|&k| self.late(k, sensing.delay_s))
                .collect(),
            clean: Vec::new(),
            planted: picked.iter().map(|&k| self.rows[k].planted).collect(),
            speed: picked.iter().map(|&k| self.rows[k].v).collect(),
            still: Vec::new(),
        };
        run.clean = run.tau.clone();
        for i in 0..n {
            let size = sensing.noise * self.sizes(i).0;
            let noise = chance.noise(picked.len(), sensing.rate_hz, sensing.memory_s);
            let step = machine.step(i, sensing.counts);
            for (row, e) in noise.iter().enumerate() {
                run.tau[row][i] += size * e;
                run.q[row][i] = (run.q[row][i] / step).round() * step;
            }
            let still = self.rows.iter().filter(|r| r.v[i] == 0.0).count();
            run.still.push(still as f64 / self.rows.len() as f64);
        }
        run
    }

    fn late(&self, k: usize, delay_s: f64) -> Joints {
        let at = (k as f64 - delay_s * CONTROL_HZ).clamp(0.0, (self.rows.len() - 1) as f64);
        let (low, part) = (at.floor() as usize, at.fract());
        let high = (low + 1).min(self.rows.len() - 1);
        let (a, b) = (&self.rows[low].u, &self.rows[high].u);
        std::array::from_fn(|i| (1.0 - part) * a[i] + part * b[i])
    }
}

struct Loops<'a> {
    machine: &'a Machine,
    controller: Controller,
    stiffness: Joints,
    damping: Joints,
    sum: Joints,
}

impl<'a> Loops<'a> {
    fn new(machine: &'a Machine, controller: Controller) -> Self {
        let hz = match controller {
            Controller::Pd | Controller::Pid => 6.0,
            Controller::FeedForward => 10.0,
            Controller::Slow => 1.5,
        };
        let w = std::f64::consts::TAU * hz;
        Self {
            machine,
            controller,
            stiffness: machine.inertia.map(|j| j * w * w),
            damping: machine.inertia.map(|j| 1.6 * j * w),
            sum: [0.0; JOINTS],
        }
    }

    fn torque(&mut self, wanted: (Joints, Joints, Joints), q: &Joints, v: &Joints) -> Joints {
        let (qr, vr, ar) = wanted;
        let bodies = &self.machine.nominal;
        let still = [0.0; JOINTS];
        let known = match self.controller {
            Controller::FeedForward => bodies.inverse(&qr, &vr, &ar),
            _ => bodies.inverse(q, &still, &still),
        };
        let mut u = [0.0; JOINTS];
        for i in 0..self.machine.plant.joints {
            let error = qr[i] - q[i];
            self.sum[i] += error / CONTROL_HZ;
            u[i] = self.stiffness[i] * error + self.damping[i] * (vr[i] - v[i]) + 0.95 * known[i];
            if self.controller == Controller::Pid {
                u[i] += 4.0 * self.stiffness[i] * self.sum[i];
            }
            if self.controller == Controller::FeedForward {
                let friction = &self.machine.plant.friction[i];
                let corner = 0.02 * self.machine.ranges[i].speed;
                u[i] +=
                    0.9 * (friction.viscous * vr[i] + friction.coulomb * (vr[i] / corner).tanh());
            }
        }
        u
    }
}
