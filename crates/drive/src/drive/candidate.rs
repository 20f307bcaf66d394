//! What a drive may have beside gain, damping, dry friction and armature: one family of numbers a step.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::law::DriveKind;
use super::unknown::{Quantity, Sizes, Unknown};

/// A named effect of drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Effect {
    CommandDelay,
    LoopDelay,
    SpeedLimit,
    TorqueLimit,
    LoadFriction,
    Stribeck,
    EncoderBias,
    TorqueOffset,
}

impl Effect {
    pub const ALL: [Effect; 8] = [
        Effect::CommandDelay,
        Effect::LoopDelay,
        Effect::SpeedLimit,
        Effect::TorqueLimit,
        Effect::LoadFriction,
        Effect::Stribeck,
        Effect::EncoderBias,
        Effect::TorqueOffset,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Effect::CommandDelay => "command-delay",
            Effect::LoopDelay => "loop-delay",
            Effect::SpeedLimit => "speed-limit",
            Effect::TorqueLimit => "torque-limit",
            Effect::LoadFriction => "load-friction",
            Effect::Stribeck => "stribeck",
            Effect::EncoderBias => "encoder-bias",
            Effect::TorqueOffset => "torque-offset",
        }
    }

    /// What it is, as a sentence about a machine.
    pub fn words(self) -> &'static str {
        match self {
            Effect::CommandDelay => "the command reaches the controller late",
            Effect::LoopDelay => "the controller acts on old positions",
            Effect::SpeedLimit => "the firmware limits the speed of the set point",
            Effect::TorqueLimit => "the torque of the drive is limited",
            Effect::LoadFriction => "dry friction grows with the torque of the drive",
            Effect::Stribeck => "dry friction is larger near rest",
            Effect::EncoderBias => "the zero of the encoder is off",
            Effect::TorqueOffset => "a constant torque acts",
        }
    }

    pub fn quantity(self) -> Quantity {
        match self {
            Effect::CommandDelay => Quantity::CommandDelay,
            Effect::LoopDelay => Quantity::LoopDelay,
            Effect::SpeedLimit => Quantity::Slowness,
            Effect::TorqueLimit => Quantity::TorqueLimit,
            Effect::LoadFriction => Quantity::LoadFriction,
            Effect::Stribeck => Quantity::Stribeck,
            Effect::EncoderBias => Quantity::Bias,
            Effect::TorqueOffset => Quantity::Offset,
        }
    }

    /// Of a quantity that is a named effect.
    pub fn of(quantity: Quantity) -> Option<Effect> {
        Effect::ALL.into_iter().find(|e| e.quantity() == quantity)
    }

    /// Whether a person can measure it: it is written as estimated or not at all; what is a shape of friction is shrunk.
    pub fn measurable(self) -> bool {
        !matches!(self, Effect::LoadFriction | Effect::Stribeck)
    }

    /// Whether it is one number of the whole machine.
    pub fn common(self) -> bool {
        matches!(self, Effect::CommandDelay | Effect::LoopDelay)
    }

    /// Its unknowns.
    pub fn unknowns(self, joints: usize) -> Vec<Unknown> {
        match self.common() {
            true => vec![Unknown::common(self.quantity())],
            false => (0..joints)
                .map(|j| Unknown::of(self.quantity(), j))
                .collect(),
        }
    }

    /// Values from which it is fitted: of limits and delays the slope at none is zero, so they begin where they act.
    pub fn starts(self, sizes: &[Sizes]) -> Vec<Vec<f64>> {
        let all = |parts: &[f64], of: &dyn Fn(&Sizes, f64) -> f64| -> Vec<Vec<f64>> {
            let one = |part: &f64| sizes.iter().map(|s| of(s, *part)).collect();
            parts.iter().map(one).collect()
        };
        match self {
            Effect::CommandDelay => vec![vec![0.005], vec![0.03], vec![0.08]],
            Effect::LoopDelay => vec![vec![0.002], vec![0.01], vec![0.03]],
            Effect::SpeedLimit => all(&[1.2, 0.9, 0.6], &|s, part| 1.0 / (part * s.speed)),
            Effect::TorqueLimit => all(&[0.9, 0.6, 0.3], &|s, part| {
                1.0 / (part * s.torque * s.farthest / s.error)
            }),
            Effect::LoadFriction => all(&[0.05], &|_, part| part),
            Effect::Stribeck => all(&[0.1], &|s, part| part * s.torque),
            Effect::EncoderBias | Effect::TorqueOffset => all(&[0.0], &|_, _| 0.0),
        }
    }

    /// Effects that a machine may have; a limit of a volts drive is no effect: its duty always has one.
    pub fn possible(kind: DriveKind, gravity: bool, links: bool) -> Vec<Effect> {
        let may = |effect: &Effect| match effect {
            // of a volts drive it is declared, or fitted with its gain
            Effect::TorqueLimit => kind == DriveKind::Torque,
            Effect::EncoderBias => gravity,
            // declared where no links are known
            Effect::TorqueOffset => links,
            _ => true,
        };
        Effect::ALL.into_iter().filter(may).collect()
    }
}
