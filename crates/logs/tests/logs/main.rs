//! Tests of logs as they are read.

mod log_bad_input;
#[cfg(feature = "parquet")]
mod log_datasets;
mod log_drawn;
mod log_fixtures;
mod log_formats;
mod log_messages;
mod log_recordings;
mod log_shared_data;
mod log_support;
mod log_tables;
