//! The physical model: pure functions of q, v, a and parameters; no files, no estimation.
//!
//! Vectors are in joint order, units are SI and radians.

pub mod bodies;
pub mod cft;
pub mod deviation;
pub mod double_pendulum;
pub mod drive;
pub mod dynamics;
pub mod error;
mod formula_signal;
pub mod friction;
pub mod joint;
pub mod model;
pub mod practice;
pub mod standard;
pub mod transmission;
pub mod tree;
pub mod undeclared;

use std::borrow::Cow;
use std::sync::{Arc, LazyLock};

use cft::regressor::{regressor12, regressor22};
use cft::{LaboratorySetup, ParameterStructure};
use tree::{Coordinate, JointCoupling, Link, ParameterGroup, Parameters, Tree};

pub use error::RobotError;
pub use formula_signal::FormulaSignal;
pub use joint::{JointKind, ParameterInfo};
use practice::{NominalModel, OperatingDefaults};
pub use transmission::Transmission;

/// A robot whose inverse dynamics are linear in its inertial parameters: links on joints, what a fit can
/// determine of them, and how the motors move the joints. Cheap to clone.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot(Arc<RobotParts>);

/// What a robot is made of; its copies share it.
#[derive(Debug, PartialEq)]
struct RobotParts {
    names: Vec<String>,
    tree: Arc<Tree>,
    /// Whether each joint's drive has an inertia of its own.
    drive_inertia: bool,
    transmission: Transmission,
    form: DynamicsForm,
}

/// How the torques are computed, and with it which parameters they are linear in.
#[derive(Debug, PartialEq)]
enum DynamicsForm {
    /// One joint with a constant inertia, free of gravity: tau = inertia a + F(v).
    Inertia,
    /// The closed forms of the CFT robot's report, with 12 or 22 parameters.
    Report(ParameterStructure),
    /// The recursion along the tree, in base parameters.
    Recursion(Parameters),
}

/// States in which a parameter that a joint's torque holds shows.
const STATES: usize = 3;

static INERTIA_KG: [ParameterInfo; 1] = [inertia("kg", "moving mass")];
static INERTIA_KG_M2: [ParameterInfo; 1] =
    [inertia("kg m^2", "moment of inertia about the joint axis")];

const fn inertia(unit: &'static str, meaning: &'static str) -> ParameterInfo {
    ParameterInfo {
        name: Cow::Borrowed("inertia"),
        theta: None,
        unit: Cow::Borrowed(unit),
        meaning: Cow::Borrowed(meaning),
    }
}

/// The chain of Table 2 of the report.
static OF_REPORT: LazyLock<Arc<Tree>> =
    LazyLock::new(|| Arc::new(cft::linkage::chain().expect("Table 2 is a chain")));

impl Robot {
    /// The CFT robot with a set-up and a structure of the inertial parameters.
    pub fn cft(setup: LaboratorySetup, structure: ParameterStructure) -> Self {
        Self(Arc::new(RobotParts {
            names: cft::JOINTS.map(String::from).to_vec(),
            tree: Arc::clone(&OF_REPORT),
            drive_inertia: false,
            transmission: Transmission::pantograph(setup),
            form: DynamicsForm::Report(structure),
        }))
    }

    /// A single joint of the name and kind given: a link that turns about, or slides along, the z axis of
    /// its base, where gravity does nothing to it.
    pub fn single_joint(name: impl Into<String>, kind: JointKind) -> Self {
        let link = Link {
            name: "link_1".to_owned(),
            parent: None,
            rotation: tree::space::UNTURNED,
            origin: [0.0; 3],
            axis: [0.0, 0.0, 1.0],
            kind,
            coordinate: Coordinate::Joint(0),
        };
        let tree = Tree::new(vec![link], 1, [0.0; 3]).expect("one link is a tree");
        Self(Arc::new(RobotParts {
            names: vec![name.into()],
            tree: Arc::new(tree),
            drive_inertia: false,
            transmission: Transmission::default(),
            form: DynamicsForm::Inertia,
        }))
    }

