//! The motion that a law makes of a command: one axis.
//!
//! (J + Ja) a = tau_m - G sin q + c - D v - dry friction. A step drifts half, kicks, drifts half; what is proportional to
//! the speed goes in by the trapezoidal rule, so the error falls with h^2; dry friction is an impulse of at most Fc h
//! against the motion (Moreau 1988): a joint that rests stays at rest, and the motion is continuous in every number.

use super::law::{DriveLawKind, JointLaw, MachineLaw};
use super::set_point::{CommandLines, SetPointFollower};
use super::track::{DriveLoad, DriveLog};

/// Longest step [s]. Half: positions of the measured servo move by under 0.1 mrad; twice: by 0.5 mrad.
pub const LONGEST_STEP: f64 = 2.5e-3;

/// Whatever moves further than this from where it was measured is lost [rad]; it is set there.
const LOST: f64 = 1e3;

/// Steps of one sample interval.
pub fn steps(dt: f64) -> usize {
    (dt / LONGEST_STEP - 1e-6).ceil().max(1.0) as usize
}

/// Speed with which a log begins [rad/s]: the slope of its first positions.
pub fn first_speed(t: &[f64], q: &[f64]) -> f64 {
    let n = q.len().min(FIRST);
    let (t, q) = (&t[..n], &q[..n]);
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n as f64;
    let (tm, qm) = (mean(t), mean(q));
    let (mut above, mut below) = (0.0, 0.0);
    for (t, q) in t.iter().zip(q) {
        above += (t - tm) * (q - qm);
        below += (t - tm) * (t - tm);
    }
    if below > 0.0 { above / below } else { 0.0 }
}

/// Samples of which the first speed is made. Half: a step of the encoder is a speed; twice: an acceleration is.
const FIRST: usize = 4;

/// What a torque of the drive is made of, at one moment.
#[derive(Debug, Clone, Copy)]
pub struct RolledDrive {
    kp: f64,
    kd: f64,
    most: f64,
}

impl RolledDrive {
    /// Of a joint at a supply; nothing where it is off.
    pub fn new(kind: DriveLawKind, law: &JointLaw, gains: [f64; 2], supply: f64) -> Self {
        let [kp, kd] = gains;
        let ratio = match kind {
            DriveLawKind::Volts(_) => law.stiffness * supply,
            DriveLawKind::Torque => 1.0,
        };
        RolledDrive {
            kp: ratio * kp,
            kd: ratio * kd,
            most: law.torque_max
                * if matches!(kind, DriveLawKind::Volts(_)) {
                    supply
                } else {
                    1.0
                },
        }
    }

    /// Torque at an error of position and a speed, and its slope with the speed.
    #[inline]
    pub fn torque(&self, error: f64, v: f64) -> (f64, f64) {
        let free = self.kp * error - self.kd * v;
        if free.abs() > self.most {
            (self.most.copysign(free), 0.0)
        } else {
            (free, self.kd)
        }
    }
}

/// Positions of one axis along a log, as its encoder would read them.
pub fn roll_axis(
    log: &DriveLog,
    kind: DriveLawKind,
    law: &MachineLaw,
    joint: usize,
    out: &mut [f64],
) {
    let (track, of) = (&log.joints[joint], &law.joints[joint]);
    let (inertia, gravity) = match log.load {
        DriveLoad::PendulumRig(rig) => (rig.inertia() + of.armature, rig.gravity()),
        DriveLoad::Unknown | DriveLoad::Robot => (1.0, 0.0),
    };
    let t = &log.t;
    let late = law.command_delay + law.loop_delay;
    let mut command = CommandLines::new(t, &track.command, log.command_is, t[0] - late);
    let mut follower = SetPointFollower::new(track.command[0], of.slowness);
    let mut q = track.position[0] + of.bias;
    let mut v = first_speed(t, &track.position);
    let mut past = PastStates::new(law.loop_delay, q, v);
    out[0] = q - of.bias;
    for k in 1..t.len() {
        let dt = t[k] - t[k - 1];
        let count = steps(dt);
        let h = dt / count as f64;
        let supply = match (law.supply, track.supply.get(k - 1)) {
            (Some(reference), Some(volts)) => volts / reference,
            _ => 1.0,
        };
        let on = track.on.get(k - 1).copied().unwrap_or(true);
        let drive = RolledDrive::new(kind, of, [track.kp, track.kd], supply);
        let damping = if on { of.damping } else { of.viscous };
        for i in 0..count {
            let begin = t[k - 1] + i as f64 * h;
            let set = follower.mean_up_to(&mut command, begin + h - late);
            let half = q + 0.5 * h * v;
            let seen = past.seen(begin, h, half, v);
            let (tau, slope) = match on {
                true => drive.torque(set - (seen.q - of.bias), seen.v),
                false => (0.0, 0.0),
            };
            let mut force = tau + of.offset - damping * v;
            if gravity != 0.0 {
                force -= gravity * half.sin();
            }
            let mass = inertia + 0.5 * h * (damping + slope * seen.own);
            let free = h * force / mass;
            let most = h * of.dry(v, tau);
            let impulse = (-(v + free) * mass).clamp(-most, most);
            v += free + impulse / mass;
            q = half + 0.5 * h * v;
            past.push(begin + h, q, v);
        }
        if (q - track.position[k]).abs() >= LOST || q.is_nan() {
            (q, v) = (track.position[k] + LOST, 0.0);
        }
        out[k] = q - of.bias;
    }
}

/// What a late controller sees.
#[derive(Debug, Clone, Copy)]
pub struct SeenLimits {
    pub q: f64,
    pub v: f64,
    /// Part of the step's own change of speed in `v`, doubled: 1 where the controller is in time.
    pub own: f64,
}

/// The last states of an axis.
#[derive(Debug, Clone)]
pub struct PastStates {
    late: f64,
    states: Vec<[f64; 3]>,
    from: usize,
}

impl PastStates {
    pub fn new(late: f64, q: f64, v: f64) -> Self {
        let states = if late > 0.0 {
            vec![[f64::NEG_INFINITY, q, v]]
        } else {
            Vec::new()
        };
        PastStates {
            late,
            states,
            from: 0,
        }
    }

    #[inline]
    pub fn push(&mut self, t: f64, q: f64, v: f64) {
        if self.late > 0.0 {
            self.states.push([t, q, v]);
        }
    }

    /// What is seen in the middle of a step that begins with speed `v` and is at `half` in its middle.
    #[inline]
    pub fn seen(&mut self, begin: f64, h: f64, half: f64, v: f64) -> SeenLimits {
        if self.late <= 0.0 {
            return SeenLimits {
                q: half,
                v,
                own: 1.0,
            };
        }
        if self.late < 0.5 * h {
            return SeenLimits {
                q: half - self.late * v,
                v,
                own: 1.0 - 2.0 * self.late / h,
            };
        }
        let time = begin + 0.5 * h - self.late;
        while self.from + 1 < self.states.len() && self.states[self.from + 1][0] <= time {
            self.from += 1;
        }
        let [t0, q0, v0] = self.states[self.from];
        let (q, v) = match self.states.get(self.from + 1) {
            Some([t1, q1, v1]) if t0.is_finite() => {
                let w = ((time - t0) / (t1 - t0)).clamp(0.0, 1.0);
                (q0 + w * (q1 - q0), v0 + w * (v1 - v0))
            }
            _ => (q0, v0),
        };
        SeenLimits { q, v, own: 0.0 }
    }
}
