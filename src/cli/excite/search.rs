//! The search of a motion, as the command line asks for it.

use super::ExciteRun;
use super::criterion::criterion;
use crate::cli::error::CliError;
use cft_ident_files::config::trajectory::FourierSection;
use cft_ident_plant::excite::blend::TimeScaling;
use cft_ident_plant::excite::search::{DesignTask, FoundMotion, design};
use cft_ident_plant::excite::series::Series;
use cft_ident_plant::excite::{Motion, trajectory};

/// Random starts of a search. Half: seeds differ by some percent in the criterion; twice: twice the time for less than
/// one.
const STARTS: usize = 16;

/// What the command line asks for, with nothing known before.
pub(super) fn task(bench: &ExciteRun) -> Result<DesignTask, CliError> {
    let args = bench.args;
    Ok(DesignTask {
        criterion: criterion(bench)?,
        fundamental_hz: bench.frequency_hz,
        harmonics: usize::from(args.harmonics),
        offsets: vec![None; bench.machine.coordinates()],
        reserve: args.margin,
        prior: None,
        starts: STARTS,
        evaluations: None,
        seed: args.seed,
    })
}

pub(super) fn searched(bench: &ExciteRun, task: &DesignTask) -> Result<FoundMotion, CliError> {
    let context = bench.context;
    let bar = context.progress("designing", Some(task.most_evaluations()));
    let advance = |steps| bar.advance(steps);
    let found = design(&bench.machine, task, &advance, context.stop_flag());
    found.map_err(|error| match context.interrupted() {
        true => CliError::interrupted(),
        false => error.into(),
    })
}

/// The motion from rest to rest, and as a file.
pub(super) fn blended(
    bench: &ExciteRun,
    series: Series,
) -> Result<(Motion, FourierSection), CliError> {
    let (args, machine) = (bench.args, &bench.machine);
    let reserved = machine.channels.iter().map(|c| c.reserved(args.margin));
    let (reserved, from): (Vec<_>, _) = (reserved.collect(), args.from.as_deref());
    let blend = TimeScaling::within(machine, &reserved, &series, args.periods, from)?;
    let fourier = FourierSection {
        start_s: Some(blend.start),
        blend_s: Some(blend.seconds),
        periods: blend.periods,
        ..trajectory(machine, &series)
    };
    Ok((Motion::Periodic { series, blend }, fourier))
}
