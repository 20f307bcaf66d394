//! Noise levels, and what is used together with a design: logs and other trajectories.

use cft_ident_core::explain::Explain;
use std::path::Path;

use super::ExciteRun;
use crate::cli::error::CliError;
use crate::cli::files;
use cft_ident_core::inertia::accumulate;
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{LogError, LogSpec};
use cft_ident_plant::excite::machine::{ForeseenRobot, NoiseSource};
use cft_ident_plant::excite::{GivenInformation, Motion, foresee};
use cft_ident_stages::identify::{IdentifyError, Log, LogData, RobotSetup};

/// Share of a joint's usual torque that its noise is taken for, where the robot file does not say.
const NOISE_SHARE: f64 = 0.01;

/// Noise of every joint: `[noise]` of the robot file, or a share of the usual torque, or 1 where no torque is foreseen.
pub(super) fn noise(file: &RobotFile, usual: &[f64], machine: &mut ForeseenRobot) {
    let known = machine.source.known();
    machine.noise_source = match known {
        true => NoiseSource::RobotFile,
        false => NoiseSource::One,
    };
    let names = machine.model.robot.joint_names();
    for ((noise, name), usual) in machine.noise.iter_mut().zip(names).zip(usual) {
        let given = file.noise.joint.get(name).and_then(|n| n.torque_std);
        if given.is_none() && known {
            machine.noise_source = NoiseSource::Share;
        }
        // a share of nothing is no noise: deviations are then for a noise of 1
        let share = match known {
            true => NOISE_SHARE * usual,
            false => 1.0,
        };
        *noise = given.filter(|std| *std > 0.0).unwrap_or(share);
        if *noise <= 0.0 {
            *noise = 1.0;
        }
    }
}

/// Adds what a log or a trajectory says.
pub(super) fn add(
    bench: &mut ExciteRun,
    name: &str,
    given: &mut GivenInformation,
    warnings: &mut Vec<String>,
) -> Result<(), CliError> {
    let args = bench.args;
    if Path::new(name).extension().is_some_and(|e| e == "toml") {
        let file = files::trajectory(Path::new(name))?;
        bench.inputs.push(file.provenance);
        let motion = Motion::of_file(&bench.machine, &file.value, bench.seconds, args.seed)?;
        let (information, rows) =
            foresee::information(&bench.machine, &motion, bench.rate_hz, bench.seconds)?;
        given.add_motion(&information, rows);
        return Ok(());
    }
    let spec: LogSpec = name.parse().map_err(|error: LogError| {
        CliError::usage(error.explanation().of(format!("--with {name}")))
    })?;
    let logs = RobotSetup::new(name, bench.file.clone());
    let control = &bench.context.control;
    let log = LogData::read_positions(&logs, &Log::from(&spec), control)?;
    let mut blocks = log.blocks(control)?;
    let (sums, summary) = accumulate(
        &logs.robot,
        &bench.machine.columns,
        &logs.settings(),
        &mut |block| blocks.read(block),
    )
    .map_err(|error| IdentifyError::of_run(&spec.name(), error))?;
    let notes = log.notes_with(&blocks, &summary);
    warnings.extend(notes.iter().map(ToString::to_string));
    bench.inputs.push(blocks.provenance()?);
    given.add_log(&sums, summary.samples as f64);
    Ok(())
}
