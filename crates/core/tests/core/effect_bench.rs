//! Every effect of the catalogue at every place of some robots, with numbers that a machine could have.

use cft_ident_core::effect::{AugmentedModel, EffectPlace, LAWS, LogCoverage, ModelEffect};
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::cft::{LaboratorySetup, ParameterStructure};
use cft_ident_core::robot::double_pendulum::double_pendulum;
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::robot::{JointKind, Robot};

use crate::diagnosis_bench::{Waves, log};

/// A model with the waves of a motion along which everything moves.
pub struct Machine {
    pub name: &'static str,
    pub model: Model,
    pub waves: Vec<Waves>,
}

fn machine(name: &'static str, robot: Robot, waves: Vec<Waves>, smooth: bool) -> Machine {
    let n = robot.joints();
    let friction = |j: usize| match smooth {
        true => JointFriction::DoubleTanh(DoubleTanh::from_parameters([
            0.7 + 0.1 * j as f64,
            1.4,
            -0.5,
            30.0,
            4.0,
        ])),
        false => JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous: 0.8 + 0.1 * j as f64,
            coulomb: 1.5 - 0.2 * j as f64,
        }),
    };
    let theta = match robot.nominal() {
        Some(nominal) => nominal.theta,
        None => (0..robot.parameters().len())
            .map(|i| 0.9 + 0.3 * (i as f64 + 1.0).sin())
            .collect(),
    };
    Machine {
        name,
        model: Model {
            theta,
            friction: (0..n).map(friction).collect(),
            offset: (0..n).map(|j| 0.2 + 0.1 * j as f64).collect(),
            robot,
        },
        waves,
    }
}

pub fn machines() -> Vec<Machine> {
    let one = || vec![vec![[0.7, 1.3, 0.4], [0.2, 4.1, 1.9]]];
    let two = vec![
        vec![[0.9, 1.1, 0.2], [0.4, 2.7, 1.0]],
        vec![[0.8, 1.6, 0.9], [0.5, 3.3, 2.1]],
    ];
    let single = |kind| Robot::single_joint("q1", kind);
    let cft = [0.35, 0.2, 0.9, 0.8].iter().enumerate().map(|(j, at)| {
        // a wave of no frequency is a place
        let still = [*at, 0.0, std::f64::consts::FRAC_PI_2];
        vec![still, [0.08, 1.3 + 0.4 * j as f64, 0.3 * j as f64]]
    });
    let cft_robot = Robot::cft(LaboratorySetup::default(), ParameterStructure::Printed12);
    vec![
        machine("wheel", single(JointKind::Revolute), one(), false),
        machine("slide", single(JointKind::Prismatic), one(), false),
        machine("smooth wheel", single(JointKind::Revolute), one(), true),
        machine("arm", double_pendulum([0.0, -9.81, 0.0], true), two, false),
        machine("cft", cft_robot, cft.collect(), true),
    ]
}

impl Machine {
    /// A log along its motion, one sample every `DT`, with the torque of the model alone.
    pub fn stretch(&self, seconds: f64) -> Stretch {
        let mut out = log(&self.model, &self.waves, (seconds, 0.0, 1), &|_, _, _| 0.0);
        out.began = 0.35;
        out
    }

    /// Every effect at every place, each in the first and the last of the shapes from which a search begins.
    pub fn effects(&self, stretch: &Stretch) -> Vec<ModelEffect> {
        let robot = &self.model.robot;
        let mut cover = LogCoverage::of(robot, std::slice::from_ref(stretch), 10.0);
        for joint in &mut cover.joints {
            let orders = vec![8.0, 13.0];
            joint.ripple_orders.clone_from(&orders);
            joint.friction_orders.clone_from(&orders);
            joint.torque_orders = orders;
        }
        let mut out = Vec::new();
        for law in LAWS {
            for place in law.places(robot, &self.model.friction) {
                let shapes = match law.entry.name {
                    "empirical" => (1..=5).map(|k| vec![f64::from(k), -0.4, 0.6]).collect(),
                    _ => law.starts_on(&cover, place).unwrap_or_default(),
                };
                let ends = match law.entry.name {
                    "empirical" => shapes,
                    _ => shapes
                        .first()
                        .into_iter()
                        .chain(shapes.last())
                        .cloned()
                        .collect(),
                };
                for shape in ends {
                    out.push(ModelEffect::new(
                        law,
                        place,
                        shape,
                        linear(law.linear.len(), place),
                    ));
                }
            }
        }
        out
    }

    /// The model with one effect.
    pub fn with(&self, effect: &ModelEffect) -> AugmentedModel {
        AugmentedModel {
            model: self.model.clone(),
            effects: vec![effect.clone()],
        }
    }
}

/// Coefficients without a pattern, all above zero: a mass and a stiffness are.
fn linear(count: usize, place: EffectPlace) -> Vec<f64> {
    let shift = place.joint().unwrap_or(7) as f64;
    let of = |k: usize| 0.05 + 0.02 * (1.0 + (k as f64 + shift).sin());
    (0..count).map(of).collect()
}
