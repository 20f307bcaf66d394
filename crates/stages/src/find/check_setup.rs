//! The check of a set-up before a fit: does the robot file say of signs, order, scales, zeros and gravity
//! what the torques of the logs say?

use crate::setup::{
    Channels, Drive, KnownBeforehand, Problem, Sample, Searched, SetupReport, Thinner, search,
};
use cft_ident_core::motion::{self, FilterSettings};
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::friction::sign;
use cft_ident_logs::log::{DeclaredChannels as Logged, Layout};

use super::setup_words;
use crate::fit::computed_torque::unused_commands;
use crate::fit::gains;
use crate::input::control::Control;
use crate::input::dataset::Dataset;
use crate::input::error::IdentifyError;
use crate::input::log::Log;
use crate::input::log_data::LogData;
use crate::input::robot_setup::RobotSetup;
use crate::input::setup_file::ChannelTables;
use crate::input::unknowns::columns;
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::correction::KeyEdit;

/// What the check found, and the robot file that is right by it.
#[derive(Debug, Clone, Default)]
pub struct CheckedSetup {
    pub report: SetupReport,
    /// The robot file with all that is sure put right; none where nothing is.
    pub corrected: Option<RobotFile>,
    /// What differs in it.
    pub edits: Vec<KeyEdit>,
    /// The data of the robot as it is declared, with the torques that its drives do not exceed; none where there are none.
    pub limited: Option<Dataset>,
}

/// [`check_setup`] where the logs can be checked; of others the stage that reads them says why they cannot.
///
/// # Errors
/// [`IdentifyError::Interrupted`] alone.
pub fn check_setup_where_possible(
    data: &Dataset,
    control: &Control,
) -> Result<CheckedSetup, IdentifyError> {
    match check_setup(data, control) {
        Err(IdentifyError::Interrupted) => Err(IdentifyError::Interrupted),
        found => Ok(found.unwrap_or_default()),
    }
}

/// Checks the set-up by logs of several joints or of one; friction is fitted with it, whatever is known of it. Reduced
/// logs are passed over: they hold no rows to look at, and were checked when they were made.
pub fn check_setup(data: &Dataset, control: &Control) -> Result<CheckedSetup, IdentifyError> {
    let (setup, logs) = (&data.setup, data.logs.as_slice());
    if setup.as_declared {
        return Ok(CheckedSetup::default());
    }
    let findings = gains::findings(setup);
    if !findings.is_empty() {
        // gains that differ look like signs, scales and loads
        return Ok(CheckedSetup {
            report: SetupReport {
                findings,
                ..SetupReport::default()
            },
            ..CheckedSetup::default()
        });
    }
    if !unused_commands(setup, logs).is_empty() {
        // a law that lacks terms looks like signs, scales and gravity
        return Ok(CheckedSetup::default());
    }
    let (channels, sample) = sampled(setup, logs, control)?;
    let in_gravity = |gravity: [f64; 3]| -> Option<Robot> {
        let mut file = setup.file.clone();
        file.robot.gravity = Some(gravity);
        Some(file.robot())
    };
    let columns = columns(setup, None);
    let problem = Problem::new(
        &setup.robot,
        (setup.file.declares_gravity())
            .then_some(&in_gravity as &(dyn Fn([f64; 3]) -> Option<Robot> + Sync)),
        (channels, &columns),
        sample,
        known(setup),
    );
    let searched = search(&problem, &|| control.stopped());
    control.check()?;
    let mut found = checked(data, &problem, &searched, control)?;
    // a limit that leaves too little to fit is not taken
    if let Some(limited) = &found.limited
        && sampled(&limited.setup, &limited.logs, control).is_err()
    {
        control.check()?;
        found.limited = None;
        found.report.torque_limits.clear();
    }
    Ok(found)
}

/// What the robot file knows beside its channels.
fn known(setup: &RobotSetup) -> KnownBeforehand {
    let file = &setup.file;
    let links = file.robot.link.iter();
    let bodies: Vec<Option<[f64; 10]>> = links
        .map(|link| Some(link.inertial.as_ref()?.body().standard()))
        .collect();
    let weighs = bodies.iter().any(Option::is_some);
    let scales = |name: &String| {
        let of = file.log.joint.get(name);
        of.map_or([None; 2], |c| [c.position_scale, c.torque_scale])
    };
    let names = setup.robot.joint_names();
    let gears = file.log.gears.iter().flatten().copied();
    let written = names.iter().flat_map(scales).flatten().chain(gears);
    let either = |x: f64| [x.abs(), x.abs().recip()];
    KnownBeforehand {
        torque: (names.iter())
            .map(|name| file.limits.of.get(name).and_then(|limits| limits.torque))
            .collect(),
        position: (names.iter())
            .map(|name| file.limits.of.get(name).and_then(|limits| limits.position))
            .collect(),
        ratios: (written.flat_map(either))
            .filter(|x| x.is_finite() && *x > 1.0)
            .collect(),
        inertial: weighs.then(|| {
            let mut standard = vec![0.0; setup.robot.standard_parameters()];
            let of = (bodies.iter()).flat_map(|body| body.unwrap_or_default());
            standard.iter_mut().zip(of).for_each(|(to, x)| *to = x);
            setup.robot.base_of(&standard)
        }),
    }
}

