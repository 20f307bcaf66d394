//! The unknowns of a fit and how a law is made of them.

use super::law::{DriveLawKind, JointLaw, MachineLaw};

/// What an unknown is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DriveQuantity {
    /// K, torque per radian and unit of kp.
    Stiffness,
    /// D while the drive is on, where it never is off.
    Damping,
    /// kt^2/R alone, where the drive is off in a part.
    BackEmf,
    /// Fv alone, likewise.
    Viscous,
    Coulomb,
    Armature,
    CommandDelay,
    LoopDelay,
    /// 1/v_max, so that none is zero.
    Slowness,
    /// 1/tau_max, likewise.
    TorqueLimit,
    LoadFriction,
    Stribeck,
    Bias,
    Offset,
}

/// An unknown of a joint, or of the whole machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DriveUnknown {
    pub quantity: DriveQuantity,
    pub joint: Option<usize>,
}

impl DriveUnknown {
    pub fn of(quantity: DriveQuantity, joint: usize) -> Self {
        DriveUnknown {
            quantity,
            joint: Some(joint),
        }
    }

    pub fn common(quantity: DriveQuantity) -> Self {
        DriveUnknown {
            quantity,
            joint: None,
        }
    }

    /// Smallest and largest value.
    pub fn bounds(&self) -> [f64; 2] {
        match self.quantity {
            DriveQuantity::Bias | DriveQuantity::Offset => [f64::NEG_INFINITY, f64::INFINITY],
            DriveQuantity::CommandDelay | DriveQuantity::LoopDelay => [0.0, LATEST],
            _ => [0.0, f64::INFINITY],
        }
    }
}

/// Latest command or loop [s].
pub const LATEST: f64 = 0.3;

/// How large the numbers of a joint are: what steps of differences and starts are measured with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSizes {
    /// [kg m^2]
    pub inertia: f64,
    /// [N m]
    pub torque: f64,
    /// [rad/s]
    pub speed: f64,
    /// [rad]
    pub error: f64,
    /// Largest error of position but one in a hundred [rad].
    pub farthest: f64,
}

impl JointSizes {
    /// What one part in a thousand of is a small change of a quantity.
    pub fn of(&self, quantity: DriveQuantity) -> f64 {
        match quantity {
            DriveQuantity::Stiffness => self.torque / self.error,
            DriveQuantity::Damping | DriveQuantity::BackEmf | DriveQuantity::Viscous => {
                self.torque / self.speed
            }
            DriveQuantity::Coulomb | DriveQuantity::Stribeck | DriveQuantity::Offset => self.torque,
            DriveQuantity::Armature => self.inertia,
            DriveQuantity::CommandDelay | DriveQuantity::LoopDelay => self.error / self.speed,
            DriveQuantity::Slowness => 1.0 / self.speed,
            DriveQuantity::TorqueLimit => 1.0 / self.torque,
            DriveQuantity::LoadFriction => 1.0,
            DriveQuantity::Bias => self.error,
        }
    }
}

/// What a machine is beside its unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct UnknownFrame {
    pub kind: DriveLawKind,
    /// Supply at which torques hold [V].
    pub supply: Option<f64>,
    pub joints: usize,
    /// vs of each joint [rad/s].
    pub stribeck_speed: Vec<f64>,
    /// Longest step of a roll-out [s].
    pub longest_step: f64,
    /// Numbers that are held: effects that are written smaller than they were estimated.
    pub held: Vec<(DriveUnknown, f64)>,
}

impl UnknownFrame {
    /// The law with these values of the unknowns; what is no unknown is absent.
    pub fn law(&self, unknowns: &[DriveUnknown], values: &[f64]) -> MachineLaw {
        let none = JointLaw {
            stiffness: 1.0,
            torque_max: f64::INFINITY,
            ..JointLaw::default()
        };
        let mut law = MachineLaw {
            joints: vec![none; self.joints],
            command_delay: 0.0,
            loop_delay: 0.0,
            supply: self.supply,
        };
        for (joint, vs) in law.joints.iter_mut().zip(&self.stribeck_speed) {
            joint.stribeck_speed = *vs;
        }
        let held = self.held.iter().map(|(unknown, value)| (unknown, value));
        for (unknown, value) in unknowns.iter().zip(values).chain(held) {
            let Some(j) = unknown.joint else {
                match unknown.quantity {
                    DriveQuantity::CommandDelay => law.command_delay = *value,
                    DriveQuantity::LoopDelay => law.loop_delay = *value,
                    _ => {}
                }
                continue;
            };
            let of = &mut law.joints[j];
            match unknown.quantity {
                DriveQuantity::Stiffness => of.stiffness = *value,
                DriveQuantity::Damping => (of.damping, of.viscous) = (*value, *value),
                DriveQuantity::BackEmf => of.damping += value,
                DriveQuantity::Viscous => {
                    of.damping += value;
                    of.viscous = *value;
                }
                DriveQuantity::Coulomb => of.coulomb = *value,
                DriveQuantity::Armature => of.armature = *value,
                DriveQuantity::Slowness => of.slowness = *value,
                DriveQuantity::TorqueLimit if *value > 0.0 => of.torque_max = 1.0 / value,
                DriveQuantity::TorqueLimit => of.torque_max = f64::INFINITY,
                DriveQuantity::LoadFriction => of.load_friction = *value,
                DriveQuantity::Stribeck => of.stribeck = *value,
                DriveQuantity::Bias => of.bias = *value,
                DriveQuantity::Offset => of.offset = *value,
                DriveQuantity::CommandDelay => law.command_delay = *value,
                DriveQuantity::LoopDelay => law.loop_delay = *value,
            }
        }
        if let DriveLawKind::Volts(firmware) = self.kind
            && let (Some(gain), Some(duty)) = (firmware.gain, firmware.duty_max)
        {
            for of in &mut law.joints {
                of.torque_max = of.torque_max.min(of.stiffness * duty / gain);
            }
        }
        law
    }
}
