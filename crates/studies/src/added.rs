//! What a plant has beyond rigid bodies and friction: the truths that studies plant.

use serde::Serialize;

use crate::uncatalogued::{Seen, Uncatalogued};

/// Shape of an addition; `size` scales it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "kebab-case")]
pub enum Shape {
    Offset,
    /// Coulomb friction that is larger in the positive direction.
    Asymmetric,
    Stribeck {
        vs: f64,
    },
    Quadratic,
    /// A torque that is periodic in the position, so many times a radian or metre.
    Ripple {
        order: f64,
        phase: f64,
    },
    Spring {
        zero: f64,
    },
    /// Friction that is periodic in the position.
    PositionFriction {
        order: f64,
        phase: f64,
    },
    /// Friction by the load.
    LoadFriction,
    /// Loss in the gear where the drive pushes the load.
    Efficiency,
    /// Viscous friction of another joint's speed.
    Coupling {
        other: usize,
    },
    /// Friction that starts higher and settles [s].
    WarmUp {
        time_s: f64,
    },
    Drift,
    /// A drift that settles [s].
    SettlingDrift {
        time_s: f64,
    },
    /// A torque constant that falls as the motor warms up [s].
    WarmMotor {
        time_s: f64,
    },
    /// A torque constant that falls in proportion to the current.
    FullIron,
    /// A torque constant that varies along the turn.
    UnevenMotor {
        order: f64,
        phase: f64,
    },
    /// Friction that another joint's pose sets.
    PoseFriction {
        other: usize,
        phase: f64,
    },
    /// What another joint's motion asks for: Coulomb friction with it, and with the sum of both; viscous friction.
    GearTrain {
        other: usize,
        together: f64,
        viscous: f64,
    },
    /// Outside every catalogue: a torque that follows the square of the position's swing and the speed's sign.
    Stray,
    /// Those of the study of formulas.
    Uncatalogued(Uncatalogued),
}

/// One addition at one joint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Added {
    pub joint: usize,
    #[serde(flatten)]
    pub shape: Shape,
    pub size: f64,
}

/// What additions make of a joint now: a torque against the motion, and a change of the friction's level.
#[derive(Debug, Clone, Copy, Default)]
pub struct Share {
    pub torque: f64,
    pub level: f64,
}

impl Added {
    /// `friction` is viscous over Coulomb.
    pub fn share(&self, seen: &Seen, friction: f64) -> Share {
        let Seen { t, v, load, .. } = *seen;
        let (k, q_own, v_own) = (self.size, seen.q[self.joint], v[self.joint]);
        let torque = |torque: f64| Share { torque, level: 0.0 };
        let level = |level: f64| Share { torque: 0.0, level };
        match self.shape {
            Shape::Offset => torque(k),
            // a step alone would be an offset and a higher Coulomb level, which every model declares
            Shape::Asymmetric => Share {
                torque: if v_own > 0.0 {
                    k * (friction * v_own)
                } else {
                    0.0
                },
                level: if v_own > 0.0 { k } else { 0.0 },
            },
            Shape::Stribeck { vs } => level(k * (-(v_own / vs).powi(2)).exp()),
            Shape::Quadratic => torque(k * v_own * v_own.abs()),
            Shape::Ripple { order, phase } => torque(k * (order * q_own + phase).sin()),
            Shape::Spring { zero } => torque(k * (q_own - zero)),
            Shape::PositionFriction { order, phase } => level(k * (order * q_own + phase).sin()),
            Shape::LoadFriction => level(k * load.abs()),
            // a loss of the gear can hold a joint that stands, and cannot push it
            Shape::Efficiency => level(if load * v_own >= 0.0 {
                k * load.abs()
            } else {
                0.0
            }),
            Shape::Coupling { other } => torque(k * v[other]),
            Shape::WarmUp { time_s } => {
                let cold = k * (-t / time_s).exp();
                Share {
                    torque: cold * (friction * v_own),
                    level: cold,
                }
            }
            Shape::Drift => torque(k * t),
            Shape::SettlingDrift { time_s } => torque(k * (1.0 - (-t / time_s).exp())),
            // what the drive is told and does not give
            Shape::WarmMotor { time_s } => torque(seen.drive * k * (1.0 - (-t / time_s).exp())),
            Shape::FullIron => torque(seen.drive * k * seen.drive.abs()),
            Shape::UnevenMotor { order, phase } => {
                torque(seen.drive * k * (order * q_own + phase).sin())
            }
            Shape::PoseFriction { other, phase } => level(k * (seen.q[other] + phase).cos()),
            Shape::GearTrain {
                other,
                together,
                viscous,
            } => {
                let sign = |v: f64| if v == 0.0 { 0.0 } else { v.signum() };
                let (w, both) = (v[other], v_own + v[other]);
                torque(k * (sign(w) + together * sign(both) + viscous * w))
            }
            Shape::Uncatalogued(law) => law.share(k, self.joint, seen),
            Shape::Stray => torque(k * (3.0 * q_own).sin() * (2.5 * v_own).cos()),
        }
    }
}
