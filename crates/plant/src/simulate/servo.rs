//! A servo on a pendulum rig, to test against: what a bench logs of command and position.
//!
//! ```text
//! (m l^2 + ma l^2/3 + Ja) q'' = tau - g sin q - Fv q' - dry
//! volts drive    tau = kt i,   i = (V d - kt q')/R,   d = clip(k kp (s - q_seen), +-d_max)
//! torque drive   tau = clip(kp (s - q_seen) - kd q'_seen, +-tau_max)
//! ```
//!
//! Written apart from the estimator: small explicit steps, a joint that is held while the torques on it are below its dry
//! friction, delays as memories of what was sent and seen.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::order::SimulationSummary;
use super::simulated_run::RunEnding;
use super::truth::{TruthFile, parameter};
use cft_ident_files::config::model_file::Parameter;

/// What a controller's error becomes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ServoDrive {
    /// A duty of the supply: the motor brakes itself.
    Volts,
    /// A torque, by a current controller.
    Torque {
        /// Gain of the speed [N m s/rad].
        kd: f64,
        /// Largest torque [N m].
        limit: f64,
    },
}

/// A servo and its firmware. SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoPlant {
    pub drive: ServoDrive,
    /// Torque constant [N m/A], as seen at the output.
    pub kt: f64,
    /// Winding resistance [ohm].
    pub resistance: f64,
    /// Inertia of rotor and gears at the output [kg m^2].
    pub armature: f64,
    /// [N m s/rad]
    pub viscous: f64,
    /// [N m]
    pub coulomb: f64,
    /// Dry friction per torque of the motor.
    pub load_friction: f64,
    /// Duty per radian and unit of kp.
    pub firmware_gain: f64,
    pub duty_max: f64,
    /// Supply [V].
    pub supply: f64,
    /// Largest speed of the set point [rad/s].
    pub speed_limit: Option<f64>,
    /// The command arrives so late [s].
    pub command_delay: f64,
    /// The controller acts on a position so old [s].
    pub loop_delay: f64,
    /// Steps of the encoder in a turn.
    pub ticks: f64,
}

impl ServoPlant {
    /// One like those of hobby arms, without limit of speed and without delay.
    pub const HOBBY: ServoPlant = ServoPlant {
        drive: ServoDrive::Volts,
        kt: 1.1,
        resistance: 2.2,
        armature: 0.027,
        viscous: 0.05,
        coulomb: 0.09,
        load_friction: 0.0,
        firmware_gain: 0.165,
        duty_max: 0.97,
        supply: 12.0,
        speed_limit: None,
        command_delay: 0.0,
        loop_delay: 0.0,
        ticks: 4096.0,
    };
}

/// What the servo lifts: a mass at the end of a rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoRig {
    /// [kg]
    pub mass: f64,
    /// [kg]
    pub arm_mass: f64,
    /// [m]
    pub length: f64,
}

/// Motions that benches command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BenchMotion {
    /// Lifts at once and waits.
    Step,
    /// Two sines.
    Sines,
    /// A sine that becomes faster.
    Chirp,
    /// Slow ramps up and down.
    Ramps,
    /// Steps between places drawn by chance.
    Places,
}

impl BenchMotion {
    pub const ALL: [BenchMotion; 5] = [
        BenchMotion::Step,
        BenchMotion::Sines,
        BenchMotion::Chirp,
        BenchMotion::Ramps,
        BenchMotion::Places,
    ];

    pub fn name(self) -> &'static str {
        match self {
            BenchMotion::Step => "step",
            BenchMotion::Sines => "sines",
            BenchMotion::Chirp => "chirp",
            BenchMotion::Ramps => "ramps",
            BenchMotion::Places => "places",
        }
    }

    /// Seconds that it lasts.
    pub const SECONDS: f64 = 6.0;

    /// Commanded positions at times [rad].
    fn positions(self, t: &[f64], seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let places: Vec<f64> = (0..8).map(|_| rng.random_range(-1.5..1.5)).collect();
        let at = |t: f64| match self {
            BenchMotion::Step => {
                if (0.5..4.0).contains(&t) {
                    1.57
                } else {
                    0.0
                }
            }
            BenchMotion::Sines => 1.1 * (TAU * 0.5 * t).sin() + 0.5 * (TAU * 1.3 * t).sin(),
            BenchMotion::Chirp => (1.6 * t * t).sin(),
            BenchMotion::Ramps => {
                let phase = (t / 3.0).fract();
                1.5 * (1.0 - (2.0 * phase - 1.0).abs())
            }
            BenchMotion::Places => places[((t / 0.75) as usize).min(places.len() - 1)],
        };
        t.iter().map(|t| at(*t)).collect()
    }
}

/// A log of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoRun {
    pub motion: BenchMotion,
    pub kp: f64,
    pub rig: ServoRig,
    pub servo: ServoPlant,
    pub t: Vec<f64>,
    pub command: Vec<f64>,
    pub position: Vec<f64>,
}

/// Rate of a log [Hz].
const RATE_HZ: f64 = 200.0;

