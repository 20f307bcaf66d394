//! What turns a joint, as far as somebody said so: it says how much play and presliding the joint can have.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::JointKind;

/// Kind of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DriveKind {
    /// A harmonic (strain wave) gear: no play.
    Harmonic,
    /// Spur, planetary or worm gears.
    Geared,
    /// A toothed belt.
    Belt,
    /// A lead or ball screw.
    Screw,
    /// The motor itself: no play.
    Direct,
}

/// `[drive.NAME]` of a joint; what is absent is unknown.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointDrive {
    /// Kind.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<DriveKind>,
    /// Largest play between motor and joint [m or rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backlash_max: Option<f64>,
    /// Largest distance over which friction builds up after a reversal [m or rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub presliding_max: Option<f64>,
}

impl JointDrive {
    /// Largest play of a joint [m or rad]: as declared, none of a drive that has none, else what a worn gear has.
    pub fn backlash(&self, joint: JointKind) -> f64 {
        self.backlash_max.unwrap_or(match (self.kind, joint) {
            (Some(DriveKind::Harmonic | DriveKind::Direct), _) => 0.0,
            (_, JointKind::Revolute) => 0.03,
            (_, JointKind::Prismatic) => 2e-3,
        })
    }

    /// Largest presliding displacement of a joint [m or rad]: as declared, else what rolling contacts and seals
    /// have at most.
    pub fn presliding(&self, joint: JointKind) -> f64 {
        self.presliding_max.unwrap_or(match joint {
            JointKind::Revolute => 0.05,
            JointKind::Prismatic => 5e-3,
        })
    }
}
