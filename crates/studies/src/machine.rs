//! Machines of the studies: one joint, arms of three and six joints, a SCARA; each with its drives and its friction.

use serde::Serialize;

use crate::added::{Added, Shape};
use crate::arms;
use crate::cft::Cft;
use crate::chain::{Chain, JOINTS, Joints};
use crate::chance::Chance;
use crate::friction::{Friction, Law};
use crate::path::Range;
use crate::plant::{Bodies, Elastic, Plant};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    Single,
    Arm3,
    /// Two joints that turn and one that slides along gravity.
    Scara,
    Arm6,
    /// The robot with a pantograph that the tool was first built for.
    Cft,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    Direct,
    /// Elastic, with a periodic error twice a turn of its motor.
    Harmonic,
    /// A slide on a screw; a SCARA's last joint is one.
    BallScrew,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LawKind {
    Coulomb,
    Smooth,
    Stribeck,
    Presliding,
}

pub const KINDS: [Kind; 4] = [Kind::Single, Kind::Arm3, Kind::Scara, Kind::Arm6];
pub const DRIVES: [Drive; 3] = [Drive::Direct, Drive::Harmonic, Drive::BallScrew];
pub const LAWS: [LawKind; 4] = [
    LawKind::Coulomb,
    LawKind::Smooth,
    LawKind::Stribeck,
    LawKind::Presliding,
];

pub struct Machine {
    pub kind: Kind,
    pub drive: Drive,
    pub plant: Plant,
    /// The bodies as a laboratory's drawing has them: what its controller and its URDF know.
    pub nominal: Bodies,
    /// The true links with their drives' inertias; none for one joint.
    pub chain: Option<Chain>,
    pub names: Vec<String>,
    pub ranges: Vec<Range>,
    /// Inertia of each joint amid its range, with its drive's.
    pub inertia: Joints,
    /// Steps of the integrator a second.
    pub step_hz: f64,
}

/// Frequency at which an elastic drive swings against its link [Hz].
const SWING_HZ: f64 = 45.0;
/// Damping of that swing.
const SWING_DAMPING: f64 = 0.08;

impl Kind {
    /// Only slides have screws, and a SCARA has no other drive here.
    pub fn may_have(self, drive: Drive) -> bool {
        match self {
            Self::Single => true,
            Self::Scara => drive == Drive::BallScrew,
            Self::Cft => drive == Drive::Direct,
            Self::Arm3 | Self::Arm6 => drive != Drive::BallScrew,
        }
    }
}

impl Machine {
    /// Draws a machine; `error` is the periodic error of harmonic gears [rad].
    pub fn draw(kind: Kind, drive: Drive, law: LawKind, error: f64, chance: &mut Chance) -> Self {
        let mut machine = match kind {
            Kind::Single => single(drive, law, chance),
            Kind::Arm3 => arm(arms::arm3(), law, chance),
            Kind::Scara => arm(arms::scara(), law, chance),
            Kind::Arm6 => arm(arms::arm6(), law, chance),
            Kind::Cft => cft(law, chance),
        };
        machine.kind = kind;
        machine.drive = drive;
        if drive == Drive::Harmonic {
            machine.soften(error);
        }
        machine
    }

    pub fn slides(&self, joint: usize) -> bool {
        match &self.chain {
            Some(chain) => chain.links[joint].slides,
            None if self.kind == Kind::Cft => joint == 0,
            None => self.drive == Drive::BallScrew,
        }
    }

    /// One count of a joint's encoder with so many over the joint's range.
    pub fn step(&self, joint: usize, counts: f64) -> f64 {
        self.ranges
            .get(joint)
            .map_or(0.0, |range| 2.0 * range.half / counts)
    }

    /// Whether its drives' temperatures are logged.
    pub fn is_warm(&self) -> bool {
        let warm = |a: &Added| matches!(a.shape, Shape::Uncatalogued(law) if law.is_warm());
        self.plant.added.iter().any(warm)
    }

