//! Tests of physics, motion and estimators.

mod data_principles;
mod diagnosis_bench;
mod diagnosis_formulas;
mod diagnosis_joints;
mod diagnosis_principles;
mod effect_bench;
mod effect_code;
mod effect_principles;
mod filter_principles;
mod fit_principles;
mod gains_principles;
mod inertia_principles;
mod judge_principles;
mod motion_accuracy;
mod motion_measured;
mod motion_time_base;
mod motion_windows;
mod robot_actuation;
mod robot_excitation;
mod robot_kinematics;
mod robot_lagrange;
mod robot_oracle;
mod robot_principles;
mod robot_properties;
mod robot_reference;
mod validate_principles;
