//! Identified models for other programs: a C header, a Rust module, a URDF, files of simulators.
//!
//! | file | what |
//! |---|---|
//! | [`program`] | a model as a chain of links with numbers |
//! | `code` | tables and statements that C and Rust have in common |
//! | `functions` | small functions that the statements call |
//! | [`header`] | the C99 header |
//! | [`module`] | the Rust module |
//! | [`recipe`] | an observer of external torques as numbers |
//! | `observer` | the same in C and Rust |
//! | `standard` | standard parameters of links from base parameters |
//! | [`dissipative`] | friction and drive inertias below zero |
//! | `single` | a single joint as a chain of one link |
//! | `prepared` | a model as links with inertials |
//! | `turned` | a base turned so that gravity is along -z |
//! | [`arm`] | the same as simulators take it: armature, damping, friction |
//! | [`left_out`] | what a format cannot say, and how much of the torque that is |
//! | [`mjcf`] [`sdf`] [`usd`] | MuJoCo, Gazebo, Isaac Sim |
//! | [`ros2_control`] | gains of ros2_control by the inertia of each joint |
//! | [`urdf`] | the URDF, and what it cannot hold beside it |
//! | [`source_text`] `source_link` `text_edits` | a file of the user's, its links, changes of its text |
//! | [`urdf_source`] [`mjcf_source`] | the user's own URDF or MJCF with what was identified |
//! | [`checked`] | a file that is read back gives the torques of the model |

pub mod arm;
pub mod checked;
mod code;
pub mod dissipative;
mod error;
mod functions;
pub mod header;
pub mod left_out;
pub mod mjcf;
pub mod mjcf_source;
pub mod module;
pub mod note;
mod observer;
mod prepared;
pub mod program;
pub mod recipe;
pub mod ros2_control;
pub mod sdf;
mod single;
pub mod source_link;
pub mod source_text;
mod standard;
mod text_edits;
mod turned;
pub mod urdf;
pub mod urdf_source;
pub mod usd;

pub use error::ExportError;
pub use note::Note;
pub use program::Program;
