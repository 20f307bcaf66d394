//! A link as a URDF has it.

use super::UrdfPlace;
use super::shapes::LinkShape;
use crate::config::ConfigError;
use cft_ident_core::robot::tree::space::{Rotation, Vector};
use cft_ident_logs::log::escape;

/// A mass with its centre and inertia, in the frame of the link that carries it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Body {
    /// \[kg\]
    pub mass: f64,
    /// \[m\]
    pub centre: Vector,
    /// About the centre, along the link's axes [kg m^2].
    pub inertia: Rotation,
}

#[derive(Debug)]
pub(super) struct Link {
    pub name: String,
    pub line: usize,
    pub body: Option<Body>,
    pub shapes: Vec<Option<LinkShape>>,
}

impl Link {
    pub(super) fn wrong(&self, place: &UrdfPlace, problem: &str, remedy: &str) -> ConfigError {
        let what = format!("link {}", escape(&self.name));
        place.wrong(self.line, &what, problem, remedy)
    }
}
