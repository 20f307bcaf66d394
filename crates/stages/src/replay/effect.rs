//! One effect along logs: the residual of the model that is fitted without it over the signal on which it depends, and
//! what the model with it explains of that.

use super::LogReplay;
use cft_ident_core::effect::empirical::ways;
use cft_ident_core::effect::{AugmentedModel, CurveSignal, Family, ModelEffect, Role, ShapeSearch};
use cft_ident_core::motion::{MotionError, Stretch};
use cft_ident_core::robot::JointKind;

/// The rows of one effect at one joint.
#[derive(Debug, Clone)]
pub struct EffectRows {
    /// Which of the model's effects it is.
    pub effect: usize,
    pub joint: usize,
    /// Name and unit of the signal.
    pub over: (String, String),
    /// The torque counts along the motion: it flips with the direction.
    pub along_motion: bool,
    /// Root mean squares of the residual without the effect, all else fitted anew, and with it [Nm or N].
    pub rms: [f64; 2],
    /// Signal, residual of the model that is fitted without the effect, and what the model with it explains of that.
    pub rows: Vec<[f64; 3]>,
}

pub(super) fn effect(
    replay: &LogReplay,
    (model, without): (&AugmentedModel, &AugmentedModel),
    at: usize,
    logs: &[usize],
) -> Result<EffectRows, MotionError> {
    let effect = &model.effects[at];
    let (joint, mut rows) = rows(replay, (model, without), at, logs)?;
    let rms = |of: fn(&[f64; 3]) -> f64| {
        let squares = rows.iter().map(|row| of(row).powi(2));
        let sum: f64 = squares.filter(|x| x.is_finite()).sum();
        (sum / rows.len().max(1) as f64).sqrt()
    };
    let rms = [rms(|row| row[1]), rms(|row| row[1] - row[2])];
    let signal = OfSignal::of(effect, joint);
    if signal == OfSignal::Way {
        keep_near(&mut rows);
    }
    Ok(EffectRows {
        effect: at,
        joint,
        over: signal.named(replay, effect, joint),
        along_motion: flips(effect),
        rms,
        rows,
    })
}

/// The rows of an effect: at its joint, or where it adds the most.
fn rows(
    replay: &LogReplay,
    (model, without): (&AugmentedModel, &AugmentedModel),
    at: usize,
    logs: &[usize],
) -> Result<(usize, Vec<[f64; 3]>), MotionError> {
    let effect = &model.effects[at];
    let joints = replay.setup.robot.joints();
    let mut all: Vec<Vec<[f64; 3]>> = vec![Vec::new(); joints];
    let wanted = |stretch: &&Stretch| logs.contains(&stretch.log);
    for stretch in replay.stretches.iter().filter(wanted) {
        let parallel = replay.filters.of(stretch);
        let (full, bare) = (model.reconstruct(stretch), without.reconstruct(stretch));
        for (j, rows) in all.iter_mut().enumerate() {
            if !effect.place.touches(j) {
                continue;
            }
            let less =
                |x: &[f64]| -> Vec<f64> { x.iter().zip(&bare[j]).map(|(x, y)| x - y).collect() };
            let filtered = parallel.run(&[&less(&stretch.tau[j]), &less(&full[j])])?;
            let signal = OfSignal::of(effect, j);
            let values = signal.along(model, (effect, stretch), &bare, j);
            rows.extend((0..filtered[0].len()).map(|i| {
                let k = parallel.sample_of(i);
                let sign = match flips(effect) {
                    true => stretch.v[j][k].signum(),
                    false => 1.0,
                };
                [values[k], sign * filtered[0][i], sign * filtered[1][i]]
            }));
        }
    }
    let size = |rows: &Vec<[f64; 3]>| rows.iter().map(|row| row[2] * row[2]).sum::<f64>();
    let most = (0..joints).max_by(|a, b| size(&all[*a]).total_cmp(&size(&all[*b])));
    let joint = effect.place.joint().or(most).unwrap_or(0);
    Ok((joint, std::mem::take(&mut all[joint])))
}

/// Keeps the rows about those in which the effect is at work.
fn keep_near(rows: &mut Vec<[f64; 3]>) {
    let ways = rows.iter().map(|row| [row[0].abs(), row[2] * row[2]]);
    let mut by_way: Vec<[f64; 2]> = ways.collect();
    by_way.retain(|[way, square]| way.is_finite() && square.is_finite());
    by_way.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let whole: f64 = by_way.iter().map(|[_, square]| square).sum();
    let mut sum = 0.0;
    let reach = by_way.iter().find(|[_, square]| {
        sum += square;
        sum >= AT_WORK_SHARE * whole
    });
    if let Some([reach, _]) = reach.filter(|[reach, _]| *reach > 0.0) {
        rows.retain(|row| row[0].abs() <= PICTURE_FACTOR * reach);
    }
}

/// Whether the torque of an effect flips with the direction of motion, over a signal that does not.
fn flips(effect: &ModelEffect) -> bool {
    effect.law.entry.friction && matches!(effect.family(), Family::Load | Family::Position)
}