/// A bounded number of rows of logs, as the robot file declares them.
fn sampled(
    setup: &RobotSetup,
    logs: &[LogData],
    control: &Control,
) -> Result<(Channels, Sample), IdentifyError> {
    let n = setup.robot.joints();
    let settings = FilterSettings {
        // signs of the speed are off by half a sample at most, which is no matter here
        thin: true,
        ..setup.settings()
    };
    let _work = control.begin("checking the set-up", None);
    let mut thinner = Thinner::new(n);
    let mut channels: Option<Channels> = None;
    for (index, log) in logs.iter().enumerate() {
        let mut blocks = log.blocks(control)?;
        let of_log = channels_of(setup, log, blocks.reader().layout());
        if of_log.drive == Drive::Motors {
            // positions that belong to no pose are what is looked for
            blocks = log.logged_blocks(control)?;
        }
        channels.get_or_insert(of_log);
        let run = motion::run(
            &mut |block| blocks.read(block),
            n,
            &settings,
            None,
            5 * n,
            &|s, out| {
                for (out, x) in out.chunks_exact_mut(n).zip([s.q, s.v, s.a, s.v, s.tau]) {
                    out.copy_from_slice(x);
                }
                for x in &mut out[3 * n..4 * n] {
                    *x = sign(*x);
                }
            },
            &mut |row| thinner.add(index, row.t, row.filtered),
        );
        run.map_err(|error| log.to_stage_error(&blocks, error))?;
    }
    Ok((channels.ok_or(IdentifyError::NoLog)?, thinner.finish()))
}

fn checked(
    data: &Dataset,
    problem: &Problem,
    searched: &Searched,
    control: &Control,
) -> Result<CheckedSetup, IdentifyError> {
    let setup = &data.setup;
    let declared = ChannelTables::new(&setup.file, problem.channels.drive == Drive::Motors);
    let edits = searched.correction.as_ref().map(|by| declared.edits(by));
    let edits = edits.unwrap_or_default();
    // what no line mends is refused and not put right
    let by = searched
        .correction
        .as_ref()
        .filter(|by| by.begins.iter().all(Option::is_none));
    let report = setup_words::report(setup, problem, searched);
    let limited = (!report.torque_limits.is_empty()).then(|| {
        let mut file = setup.file.clone();
        for of in &report.torque_limits {
            let own = file.log.joint.entry(of.joint.clone()).or_default();
            own.torque_limit = Some(of.limit);
        }
        data.of_robot(RobotSetup::new(&setup.name, file), control)
    });
    Ok(CheckedSetup {
        limited: limited.transpose()?,
        report,
        corrected: by.map(|by| declared.corrected(&edits, by)),
        edits,
    })
}

/// The channels of a log as the robot file declares them.
fn channels_of(setup: &RobotSetup, log: &LogData, layout: &Layout) -> Channels {
    let n = setup.robot.joints();
    if matches!(log.source, Log::Arrays(_)) {
        return Channels::of_joints(n);
    }
    let gears = setup.file.gear_matrix();
    let gears = gears.and_then(|r| Some((r.clone().try_inverse()?, r)));
    let drive = match (layout.channels, gears) {
        (Logged::Actuator, _) => Drive::Motors,
        (Logged::Joint, Some((inverse, r))) => Drive::Gears(r, inverse),
        (Logged::Joint, None) => Drive::Joints,
    };
    let joint = |name: &String| setup.file.log.joint.get(name);
    let offsets = match drive {
        // behind gears they belong to the joints
        Drive::Gears(..) => setup
            .robot
            .joint_names()
            .iter()
            .map(|name| joint(name).and_then(|c| c.position_offset).unwrap_or(0.0))
            .collect(),
        _ => layout.positions.iter().map(|c| c.offset).collect(),
    };
    Channels {
        drive,
        position_gain: layout.positions.iter().map(|c| c.factor).collect(),
        position_offset: offsets,
        torque_gain: layout.torques.iter().map(|c| c.factor).collect(),
    }
}
