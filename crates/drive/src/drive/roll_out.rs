//! The motion that a law makes of a command: one axis.
//!
//! (J + Ja) a = tau_m - G sin q + c - D v - dry friction. A step drifts half, kicks, drifts half; what is proportional to
//! the speed goes in by the trapezoidal rule, so the error falls with h^2; dry friction is an impulse of at most Fc h
//! against the motion (Moreau 1988): a joint that rests stays at rest, and the motion is continuous in every number.

use nalgebra::{DMatrix, DVector};

use super::law::{DriveLawKind, JointLaw, MachineLaw};
use super::set_point::{CommandLines, SetPointFollower};
use super::track::{DriveLoad, DriveLog, JointTrack};

/// Longest step of the roll-outs that choose effects [s]. Half: by the numbers of a simulated servo, whose encoder alone
/// makes 0.38 mrad, positions are missed by 0.41 mrad in place of 0.44; twice: by 0.56 mrad.
pub const COARSE_STEP: f64 = 2.5e-3;

/// Longest step of those that estimate and judge [s].
pub const FINE_STEP: f64 = 0.625e-3;

/// Whatever moves further than this from where it was measured is lost [rad]; it is set there.
const LOST: f64 = 1e3;

/// Steps of one sample interval.
pub fn steps(dt: f64, longest: f64) -> usize {
    (dt / longest - 1e-6).ceil().max(1.0) as usize
}

/// Span whose positions say with which speed a log begins [s]. 0.125, 0.25 and 0.5: the numbers of a simulated
/// servo are the same within 0.03 %, a tenth of their error.
const BEGIN: f64 = 0.15;

/// Gauss-Newton steps to that speed. Half: a servo whose log begins in a jump has an armature 0.2 % off; twice: the same.
const BEGIN_STEPS: usize = 2;

/// Step of differences of a speed [rad/s].
const SPEED_STEP: f64 = 1e-3;

/// Speeds with which the joints of a log begin [rad/s]: those whose motion lies nearest to the first positions. A slope of
/// the first samples would be that of what the drive does meanwhile. `roll` gives the first so many positions from speeds.
pub fn first_speeds(
    t: &[f64],
    tracks: &[JointTrack],
    roll: impl Fn(&[f64], usize) -> Vec<Vec<f64>>,
) -> Vec<f64> {
    let end = t[0] + BEGIN;
    let count = t.partition_point(|t| *t <= end);
    let n = tracks.len();
    let mut speeds = vec![0.0; n];
    if count <= FEW {
        return speeds;
    }
    let slope = |q: &[f64]| (q[FEW] - q[0]) / (t[FEW] - t[0]);
    for (speed, track) in speeds.iter_mut().zip(tracks) {
        *speed = slope(&track.position);
    }
    let off = |at: &[Vec<f64>]| -> Vec<f64> {
        let pairs = at.iter().zip(tracks);
        let off = pairs.map(|(at, track)| at.iter().zip(&track.position).map(|(x, q)| x - q));
        off.flatten().collect()
    };
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let mut here = roll(&speeds, count);
    let mut error = off(&here);
    for _ in 0..BEGIN_STEPS {
        let column = |j: usize| -> Vec<f64> {
            let mut moved = speeds.clone();
            moved[j] += SPEED_STEP;
            let there = roll(&moved, count);
            let pairs = there.iter().flatten().zip(here.iter().flatten());
            pairs.map(|(x, base)| (x - base) / SPEED_STEP).collect()
        };
        let columns: Vec<Vec<f64>> = (0..n).map(column).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let normal = DMatrix::from_fn(n, n, |a, b| {
            // a joint that rests whatever its speed says nothing of it
            let own = if a == b { f64::MIN_POSITIVE } else { 0.0 };
            dot(&columns[a], &columns[b]) + own
        });
        let right = DVector::from_fn(n, |a, _| dot(&columns[a], &error));
        let Some(change) = normal.cholesky().map(|factor| factor.solve(&right)) else {
            break;
        };
        let next: Vec<f64> = speeds
            .iter()
            .zip(change.iter())
            .map(|(v, c)| v - c)
            .collect();
        let there = roll(&next, count);
        let after = off(&there);
        match square(&after) < square(&error) {
            true => (speeds, here, error) = (next, there, after),
            false => break,
        }
    }
    speeds
}

/// Samples of whose slope a speed is sought from.
const FEW: usize = 3;

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
                    supply.abs()
                } else {
                    1.0
                },
        }
    }

    /// Mean torque over a step of length h that ends at a time of the command, and its mean slope with the speed. The
    /// error of position is a straight line along each part of the set point, so that a limit which is reached within the
    /// step limits what is beyond it alone.
    #[inline]
    pub fn mean_torque(
        &self,
        (follower, command): (&mut SetPointFollower, &mut CommandLines),
        (to, h): (f64, f64),
        (seen, bias): (SeenState, f64),
    ) -> (f64, f64) {
        let (mut begin, mut impulse, mut free) = (0.0, 0.0, 0.0);
        follower.up_to(command, to, &mut |part| {
            let end = begin + part.long;
            let asked = |set: f64, time: f64| {
                let q = seen.q - bias + seen.v * (time - 0.5 * h);
                self.kp * (set - q) - self.kd * seen.v
            };
            let line = [asked(part.from, begin), asked(part.to, end)];
            let (mean, share) = limited_mean(line, self.most);
            impulse += part.long * mean;
            free += part.long * share;
            begin = end;
        });
        match begin > 0.0 {
            true => (impulse / begin, self.kd * free / begin),
            // a step below what a clock tells apart
            false => (0.0, 0.0),
        }
    }
}

