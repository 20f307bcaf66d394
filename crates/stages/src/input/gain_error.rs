//! Why no gains were found.

use super::error_kind::ErrorKind;
use cft_ident_core::explain::Explain;

/// Why no gains were found. Its text reads `what is wrong; what to do`.
#[derive(Debug, Clone, PartialEq, Explain, thiserror::Error)]
pub enum GainError {
    #[explain(
        "the payload's mass is {mass} kg +- {std} kg",
        "give a mass above 0 and a deviation from 0 on"
    )]
    Mass { mass: f64, std: f64 },
    #[explain(
        "{robot}: gains are fitted joint by joint, but {why}",
        "give the gains of the motors as `torque_scale` in [log.joint.NAME]"
    )]
    NotByJoint { robot: String, why: &'static str },
    #[explain(
        "gains are fitted with the friction of every joint, and -m gives a friction in some unit already",
        "leave -m out"
    )]
    FrictionGiven,
    #[explain(
        "no motion of this robot shows the mass of a payload apart from its centre and its inertia",
        "give the gain of a joint from a data sheet, or weigh with a robot that gravity acts on"
    )]
    MassHidden,
    #[explain(
        "{log}: no joint shows a load: the payload mass that the torques show is zero within two standard deviations ({joints})",
        "give the log with the payload, or a heavier one, in motions that lift it"
    )]
    NoLoad { log: String, joints: String },
    #[explain(
        "{log}: the payload shows with a negative mass on every joint",
        "the log with the payload belongs behind --fit-gains, those without before it",
        "or all torques are sign-flipped: give `torque_sign = -1` in every [log.joint.NAME]"
    )]
    Exchanged { log: String },
    #[explain(
        "the gain of {joints} comes out negative, {found}: the channel counts against the joint",
        "give `torque_sign = -1` in its [log.joint.NAME]"
    )]
    Negative { joints: String, found: String },
    #[explain(
        "the logs do not fix the gain of {joints}{found}",
        "move these joints fast, and in poses where gravity and the other joints act on them",
        "or give their `torque_scale`, and fit no gains"
    )]
    Undetermined { joints: String, found: String },
    #[explain(
        "without a payload only ratios of gains can be identified, and the logs do not fix that of {joints} to {reference}{found}",
        "give a log with a known payload, `--fit-gains LOG:mass=KG`",
        "or give `torque_scale` in [log.joint.NAME]"
    )]
    RatioUndetermined {
        joints: String,
        reference: String,
        found: String,
    },
}

impl GainError {
    /// What it is about.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::FrictionGiven => ErrorKind::Usage,
            Self::Mass { .. }
            | Self::NotByJoint { .. }
            | Self::Exchanged { .. }
            | Self::Negative { .. } => ErrorKind::Input,
            Self::MassHidden
            | Self::NoLoad { .. }
            | Self::Undetermined { .. }
            | Self::RatioUndetermined { .. } => ErrorKind::Undetermined,
        }
    }
}
