//! The search of a motion, as the command line asks for it.

use super::Bench;
use super::criterion::criterion;
use crate::cli::error::CliError;
use crate::cli::files;
use cft_ident_files::config::Trajectory;
use cft_ident_files::config::trajectory::FourierSection;
use cft_ident_plant::excite::blend::Blend;
use cft_ident_plant::excite::search::{FoundMotion, Task, design};
use cft_ident_plant::excite::series::Series;
use cft_ident_plant::excite::{Motion, series_of, trajectory};

/// What the command line asks for, with nothing known before.
pub(super) fn task(bench: &mut Bench) -> Result<Task, CliError> {
    let args = bench.args;
    Ok(Task {
        criterion: criterion(bench)?,
        fundamental_hz: bench.frequency_hz,
        harmonics: usize::from(args.harmonics),
        offsets: offsets(bench)?,
        reserve: args.margin,
        prior: None,
        starts: usize::from(args.starts),
        evaluations: args.evaluations,
        seed: args.seed,
    })
}

pub(super) fn searched(bench: &Bench, task: &Task) -> Result<FoundMotion, CliError> {
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
pub(super) fn blended(bench: &Bench, series: Series) -> Result<(Motion, FourierSection), CliError> {
    let (args, machine) = (bench.args, &bench.machine);
    let reserved = machine.channels.iter().map(|c| c.reserved(args.margin));
    let (reserved, from): (Vec<_>, _) = (reserved.collect(), args.from.as_deref());
    let blend = Blend::within(machine, &reserved, &series, args.periods, from)?;
    let fourier = FourierSection {
        start_s: Some(blend.start),
        blend_s: Some(blend.seconds),
        periods: blend.periods,
        ..trajectory(machine, &series)
    };
    Ok((Motion::Periodic { series, blend }, fourier))
}

fn offsets(bench: &mut Bench) -> Result<Vec<Option<f64>>, CliError> {
    let n = bench.machine.coordinates();
    let Some(path) = &bench.args.offsets else {
        return Ok(vec![None; n]);
    };
    let given = files::trajectory(path)?;
    bench.inputs.push(given.provenance);
    let Trajectory::Fourier(file) = &given.value else {
        return Err(
            CliError::input(format!("{} is no Fourier series", given.name))
                .hint("give a trajectory of kind \"fourier\" for --offsets"),
        );
    };
    let series = series_of(&bench.machine, file)?;
    let names = bench.machine.coordinate_names();
    let offset = |i: usize| {
        let named = file.series.iter().any(|c| c.name == names[i]);
        named.then_some(series.offset[i])
    };
    Ok((0..n).map(offset).collect())
}
