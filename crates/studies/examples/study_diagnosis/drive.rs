//! Campaigns of a single drive whose declared friction is viscous and Coulomb: a slide on a screw, or a
//! wheel. What a double tanh law would take up shows on it.

use std::collections::BTreeMap;

use cft_ident::diagnose::{LogRole, ParameterPrior};
use cft_ident::effect::AugmentedModel;
use cft_ident::inertia::accumulate;
use cft_ident::inertia::columns::{Own, RegressorColumns};
use cft_ident::inertia::solve::{Weighting, fit};
use cft_ident::log::Block;
use cft_ident::motion::{FilterSettings as Processing, ZeroOrderHold};
use cft_ident::robot::friction::ViscousCoulomb;
use cft_ident::robot::model::{JointFriction, Model};
use cft_ident::robot::{JointKind, Robot};
use cft_ident::simulate::reference::{LadderPlan, Path, ReferenceFrame};
use cft_ident::simulate::run::run;
use cft_ident::simulate::single_joint::effects;
use cft_ident::simulate::{
    EffectSpec, MotorInput, Noise, Reference, Settings, SimulatedRun, SingleJointTruth,
    SmoothFriction, Start,
};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};

use crate::campaign::{Campaign, NOISE, SECONDS, held};
use crate::study::processing;

/// Names of the two drives.
pub const SLIDE: &str = "slide";
pub const WHEEL: &str = "wheel";

/// Processing of their logs: reversals are short, so the band is wide.
pub fn settings() -> Processing {
    Processing {
        cutoff_hz: 20.0,
        q_cutoff_hz: Some(200.0),
        ..processing()
    }
}

/// A drive with its parameters varied by 15 %.
pub fn truth(name: &str, seed: u64) -> SingleJointTruth {
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut vary = |x: f64| x * (1.0 + 0.15 * (2.0 * chance.random::<f64>() - 1.0));
    let slides = name == SLIDE;
    let [inertia, viscous, coulomb] = if slides {
        [95.0, 200.0, 20.0]
    } else {
        [0.5, 1.0, 2.0]
    };
    let inertia = vary(inertia);
    let law = ViscousCoulomb {
        viscous: vary(viscous),
        coulomb: vary(coulomb),
    };
    SingleJointTruth {
        name: name.to_owned(),
        kind: if slides {
            JointKind::Prismatic
        } else {
            JointKind::Revolute
        },
        inertia,
        friction: SmoothFriction::viscous_coulomb(law, inertia),
        offset: 0.0,
        gain: if slides { 35.0 } else { 2.0 },
        resolution: if slides { 1e-6 } else { 1e-5 },
        limits: if slides { (0.0, 0.25) } else { (-3.0, 3.0) },
    }
}

fn robot(truth: &SingleJointTruth) -> Robot {
    Robot::single_joint(truth.name.as_str(), truth.kind)
}

/// A log along a ladder of speeds.
pub fn log(truth: &SingleJointTruth, specs: &[EffectSpec], noise: f64, seed: u64) -> Block {
    let (low, high) = truth.limits;
    let margin = 0.05 * (high - low);
    let range = (low + margin, high - margin);
    let acceleration = 8.0 * (high - low);
    let top = LadderPlan::fastest(range, acceleration);
    let ladder = LadderPlan::usual(range, (top / 60.0, top), acceleration, SECONDS, Some(seed));
    let ladder = ladder.expect("a ladder");
    let reference = Reference {
        frame: ReferenceFrame::Joints,
        path: Path::Ladder {
            moving: 0,
            pose: [ladder.at(0.0).0],
            ladder,
        },
    };
    let mut settings = Settings::new(SECONDS);
    settings.seed = seed;
    settings.sensors.torque_noise = Noise::Relative(noise);
    let plant = truth.plant().expect("a joint");
    let drive = MotorInput::Follow {
        reference,
        control: plant.control(),
    };
    let (effects, _) = effects(truth, specs).expect("effects");
    let recording: SimulatedRun<1> =
        run(&plant, effects, &Start::Settled, &drive, &settings).expect("a run");
    let mut log = Block {
        t: recording.t.clone(),
        q: recording.q.concat(),
        tau: recording.torque.concat(),
        ..Block::default()
    };
    ZeroOrderHold::new(1).centre(&robot(truth), &mut log);
    log
}

