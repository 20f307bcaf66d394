//! An arm of four joints that logs currents: its robot file, its plant, motions of it, and its logs with
//! and without a payload. A study and a test share it.

#![allow(dead_code, reason = "each takes what it needs")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use cft_ident::config::{ModelFile, RobotFile, Trajectory};
use cft_ident::robot::standard::Body;
use cft_ident::simulate::{Experiment, Order, SimulatedLog, simulate};

pub const JOINTS: [&str; 4] = ["turn", "shoulder", "elbow", "wrist"];
/// Gains that the robot file gives [Nm/A].
pub const DECLARED: [f64; 4] = [90.0, 90.0, 60.0, 20.0];
/// Viscous [Nm s/rad] and Coulomb friction [Nm], inertia of the drive [kg m^2].
pub const DRIVES: [[f64; 3]; 4] = [
    [9.0, 7.0, 1.2],
    [9.0, 8.0, 1.2],
    [6.0, 5.0, 0.6],
    [1.5, 0.5, 0.3],
];
pub const ARM: &str = r#"
[robot]
model = "serial"

[[robot.link]]
joint = "turn"
d = 0.3

[[robot.link]]
joint = "shoulder"
alpha = -1.5707963267948966

[[robot.link]]
joint = "elbow"
a = 0.45

[[robot.link]]
joint = "wrist"
a = 0.05
alpha = -1.5707963267948966
d = 0.4

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true

[filter]
cutoff_hz = 10.0

[control]
rate_hz = 200.0
"#;

/// Chance for what differs from run to run (Steele, Lea and Flood 2014, SplitMix).
pub struct Chance(u64);

impl Chance {
    pub fn new(seed: u64) -> Self {
        Chance(seed.wrapping_mul(0xD134_2543_DE82_EF95).wrapping_add(17))
    }

