//! Logs of machines whose motion and torque are known in closed form, and what a diagnosis is asked of them.

use cft_ident_core::diagnose::{
    DiagnoseError, Diagnosis, DiagnosisCase, DiagnosisOptions, DiagnosisProgress, DiagnosisWatch,
    FORMULA_NUMBERS, FreeParameters, LogRole, ModelProposal, PREDICTION_NUMBERS, ParameterPrior,
    diagnose,
};
use cft_ident_core::effect::{AugmentedModel, ModelEffect};
use cft_ident_core::judge::NUMBERS;
use cft_ident_core::motion::{FilterSettings, ParallelFilters, Stretch};
use cft_ident_core::robot::drive::JointDrive;
use cft_ident_core::robot::friction::ViscousCoulomb;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::robot::{JointKind, Robot};
use nalgebra::DMatrix;

pub const DT: f64 = 0.01;

/// Numbers between -1/2 and 1/2 that look like chance.
pub struct Chance(pub u32);

impl Chance {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 24) - 0.5
    }
}

/// A revolute joint with viscous and Coulomb friction and an offset, its numbers times a scale.
pub fn one_joint(scale: f64) -> Model {
    Model {
        robot: Robot::single_joint("q1", JointKind::Revolute),
        theta: vec![scale * 0.4],
        friction: vec![JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous: scale * 0.8,
            coulomb: scale * 1.5,
        })],
        offset: vec![scale * 0.3],
    }
}

/// Waves of a joint: amplitude, angular frequency, phase.
pub type Waves = Vec<[f64; 3]>;

/// Position, velocity and acceleration at a time.
pub fn motion(waves: &Waves, t: f64) -> [f64; 3] {
    waves.iter().fold([0.0; 3], |[q, v, a], [size, w, phase]| {
        let (sin, cos) = (w * t + phase).sin_cos();
        [q + size * sin, v + size * w * cos, a - size * w * w * sin]
    })
}

/// What acts beside a model, by joint, time, and position, velocity and acceleration of all joints.
pub type MarginalGain<'a> = dyn Fn(usize, f64, &[[f64; 3]]) -> f64 + 'a;

/// A log of joints along waves, with what acts beside the model.
pub fn log(
    model: &Model,
    waves: &[Waves],
    (seconds, noise, seed): (f64, f64, u32),
    more: &MarginalGain<'_>,
) -> Stretch {
    let n = waves.len();
    let rows = (seconds / DT) as usize;
    let mut chance = Chance(seed);
    let mut out = Stretch {
        dt: DT,
        t: (0..rows).map(|k| DT * k as f64).collect(),
        ..Stretch::default()
    };
    for x in [&mut out.q, &mut out.v, &mut out.a, &mut out.tau] {
        *x = vec![Vec::with_capacity(rows); n];
    }
    let mut tau = vec![0.0; n];
    for k in 0..rows {
        let t = DT * k as f64;
        let state: Vec<[f64; 3]> = waves.iter().map(|w| motion(w, t)).collect();
        let of = |i: usize| state.iter().map(|s| s[i]).collect::<Vec<f64>>();
        model.torque(&of(0), &of(1), &of(2), &mut tau);
        for j in 0..n {
            out.q[j].push(state[j][0]);
            out.v[j].push(state[j][1]);
            out.a[j].push(state[j][2]);
            out.tau[j].push(tau[j] + more(j, t, &state) + noise * chance.next());
        }
    }
    out
}

/// A diagnosis of a model on logs, nothing known before, all of it open.
pub fn case(given: &Model, stretches: Vec<Stretch>, rest_speed: f64) -> DiagnosisCase {
    let mut stretches = stretches;
    for (log, stretch) in stretches.iter_mut().enumerate() {
        stretch.log = log;
    }
    let n = given.robot.joints();
    let filters = ParallelFilters::design(&FilterSettings::default(), &stretches);
    let given = AugmentedModel::plain(given.clone());
    let size = given.model.parameters();
    let all_of = |j: usize| vec![true; given.model.friction[j].parameters()];
    DiagnosisCase {
        in_use: given.clone(),
        prior: ParameterPrior {
            centre: given.clone(),
            information: DMatrix::zeros(size, size),
            rows_per_independent: 1.0,
            firmness: 1.0,
        },
        open: FreeParameters {
            offset: vec![true; n],
            friction: (0..n).map(all_of).collect(),
        },
        roles: vec![LogRole::Train; stretches.len()],
        stretches,
        filters: filters.expect("a rate that carries the cut-off"),
        cutoff_hz: 10.0,
        rest_speed: vec![rest_speed; n],
        drives: vec![JointDrive::default(); n],
        units: (0..n)
            .map(|j| given.model.robot.joint_unit(j).to_owned())
            .collect(),
        averaged: false,
        kept: None,
        own: Vec::new(),
        wishes: DiagnosisOptions::default(),
        numbers: NUMBERS,
        formula: FORMULA_NUMBERS,
        prediction: PREDICTION_NUMBERS,
        given,
    }
}

/// The diagnosis, the model that is proposed taken as it is.
pub fn diagnosed(case: &DiagnosisCase) -> Diagnosis {
    try_diagnosed(case).expect("logs that can be diagnosed")
}

pub fn try_diagnosed(case: &DiagnosisCase) -> Result<Diagnosis, DiagnoseError> {
    let refit = |proposal: &ModelProposal| Ok(proposal.model.clone());
    let watch = DiagnosisWatch {
        tell: &|_: DiagnosisProgress| {},
        stop: &|| false,
    };
    diagnose(case, &refit, watch)
}

/// Effects that are written, by name.
pub fn written(found: &Diagnosis) -> Vec<&'static str> {
    found.written().map(|step| step.estimate.name()).collect()
}

/// The effect of a name that is written.
pub fn effect<'a>(found: &'a Diagnosis, name: &str) -> &'a ModelEffect {
    let step = found.written().find(|step| step.estimate.name() == name);
    &step
        .unwrap_or_else(|| panic!("{name} is not among {:?}", written(found)))
        .estimate
}

/// The value of a key of an effect.
pub fn number(effect: &ModelEffect, robot: &Robot, key: &str) -> f64 {
    let numbers = effect.numbers(robot, "Nm", None);
    numbers
        .iter()
        .find(|n| n.key == key)
        .expect("a key of the effect")
        .value
}
