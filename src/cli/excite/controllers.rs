//! A motion as a controller takes it: a program in URScript.

use std::path::Path;

use super::{ExciteRun, samples};
use crate::cli::CliError;
use cft_ident_core::number;
use cft_ident_core::robot::JointKind;
use cft_ident_logs::log::{escape, escape_whole};
use cft_ident_logs::output::JointTrajectory;
use cft_ident_plant::excite::{ExciteError, Motion, MotionJudgement};

/// Most lines of a program: controllers hold them in memory.
const MOST_POINTS: f64 = 1e6;

/// Joints of an arm that speaks URScript.
const OF_UR: usize = 6;

/// Writes the program that is asked for.
pub(super) fn write(
    bench: &ExciteRun,
    motion: &Motion,
    judged: &MotionJudgement,
    path: &Path,
) -> Result<(), CliError> {
    let robot = &bench.machine.model.robot;
    let turns = (0..robot.joints()).all(|j| robot.joint_kind(j) == JointKind::Revolute);
    if robot.joints() != OF_UR || !turns {
        let joints = escape(&robot.joint_names().join(", "));
        let text = format!("--urscript is for arms of {OF_UR} joints that turn");
        return Err(CliError::usage(text)
            .hint(format!("this robot has the joints {joints}"))
            .hint("--samples writes the motion of any robot"));
    }
    let trajectory = sampled(bench, motion, judged)?;
    bench.context.write_text(path, &trajectory.urscript())
}

/// The motion at the rate of the run.
fn sampled(
    bench: &ExciteRun,
    motion: &Motion,
    judged: &MotionJudgement,
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
        points.push(state.q[..n].to_vec());
    }
    Ok(JointTrajectory {
        notes: notes(bench, judged),
        rate_hz: bench.rate_hz,
        points,
    })
}

/// What is to be known before the robot moves; what nobody has checked comes first.
fn notes(bench: &ExciteRun, judged: &MotionJudgement) -> Vec<String> {
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
