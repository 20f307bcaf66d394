//! Motions simulated from the torques of logs.

use super::control::Control;
use super::error::IdentifyError;
use super::in_memory::read_each;
use super::log::Log;
use super::logged_robot::LoggedRobot;
use super::position_cutoff::known;
use crate::open_loop::{OpenLoop, WindowLength, along};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::FilterSettings;

/// Length of the windows of robots that have more than one axis \[s\].
const WINDOW_S: f64 = 0.25;

/// Simulates the motion of logs from their torques, in windows that begin at measured states; without a length
/// single axes run from the begin of each stretch to its end, and other robots in windows of 0.25 s.
///
/// # Errors
/// Logs that cannot be used.
pub fn open_loop(
    machine: &LoggedRobot,
    refined: &AugmentedModel,
    logs: &[Log],
    window: Option<f64>,
    control: &Control,
) -> Result<OpenLoop, IdentifyError> {
    let machine = &machine.with_position_cutoffs(logs, &known(&refined.model), control)?;
    let settings = FilterSettings {
        q_trim_s: Some(0.0),
        trim_s: Some(0.0),
        ..machine.settings()
    };
    let whole = read_each(machine, &vec![settings; logs.len()], logs, control)?;
    machine.check_temperatures(refined, logs, &whole.stretches)?;
    let length = match window {
        Some(s) => WindowLength::Seconds(s),
        None if machine.robot.joints() == 1 => WindowLength::Whole,
        None => WindowLength::Seconds(WINDOW_S),
    };
    let _work = control.begin("open loop", None);
    Ok(along(refined, &whole.stretches, length))
}
