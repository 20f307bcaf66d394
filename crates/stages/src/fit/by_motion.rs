//! A fit by least squares of torques refined by the motion that the torques make: single axes.

use nalgebra::DMatrix;

use super::dynamics::IdentifiedDynamics;
use super::motion_fit::MotionFit;
use crate::held_out::residual::JointResidual;
use crate::held_out::validate::{ValidateSettings, validate};
use crate::input::control::Control;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::in_memory::read_each;
use crate::input::model::{in_file, refined};
use crate::input::position_cutoff::known;
use crate::input::robot_setup::RobotSetup;
use crate::note::{FitNote, StageNote};
use crate::open_loop::{AxisError, AxisFit, BLOCKS, fit_axis};
use cft_ident_core::effect::{AugmentedModel, ModelEffect};
use cft_ident_core::inertia::verdict::verdict;
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_core::motion::FilterSettings;
use cft_ident_core::robot::model::JointFriction;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::model_file::EffectSection;

/// Windows for each number below which deviations are not trusted.
const MIN_WINDOWS_PER_NUMBER: f64 = 4.0;

/// Refines what `lsq` found by the motion that the torques make; without a window, blocks set aside choose it.
pub(crate) fn by_motion(
    data: &Dataset,
    found: &mut IdentifiedDynamics,
    window: Option<f64>,
    control: &Control,
) -> Result<(), IdentifyError> {
    data.needs_rows(
        "the motion that --open-loop simulates",
        "give the log itself",
    )?;
    let (setup, logs) = (&data.setup, data.logs.as_slice());
    let file = found.model(setup, None);
    let start = refined(&file, &setup.name)?;
    let one_axis = setup.robot.joints() == 1;
    let linear = |law: &JointFriction| matches!(law, JointFriction::ViscousCoulomb(_));
    if !one_axis || !start.model.friction.iter().all(linear) {
        return Err(IdentifyError::NotByMotion);
    }
    let filtered = &setup.with_position_cutoffs(logs, &known(&start.model), control)?;
    let settings = filtered.settings();
    let settings = FilterSettings {
        // where the position filter has no neighbours speeds are wrong, and a window that begins there with them
        q_trim_s: None,
        trim_s: Some(0.0),
        ..settings
    };
    let whole = read_each(filtered, &vec![settings; logs.len()], logs, control)?;
    let work = control.begin("fit to the motion", None);
    let offset = setup.file.friction.offset;
    let fit = fit_axis(&start, &whole.stretches, (window, offset), &|| {
        control.stopped()
    });
    let fit = fit.map_err(|error| match error {
        AxisError::Stopped => IdentifyError::Interrupted,
        error => IdentifyError::ByMotion(error),
    })?;
    drop(work);
    // what least squares does better on blocks set aside, though it has seen them, is not taken from it
    let taken = fit.after.blocks < fit.before.blocks;
    found.by_motion = Some(motion_fit(setup, &fit, (window.is_some(), taken)));
    if !taken {
        found.notes.push(StageNote::Fit(FitNote::MotionNoBetter));
        return Ok(());
    }
    take(found, &fit);
    let file = found.model(setup, None);
    let given = GivenModel::new(&setup.name, file);
    let errors = validate(data, &ValidateSettings::of(&given), control, &mut |_, _| {})?;
    let errors = errors.validation.errors.joints.into_iter();
    for (j, (joint, error)) in found.joints.iter_mut().zip(errors).enumerate() {
        found.fit.residual_std[j] *= error.rmse / joint.rmse;
        *joint = JointResidual::of(error);
    }
    let file = found.model(setup, None);
    found.set_blocks_aside(data, &file, control)
}

/// Puts the numbers of a fit to the motion in place of those of least squares.
fn take(found: &mut IdentifiedDynamics, fit: &AxisFit) {
    let model = &fit.model;
    let mut values = model.model.theta.clone();
    if let JointFriction::ViscousCoulomb(law) = &model.model.friction[0] {
        values.extend([law.viscous, law.coulomb]);
    }
    values.extend(&model.model.offset);
    let torque_rms = found.fit.torque_rms[0];
    for (i, unknown) in found.unknowns.iter_mut().enumerate() {
        let (value, std) = (values[i], fit.covariance[(i, i)].max(0.0).sqrt());
        let share = 2.0 * std * found.fit.column_rms[(0, i)] / torque_rms;
        let determined = fit.free.contains(&i);
        let (verdict, negligible) = verdict(value, std, determined, share);
        let shown = verdict != Verdict::NotIdentifiable;
        (unknown.fitted, unknown.fitted_std) = (value, std);
        (unknown.verdict, unknown.negligible) = (verdict, negligible);
        unknown.value = shown.then_some(value);
        unknown.std = shown.then_some(std);
        unknown.relative_std = shown.then(|| std / value.abs());
    }
    let u = found.unknowns.len();
    found.covariance = fit.covariance.view((0, 0), (u, u)).into_owned();
    if fit.apart < MIN_WINDOWS_PER_NUMBER * fit.free.len() as f64 {
        found.notes.push(StageNote::Fit(FitNote::FewWindows {
            windows: fit.apart,
            window_s: fit.window_s,
            numbers: fit.free.len(),
        }));
    }
    if fit.ending == IterationEnding::IterationLimit {
        let steps = fit.steps;
        let note = FitNote::MotionNotSettled { steps };
        found.notes.push(StageNote::Fit(note));
    }
}

/// A fit to the motion as documents hold it: whether its windows were given, and whether it is in the model.
fn motion_fit(setup: &RobotSetup, fit: &AxisFit, (given, taken): (bool, bool)) -> MotionFit {
    MotionFit {
        joint: setup.robot.joint_names()[0].clone(),
        unit: setup.robot.joint_kind(0).position_unit(),
        window_s: fit.window_s,
        window_given: given,
        windows: fit.windows as u64,
        windows_apart: fit.apart,
        blocks: BLOCKS as u64,
        before: fit.before,
        after: fit.after,
        taken,
        status: fit.ending,
        steps: fit.steps as u64,
        effects: match taken {
            true => effects(setup, &fit.model, fit),
            false => Vec::new(),
        },
        tried: fit.tried.clone(),
    }
}

/// Effects as a model file holds them; what the fit left where it was is held.
fn effects(setup: &RobotSetup, model: &AugmentedModel, fit: &AxisFit) -> Vec<EffectSection> {
    let mut first = fit.covariance.nrows()
        - model
            .effects
            .iter()
            .map(ModelEffect::parameters)
            .sum::<usize>();
    let of = |effect: &ModelEffect| {
        let (n, shapes) = (effect.parameters(), effect.shape.len());
        let mut effect = effect.clone();
        let mut covariance = DMatrix::zeros(n, n);
        covariance.copy_from(&fit.covariance.view((first, first), (n, n)));
        for i in 0..n {
            effect.held[i] = i >= shapes && !fit.free.contains(&(first + i));
        }
        first += n;
        let shown = effect.numbers(
            &setup.robot,
            setup.file.torque_unit(0),
            Some(covariance.as_slice()),
        );
        in_file(&effect, setup, &shown)
    };
    model.effects.iter().map(of).collect()
}
