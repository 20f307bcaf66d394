//! What a motion is to make small.

use super::{CriterionName, ExciteRun};
use crate::cli::error::CliError;
use cft_ident_plant::excite::Criterion;
use cft_ident_plant::excite::machine::ForeseenRobot;

/// 1/noise per joint where the criterion weighs rows, else ones.
pub fn weights(machine: &ForeseenRobot, criterion: &Criterion) -> Vec<f64> {
    match criterion.weighted() {
        true => machine.noise.iter().map(|s| 1.0 / s).collect(),
        false => vec![1.0; machine.coordinates()],
    }
}

pub fn criterion(bench: &ExciteRun) -> Result<Criterion, CliError> {
    let args = bench.args;
    let names = bench.machine.unknown_names();
    let place = |name: &String| {
        names.iter().position(|n| n == name).ok_or_else(|| {
            CliError::usage(format!("no parameter is called {name}"))
                .hint(format!("the parameters are {}", names.join(", ")))
        })
    };
    let chosen = args.parameters.iter().map(place);
    let chosen = chosen.collect::<Result<Vec<usize>, _>>()?;
    if !chosen.is_empty() && args.criterion != CriterionName::AOptimal {
        return Err(CliError::usage(
            "--parameter belongs to --criterion a-optimal",
        ));
    }
    Ok(match args.criterion {
        CriterionName::Condition => Criterion::Condition,
        CriterionName::ConditionNormalised => Criterion::ConditionNormalised,
        CriterionName::DOptimal => Criterion::DOptimal,
        CriterionName::AOptimal if chosen.is_empty() => Criterion::AOptimal(vec![1.0; names.len()]),
        CriterionName::AOptimal => {
            let values = bench.machine.unknown_values();
            if !bench.machine.source.known() {
                return Err(CliError::usage(
                    "--parameter asks for relative errors, and no value of a parameter is known",
                )
                .hint("give a model with -m, or a URDF with inertials"));
            }
            let mut factors = vec![0.0; names.len()];
            for k in chosen {
                if values[k] == 0.0 {
                    let name = &names[k];
                    let text =
                        format!("{name} is 0 in the model, so its relative error has no meaning");
                    return Err(
                        CliError::usage(text).hint("give a model with -m in which it is not")
                    );
                }
                factors[k] = 1.0 / (values[k] * values[k]);
            }
            Criterion::AOptimal(factors)
        }
    })
}