/// Steps of the simulation between two rows of a log: a step of 50 us makes a loop late by a half of it, which an estimate of
/// viscous friction sees.
const STEPS: usize = 1000;

/// Runs a motion at a gain.
pub fn run_servo(
    servo: &ServoPlant,
    rig: &ServoRig,
    motion: BenchMotion,
    kp: f64,
    seed: u64,
) -> ServoRun {
    let rows = (BenchMotion::SECONDS * RATE_HZ) as usize;
    let t: Vec<f64> = (0..=rows).map(|k| k as f64 / RATE_HZ).collect();
    let command = motion.positions(&t, seed);
    let h = 1.0 / (RATE_HZ * STEPS as f64);
    // set points of a torque drive are sent row by row; a rig's log was interpolated, on straight lines
    let held = servo.drive != ServoDrive::Volts;
    let sent = |time: f64| {
        let place = (time * RATE_HZ + 1e-6).clamp(0.0, rows as f64);
        let k = (place as usize).min(rows - 1);
        let part = if held { 0.0 } else { place - k as f64 };
        command[k] + part * (command[k + 1] - command[k])
    };
    let inertia = (rig.mass + rig.arm_mass / 3.0) * rig.length * rig.length + servo.armature;
    let weight = (rig.mass + 0.5 * rig.arm_mass) * 9.80665 * rig.length;
    let (mut q, mut v, mut set) = (0.0f64, 0.0f64, command[0]);
    let old = (servo.loop_delay / h).round() as usize;
    let mut seen: VecDeque<[f64; 2]> = VecDeque::from(vec![[q, v]; old]);
    let mut position = Vec::with_capacity(rows + 1);
    let tick = TAU / servo.ticks;
    for start in t.iter().take(rows + 1) {
        position.push((q / tick).round() * tick);
        for i in 0..STEPS {
            let time = start + i as f64 * h;
            let target = sent(time - servo.command_delay - servo.loop_delay);
            set = match servo.speed_limit {
                Some(limit) => set + (target - set).clamp(-limit * h, limit * h),
                None => target,
            };
            seen.push_back([q, v]);
            let [old, old_speed] = seen.pop_front().unwrap_or([q, v]);
            let (motor, stalled) = match servo.drive {
                ServoDrive::Volts => {
                    let duty = servo.firmware_gain * kp * (set - old);
                    let volts = servo.supply * duty.clamp(-servo.duty_max, servo.duty_max);
                    let torque = |volts: f64| servo.kt * volts / servo.resistance;
                    (torque(volts - servo.kt * v), torque(volts))
                }
                ServoDrive::Torque { kd, limit } => {
                    let torque = (kp * (set - old) - kd * old_speed).clamp(-limit, limit);
                    (torque, torque)
                }
            };
            let dry = servo.coulomb + servo.load_friction * stalled.abs();
            let pushed = motor - weight * q.sin() - servo.viscous * v;
            if v == 0.0 && pushed.abs() <= dry {
                continue;
            }
            let against = if v == 0.0 {
                pushed.signum()
            } else {
                v.signum()
            };
            let next = v + h * (pushed - dry * against) / inertia;
            // what comes to rest is asked anew whether it moves on
            v = if v != 0.0 && next * v <= 0.0 {
                0.0
            } else {
                next
            };
            q += h * v;
        }
    }
    ServoRun {
        motion,
        kp,
        rig: *rig,
        servo: *servo,
        t,
        command,
        position,
    }
}

impl ServoPlant {
    /// Its numbers by the names of a drive's model file.
    fn parameters(&self) -> Vec<Parameter> {
        let per_volt = self.kt / self.resistance;
        let of = |name: &str, value: f64, unit: &str, meaning: &str| {
            parameter(name, Some("servo"), value, unit, meaning)
        };
        let mut out = vec![
            of(
                "armature",
                self.armature,
                "kg m^2",
                "inertia of rotor and gears at the output",
            ),
            of("coulomb", self.coulomb, "Nm", "dry friction"),
        ];
        match self.drive {
            ServoDrive::Volts => out.extend([
                of(
                    "stiffness",
                    self.firmware_gain * self.supply * per_volt,
                    "Nm/rad",
                    "torque per radian and unit of kp",
                ),
                of(
                    "damping",
                    self.kt * per_volt + self.viscous,
                    "Nm s/rad",
                    "viscous friction and back-EMF",
                ),
                of(
                    "torque_limit",
                    self.duty_max * self.supply * per_volt,
                    "Nm",
                    "largest torque at standstill",
                ),
            ]),
            ServoDrive::Torque { limit, .. } => {
                out.push(of("damping", self.viscous, "Nm s/rad", "viscous friction"));
                if limit.is_finite() {
                    out.push(of("torque_limit", limit, "Nm", "largest torque"));
                }
            }
        }
        if self.load_friction > 0.0 {
            let meaning = "dry friction per torque of the drive";
            out.push(of("load_friction", self.load_friction, "", meaning));
        }
        if let Some(limit) = self.speed_limit {
            out.push(of(
                "speed_limit",
                limit,
                "rad/s",
                "largest speed of the set point",
            ));
        }
        let late = [
            ("command_delay", self.command_delay, "the command is late"),
            (
                "loop_delay",
                self.loop_delay,
                "the controller acts on an old position",
            ),
        ];
        let late = late.into_iter().filter(|(_, value, _)| *value > 0.0);
        out.extend(late.map(|(name, value, meaning)| parameter(name, None, value, "s", meaning)));
        out
    }
}