/// Its logs and the declared model.
pub fn campaign(truth: &SingleJointTruth, specs: &[EffectSpec], seed: u64) -> Campaign {
    let robot = robot(truth);
    let columns = RegressorColumns {
        joints: 1,
        shared: 1,
        own: vec![vec![Own::Viscous, Own::Coulomb]],
        known: vec![None],
        rest_speed: Vec::new(),
    };
    let training = log(truth, specs, NOISE, 10 * seed);
    let sums = accumulate(
        &robot,
        &columns,
        &settings(),
        &mut crate::study::source(&training),
    );
    let fitted = fit(&sums.expect("a log").0, Weighting::Wls).expect("a fit");
    let declared = AugmentedModel::plain(model(
        &robot,
        [fitted.theta[0], fitted.theta[1], fitted.theta[2]],
    ));
    let mut stretches = held(0, 1, &settings(), &training);
    let unseen = log(truth, specs, NOISE, 10 * seed + 1);
    stretches.extend(held(1, 1, &settings(), &unseen));
    Campaign {
        prior: ParameterPrior {
            centre: declared.clone(),
            information: DMatrix::zeros(4, 4),
            rows_per_independent: 5.0,
        },
        declared,
        stretches,
        wide: crate::campaign::wider(1, &settings(), &[training, unseen]),
        roles: vec![LogRole::Train, LogRole::Holdout],
        keep: false,
    }
}

/// The true model without effects.
pub fn plain(truth: &SingleJointTruth) -> Model {
    let law = match truth.friction {
        SmoothFriction::ViscousCoulomb { law, .. } => law,
        SmoothFriction::DoubleTanh(_) => ViscousCoulomb {
            viscous: 0.0,
            coulomb: 0.0,
        },
    };
    model(&robot(truth), [truth.inertia, law.viscous, law.coulomb])
}

fn model(robot: &Robot, [inertia, viscous, coulomb]: [f64; 3]) -> Model {
    Model {
        robot: robot.clone(),
        theta: vec![inertia],
        friction: vec![JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous,
            coulomb,
        })],
        offset: vec![0.0],
    }
}

/// Coulomb level of its friction, N or N m.
fn level(truth: &SingleJointTruth) -> f64 {
    match truth.friction {
        SmoothFriction::ViscousCoulomb { law, .. } => law.coulomb,
        SmoothFriction::DoubleTanh(law) => law.coulomb_1 + law.coulomb_2,
    }
}

fn travel(truth: &SingleJointTruth) -> f64 {
    truth.limits.1 - truth.limits.0
}

fn keys<const N: usize>(keys: [(&str, f64); N]) -> BTreeMap<String, f64> {
    keys.map(|(key, x)| (key.to_owned(), x)).into()
}

/// Bristles in place of the whole Coulomb level, the softer the more they show.
pub fn bristles(truth: &SingleJointTruth, scale: f64) -> BTreeMap<String, f64> {
    let level = level(truth);
    keys([
        ("fc", level),
        ("sigma0", level / (1e-3 * scale * travel(truth))),
        ("sigma1", 0.0),
    ])
}

/// A spring between motor and link, the softer the more it shows.
pub fn soft(truth: &SingleJointTruth, scale: f64) -> BTreeMap<String, f64> {
    keys([
        ("stiffness", truth.inertia * 4e4 / scale),
        ("inertia", 0.8 * truth.inertia),
        ("damping", 0.025),
    ])
}

/// More friction at low speed.
pub fn hump(truth: &SingleJointTruth, scale: f64) -> BTreeMap<String, f64> {
    keys([
        ("c", 1e-3 * scale * level(truth)),
        ("vs", 0.05 * travel(truth)),
    ])
}
