//! Effects of a user's own: the formulas of his text, in the true states of the plant.
//!
//! Accelerations and loads hang on the torque that they decide; what is in them is solved for
//! ([`super::Effect::implicit`]).

use super::{
    Effect, EffectSite, EffectSpec, EffectValue, LAWS, PlantParameter, PlantState, RobotSites, sign,
};
use crate::simulate::SimulateError;
use crate::simulate::temperature::PlantTemperatures;
use cft_ident_core::effect::PlaceRule;
use cft_ident_core::math::formula::{Formula, MOST_NAMES};
use cft_ident_core::robot::FormulaSignal;
use cft_ident_files::config::candidates::CandidateSection;

/// A coefficient's formula with its number.
struct Term {
    coefficient: f64,
    formula: Formula,
    inputs: Vec<Input>,
}

/// What stands for a name.
#[derive(Debug, Clone, Copy)]
enum Input {
    Signal(FormulaSignal, usize),
    Shape(f64),
}

/// The formulas of one candidate at one joint.
struct CandidateFormulas {
    joint: usize,
    terms: Vec<Term>,
    /// Of every joint: Coulomb level, viscous coefficient and a steep slope.
    friction: Vec<[f64; 3]>,
    temperatures: PlantTemperatures,
    /// In accelerations or loads.
    implicit: bool,
}

/// An effect of the plant, and its numbers.
type OfPlant = (Box<dyn Effect>, EffectValue);

/// What an asked effect of a candidate is built into, joint by joint.
pub(super) fn build(
    spec: &EffectSpec,
    candidate: &CandidateSection,
    sites: &RobotSites,
) -> Result<Vec<OfPlant>, SimulateError> {
    if LAWS.iter().any(|law| law.entry.name == candidate.name) {
        return Err(wrong(candidate, "an effect that is known has its name"));
    }
    let keys = candidate.shapes.keys().chain(candidate.formulas.keys());
    spec.check_keys(keys.map(String::as_str).collect())?;
    let mut out = Vec::new();
    for site in spec.sites(PlaceRule::Joints, sites)? {
        let may = |joints: &Vec<String>| joints.contains(&site.name);
        if !candidate.joints.as_ref().is_none_or(may) {
            match &spec.joint {
                Some(_) => return Err(site.refuse(&spec.name, "its `joints` do not name it")),
                None => continue,
            }
        }
        let own = CandidateFormulas::of(spec, candidate, site, sites)?;
        let value = value(spec, candidate, site)?;
        out.push((Box::new(own) as Box<dyn Effect>, value));
    }
    match out.is_empty() {
        true => Err(wrong(candidate, "this robot has none of its `joints`")),
        false => Ok(out),
    }
}

fn wrong(candidate: &CandidateSection, what: &str) -> SimulateError {
    SimulateError::Candidate {
        name: candidate.name.clone(),
        what: what.to_owned(),
    }
}

/// The number of a key, which only the user knows.
fn number(spec: &EffectSpec, key: &str) -> Result<f64, SimulateError> {
    spec.given(key).ok_or_else(|| SimulateError::MissingKey {
        effect: spec.name.clone(),
        key: key.to_owned(),
    })
}

/// The effect as the truth says it.
fn value(
    spec: &EffectSpec,
    candidate: &CandidateSection,
    site: &EffectSite,
) -> Result<EffectValue, SimulateError> {
    let shapes = candidate.shapes.iter();
    let shapes = shapes.map(|(key, range)| (key, range.unit.clone()));
    let unit = |key| candidate.units.get(key).cloned().unwrap_or_default();
    let sizes = candidate.formulas.keys().map(|key| (key, unit(key)));
    let parameters = shapes.chain(sizes).map(|(key, unit)| {
        let value = number(spec, key)?;
        Ok((key.clone(), PlantParameter { value, unit }))
    });
    Ok(EffectValue {
        effect: candidate.name.clone(),
        family: "own".to_owned(),
        joint: Some(site.name.clone()),
        parameters: parameters.collect::<Result<_, SimulateError>>()?,
    })
}

