//! Motions simulated from the torques of logs.

use super::hold_out::read_pieces;
use crate::input::control::Control;
use crate::input::error::IdentifyError;
use crate::input::in_memory::read_each;
use crate::input::log_data::LogData;
use crate::input::position_cutoff::known;
use crate::input::robot_setup::RobotSetup;
use crate::note::{ModelNote, StageNote};
use crate::open_loop::{self, FreeRun, OpenLoop, RunSpan, WindowLength, along};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::{FilterSettings, Stretch};
use cft_ident_logs::log::Provenance;

/// Length of the windows of robots that have more than one axis \[s\].
const WINDOW_S: f64 = 0.25;

/// Simulates the motion of logs from their torques, in windows that begin at measured states.
pub(crate) fn open_loop(
    setup: &RobotSetup,
    refined: &AugmentedModel,
    logs: &[LogData],
    window: Option<f64>,
    control: &Control,
) -> Result<OpenLoop, IdentifyError> {
    let setup = &setup.with_position_cutoffs(logs, &known(&refined.model), control)?;
    let settings = FilterSettings {
        q_trim_s: Some(0.0),
        trim_s: Some(0.0),
        ..setup.settings()
    };
    let whole = read_each(setup, &vec![settings; logs.len()], logs, control)?;
    setup.check_temperatures(refined, logs, &whole.stretches)?;
    let length = match window {
        Some(s) => WindowLength::Seconds(s),
        None if setup.robot.joints() == 1 => WindowLength::Whole,
        None => WindowLength::Seconds(WINDOW_S),
    };
    let _work = control.begin("open loop", None);
    Ok(along(refined, &whole.stretches, length))
}

/// The free run of a model on logs that were read as `inputs`, where units and length allow one.
pub(crate) fn free_run(
    setup: &RobotSetup,
    refined: &AugmentedModel,
    (logs, inputs): (&[LogData], &[Provenance]),
    control: &Control,
) -> Result<Option<FreeRun>, IdentifyError> {
    if !is_in_si(setup) {
        return Ok(None);
    }
    let setup = &setup.with_position_cutoffs(logs, &known(&refined.model), control)?;
    let settings = FilterSettings {
        trim_s: Some(0.0),
        ..setup.settings()
    };
    let stretches = read_pieces(setup, &settings, refined, (logs, inputs), control)?;
    let _work = control.begin("free run", None);
    let spans = whole(&stretches);
    Ok(open_loop::free_run(refined, None, &stretches, &spans))
}

/// Whether every torque is in N or N m: of several joints in other units no motion follows.
pub(crate) fn is_in_si(setup: &RobotSetup) -> bool {
    let robot = &setup.robot;
    let unit = |j: usize| setup.file.torque_unit(j) == robot.joint_kind(j).torque_unit();
    setup.file.without_gains().is_empty() && (0..robot.joints()).all(unit)
}

/// Every stretch from its begin to its end.
pub(crate) fn whole(stretches: &[Stretch]) -> Vec<RunSpan> {
    let each = stretches.iter().enumerate();
    each.map(|(s, stretch)| (s, 0, stretch.len())).collect()
}

/// What a free run says against the model after.
pub(crate) fn spoiled(found: &FreeRun) -> Option<StageNote> {
    let worse = found.worse().filter_map(|joint| {
        let after = joint.after.as_ref()?;
        let rms = [joint.given.rms, after.rms];
        Some((joint.joint.clone(), rms, joint.unit))
    });
    let joints: Vec<_> = worse.collect();
    (!joints.is_empty()).then_some(StageNote::Model(ModelNote::FreeRunWorse {
        window_s: found.window_s,
        joints,
    }))
}
