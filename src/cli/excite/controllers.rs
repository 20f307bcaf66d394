//! A motion as controllers take it: messages of ROS 2 and programs in URScript.

use std::path::Path;

use super::{Bench, Names, samples};
use crate::cli::CliError;
use crate::cli::controller::name_in_controller;
use cft_ident_core::number;
use cft_ident_core::robot::JointKind;
use cft_ident_logs::log::{escape, escape_whole};
use cft_ident_logs::output::JointTrajectory;
use cft_ident_plant::excite::{ExciteError, Judgement, Motion};

/// Most points of a message or lines of a program: controllers hold them in memory.
const MOST_POINTS: f64 = 1e6;

/// Joints of an arm that speaks URScript.
const OF_UR: usize = 6;

/// Writes the files for controllers that are asked for; their paths.
pub(super) fn write<'a>(
    bench: &Bench,
    motion: &Motion,
    judged: &Judgement,
    names: &'a Names,
) -> Result<Vec<&'a Path>, CliError> {
    let mut written = Vec::new();
    if names.message.is_none() && names.urscript.is_none() {
        return Ok(written);
    }
    let trajectory = sampled(bench, motion, judged)?;
    if let Some(path) = &names.message {
        let end = path.extension();
        if end.is_some_and(|end| end.eq_ignore_ascii_case("mcap")) {
            let failed = |error| CliError::input(format!("{}: {error}", path.display()));
            let bytes = trajectory.mcap().map_err(failed)?;
            bench.context.files.write(path, &bytes)?;
        } else {
            bench.context.write_text(path, &trajectory.yaml())?;
        }
        written.push(path.as_path());
    }
    if let Some(path) = &names.urscript {
        let robot = &bench.machine.model.robot;
        let turns = (0..robot.joints()).all(|j| robot.joint_kind(j) == JointKind::Revolute);
        if robot.joints() != OF_UR || !turns {
            let joints = escape(&robot.joint_names().join(", "));
            let text = format!("--urscript is for arms of {OF_UR} joints that turn");
            return Err(CliError::usage(text)
                .hint(format!("this robot has the joints {joints}"))
                .hint("--samples and --trajectory-message write the motion of any robot"));
        }
        bench.context.write_text(path, &trajectory.urscript())?;
        written.push(path.as_path());
    }
    Ok(written)
}

/// The motion at the rate of the run, its joints named as their controller names them.
fn sampled(
    bench: &Bench,
    motion: &Motion,
    judged: &Judgement,
) -> Result<JointTrajectory, CliError> {
    let machine = &bench.machine;
    let n = machine.coordinates();
    let rows = samples::rows(bench, motion, MOST_POINTS)?;
    let mut points = Vec::with_capacity(rows);
    for k in 0..rows {
        if k % 4096 == 0 {
            bench.context.check()?;
        }
        let at = motion.at(k as f64 / bench.rate_hz);
        let state = machine.joints(&at).map_err(ExciteError::Robot)?;
        points.push([state.q, state.v, state.a].map(|x| x[..n].to_vec()));
    }
    let named = machine.model.robot.joint_names().iter();
    let named = named.map(|joint| {
        name_in_controller(&bench.file, joint)
            .unwrap_or(joint)
            .clone()
    });
    Ok(JointTrajectory {
        names: named.collect(),
        notes: notes(bench, judged),
        rate_hz: bench.rate_hz,
        points,
    })
}

/// What is to be known before the robot moves; what nobody has checked comes first.
fn notes(bench: &Bench, judged: &Judgement) -> Vec<String> {
    let [first, second] = judged.first_words();
    vec![
        escape_whole(first),
        escape_whole(second),
        match &judged.broken()[..] {
            [] => format!(
                "Checked: the limits of {}{} along the whole motion{}. {} s at {} Hz, by cft-ident {}.",
                escape(&bench.robot),
                match judged.torques_foreseen {
                    true => "",
                    false => ", but for torques,",
                },
                match judged.way {
                    Some(_) => " and on the straight way from the given pose",
                    None => "",
                },
                number::significant(judged.seconds, 4),
                number::significant(bench.rate_hz, 4),
                env!("CARGO_PKG_VERSION")
            ),
            broken => format!("BREAKS LIMITS: {}.", escape_whole(&broken.join("; "))),
        },
        "Bring the robot to the first point slowly, and run the motion at a tenth of its speed first."
            .to_owned(),
    ]
}
