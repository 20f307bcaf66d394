//! A motion judged on the bench of a run, and what is written of it.

use super::ExciteRun;
use crate::cli::error::CliError;
use cft_ident_core::number;
use cft_ident_plant::excite::limits::BoundedQuantity;
use cft_ident_plant::excite::{
    GivenInformation, LawForeseen, Motion, MotionJudgement, MotionTerms, judge, lifted,
};

pub(super) fn judged(
    bench: &ExciteRun,
    motion: &Motion,
    channels: &[BoundedQuantity],
    given: Option<&GivenInformation>,
    friction: Option<LawForeseen>,
) -> Result<MotionJudgement, CliError> {
    let terms = MotionTerms {
        channels,
        given,
        friction,
        from: bench.args.from.as_deref(),
        rate_hz: bench.rate_hz,
        seconds: bench.seconds,
        criterion: &criterion_name(bench),
        seed: bench.args.seed,
    };
    let lifted = lifted(&bench.machine, motion, &terms)?;
    let judged = judge(&bench.machine, motion, terms)?;
    Ok(MotionJudgement { lifted, ..judged })
}

/// A design that breaks a limit is never written.
pub(super) fn refuse_broken(judged: &MotionJudgement) -> Result<(), CliError> {
    let Some(first) = judged.broken().into_iter().next() else {
        return Ok(());
    };
    let text = format!("the motion found breaks a limit, nothing was written: {first}");
    Err(CliError::input(text).hint("leave more of the limits free with --margin"))
}

/// The comment at the head of the trajectory file.
pub(super) fn head(judged: &MotionJudgement) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let torques = &judged.torques;
    if let Some(friction) = &judged.friction {
        return format!(
            "One-joint experiment for the friction of {}, designed by cft-ident {version} for {} s.\n{torques}",
            friction.joint,
            number::significant(judged.seconds, 4)
        );
    }
    let shown = |value: Option<f64>| value.map_or("-".into(), |v| number::significant(v, 4));
    let condition = &judged.condition;
    format!(
        "Excitation trajectory, designed by cft-ident {version} (criterion {}, seed {}).\n{torques}\n\
         Condition number of the regressor along the period: {} raw, {} with its columns scaled.\n\
         x_i(t) = offset + sum over l of a_l/(l w) sin(l w t) - b_l/(l w) cos(l w t), w = 2 pi fundamental_hz.",
        judged.criterion,
        judged.seed,
        shown(condition.raw),
        shown(condition.normalised)
    )
}

fn criterion_name(bench: &ExciteRun) -> String {
    use clap::ValueEnum;
    if let Some(aim) = &bench.args.aim {
        return format!("for {aim}");
    }
    let value = bench.args.criterion.to_possible_value();
    value.map_or(String::new(), |value| value.get_name().to_owned())
}