/// What the torque of an effect is drawn over.
#[derive(Debug, Clone, Copy, PartialEq)]
enum OfSignal {
    /// The position, counted anew after each wave of this length [m or rad].
    Wave(f64),
    Position,
    Velocity,
    /// Velocity of the joint whose motion it follows.
    OtherVelocity(usize),
    /// Way since the joint last reversed, to the side on which it moves.
    Way,
    Load,
    TorqueRate,
    Acceleration,
    Time,
}

impl OfSignal {
    fn of(effect: &ModelEffect, joint: usize) -> Self {
        let wave = (effect.law.entry.search == ShapeSearch::Orders).then(|| effect.shape.first());
        if let Some(order) = wave.flatten().filter(|order| **order > 0.0) {
            return OfSignal::Wave(1.0 / order);
        }
        match (effect.curve(), effect.family()) {
            (Some((CurveSignal::Way, _)), _) | (_, Family::Memory) => OfSignal::Way,
            (_, Family::Position | Family::Own) => OfSignal::Position,
            (_, Family::Velocity) => OfSignal::Velocity,
            (_, Family::Cross) => OfSignal::OtherVelocity(effect.place.from().unwrap_or(joint)),
            (_, Family::Load) => OfSignal::Load,
            (_, Family::Timing) if effect.law.entry.role == Role::Shift => OfSignal::TorqueRate,
            (_, Family::Timing | Family::Inertia) => OfSignal::Acceleration,
            (_, Family::Offset | Family::Slow | Family::Event | Family::Data) => OfSignal::Time,
        }
    }

    fn named(self, replay: &LogReplay, effect: &ModelEffect, joint: usize) -> (String, String) {
        let robot = &replay.setup.robot;
        let unit = |j: usize| robot.joint_kind(j).position_unit();
        let torque = replay.setup.file.torque_unit(joint);
        let force = if torque == "N" { "force" } else { "torque" };
        let (what, joint, unit) = match self {
            OfSignal::Wave(_) if effect.place.joint().is_some() => (
                "position within a wave".to_owned(),
                joint,
                unit(joint).to_owned(),
            ),
            OfSignal::Wave(_) | OfSignal::Position => {
                ("position".to_owned(), joint, unit(joint).to_owned())
            }
            OfSignal::Velocity => ("velocity".to_owned(), joint, format!("{}/s", unit(joint))),
            OfSignal::OtherVelocity(j) => ("velocity".to_owned(), j, format!("{}/s", unit(j))),
            OfSignal::Way => {
                let what = "travel since the last reversal".to_owned();
                (what, joint, unit(joint).to_owned())
            }
            OfSignal::Load => (format!("load {force}"), joint, torque.to_owned()),
            OfSignal::TorqueRate => (format!("rate of the {force}"), joint, format!("{torque}/s")),
            OfSignal::Acceleration => (
                "acceleration".to_owned(),
                joint,
                format!("{}/s\u{b2}", unit(joint)),
            ),
            OfSignal::Time => return ("time".to_owned(), "s".to_owned()),
        };
        (format!("{what} of {}", robot.joint_names()[joint]), unit)
    }

    /// Its values along a stretch, sample by sample; `bare` is the torque of the model without the effect.
    fn along(
        self,
        model: &AugmentedModel,
        (effect, s): (&ModelEffect, &Stretch),
        bare: &[Vec<f64>],
        joint: usize,
    ) -> Vec<f64> {
        match self {
            OfSignal::Wave(turns) if effect.place.joint().is_some() => {
                let length = match model.model.robot.joint_kind(joint) {
                    JointKind::Revolute => std::f64::consts::TAU * turns,
                    JointKind::Prismatic => turns,
                };
                s.q[joint].iter().map(|q| q.rem_euclid(length)).collect()
            }
            OfSignal::Wave(_) | OfSignal::Position => s.q[joint].clone(),
            OfSignal::Velocity => s.v[joint].clone(),
            OfSignal::OtherVelocity(j) => s.v[j].clone(),
            OfSignal::Way => {
                let q = &s.q[joint];
                let low = q.iter().copied().fold(f64::INFINITY, f64::min);
                let high = q.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let ways = ways(q, REVERSAL_SHARE_OF_TRAVEL * (high - low));
                let signed = ways.iter().zip(&s.v[joint]);
                signed.map(|(way, v)| way * v.signum()).collect()
            }
            OfSignal::Load => model.torques(s).load[joint].clone(),
            OfSignal::TorqueRate => {
                let x = &bare[joint];
                let last = x.len().saturating_sub(1);
                let slope = |k: usize| x[(k + 1).min(last)] - x[k.saturating_sub(1)];
                (0..x.len()).map(|k| slope(k) / (2.0 * s.dt)).collect()
            }
            OfSignal::Acceleration => s.a[joint].clone(),
            OfSignal::Time => s.t.clone(),
        }
    }
}

/// Way back that counts as a reversal, over the travel of a stretch.
const REVERSAL_SHARE_OF_TRAVEL: f64 = 5e-4;
/// Part of an effect's squared torque that lies within a way, and how much farther a picture reaches.
const AT_WORK_SHARE: f64 = 0.6;
const PICTURE_FACTOR: f64 = 4.0;
