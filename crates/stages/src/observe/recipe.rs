//! An observer for one sampling step as numbers, for generated code.

use super::observer::{ORDER, SETTLED, StandstillDoubt, TorqueDelay};
use crate::band::{Direction, Directions};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::math::causal::delay_samples;
use cft_ident_core::math::sos::{Section, SosFilter, steady};
use cft_ident_core::motion::{CausalFilter, FilterSettings, MotionError};
pub use cft_ident_export::export::recipe::ObserverRecipe;
use cft_ident_export::export::recipe::{
    DelayRecipe as LateOf, FilterCascade, ParameterDeviation, UntouchedTorques,
};
use cft_ident_files::config::held_out::{HeldOut, TorqueExcesses};

fn cascade(sos: Option<&SosFilter>, settle: usize) -> FilterCascade {
    let flat = |s: &Section| [s.b[0], s.b[1], s.b[2], s.a[0], s.a[1]];
    let (sections, steady) = match sos.map(SosFilter::sections) {
        Some(sections) => (sections.iter().map(flat).collect(), steady(sections)),
        // lets everything through
        None => (vec![[1.0, 0.0, 0.0, 0.0, 0.0]], vec![[0.0; 2]]),
    };
    FilterCascade {
        sections,
        steady,
        settle,
    }
}

/// What an observer does with rows `step_s` seconds apart, at so many false alarms an hour.
pub fn recipe(
    (model, uncertain): (&AugmentedModel, &Directions),
    settings: &FilterSettings,
    (held, excesses): (&[HeldOut], &TorqueExcesses),
    step_s: f64,
    per_hour: f64,
) -> Result<ObserverRecipe, MotionError> {
    let CausalFilter {
        sos,
        settle,
        delay_s,
    } = CausalFilter::design(settings, step_s)?;
    let smooth = SosFilter::butterworth(ORDER, settings.cutoff_hz, 1.0 / step_s)?;
    let late = TorqueDelay::of(model, step_s);
    let lead = late.as_ref().map_or(0, |late| late.lead);
    let threshold = excesses.threshold(per_hour);
    let doubt = StandstillDoubt::of(model, settings, step_s);
    let untouched = |(held, standstill): (&HeldOut, &f64)| UntouchedTorques {
        standstill: *standstill,
        speed_edges: held.speed_edges.clone(),
        std: held.external_std.clone(),
        band: held.external_99,
        limit: threshold * held.external_99,
    };
    let robot = uncertain.robot();
    let mut each = uncertain.each().to_vec();
    if each.is_empty() {
        // tables of C have at least one entry
        let nothing = vec![0.0; model.model.parameters()];
        each.push(Direction::of(&model.model, &nothing));
    }
    let uncertain = each.iter().map(|of| ParameterDeviation {
        bodies: robot.link_parameters(&of.theta),
        drives: robot.drive_parameters(&of.theta),
        couplings: robot.coupling_parameters(&of.theta),
        friction: of.friction.clone(),
        offset: of.offset.clone(),
    });
    Ok(ObserverRecipe {
        step_s,
        delay_s: delay_s + step_s * (delay_samples(&smooth) + lead as f64),
        per_hour,
        position: cascade(sos.as_ref(), settle),
        smooth: cascade(Some(&smooth), smooth.settle_samples(SETTLED)),
        late: late.map(|late| LateOf {
            lead: late.lead,
            size: late.size,
            by: late.by,
        }),
        joints: held.iter().zip(&doubt.deviations).map(untouched).collect(),
        reach_s: doubt.reach_s,
        uncertain: uncertain.collect(),
    })
}
