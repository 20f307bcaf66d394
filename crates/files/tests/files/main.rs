//! Tests of robot, model and trajectory files.

mod config_files;
mod config_model;
mod serial_chain;
mod urdf_bad_input;
