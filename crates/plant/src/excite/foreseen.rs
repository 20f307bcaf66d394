//! The numbers that torques are foreseen with: an identified model, those that stand for the robot, the mass
//! properties that its file gives, or none.

use cft_ident_core::robot::Robot;
use cft_ident_core::robot::deviation::{Deviation, NORMAL_95};
use cft_ident_core::robot::friction::ViscousCoulomb;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::robot::standard::STANDARD;
use cft_ident_files::config::{ModelFile, RobotFile};
use cft_ident_logs::log::escape;

use super::ExciteError;
use super::series::MAX_COORDINATES;

/// Where torques come from before the robot moves.
#[derive(Debug, Clone)]
pub enum TorqueSource {
    /// An identified model, with the deviation of its torques.
    Model {
        /// By the covariance of the parameters; none where the file holds no covariance.
        deviation: Option<Box<Deviation<'static>>>,
        /// Effects of the model, whose torques are not foreseen.
        effects: Vec<String>,
    },
    /// Numbers that stand for the robot.
    Nominal,
    /// Mass properties in the robot file or its URDF.
    Declared {
        /// Whether the robot file gives friction too.
        friction: bool,
    },
    /// Nothing, for no mass of these links is known.
    Nothing { links: Vec<String> },
}

impl TorqueSource {
    /// A robot's numbers and where they come from.
    pub(super) fn of(
        file: &RobotFile,
        robot: &Robot,
        model: Option<(&str, &ModelFile)>,
    ) -> Result<(Model, Self), ExciteError> {
        if let Some((name, given)) = model {
            given.belongs_to(name, file)?;
            let model = given.model(name)?;
            let deviation = given.covariance.is_some();
            let deviation = deviation.then(|| {
                let covariance = given.model_covariance(&model);
                Box::new(Deviation::owned(&covariance, model.clone()))
            });
            let effects = given.effects.iter().map(|e| match &e.joint {
                Some(joint) => format!("{} of {}", escape(&e.name), escape(joint)),
                None => escape(&e.name),
            });
            let effects = effects.collect();
            return Ok((model, Self::Model { deviation, effects }));
        }
        let of = |theta, friction| Model {
            theta,
            friction,
            offset: vec![0.0; robot.joints()],
            robot: robot.clone(),
        };
        if let Some(nominal) = robot.nominal() {
            let laws = nominal.friction.into_iter();
            let laws = laws.map(JointFriction::DoubleTanh).collect();
            return Ok((of(nominal.theta, laws), Self::Nominal));
        }
        let friction = declared_friction(file, robot);
        let (theta, source) = match declared_inertia(file, robot) {
            Ok(theta) => {
                let friction = friction.iter().any(|law| *law != JointFriction::None);
                (theta, Self::Declared { friction })
            }
            Err(links) => (vec![0.0; robot.parameters().len()], Self::Nothing { links }),
        };
        Ok((of(theta, friction), source))
    }

    /// Whether torques are foreseen at all.
    pub fn known(&self) -> bool {
        !matches!(self, Self::Nothing { .. })
    }

    /// How far torques may be off at a motion, 95 % of the time \[N or N m\].
    pub(super) fn half_widths(&self, motion: [&[f64]; 3], out: &mut [f64; MAX_COORDINATES]) {
        out.fill(0.0);
        let Self::Model {
            deviation: Some(deviation),
            ..
        } = self
        else {
            return;
        };
        deviation.variances(motion, &mut out[..motion[0].len()]);
        for x in out {
            *x = NORMAL_95 * x.sqrt();
        }
    }

    /// With what torques are foreseen, in one sentence.
    pub fn sentence(&self) -> String {
        match self {
            Self::Model { deviation, effects } => {
                let how = match deviation {
                    Some(_) => {
                        ", and their limits hold for the 95 % band of its parameters"
                    }
                    None => ", whose uncertainty the file does not hold",
                };
                let without = match effects.is_empty() {
                    true => String::new(),
                    false => format!(", without its effects {}", effects.join(", ")),
                };
                format!("Torques are foreseen with the model given{without}{how}.")
            }
            Self::Nominal => {
                "Torques are foreseen with the nominal numbers of the robot, not with a model of this machine."
                    .to_owned()
            }
            Self::Declared { friction } => format!(
                "TORQUES ARE A GUESS: foreseen with the masses and inertias of the robot file or its URDF{}, \
                 without the inertia of the drives; check the motion again with an identified model (-m).",
                match friction {
                    true => " and the friction that the robot file gives",
                    false => ", without friction",
                }
            ),
            Self::Nothing { links } => format!(
                "TORQUES ARE NOT FORESEEN: the masses of {} are not known, so no limit of torque was checked; \
                 give an identified model (-m), or a URDF with inertials.",
                escape(&links.join(", "))
            ),
        }
    }

    /// The sentence where torques are less than foreseen: what no file may leave out.
    pub fn caution(&self) -> Option<String> {
        match self {
            Self::Model { .. } | Self::Nominal => None,
            Self::Declared { .. } | Self::Nothing { .. } => Some(self.sentence()),
        }
    }
}

/// Friction that the robot file starts from.
fn declared_friction(file: &RobotFile, robot: &Robot) -> Vec<JointFriction> {
    let law = |joint| {
        let start = file.friction.joint.get(joint).cloned().unwrap_or_default();
        match (start.viscous, start.coulomb) {
            (None, None) => JointFriction::None,
            (viscous, coulomb) => JointFriction::ViscousCoulomb(ViscousCoulomb {
                viscous: viscous.unwrap_or(0.0),
                coulomb: coulomb.unwrap_or(0.0),
            }),
        }
    };
    robot.joint_names().iter().map(law).collect()
}

/// Inertial parameters by the mass properties of every moving link, or the links that have none.
fn declared_inertia(file: &RobotFile, robot: &Robot) -> Result<Vec<f64>, Vec<String>> {
    let names = robot.tree().links().iter().map(|link| &link.name);
    let given = |i: usize| file.robot.link.get(i)?.inertial.as_ref();
    let bare = names.enumerate().filter(|(i, _)| given(*i).is_none());
    let bare: Vec<String> = bare.map(|(_, name)| name.clone()).collect();
    if !bare.is_empty() {
        return Err(bare);
    }
    let mut standard = vec![0.0; robot.standard_parameters()];
    for (i, values) in standard.chunks_mut(STANDARD).enumerate() {
        if let Some(inertial) = given(i) {
            values.copy_from_slice(&inertial.body().standard());
        }
    }
    Ok(robot.base_of(&standard))
}
