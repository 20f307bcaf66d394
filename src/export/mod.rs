//! Identified models for other programs: a C header, a Rust module, a URDF.
//!
//! | file | what |
//! |---|---|
//! | [`program`] | a model as a chain of links with numbers |
//! | `code` | tables and statements that C and Rust have in common |
//! | [`header`] | the C99 header |
//! | [`module`] | the Rust module |
//! | [`standard`] | standard parameters of links from base parameters |
//! | [`dissipative`] | friction and drive inertias below zero |
//! | `single` | a single joint as a chain of one link |
//! | [`urdf`] | the URDF, and what it cannot hold beside it |

mod code;
pub mod dissipative;
pub mod header;
pub mod module;
pub mod note;
pub mod program;
mod single;
pub mod standard;
pub mod urdf;

pub use note::Note;
pub use program::Program;

use crate::config::ConfigError;

/// Why a model cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A URDF has no word for this.
    #[error("a URDF cannot hold {what}; {remedy}")]
    NotInUrdf { what: String, remedy: &'static str },
    /// The mass of a link comes out as 0 while its first moment does not.
    #[error(
        "link `{link}` has the mass {mass:e} kg by this model but the first moment {moment:.3e} kg m, \
         which no centre of gravity gives; give it a prior mass in [[robot.link]] `inertial`, or \
         export with --c or --rust"
    )]
    NoMass {
        link: String,
        mass: f64,
        moment: f64,
    },
    /// The side file could not be written as text.
    #[error(transparent)]
    Config(#[from] ConfigError),
}
