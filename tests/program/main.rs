//! Tests of the program and the stages from outside.

mod altered_log;
mod bad_input;
mod by_motion;
mod candidates;
mod cli_excite;
mod cli_new;
mod cli_simulate;
mod cli_status;
mod cli_terminal;
mod compare;
mod conformance;
mod controllers;
mod currents_arm;
mod cut_out;
mod deviations;
mod diagnose;
mod diagnose_cft;
mod diagnose_measured;
mod docs;
mod drive;
mod example;
mod excite_places;
mod excite_robots;
mod excite_support;
mod export;
mod export_effects;
mod export_observer;
mod export_support;
mod few_blocks;
mod friction_prior;
mod from_log_to_use;
mod gains;
mod held_poses;
#[allow(
    dead_code,
    reason = "a folder with a good log is all that is wanted of it"
)]
#[path = "../hostile/bench.rs"]
mod hostile_bench;
mod house;
mod house_plan;
mod identify;
mod inspect_faults;
mod inspect_shared_data;
mod interrupted;
mod log_folder;
#[path = "../../crates/logs/tests/logs/log_support/mod.rs"]
mod log_support;
mod log_writing;
mod lsq_estimators;
mod measured;
mod measured_arms;
mod measured_support;
mod mesh_capsules;
mod mixed_rates;
mod new_any_log;
mod one_joint_logs;
mod options;
mod pipeline;
mod printed_is_written;
mod reduced;
mod report;
mod rests;
#[path = "../../crates/core/tests/core/robot_oracle/mod.rs"]
mod robot_oracle;
mod row_faults;
mod schema;
mod schema_support;
mod serial_arm;
mod serial_cft;
mod serial_logs;
mod serial_urdf;
mod setup;
mod simulate_serial;
mod temperature;
mod tests_in_one_file;
mod tool_conventions;
mod track;
mod two_arms;
mod watch;
mod within_a_log;
mod writers_readers;
mod written_angles;
