//! What the effects of a model add to generated code: statements that C and Rust share, and what of them is
//! rather a property of links. Each effect writes its own, in its file.
//!
//! The text is that of both languages but for four marks: `$f(` calls a function of the file, `state.x` is
//! what the model remembers, `let x = ..;` begins a constant, and `&state.x` hands a memory to a function.
//! Each text is that of the effect's columns, which a test compares along motions.

use super::exact;
use super::site::{CodeSite, saturating};
pub use super::site::{EffectsCode, RobotProperty, StateVariable};
use super::{AugmentedModel, EffectError, EffectPlace, ModelEffect, entry};
use crate::robot::FormulaSignal;
use crate::robot::model::JointFriction;

/// Where the inertia of an elastic drive stands in its memory.
pub const INERTIA: usize = 9;

impl EffectsCode {
    /// Those of a model.
    pub fn of(refined: &AugmentedModel) -> Result<Self, EffectError> {
        let mut out = EffectsCode {
            lead_s: vec![0.0; refined.model.robot.joints()],
            ..EffectsCode::default()
        };
        let joints = 0..refined.model.robot.joints();
        let directions: Vec<String> = joints.map(|j| direction(refined, j)).collect();
        for (number, effect) in refined.effects.iter().enumerate() {
            let title = effect.title(&refined.model.robot);
            let mut site = CodeSite {
                out: &mut out,
                number,
                place: effect.place,
                shape: &effect.shape,
                linear: &effect.linear,
                title: &title,
                model: &refined.model,
                directions: &directions,
            };
            let written = match effect.law.code {
                Some(code) => {
                    code(&mut site);
                    true
                }
                None => formula(&mut site, effect),
            };
            if !written {
                return Err(EffectError::NoCode { effect: title });
            }
            out.titles.push(title);
        }
        Ok(out)
    }

    /// Whether anything is remembered or runs with time.
    pub fn remember_anything(&self) -> bool {
        !self.steps.is_empty()
    }
}

/// The formula of a user's own; false where it has none, or calls what code has not.
fn formula(site: &mut CodeSite, effect: &ModelEffect) -> bool {
    let Some(formulas) = effect.law.formula else {
        return false;
    };
    let directions = site.directions;
    let signal = |signal: FormulaSignal, j: usize| {
        Some(match signal {
            FormulaSignal::Position => format!("q[{j}]"),
            FormulaSignal::Speed => format!("v[{j}]"),
            FormulaSignal::Acceleration => format!("a[{j}]"),
            FormulaSignal::Load => format!("load[{j}]"),
            FormulaSignal::Direction => directions.get(j)?.clone(),
            FormulaSignal::Temperature => format!("temperature[{j}]"),
            FormulaSignal::Time => "state.t".to_owned(),
            FormulaSignal::SinceReversal | FormulaSignal::Play | FormulaSignal::Dahl => {
                return None;
            }
        })
    };
    let numbers = (effect.shape.as_slice(), effect.linear.as_slice());
    match formulas.code(site.joint(), numbers, &signal) {
        Some((text, true)) => site.step(text),
        Some((text, false)) => site.added(text),
        None => return false,
    }
    true
}

/// Direction of a joint's friction: that of its law, or of what was added to make it smooth.
fn direction(refined: &AugmentedModel, j: usize) -> String {
    let smooth = |e: &&ModelEffect| e.law.direction.is_some() && e.place == EffectPlace::Joint(j);
    match refined.effects.iter().find(smooth) {
        Some(e) if refined.model.friction[j].jumps() => {
            format!("tanh(v[{j}] / {})", exact(e.shape[0]))
        }
        _ if refined.model.friction[j] == JointFriction::None => format!("$sign(v[{j}])"),
        _ => format!("({})", saturating(&refined.model, j)),
    }
}

impl ModelEffect {
    /// The property that the effect is, where it is one that files of links can have.
    pub fn property(&self) -> Option<RobotProperty> {
        (self.law.property)(self.place, &self.shape, &self.linear)
    }
}

/// Why an effect of this name is no torque that a controller could send; `None` where it is one.
pub fn no_torque(name: &str) -> Option<&'static str> {
    entry(name)?.no_torque
}