impl CandidateFormulas {
    fn of(
        spec: &EffectSpec,
        candidate: &CandidateSection,
        site: &EffectSite,
        sites: &RobotSites,
    ) -> Result<Self, SimulateError> {
        for (name, range) in &candidate.shapes {
            let value = number(spec, name)?;
            if !(range.from..=range.to).contains(&value) {
                let rule = format!("must be from {} to {}", range.from, range.to);
                return Err(SimulateError::number(&spec.name, name, value, rule));
            }
        }
        let joints = sites.machine.robot.joint_names();
        let input = |key: &str, name: &String| {
            if candidate.shapes.contains_key(name) {
                return number(spec, name).map(Input::Shape);
            }
            let read = FormulaSignal::read(name, joints);
            let (signal, of) = read.ok_or_else(|| {
                let what = format!("`{key}`: `{name}` is no signal of this robot and no shape");
                wrong(candidate, &what)
            })?;
            if signal.remembers() {
                let what = format!(
                    "`{key}`: `{name}` hangs on the way before, which a plant of formulas does not keep; simulate a model \
                     without it, or with backlash or presliding of the catalogue in its place"
                );
                return Err(wrong(candidate, &what));
            }
            let of = of.unwrap_or(site.joint());
            if signal == FormulaSignal::Temperature && sites.temperatures.at(of, 0.0).is_none() {
                let joint = &joints[of];
                let what = format!(
                    "`{key}` takes the temperature of {joint}, and no course of it is declared; give one in the robot \
                     file: `[sensors.temperature.{joint}]` with start, rise and time_constant_s"
                );
                return Err(wrong(candidate, &what));
            }
            Ok(Input::Signal(signal, of))
        };
        let term = |(key, text): (&String, &String)| {
            let formula = Formula::parse(text).map_err(|why| {
                let what = format!("`{key}`: `{text}` is no formula: {why}");
                wrong(candidate, &what)
            })?;
            let inputs = formula.names().iter().map(|name| input(key, name));
            Ok(Term {
                coefficient: number(spec, key)?,
                inputs: inputs.collect::<Result<_, SimulateError>>()?,
                formula,
            })
        };
        let terms = candidate.formulas.iter().map(term);
        let terms: Vec<Term> = terms.collect::<Result<_, SimulateError>>()?;
        use FormulaSignal::{Acceleration, Load};
        let implicit = |input: &Input| matches!(input, Input::Signal(Acceleration | Load, _));
        let of = |site: &EffectSite| [site.coulomb, site.viscous, site.slope()];
        Ok(Self {
            joint: site.joint(),
            implicit: terms.iter().any(|term| term.inputs.iter().any(implicit)),
            terms,
            temperatures: sites.temperatures.clone(),
            friction: sites.joints.iter().map(of).collect(),
        })
    }

    fn add(&self, motion: &PlantState, torque: &mut [f64]) {
        let mut values = [0.0; MOST_NAMES];
        for term in &self.terms {
            for (value, input) in values.iter_mut().zip(&term.inputs) {
                *value = match *input {
                    Input::Shape(x) => x,
                    Input::Signal(signal, j) => self.signal(motion, signal, j),
                };
            }
            let value = term.formula.value(&values[..term.inputs.len()]);
            torque[self.joint] += term.coefficient * value;
        }
    }

    fn signal(&self, motion: &PlantState, signal: FormulaSignal, j: usize) -> f64 {
        match signal {
            FormulaSignal::Position => motion.q[j],
            FormulaSignal::Speed => motion.v[j],
            FormulaSignal::Acceleration => motion.a[j],
            FormulaSignal::Load => motion.load[j],
            FormulaSignal::Direction => {
                let [coulomb, viscous, slope] = self.friction[j];
                match coulomb.abs() > 1e-12 {
                    true => (motion.friction[j] - viscous * motion.v[j]) / coulomb,
                    false => sign(slope, motion.v[j]),
                }
            }
            FormulaSignal::Temperature => self.temperatures.at(j, motion.t).unwrap_or(f64::NAN),
            FormulaSignal::Time => motion.t,
            FormulaSignal::SinceReversal | FormulaSignal::Play | FormulaSignal::Dahl => f64::NAN,
        }
    }
}

impl Effect for CandidateFormulas {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        if !self.implicit {
            self.add(motion, torque);
        }
    }

    fn implicit_joint(&self) -> Option<usize> {
        self.implicit.then_some(self.joint)
    }

    fn implicit(&self, motion: &PlantState, torque: &mut [f64]) {
        if self.implicit {
            self.add(motion, torque);
        }
    }
}