    /// Whether the robot file's law of friction is the plant's.
    pub fn law_declared(&self) -> bool {
        self.plant.friction.iter().all(|f| f.law == Law::Coulomb)
    }

    /// Puts an elastic gear between each motor and its link.
    fn soften(&mut self, error: f64) {
        for i in 0..self.plant.joints {
            let motor = match &mut self.plant.bodies {
                Bodies::Single { inertia, .. } => {
                    let motor = 0.6 * *inertia;
                    *inertia -= motor;
                    motor
                }
                Bodies::Chain(chain) => std::mem::take(&mut chain.links[i].drive_inertia),
                Bodies::Cft(_) => return,
            };
            let link = self.inertia[i] - motor;
            let both = motor * link / (motor + link);
            let w = std::f64::consts::TAU * SWING_HZ;
            self.plant.drives[i] = Some(Elastic {
                stiffness: both * w * w,
                damping: 2.0 * SWING_DAMPING * both * w,
                gap: 0.0,
                motor,
                error,
                order: 200.0,
            });
        }
    }
}

fn law_of(kind: LawKind, coulomb: f64, speed: f64, inertia: f64) -> Law {
    match kind {
        LawKind::Coulomb => Law::Coulomb,
        LawKind::Smooth => Law::Smooth {
            width: 0.02 * speed,
        },
        LawKind::Stribeck => Law::Stribeck {
            more: 0.3 * coulomb,
            vs: 0.04 * speed,
        },
        LawKind::Presliding => {
            // yields over a thousandth of what the joint goes in a second at top speed
            let stiffness = coulomb / (1e-3 * speed);
            Law::Presliding {
                stiffness,
                damping: 0.4 * (stiffness * inertia).sqrt(),
            }
        }
    }
}

fn single(drive: Drive, law: LawKind, chance: &mut Chance) -> Machine {
    let screw = drive == Drive::BallScrew;
    let (inertia, viscous, coulomb) = if screw {
        (
            chance.ratio(40.0, 120.0),
            chance.ratio(100.0, 300.0),
            chance.ratio(12.0, 30.0),
        )
    } else {
        (
            chance.ratio(0.012, 0.06),
            chance.ratio(0.25, 0.6),
            chance.ratio(0.35, 0.7),
        )
    };
    let range = if screw {
        Range {
            centre: 0.15,
            half: 0.12,
            speed: 0.3,
        }
    } else {
        Range {
            centre: 0.0,
            half: 0.8,
            speed: 2.2,
        }
    };
    let friction = Friction {
        viscous,
        coulomb,
        law: law_of(law, coulomb, range.speed, inertia),
    };
    let bodies = Bodies::Single {
        inertia,
        weight: 0.0,
        phase: 0.0,
    };
    let mut offset = [0.0; JOINTS];
    offset[0] = chance.between(-0.1, 0.1) * coulomb;
    let mut inertias = [0.0; JOINTS];
    inertias[0] = inertia;
    Machine {
        kind: Kind::Single,
        drive,
        nominal: bodies.clone(),
        plant: Plant {
            bodies,
            joints: 1,
            drives: [None; JOINTS],
            friction: vec![friction],
            offset,
            added: Vec::new(),
        },
        chain: None,
        names: vec!["q1".to_owned()],
        ranges: vec![range],
        inertia: inertias,
        step_hz: 20_000.0,
    }
}