impl ServoRun {
    /// Columns of its table and its rows.
    pub fn table(&self) -> ([&'static str; 3], impl Iterator<Item = [f64; 3]>) {
        let rows = self.t.iter().zip(&self.position).zip(&self.command);
        let rows = rows.map(|((t, q), command)| [*t, *q, *command]);
        (["t", "q_servo", "q_des_servo"], rows)
    }

    /// What was true.
    pub fn summary(&self, version: &str, seed: u64) -> SimulationSummary {
        SimulationSummary {
            truth: TruthFile {
                version: version.to_owned(),
                seed,
                model: "servo".to_owned(),
                setup: None,
                ending: "completed".to_owned(),
                volt_noise: Vec::new(),
                torque_noise: Vec::new(),
                parameters: self.servo.parameters(),
                effects: Vec::new(),
            },
            limits: Vec::new(),
            ending: RunEnding::Completed,
            saturated: Vec::new(),
            left_out: Vec::new(),
        }
    }

    /// The rig as a URDF: a rod that hangs down, with a mass at its end.
    pub fn urdf(&self) -> String {
        let ServoRig {
            mass,
            arm_mass,
            length,
        } = self.rig;
        let whole = mass + arm_mass;
        let centre = (mass + 0.5 * arm_mass) * length / whole;
        let about_axis = (mass + arm_mass / 3.0) * length * length;
        let about_centre = about_axis - whole * centre * centre;
        format!(
            r#"<robot name="rig">
  <link name="base"/>
  <joint name="servo" type="revolute">
    <parent link="base"/>
    <child link="rod"/>
    <axis xyz="0 1 0"/>
    <limit lower="-3.2" upper="3.2" effort="100" velocity="100"/>
  </joint>
  <link name="rod">
    <inertial>
      <origin xyz="0 0 {}"/>
      <mass value="{whole}"/>
      <inertia ixx="{about_centre}" iyy="{about_centre}" izz="1e-6" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
</robot>
"#,
            -centre
        )
    }

    /// Name of its file.
    pub fn file_name(&self) -> String {
        let (mass, length) = (self.rig.mass, self.rig.length);
        format!(
            "m{mass}_l{length}_kp{}_{}.json",
            self.kp,
            self.motion.name()
        )
    }

    /// As a rig's log in JSON: its head and `entries`.
    pub fn to_json(&self) -> String {
        let entry = |k: usize| {
            serde_json::json!({
                "timestamp": self.t[k],
                "position": self.position[k],
                "goal_position": self.command[k],
                "torque_enable": true,
                "input_volts": self.servo.supply,
            })
        };
        let entries: Vec<_> = (0..self.t.len()).map(entry).collect();
        let log = serde_json::json!({
            "mass": self.rig.mass,
            "arm_mass": self.rig.arm_mass,
            "length": self.rig.length,
            "kp": self.kp,
            "vin": self.servo.supply,
            "dt": 1.0 / RATE_HZ,
            "motor": "servo",
            "trajectory": self.motion.name(),
            "entries": entries,
        });
        format!("{log}\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: ServoRig = ServoRig {
        mass: 0.5,
        arm_mass: 0.05,
        length: 0.12,
    };

    #[test]
    fn a_servo_at_rest_carries_its_load_by_its_gain_within_its_dry_friction() {
        let run = run_servo(&ServoPlant::HOBBY, &RIG, BenchMotion::Step, 16.0, 1);
        let at = run.t.iter().position(|t| *t > 3.9).unwrap();
        let servo = ServoPlant::HOBBY;
        let stiffness = servo.kt * servo.supply * servo.firmware_gain * 16.0 / servo.resistance;
        let weight = (RIG.mass + 0.5 * RIG.arm_mass) * 9.80665 * RIG.length;
        let missing = stiffness * (run.command[at] - run.position[at]);
        let carried = weight * run.position[at].sin();
        let step = stiffness * TAU / servo.ticks;
        assert!(
            (missing - carried).abs() < servo.coulomb + step,
            "{missing} {carried}"
        );
    }

    #[test]
    fn a_late_command_moves_the_same_so_much_later() {
        let late = ServoPlant {
            command_delay: 0.03,
            ..ServoPlant::HOBBY
        };
        let one = run_servo(&ServoPlant::HOBBY, &RIG, BenchMotion::Step, 16.0, 1);
        let other = run_servo(&late, &RIG, BenchMotion::Step, 16.0, 1);
        for k in 200..1000 {
            assert!(
                (one.position[k - 6] - other.position[k]).abs() < 4e-3,
                "{k}"
            );
        }
    }
}
