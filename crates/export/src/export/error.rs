//! Why a model cannot be exported.

use cft_ident_core::effect::EffectError;
use cft_ident_core::explain::Explain;
use cft_ident_files::config::ConfigError;

/// Why a model cannot be exported.
#[derive(Debug, Explain, thiserror::Error)]
pub enum ExportError {
    /// Files of links have no word for this.
    #[explain("a file of links cannot hold {what}", remedy)]
    NoLinks { what: String, remedy: &'static str },
    /// No code is known of an effect.
    #[explain(
        _0.explanation(),
        "export the rest with --without-effects, or compute the torque with `cft-ident torque`"
    )]
    Effect(#[from] EffectError),
    /// The mass of a link comes out as 0 while its first moment does not.
    #[explain(
        "link `{link}` has the mass {mass:e} kg by this model but the first moment {moment:.3e} kg m, which no centre of gravity gives",
        "give it a prior mass in [[robot.link]] `inertial`, or export with --c or --rust"
    )]
    NoMass {
        link: String,
        mass: f64,
        moment: f64,
    },
    /// Gains come from an inertia above zero.
    #[explain(
        "{joint} has the inertia {inertia:.3e} in the middle of its travel, which no machine has",
        "identify with `lsq` without --unconstrained"
    )]
    NoInertia { joint: String, inertia: f64 },
    /// A link that no body can be, which simulators refuse or integrate into nonsense.
    #[explain(
        "link `{link}` can be no body: its mass is not above 0, or a principal moment is below 0 or above the sum of the others",
        remedy
    )]
    Impossible { link: String, remedy: &'static str },
    /// The user's URDF or MJCF is of another robot, its frames are others, or it has parts that are not read.
    #[explain("{file}: {problem}", remedy)]
    OtherSource {
        file: String,
        problem: String,
        remedy: String,
    },
    /// The file that was to be written is another robot than the model.
    #[explain(
        "{file}, read back, is another robot than the model: {problem}",
        "export with --c or --rust, and report it with the files"
    )]
    ReadBack { file: String, problem: String },
    /// The side file could not be written as text.
    #[explain(_0.explanation())]
    Config(#[from] ConfigError),
    /// A list of what is left out could not be written as text.
    #[explain("what is left out cannot be written: {_0}")]
    Side(#[from] toml::ser::Error),
}