fn arm(drawing: Chain, law: LawKind, chance: &mut Chance) -> Machine {
    let mut links = drawing.links.clone();
    for link in &mut links {
        let k = chance.between(0.85, 1.15);
        link.mass *= k;
        link.inertia = link.inertia.map(|row| row.map(|x| k * x));
        link.drive_inertia *= chance.between(0.85, 1.15);
    }
    let chain = Chain::new(links, drawing.gravity);
    let n = chain.links.len();
    let range = |i: usize| {
        if chain.links[i].slides {
            return Range {
                centre: 0.1,
                half: 0.09,
                speed: 0.35,
            };
        }
        let centre = [0.0, -0.4, 0.6, 0.0, 0.5, 0.0][i];
        Range {
            centre,
            half: 0.9,
            speed: 2.0,
        }
    };
    let ranges: Vec<Range> = (0..n).map(range).collect();
    let centre: Joints = std::array::from_fn(|i| ranges.get(i).map_or(0.0, |r| r.centre));
    let mass = chain.mass_matrix(&centre);
    let mut inertia = [0.0; JOINTS];
    let (mut friction, mut offset) = (Vec::new(), [0.0; JOINTS]);
    for (i, link) in chain.links.iter().enumerate() {
        inertia[i] = mass[i][i] + link.drive_inertia;
        let (viscous, coulomb) = if link.slides {
            (30.0, 8.0)
        } else {
            (
                [3.0, 3.0, 1.5, 0.8, 0.6, 0.4][i],
                [2.4, 2.6, 1.4, 0.7, 0.5, 0.3][i],
            )
        };
        let coulomb = coulomb * chance.between(0.8, 1.2);
        friction.push(Friction {
            viscous: viscous * chance.between(0.8, 1.2),
            coulomb,
            law: law_of(law, coulomb, ranges[i].speed, link.drive_inertia),
        });
        offset[i] = chance.between(-0.1, 0.1) * coulomb;
    }
    Machine {
        kind: Kind::Arm3,
        drive: Drive::Direct,
        plant: Plant {
            bodies: Bodies::Chain(chain.clone()),
            joints: n,
            drives: [None; JOINTS],
            friction,
            offset,
            added: Vec::new(),
        },
        nominal: Bodies::Chain(drawing),
        chain: Some(chain),
        names: (1..=n).map(|i| format!("j{i}")).collect(),
        ranges,
        inertia,
        step_hz: if n > 3 { 10_000.0 } else { 20_000.0 },
    }
}

/// Inertial parameters of the CFT robot; all but the first three are made up.
const THETA: [f64; 12] = [
    121.3049, 0.3107, 4.1955, 0.95, -0.07, 0.0012, 0.08, 0.0128, -0.94, -0.02, 4.67, 2.83,
];

fn cft(law: LawKind, chance: &mut Chance) -> Machine {
    // masses move together, so that the mass matrix stays that of bodies
    let scale = chance.between(0.9, 1.1);
    let own = Cft {
        theta: THETA.map(|t| scale * t),
    };
    let range = |centre, half, speed| Range {
        centre,
        half,
        speed,
    };
    let ranges = vec![
        range(0.42, 0.2, 0.4),
        range(0.4, 1.0, 1.5),
        range(-0.9, 0.3, 0.8),
        range(1.7, 0.3, 0.8),
    ];
    let centre: Joints = std::array::from_fn(|i| ranges.get(i).map_or(0.0, |r| r.centre));
    let mass = own.mass_matrix(&centre);
    let inertia: Joints = std::array::from_fn(|i| mass[i][i]);
    let (mut friction, mut offset) = (Vec::new(), [0.0; JOINTS]);
    for (i, range) in ranges.iter().enumerate() {
        let coulomb = [35.0, 6.0, 4.5, 3.2][i] * chance.between(0.85, 1.15);
        friction.push(Friction {
            viscous: [120.0, 9.0, 5.0, 4.0][i] * chance.between(0.85, 1.15),
            coulomb,
            law: law_of(law, coulomb, range.speed, inertia[i]),
        });
        offset[i] = chance.between(-0.1, 0.1) * coulomb;
    }
    Machine {
        kind: Kind::Cft,
        drive: Drive::Direct,
        nominal: Bodies::Cft(Cft { theta: THETA }),
        plant: Plant {
            bodies: Bodies::Cft(own),
            joints: 4,
            drives: [None; JOINTS],
            friction,
            offset,
            added: Vec::new(),
        },
        chain: None,
        names: ["q1", "q2", "q4", "q5"].map(str::to_owned).to_vec(),
        ranges,
        inertia,
        step_hz: 20_000.0,
    }
}