/// Mean of what is limited to +-most along a straight line, and the share of it that is not limited.
#[inline]
fn limited_mean([from, to]: [f64; 2], most: f64) -> (f64, f64) {
    // a limit that is no number is none: a supply of 0 V times a limit that is never reached
    let [low, high] = [from, to].map(|x| x.max(-most).min(most));
    if (low, high) == (from, to) {
        return (0.5 * (from + to), 1.0);
    }
    if low == high {
        return (low, 0.0);
    }
    // each end beyond the limit stays at it for its part of the line
    let share = (high - low) / (to - from);
    let beyond = low * (low - from) + high * (to - high);
    (0.5 * (low + high) * share + beyond / (to - from), share)
}

/// How a drive makes torque, and the longest step of a roll-out [s].
pub type RollOutFrame = (DriveLawKind, f64);

/// Positions of one axis along a log, as its encoder would read them.
pub fn roll_axis(
    log: &DriveLog,
    frame: RollOutFrame,
    law: &MachineLaw,
    joint: usize,
    out: &mut [f64],
) {
    let only = std::slice::from_ref(&log.joints[joint]);
    let roll = |speeds: &[f64], count: usize| {
        let mut out = vec![0.0; count];
        roll_from(log, (frame, law), joint, speeds[0], &mut out);
        vec![out]
    };
    let speed = first_speeds(&log.t, only, roll)[0];
    roll_from(log, (frame, law), joint, speed, out);
}

/// The first positions of one axis from a speed at the first sample \[rad/s\].
fn roll_from(
    log: &DriveLog,
    ((kind, longest), law): (RollOutFrame, &MachineLaw),
    joint: usize,
    speed: f64,
    out: &mut [f64],
) {
    let (track, of) = (&log.joints[joint], &law.joints[joint]);
    let (inertia, gravity) = match log.load {
        DriveLoad::PendulumRig(rig) => (rig.inertia() + of.armature, rig.gravity()),
        DriveLoad::Unknown | DriveLoad::Robot => (1.0, 0.0),
    };
    let t = &log.t[..out.len()];
    let late = law.command_delay + law.loop_delay;
    let mut command = CommandLines::new(&log.t, &track.command, log.command_is, t[0] - late);
    let mut follower = SetPointFollower::new(track.command[0], of.slowness);
    let mut q = track.position[0] + of.bias;
    let mut v = speed;
    let mut past = PastStates::new(law.loop_delay, t[0], q, v);
    out[0] = q - of.bias;
    for k in 1..t.len() {
        let dt = t[k] - t[k - 1];
        let count = steps(dt, longest);
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
            let half = q + 0.5 * h * v;
            let seen = past.seen(begin, h, half, v);
            let side = (&mut follower, &mut command);
            let (mut tau, mut slope) =
                drive.mean_torque(side, (begin + h - late, h), (seen, of.bias));
            if !on {
                (tau, slope) = (0.0, 0.0);
            }
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
pub struct SeenState {
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
    /// Of an axis that is at `q` with a speed at a time; before it moved as it does then.
    pub fn new(late: f64, t: f64, q: f64, v: f64) -> Self {
        let states = if late > 0.0 {
            vec![[t, q, v]]
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
    pub fn seen(&mut self, begin: f64, h: f64, half: f64, v: f64) -> SeenState {
        if self.late <= 0.0 {
            return SeenState {
                q: half,
                v,
                own: 1.0,
            };
        }
        if self.late < 0.5 * h {
            return SeenState {
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
            Some([t1, q1, v1]) if time > t0 => {
                let w = ((time - t0) / (t1 - t0)).clamp(0.0, 1.0);
                (q0 + w * (q1 - q0), v0 + w * (v1 - v0))
            }
            _ => (q0 + v0 * (time - t0).min(0.0), v0),
        };
        SeenState { q, v, own: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_limited_line_is_that_of_its_points() {
        let lines = [
            [-3.0, 2.5],
            [2.5, -3.0],
            [0.2, 4.0],
            [-4.0, -0.2],
            [2.0, 3.0],
            [-0.5, 0.5],
        ];
        for [from, to] in lines {
            let points = (0..100_000).map(|k| from + (to - from) * (f64::from(k) + 0.5) / 1e5);
            let mean = points.clone().map(|x| x.clamp(-1.0, 1.0)).sum::<f64>() / 1e5;
            let free = points.filter(|x| x.abs() <= 1.0).count() as f64 / 1e5;
            let (found, share) = limited_mean([from, to], 1.0);
            assert!((found - mean).abs() < 1e-4, "{from} {to}: {found} {mean}");
            assert!((share - free).abs() < 1e-4, "{from} {to}: {share} {free}");
        }
        assert_eq!(limited_mean([7.0, 7.0], f64::INFINITY), (7.0, 1.0));
        assert_eq!(limited_mean([1.0, 2.0], f64::NAN), (1.5, 1.0));
    }
}
