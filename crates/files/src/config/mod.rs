//! Files of the user: robot, model, trajectory and campaign (TOML).
//!
//! Every file is read strictly: a key that is not known is an error that names the line and the
//! nearest known key. Files that come with the tool are found under `configs/` anywhere.

mod angles;
pub mod campaign;
pub mod candidates;
mod channels;
mod check;
mod check_limits;
mod check_log;
mod contents;
pub mod correction;
mod document;
mod embedded;
mod error;
pub mod held_out;
pub mod identified;
pub mod limits;
mod mjcf;
pub mod model_file;
mod model_text;
pub mod robot_file;
pub mod schema;
mod serial_chain;
pub mod serial_section;
mod text_file;
pub mod trajectory;
mod urdf;

pub use campaign::CampaignFile;
pub use cft_ident_logs::log::did_you_mean;
pub use embedded::{EMBEDDED, WantedFile, embedded, text, text_of_kind};
pub use error::ConfigError;
pub use mjcf::{MjcfText, mjcf_text};
pub use model_file::ModelFile;
pub use robot_file::RobotFile;
pub use trajectory::Trajectory;
pub use urdf::beside::DRIVE_INERTIA;
pub use urdf::capsules::DeclaredCapsules;
pub use urdf::mesh::vertices as vertices_of_mesh;
pub use urdf::source::{UrdfEdits as UrdfReplacement, WEIGHTLESS, replaced as replaced_in_urdf};
pub use urdf::{ChainRequest, NO_LIMIT, UrdfChain, WholeUrdf, xml};