    /// A tree of links whose joints have these names, with or without a drive inertia per joint, and gear
    /// trains of which some may be coupled.
    pub fn of_tree(
        tree: Tree,
        names: Vec<String>,
        drive_inertia: bool,
        couplings: Vec<JointCoupling>,
    ) -> Self {
        let form =
            DynamicsForm::Recursion(Parameters::new(&tree, &names, drive_inertia, &couplings));
        Self(Arc::new(RobotParts {
            names,
            tree: Arc::new(tree),
            drive_inertia,
            transmission: Transmission::geared(couplings),
            form,
        }))
    }

    /// Number of joints n.
    pub fn joints(&self) -> usize {
        self.0.names.len()
    }

    /// Joint names, in the order of every vector.
    pub fn joint_names(&self) -> &[String] {
        &self.0.names
    }

    /// Kind of joint i; on the CFT robot q1 slides and the others turn.
    pub fn joint_kind(&self, i: usize) -> JointKind {
        self.0.tree.joint_kind(i)
    }

    /// Unit of joint i's force or torque: "N" or "Nm".
    pub fn joint_unit(&self, i: usize) -> &'static str {
        self.joint_kind(i).torque_unit()
    }

    /// The moving links, and gravity.
    pub fn tree(&self) -> &Tree {
        &self.0.tree
    }

    /// Whether the links have places and centres of gravity in the model. Those of a single joint do not.
    pub fn knows_links(&self) -> bool {
        !matches!(self.0.form, DynamicsForm::Inertia)
    }

    /// Whether each joint's drive has an inertia of its own.
    pub fn drive_inertia(&self) -> bool {
        self.0.drive_inertia
    }

    /// How the motors move the joints.
    pub fn transmission(&self) -> &Transmission {
        &self.0.transmission
    }

    /// Names of the motors' coordinates: the joints, where the motors are there.
    pub fn coordinate_names(&self) -> Vec<String> {
        match self.transmission().coordinates() {
            Some(names) => names.iter().map(|&name| name.to_owned()).collect(),
            None => self.joint_names().to_vec(),
        }
    }

    /// Kind of the motors' coordinate i.
    pub fn coordinate_kind(&self, i: usize) -> JointKind {
        let own = self.transmission().coordinate_kind(i);
        own.unwrap_or_else(|| self.joint_kind(i))
    }

    /// Numbers that stand for the robot where no model is given; none for a robot that only its file
    /// describes.
    pub fn nominal(&self) -> Option<NominalModel> {
        self.transmission().setup()?;
        let mut theta = cft::practice::INERTIA.to_vec();
        theta.resize(self.parameters().len(), 0.0);
        Some(NominalModel {
            theta,
            friction: friction::DoubleTanh::cft_joints(&cft::practice::FRICTION).to_vec(),
        })
    }

    /// How the robot is run, where more is known of that than its file says.
    pub fn practice(&self) -> Option<OperatingDefaults> {
        self.transmission().setup().map(cft::practice::of)
    }

    /// The inertial parameters, in the order of the regressor's columns.
    pub fn parameters(&self) -> &[ParameterInfo] {
        match &self.0.form {
            DynamicsForm::Inertia => match self.joint_kind(0) {
                JointKind::Prismatic => &INERTIA_KG,
                JointKind::Revolute => &INERTIA_KG_M2,
            },
            DynamicsForm::Report(ParameterStructure::Printed12) => &cft::EXTENDED[..cft::PRINTED],
            DynamicsForm::Report(ParameterStructure::Full22) => &cft::EXTENDED,
            DynamicsForm::Recursion(parameters) => parameters.infos(),
        }
    }

    /// How base parameters that were found from the links are grouped, in the order of the first
    /// parameters; empty where the parameters are declared.
    pub fn groupings(&self) -> &[ParameterGroup] {
        match &self.0.form {
            DynamicsForm::Recursion(parameters) => parameters.groupings(),
            DynamicsForm::Inertia | DynamicsForm::Report(_) => &[],
        }
    }

    /// Number in the report's Table 4 of friction parameter `k` (order of
    /// [`friction::DoubleTanh::NAMES`]) of joint `j`, where it has one: 13 + 4 k + j.
    pub fn friction_theta(&self, j: usize, k: usize) -> Option<u32> {
        match &self.0.form {
            DynamicsForm::Report(_) => Some((13 + 4 * k + j) as u32),
            DynamicsForm::Inertia | DynamicsForm::Recursion(_) => None,
        }
    }

    /// Writes Y(q, v, a), n x p row-major, so that M a + C v + G = Y theta (eq. (26)). Does not
    /// allocate.
    ///
    /// # Panics
    /// Where q, v or a does not hold n numbers or y not n p: a mistake of the caller's code.
    #[inline]
    pub fn regressor(&self, q: &[f64], v: &[f64], a: &[f64], y: &mut [f64]) {
        match &self.0.form {
            DynamicsForm::Inertia => {
                assert!(
                    q.len() == 1 && v.len() == 1 && y.len() == 1,
                    "one joint, one parameter"
                );
                y[0] = a[0];
            }
            DynamicsForm::Report(ParameterStructure::Printed12) => {
                regressor12(four(q), four(v), four(a), rows(y))
            }
            DynamicsForm::Report(ParameterStructure::Full22) => {
                regressor22(four(q), four(v), four(a), rows(y))
            }
            DynamicsForm::Recursion(parameters) => parameters.regressor(self.tree(), q, v, a, y),
        }
    }

    /// Inertial parameters that the torque of each joint holds, by their places: the last joints of an arm are reported
    /// nothing of its first links.
    pub fn parameters_by_joint(&self) -> Vec<Vec<usize>> {
        let (n, p) = (self.joints(), self.parameters().len());
        let mut held = vec![false; n * p];
        let mut y = vec![0.0; n * p];
        for state in 0..STATES {
            // numbers without a pattern, in which nothing is zero by chance
            let at = |order: usize| -> Vec<f64> {
                let of = |j: usize| {
                    (1.7 + 2.9 * j as f64 + 5.3 * order as f64 + 7.1 * state as f64).sin()
                };
                (0..n).map(of).collect()
            };
            self.regressor(&at(0), &at(1), &at(2), &mut y);
            for (held, y) in held.iter_mut().zip(&y) {
                *held |= *y != 0.0;
            }
        }
        let of = |j: usize| (0..p).filter(|i| held[j * p + i]).collect();
        (0..n).map(of).collect()
    }

    /// Writes Y(q, v, a) theta: the torque of every joint \[N or N m\], friction aside. Does not allocate.
    #[inline]
    pub fn torque(&self, theta: &[f64], q: &[f64], v: &[f64], a: &[f64], tau: &mut [f64]) {
        match &self.0.form {
            DynamicsForm::Inertia => tau[0] = a[0] * theta[0],
            DynamicsForm::Report(_) => {
                let (mut buffer, p) = ([0.0; MOST_OF_REPORT], theta.len());
                let y = &mut buffer[..4 * p];
                self.regressor(q, v, a, y);
                for (tau, row) in tau.iter_mut().zip(y.chunks_exact(p)) {
                    *tau = row.iter().zip(theta).map(|(y, t)| y * t).sum();
                }
            }
            DynamicsForm::Recursion(parameters) => {
                parameters.torque(self.tree(), theta, [q, v, a], tau);
            }
        }
    }
}

/// Entries of the 4 x 22 regressor.
const MOST_OF_REPORT: usize = 88;

#[inline(always)]
fn four(x: &[f64]) -> &[f64; 4] {
    x.try_into().expect("the CFT robot has four joints")
}

#[inline(always)]
fn rows<const P: usize>(y: &mut [f64]) -> &mut [[f64; P]; 4] {
    let (rows, rest) = y.as_chunks_mut::<P>();
    assert!(rest.is_empty(), "the regressor has 4 rows of {P}");
    rows.try_into().expect("the regressor has 4 rows")
}
