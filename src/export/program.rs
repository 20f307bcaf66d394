//! A model as the numbers of a recursion: what generated code is written from.

use crate::robot::cft::{self, linkage};
use crate::robot::model::{JointFriction, Model};
use crate::robot::serial::space::UNTURNED;
use crate::robot::serial::{Chain, ChainError, Coordinate, Coupling, Link};
use crate::robot::standard::STANDARD;
use crate::robot::{JointKind, Robot};

/// Chain, link parameters, drives, friction and offsets of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Their kinds.
    pub kinds: Vec<JointKind>,
    /// Links that move as the robot does.
    pub chain: Chain,
    /// Standard parameters of each link that give the model's torques: those that the base
    /// parameters are named after, and 0 for what is grouped into them. No picture of the links.
    pub bodies: Vec<[f64; STANDARD]>,
    /// Drive inertia of each joint [kg or kg m^2]; 0 where it is grouped into a link.
    pub drives: Vec<f64>,
    /// Coupled gear trains, each with inertia, viscous and Coulomb part.
    pub couplings: Vec<(Coupling, [f64; 3])>,
    /// Friction of each joint.
    pub friction: Vec<JointFriction>,
    /// Constant torque of each joint [N or Nm].
    pub offset: Vec<f64>,
}

impl Program {
    /// The program of a model.
    ///
    /// # Errors
    /// [`ChainError`] where the model is of no chain that can be; none of a checked file is.
    pub fn of(model: &Model) -> Result<Self, ChainError> {
        let n = model.robot.joints();
        let mut drives = vec![0.0; n];
        let mut couplings = Vec::new();
        let (chain, bodies) = match &model.robot {
            Robot::Cft(_) => {
                let mut theta = [0.0; 22];
                // the report's structure is the full one with the last ten at 0
                for (out, theta) in theta.iter_mut().zip(&model.theta) {
                    *out = *theta;
                }
                let links = linkage::links_of(&theta);
                let bodies = links.iter().map(cft::links::PseudoInertia::standard);
                (linkage::chain()?, bodies.collect())
            }
            Robot::SingleJoint(robot) => {
                let mut body = [0.0; STANDARD];
                // about z, or along it: Izz or the mass
                body[match robot.kind {
                    JointKind::Revolute => 5,
                    JointKind::Prismatic => 9,
                }] = model.theta.first().copied().unwrap_or_default();
                let link = Link {
                    name: "link_1".to_owned(),
                    parent: None,
                    rotation: UNTURNED,
                    origin: [0.0; 3],
                    axis: [0.0, 0.0, 1.0],
                    kind: robot.kind,
                    coordinate: Coordinate::Joint(0),
                };
                (Chain::new(vec![link], 1, [0.0; 3])?, vec![body])
            }
            Robot::Serial(robot) => {
                let links = robot.chain().links().len();
                let mut bodies = vec![[0.0; STANDARD]; links];
                let (base, coupled) = model.theta.split_at(robot.groupings().len());
                for (grouping, value) in robot.groupings().iter().zip(base) {
                    match grouping.kept.checked_sub(links * STANDARD) {
                        Some(joint) => drives[joint] = *value,
                        None => bodies[grouping.kept / STANDARD][grouping.kept % STANDARD] = *value,
                    }
                }
                let (numbers, _) = coupled.as_chunks::<3>();
                couplings.extend(
                    robot
                        .couplings()
                        .iter()
                        .copied()
                        .zip(numbers.iter().copied()),
                );
                (robot.chain().clone(), bodies)
            }
        };
        Ok(Self {
            joints: model.robot.joint_names().to_vec(),
            kinds: (0..n).map(|j| model.robot.joint_kind(j)).collect(),
            chain,
            bodies,
            drives,
            couplings,
            friction: model.friction.clone(),
            offset: model.offset.clone(),
        })
    }
}