    /// In 0..1.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Of variance 1 (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Masses [kg], centres [m] and inertias [kg m^2] of the links.
pub fn links() -> Vec<f64> {
    let link = |mass, centre, [x, y, z]: [f64; 3]| {
        let inertia = [x, 0.0, 0.0, y, 0.0, z];
        Body {
            mass,
            centre,
            inertia,
        }
        .standard()
    };
    [
        link(12.0, [0.01, 0.02, -0.05], [0.12, 0.12, 0.1]),
        link(9.0, [0.2, 0.01, 0.05], [0.03, 0.2, 0.2]),
        link(6.0, [0.03, 0.12, 0.01], [0.08, 0.02, 0.08]),
        link(2.0, [0.01, -0.005, 0.05], [0.006, 0.006, 0.003]),
    ]
    .concat()
}

/// Its robot file, with noise, the `[log]` section, and what else.
pub fn robot_file(extra: &str) -> String {
    let mut text = ARM.to_owned();
    for (joint, half) in JOINTS.iter().zip([2.5, 1.2, 1.4, 2.5]) {
        let _ = write!(
            text,
            "\n[limits.{joint}]\nposition = [{:?}, {half:?}]\n\n[noise.joint.{joint}]\nposition_resolution = 2e-5\n",
            -half
        );
    }
    text + extra
}

/// The model of the plant whose torques have noise of this share of their rms, and its base parameters by name.
pub fn plant(noise: f64) -> (String, Vec<(String, f64)>) {
    let text = robot_file(&format!("\n[sensors]\ntorque_noise_relative = {noise}\n"));
    let robot = RobotFile::parse("plant.toml", &text)
        .expect("a robot")
        .robot();
    let mut standard = links();
    standard.extend(DRIVES.iter().map(|drive| drive[2]));
    let names = robot.parameters().iter().map(|p| p.name.to_string());
    let base: Vec<(String, f64)> = names.zip(robot.base_of(&standard)).collect();
    let mut out = text;
    let mut tell = |name: &str, joint: &str, value: f64| {
        let _ = write!(
            out,
            "\n[[parameter]]\nname = \"{name}\"\n{joint}value = {value:?}\nunit = \"SI\"\nmeaning = \"\"\n"
        );
    };
    for (name, value) in &base {
        tell(name, "", *value);
    }
    for (joint, [viscous, coulomb, _]) in JOINTS.iter().zip(DRIVES) {
        let joint = format!("joint = \"{joint}\"\n");
        tell("viscous", &joint, viscous);
        tell("coulomb", &joint, coulomb);
    }
    (out, base)
}

/// A motion of all joints with phases of its own.
pub fn motion(chance: &mut Chance) -> String {
    let mut out =
        String::from("kind = \"fourier\"\ncoordinates = \"joint\"\nfundamental_hz = 0.15\n");
    for (joint, half) in JOINTS.iter().zip([2.3, 1.1, 1.3, 2.3]) {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for k in 1..=5 {
            let phase = std::f64::consts::TAU * chance.uniform();
            // the harmonic series of five terms is 2.28: no phases reach the limits
            let size = half / (2.3 * f64::from(k));
            a.push(format!("{:.5}", size * phase.cos()));
            b.push(format!("{:.5}", size * phase.sin()));
        }
        let _ = write!(
            out,
            "\n[[coordinate]]\nname = \"{joint}\"\noffset = 0.0\na = [{}]\nb = [{}]\n",
            a.join(", "),
            b.join(", ")
        );
    }
    out
}

/// Writes the currents of a simulated log.
pub fn write_currents(path: &Path, log: &SimulatedLog, gains: &[f64]) {
    let place = |name: String| {
        log.header
            .iter()
            .position(|h| *h == name)
            .expect("a column")
    };
    let t = place("t".to_owned());
    let q = JOINTS.map(|j| place(format!("q_{j}")));
    let tau = JOINTS.map(|j| place(format!("tau_{j}")));
    let mut text = format!("t,{},{}\n", JOINTS.map(|j| format!("q_{j}")).join(","), {
        JOINTS.map(|j| format!("i_{j}")).join(",")
    });
    for row in log.rows() {
        let _ = write!(text, "{}", row[t]);
        q.iter().for_each(|c| {
            let _ = write!(text, ",{}", row[*c]);
        });
        for (c, gain) in tau.iter().zip(gains) {
            let _ = write!(text, ",{}", row[*c] / gain);
        }
        text.push('\n');
    }
    fs::write(path, text).expect("the log is written");
}

/// A body at the last link.
#[derive(Debug, Clone, Copy)]
pub struct Payload {
    /// [kg]
    pub mass: f64,
    /// In the frame of the last link [m].
    pub centre: [f64; 3],
    /// About its centre, of a ball [kg m^2].
    pub inertia: f64,
}

impl Payload {
    /// Drawn at random: 2 to 4 kg.
    pub fn drawn(chance: &mut Chance) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * chance.uniform();
        let mass = between(2.0, 4.0);
        Payload {
            mass,
            centre: [
                between(-0.06, 0.06),
                between(-0.06, 0.06),
                between(0.02, 0.12),
            ],
            inertia: mass * between(0.002, 0.01),
        }
    }
}

/// Simulates the plant of a model along a motion of its own and writes the currents of gains [Nm/A].
pub fn log(
    path: &Path,
    model: &ModelFile,
    (gains, payload): (&[f64], Option<Payload>),
    (chance, seconds, seed): (&mut Chance, f64, u64),
) {
    let trajectory = Trajectory::parse("motion.toml", &motion(chance)).expect("a motion");
    let effect = |p: Payload| {
        let [mx, my, mz] = p.centre.map(|x| p.mass * x);
        let (mass, inertia) = (p.mass, p.inertia);
        let text = format!("payload:mass={mass},mx={mx},my={my},mz={mz},inertia={inertia}");
        text.parse().expect("an effect")
    };
    let order = Order {
        robot: &model.robot,
        model: Some(("plant.toml", model)),
        experiment: Experiment::Trajectory(&trajectory),
        seconds: Some(seconds),
        effects: payload.map(effect).into_iter().collect(),
        seed,
    };
    write_currents(path, &simulate(&order).expect("a run"), gains);
}

/// The `[log]` section for these currents; with scales [Nm/A], where there are any.
pub fn log_section(scales: Option<[f64; 4]>) -> String {
    let mut out =
        String::from("\n[log]\ntorque_is = \"current\"\ntorque_held = true\n\n[log.joint]\n");
    for (j, joint) in JOINTS.iter().enumerate() {
        let scale = scales.map(|s| format!(", torque_scale = {:?}", s[j]));
        let _ = writeln!(
            out,
            "{joint} = {{ torque = \"i_{joint}\", torque_unit = \"A\"{} }}",
            scale.unwrap_or_default()
        );
    }
    out
}
