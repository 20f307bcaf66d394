//! Files of the user: robot, model, trajectory and campaign (TOML).

pub mod campaign;
mod document;
mod error;
pub mod model_file;
pub mod robot_file;
pub mod trajectory;

pub use campaign::Campaign;
pub use error::ConfigError;
pub use model_file::ModelFile;
pub use robot_file::RobotFile;
pub use trajectory::Trajectory;
