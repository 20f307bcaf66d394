//! What a drive may have beside gain, damping, dry friction and armature: one family of numbers a step.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::law::DriveLawKind;
use super::unknown::{DriveQuantity, DriveUnknown, JointSizes};

/// A named effect of drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DriveEffect {
    CommandDelay,
    LoopDelay,
    SpeedLimit,
    TorqueLimit,
    LoadFriction,
    Stribeck,
    EncoderBias,
    TorqueOffset,
}

impl DriveEffect {
    pub const ALL: [DriveEffect; 8] = [
        DriveEffect::CommandDelay,
        DriveEffect::LoopDelay,
        DriveEffect::SpeedLimit,
        DriveEffect::TorqueLimit,
        DriveEffect::LoadFriction,
        DriveEffect::Stribeck,
        DriveEffect::EncoderBias,
        DriveEffect::TorqueOffset,
    ];

    pub fn name(self) -> &'static str {
        match self {
            DriveEffect::CommandDelay => "command-delay",
            DriveEffect::LoopDelay => "loop-delay",
            DriveEffect::SpeedLimit => "speed-limit",
            DriveEffect::TorqueLimit => "torque-limit",
            DriveEffect::LoadFriction => "load-friction",
            DriveEffect::Stribeck => "stribeck",
            DriveEffect::EncoderBias => "encoder-bias",
            DriveEffect::TorqueOffset => "torque-offset",
        }
    }

    /// What it is, as a sentence about a machine.
    pub fn words(self) -> &'static str {
        match self {
            DriveEffect::CommandDelay => "the command reaches the controller late",
            DriveEffect::LoopDelay => "the controller acts on old positions",
            DriveEffect::SpeedLimit => "the firmware limits the speed of the set point",
            DriveEffect::TorqueLimit => "the torque of the drive is limited",
            DriveEffect::LoadFriction => "dry friction grows with the torque of the drive",
            DriveEffect::Stribeck => "dry friction is larger near rest",
            DriveEffect::EncoderBias => "the zero of the encoder is off",
            DriveEffect::TorqueOffset => "a constant torque acts",
        }
    }

    pub fn quantity(self) -> DriveQuantity {
        match self {
            DriveEffect::CommandDelay => DriveQuantity::CommandDelay,
            DriveEffect::LoopDelay => DriveQuantity::LoopDelay,
            DriveEffect::SpeedLimit => DriveQuantity::Slowness,
            DriveEffect::TorqueLimit => DriveQuantity::TorqueLimit,
            DriveEffect::LoadFriction => DriveQuantity::LoadFriction,
            DriveEffect::Stribeck => DriveQuantity::Stribeck,
            DriveEffect::EncoderBias => DriveQuantity::Bias,
            DriveEffect::TorqueOffset => DriveQuantity::Offset,
        }
    }

    /// Of a quantity that is a named effect.
    pub fn of(quantity: DriveQuantity) -> Option<DriveEffect> {
        DriveEffect::ALL
            .into_iter()
            .find(|e| e.quantity() == quantity)
    }

    /// Whether a person can measure it: it is written as estimated or not at all; what is a shape of friction is shrunk.
    pub fn measurable(self) -> bool {
        !matches!(self, DriveEffect::LoadFriction | DriveEffect::Stribeck)
    }

    /// Whether it is one number of the whole machine.
    pub fn common(self) -> bool {
        matches!(self, DriveEffect::CommandDelay | DriveEffect::LoopDelay)
    }

    /// Its unknowns.
    pub fn unknowns(self, joints: usize) -> Vec<DriveUnknown> {
        match self.common() {
            true => vec![DriveUnknown::common(self.quantity())],
            false => (0..joints)
                .map(|j| DriveUnknown::of(self.quantity(), j))
                .collect(),
        }
    }

    /// Values from which it is fitted: of limits and delays the slope at none is zero, so they begin where they act.
    pub fn starts(self, sizes: &[JointSizes]) -> Vec<Vec<f64>> {
        let all = |parts: &[f64], of: &dyn Fn(&JointSizes, f64) -> f64| -> Vec<Vec<f64>> {
            let one = |part: &f64| sizes.iter().map(|s| of(s, *part)).collect();
            parts.iter().map(one).collect()
        };
        match self {
            DriveEffect::CommandDelay => vec![vec![0.005], vec![0.03], vec![0.08]],
            DriveEffect::LoopDelay => vec![vec![0.002], vec![0.01], vec![0.03]],
            DriveEffect::SpeedLimit => all(&[1.2, 0.9, 0.6], &|s, part| 1.0 / (part * s.speed)),
            DriveEffect::TorqueLimit => all(&[0.9, 0.6, 0.3], &|s, part| {
                1.0 / (part * s.torque * s.farthest / s.error)
            }),
            DriveEffect::LoadFriction => all(&[0.05, 0.4], &|_, part| part),
            DriveEffect::Stribeck => all(&[0.1, 0.8], &|s, part| part * s.torque),
            DriveEffect::EncoderBias | DriveEffect::TorqueOffset => all(&[0.0], &|_, _| 0.0),
        }
    }

    /// Effects that a machine may have; a limit of a volts drive is no effect: its duty always has one.
    pub fn possible(kind: DriveLawKind, gravity: bool, links: bool) -> Vec<DriveEffect> {
        let may = |effect: &DriveEffect| match effect {
            // of a volts drive it is declared, or fitted with its gain
            DriveEffect::TorqueLimit => kind == DriveLawKind::Torque,
            DriveEffect::EncoderBias => gravity,
            // declared where no links are known
            DriveEffect::TorqueOffset => links,
            _ => true,
        };
        DriveEffect::ALL.into_iter().filter(may).collect()
    }
}
