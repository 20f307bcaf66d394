//! A whole URDF that a model is written into: more joints than a model can have are no matter there.

use super::{AngleConvention, ChainRequest, UrdfChain};
use crate::config::ConfigError;
use crate::config::serial_chain::{ChainMisfit, placed_links};
use crate::config::serial_section::{FrameSection, InertialSection};
use cft_ident_core::robot::tree::Link;

/// What moves in a URDF, from the base outward.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeUrdf {
    /// Angles as they are meant.
    pub links: Vec<Link>,
    /// The same with their angles as the file writes them, which readers take.
    pub as_written: Vec<Link>,
    /// Names of the independent joints.
    pub joints: Vec<String>,
    /// By link.
    pub inertials: Vec<Option<InertialSection>>,
    /// Links that fixed joints hang on them.
    pub frames: Vec<FrameSection>,
}

impl WholeUrdf {
    /// Reads a URDF from text; `file` names it in errors.
    ///
    /// # Errors
    /// Those of [`UrdfChain::parse`].
    pub fn parse(file: &str, text: &str) -> Result<Self, ConfigError> {
        let read = |angles| {
            let asked = ChainRequest {
                angles,
                ..ChainRequest::default()
            };
            let chain = UrdfChain::parse_with(file, text, &asked)?;
            let placed = placed_links(&chain.links).map_err(|misfit| unplaced(file, misfit))?;
            Ok::<_, ConfigError>((chain, placed))
        };
        let (chain, (links, names)) = read(AngleConvention::Meant)?;
        let (_, (as_written, _)) = read(AngleConvention::Written)?;
        Ok(Self {
            links,
            as_written,
            joints: names.joints,
            inertials: chain.links.into_iter().map(|link| link.inertial).collect(),
            frames: chain.frames,
        })
    }
}

fn unplaced(file: &str, misfit: ChainMisfit) -> ConfigError {
    ConfigError::Value {
        file: file.to_owned(),
        line: 1,
        key: "robot".to_owned(),
        problem: misfit.problem,
        remedy: misfit.remedy,
    }
}
