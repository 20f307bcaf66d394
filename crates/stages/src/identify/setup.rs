//! The check of a set-up before a fit: does the robot file say of signs, order, scales, zeros and gravity
//! what the torques of the logs say?

use crate::setup::{Channels, Drive, Problem, Sample, Searched, SetupReport, Thinner, search};
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::motion;
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::friction::sign;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{DeclaredChannels as Logged, Layout};

use super::control::Control;
use super::error::IdentifyError;
use super::gains;
use super::known_friction::FrictionBefore;
use super::log::Log;
use super::logged_robot::LoggedRobot;
use super::setup_words;
use super::unknowns::columns;
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::correction::Edit;

/// What the check found, and the robot file that is right by it.
#[derive(Debug, Clone, Default)]
pub struct CheckedSetup {
    pub report: SetupReport,
    /// The robot file with all that is sure put right; none where nothing is.
    pub corrected: Option<RobotFile>,
    /// What differs in it.
    pub edits: Vec<Edit>,
}

/// Checks the set-up by logs of several joints or of one. `friction` is a model with the friction of every
/// joint and its name, where there is one. Reduced logs are passed over: they hold no rows to look at, and were
/// checked when they were made.
///
/// # Errors
/// Logs that cannot be read or are refused, and interruption.
pub fn check_setup(
    machine: &LoggedRobot,
    logs: &[Log],
    friction: Option<(&str, &ModelFile)>,
    control: &Control,
) -> Result<CheckedSetup, IdentifyError> {
    let findings = gains::findings(machine);
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
    let sampled = sampled(machine, logs, friction, control)?;
    let in_gravity = |gravity: [f64; 3]| -> Option<Robot> {
        let mut file = machine.file.clone();
        file.robot.gravity = Some(gravity);
        Some(file.robot())
    };
    let problem = Problem::new(
        &machine.robot,
        machine
            .file
            .declares_gravity()
            .then_some(&in_gravity as &(dyn Fn([f64; 3]) -> Option<Robot> + Sync)),
        sampled.channels,
        &sampled.columns,
        sampled.sample,
    );
    let searched = search(&problem, &|| control.stopped());
    control.check()?;
    Ok(told(machine, logs, &problem, &searched))
}

/// What a search of the set-up looks at.
struct SampledLogs {
    channels: Channels,
    /// Friction terms of each joint, fitted or known.
    columns: RegressorColumns,
    sample: Sample,
}

/// A bounded number of rows of logs, as the robot file declares them.
///
/// # Errors
/// Logs that cannot be read or are refused, and interruption.
fn sampled(
    machine: &LoggedRobot,
    logs: &[Log],
    friction: Option<(&str, &ModelFile)>,
    control: &Control,
) -> Result<SampledLogs, IdentifyError> {
    let n = machine.robot.joints();
    let settings = machine.settings();
    let _work = control.begin("checking the set-up", None);
    let held = (EstimatorKind::Ols, true);
    let known = friction.map(|given| FrictionBefore::of(machine, given, logs, held, control));
    let known = known.transpose()?;
    let known = known.as_ref().map(|before| before.known.as_slice());
    let mut thinner = Thinner::new(n, settings.cutoff_hz);
    let mut channels: Option<Channels> = None;
    let whole = logs.iter().filter(|log| log.reduced().is_none());
    for (index, log) in whole.enumerate() {
        let mut open = machine.open(log, control)?;
        let of_log = channels_of(machine, log, open.layout());
        let drive = of_log.drive.clone();
        if drive == Drive::Motors {
            // positions that belong to no pose are what is looked for
            open = machine.open_channels(log, control)?;
        }
        channels.get_or_insert(of_log);
        // at a reversal the law's mean is not the law at the mean speed
        let laws = known.filter(|_| drive == Drive::Joints);
        let (mut last, mut step) = (None, 0.0);
        let run = motion::run(
            &mut |block| open.read(block),
            n,
            &settings,
            None,
            if laws.is_some() { 6 * n } else { 5 * n },
            &|s, out| {
                for (out, x) in out.chunks_exact_mut(n).zip([s.q, s.v, s.a, s.v, s.tau]) {
                    out.copy_from_slice(x);
                }
                for x in &mut out[3 * n..4 * n] {
                    *x = sign(*x);
                }
                let friction = laws.into_iter().flatten().zip(s.v);
                for (out, (known, v)) in out[5 * n..].iter_mut().zip(friction) {
                    *out = known.law.torque(*v);
                }
            },
            &mut |row| {
                if let Some((segment, t)) = last
                    && segment == row.segment
                {
                    step = row.t - t;
                }
                last = Some((row.segment, row.t));
                thinner.add((index, row.segment), row.t, step, row.filtered);
            },
        );
        let run = run.map_err(|error| IdentifyError::of_run(&log.name(), error))?;
        thinner.logged_every(run.dt);
    }
    Ok(SampledLogs {
        channels: channels.ok_or(IdentifyError::NoLog)?,
        columns: columns(machine, known),
        sample: thinner.finish(),
    })
}

fn told(
    machine: &LoggedRobot,
    logs: &[Log],
    problem: &Problem,
    searched: &Searched,
) -> CheckedSetup {
    let report = setup_words::report(machine, logs, problem, searched);
    let motors = problem.channels.drive == Drive::Motors;
    let edits = match report.refusals().next() {
        Some(_) => setup_words::edits(&machine.file, &searched.correction, motors),
        None => Vec::new(),
    };
    let corrected = (!edits.is_empty())
        .then(|| setup_words::corrected(&machine.file, &searched.correction, motors));
    CheckedSetup {
        report,
        corrected,
        edits,
    }
}

/// The channels of a log as the robot file declares them.
fn channels_of(machine: &LoggedRobot, log: &Log, layout: &Layout) -> Channels {
    let n = machine.robot.joints();
    if matches!(log, Log::Arrays(_)) {
        return Channels::of_joints(n);
    }
    let gears = machine.file.gear_matrix();
    let gears = gears.and_then(|r| Some((r.clone().try_inverse()?, r)));
    let drive = match (layout.channels, gears) {
        (Logged::Actuator, _) => Drive::Motors,
        (Logged::Joint, Some((inverse, r))) => Drive::Gears(r, inverse),
        (Logged::Joint, None) => Drive::Joints,
    };
    let joint = |name: &String| machine.file.log.joint.get(name);
    let offsets = match drive {
        // behind gears they belong to the joints
        Drive::Gears(..) => machine
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
