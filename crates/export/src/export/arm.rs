//! A model as simulators take it: bodies on joints with damping, friction and armature.

use nalgebra::{Matrix3, Rotation3, SymmetricEigen, UnitQuaternion};

use super::dissipative::{CURVES, damping_and_friction, friction_at, nearest_sizes, speeds};
use super::error::ExportError;
use super::prepared::{Drive, PreparedModel, drive, joint_name, placed, root};
use super::turned::{length, turned_base};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::effect::as_code::{EffectsCode, RobotProperty};
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::standard::{Body, COMPUTED, STANDARD};
use cft_ident_core::robot::tree::JointCoupling;
use cft_ident_core::robot::tree::space::{Rotation, UNTURNED, Vector, cross, times};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::robot_file::CoordinateLimits;
use cft_ident_files::config::serial_section::FrameSection;

/// What a format can say beside bodies, joints, damping and friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FormatSupport {
    /// Inertia of a drive at its joint.
    pub armature: bool,
    /// Inertia and friction that two joints share.
    pub couplings: bool,
    /// Who reads a drive's inertia, where not every reader does.
    pub armature_readers: Option<&'static str>,
    /// Who takes the gravity of the earth along -z for the model's, whatever the file says, as the beginning of a clause.
    pub gravity_skipped_by: Option<&'static str>,
}

/// How a model is taken for a file.
#[derive(Debug, Clone, Copy)]
pub struct ArmSettings<'a> {
    /// Motion whose speeds weigh what damping and friction cannot say of a law.
    pub along: &'a [Stretch],
    /// Whether bodies that cannot exist are written as they are: a model file reads them back.
    pub any_bodies: bool,
    pub base: BaseFrame,
    /// Whether the file has words for damping that bends with speed.
    pub bends: bool,
}

/// What becomes of the frame of the base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BaseFrame {
    /// It is turned until gravity is along -z.
    Turned,
    /// It stays, and the file says what gravity is.
    Kept,
    /// It stays, and gravity is the reader's.
    Silent,
}

impl ArmSettings<'_> {
    /// Of a file that the program writes by itself, without a motion.
    pub const PLAIN: Self = ArmSettings {
        along: &[],
        any_bodies: false,
        base: BaseFrame::Turned,
        bends: false,
    };
}

/// A model as bodies on joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Name of the link that stands still.
    pub root: String,
    /// Acceleration of free fall in its frame \[m/s^2\].
    pub gravity: Vector,
    /// How the base stands in a world whose gravity is along -z; none where it stands upright, or where the file keeps its
    /// frame.
    pub turn: Option<Rotation>,
    pub links: Vec<ArmLink>,
    pub frames: Vec<FrameSection>,
    /// Gear trains that two joints turn, with inertia, damping and friction.
    pub couplings: Vec<(JointCoupling, [f64; 3])>,
    /// Inertia of each drive \[kg or kg m^2\], below zero where a fit without constraints found it so.
    pub drives: Vec<f64>,
    /// Where the inertials come from.
    pub of_inertials: Vec<String>,
    /// Places in the model of the effects that are in bodies, gravity, armatures and friction.
    pub held: Vec<usize>,
    /// Those of friction among them.
    pub bent: Vec<usize>,
}

/// A link and the joint before it.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmLink {
    pub name: String,
    pub parent: Option<usize>,
    /// The joint's frame in that of the link before.
    pub rotation: Rotation,
    /// Its origin \[m\].
    pub origin: Vector,
    pub axis: Vector,
    pub kind: JointKind,
    pub joint: ArmJoint,
    pub body: Body,
}

/// What moves a link.
#[derive(Debug, Clone, PartialEq)]
pub enum ArmJoint {
    /// A joint of its own.
    Own(Box<OwnJoint>),
    /// It follows joint `of` by `factor` and `offset`.
    Mimic {
        name: String,
        of: String,
        factor: f64,
        offset: f64,
    },
    /// Nothing.
    Fixed,
}

/// An independent joint.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnJoint {
    pub name: String,
    /// Its place in vectors.
    pub index: usize,
    /// \[N s/m or Nm s/rad\]
    pub damping: f64,
    /// Damping by the speed times its size and by its cube; none but in files of MuJoCo that are to have it.
    pub bend: [f64; 2],
    /// \[N or Nm\]
    pub friction: f64,
    /// Inertia of its drive \[kg or kg m^2\].
    pub armature: f64,
    pub limits: CoordinateLimits,
}

impl Arm {
    /// The bodies and joints of a model, `refined` being what its `file` stands for. Payload, tilt and rotor
    /// inertia go into bodies, gravity and armatures; a tilt only where the base may be turned.
    ///
    /// # Errors
    /// [`ExportError::NoLinks`] for robots that are no such tree; [`ExportError::Impossible`] for a link that
    /// no body can be; [`ExportError::NoMass`].
    pub fn of(
        file: &ModelFile,
        refined: &AugmentedModel,
        settings: ArmSettings,
    ) -> Result<Self, ExportError> {
        let prepared = PreparedModel::of(file, &refined.model)?;
        let (file, robot) = (&prepared.file, &prepared.model.robot);
        let links = robot.tree().links();
        let (bodies, drives) = prepared.standard.values.split_at(links.len() * STANDARD);
        let (mut bodies, mut drives) = (bodies.to_vec(), drives.to_vec());
        drives.resize(robot.joints(), 0.0);
        let bent = match settings.bends {
            true => EffectsCode::of(refined)?.of_friction,
            false => Vec::new(),
        };
        let (mut gravity, mut held) = (robot.tree().gravity(), bent.clone());
        for (i, effect) in refined.effects.iter().enumerate() {
            let property = effect.property();
            let stays = |property: &RobotProperty| {
                settings.base == BaseFrame::Silent && matches!(property, RobotProperty::Gravity(_))
            };
            if let Some(property) = property.filter(|property| !stays(property)) {
                fold(property, &mut bodies, &mut drives, &mut gravity);
                held.push(i);
            }
        }
        let couplings = robot.transmission().couplings().iter().copied();
        let couplings = couplings.zip(robot.coupling_parameters(&prepared.model.theta));
        let mut of_inertials: Vec<String> = prepared
            .of_inertials
            .iter()
            .map(|x| (*x).to_owned())
            .collect();
        let (mut out, mut points) = (Vec::new(), Vec::new());
        for (i, link) in links.iter().enumerate() {
            let body: [f64; STANDARD] = std::array::from_fn(|k| bodies[i * STANDARD + k]);
            let body = body_of(
                &link.name,
                &body,
                settings.any_bodies,
                file.links.is_empty(),
            )?;
            if body.is_point() {
                points.push(link.name.as_str());
            }
            out.push(prepared.link(i, body, &drives, (refined, &bent), settings)?);
        }
        if !points.is_empty() {
            of_inertials.push(format!(
                "No extent by this model, so that they have the least moments that all readers take: {}.",
                points.join(", ")
            ));
        }
        Ok(Self {
            root: root(robot, file),
            turn: turned_base(&gravity).filter(|_| settings.base == BaseFrame::Turned),
            gravity,
            links: out,
            frames: file.robot.robot.frame.clone(),
            couplings: couplings.collect(),
            drives,
            of_inertials,
            held,
            bent,
        })
    }

    /// How the base stands in the world of the file.
    pub(super) fn standing(&self) -> Rotation {
        self.turn.unwrap_or(UNTURNED)
    }

    /// Free fall in the world of the file \[m/s^2\].
    pub fn world_gravity(&self) -> Vector {
        match self.turn {
            Some(_) => [0.0, 0.0, -length(&self.gravity)],
            None => self.gravity,
        }
    }

    /// The independent joints in the order of vectors.
    pub fn joints(&self) -> Vec<&OwnJoint> {
        let own = self.links.iter().filter_map(|link| match &link.joint {
            ArmJoint::Own(joint) => Some(&**joint),
            _ => None,
        });
        let mut own: Vec<&OwnJoint> = own.collect();
        own.sort_by_key(|joint| joint.index);
        own
    }

    /// What gear trains of v_motor + ratio v_other leave of each joint's armature and damping; none where it is below 0.
    pub(super) fn trains(&self) -> Option<Vec<[f64; 2]>> {
        let joints = self.joints();
        let mut own: Vec<[f64; 2]> = joints.iter().map(|j| [j.armature, j.damping]).collect();
        for (c, [inertia, damping, friction]) in &self.couplings {
            if [inertia, damping, friction].iter().any(|x| **x < 0.0) {
                return None;
            }
            for (k, share) in [(0, inertia), (1, damping)] {
                own[c.motor][k] -= share;
                own[c.other][k] -= share * c.ratio * c.ratio;
            }
        }
        own.iter().flatten().all(|x| *x >= 0.0).then_some(own)
    }
}

impl PreparedModel {
    /// Link `i` with its body, on its joint.
    fn link(
        &self,
        i: usize,
        body: Body,
        drives: &[f64],
        bent: (&AugmentedModel, &[usize]),
        settings: ArmSettings,
    ) -> Result<ArmLink, ExportError> {
        let robot = &self.model.robot;
        let link = &robot.tree().links()[i];
        let moved = drive(robot, link)?;
        let name = joint_name(robot, link, &moved);
        let (rotation, origin) = placed(link, &moved);
        let joint = match moved {
            Drive::Joint(j) => {
                let [damping, friction, bend @ ..] = self.friction(j, bent, settings);
                let limits = self.file.robot.limits.get(&name);
                ArmJoint::Own(Box::new(OwnJoint {
                    limits: limits.cloned().unwrap_or_default(),
                    index: j,
                    damping,
                    friction,
                    bend,
                    armature: drives[j].max(0.0),
                    name,
                }))
            }
            Drive::Mimic(of, factor, offset) => ArmJoint::Mimic {
                name,
                of,
                factor,
                offset,
            },
            Drive::Rest(_) => ArmJoint::Fixed,
        };
        Ok(ArmLink {
            name: link.name.clone(),
            parent: link.parent,
            rotation,
            origin,
            axis: link.axis,
            kind: link.kind,
            joint,
            body,
        })
    }
}

impl PreparedModel {
    /// Sizes of the [`CURVES`] of joint `j`, none below zero; effects `bent` of friction are in them.
    fn friction(
        &self,
        j: usize,
        (refined, bent): (&AugmentedModel, &[usize]),
        settings: ArmSettings,
    ) -> [f64; 4] {
        let law = &self.model.friction[j];
        let [damping, friction] = damping_and_friction(law).map(|x| x.max(0.0));
        let said = [damping, friction, 0.0, 0.0];
        if law.parameters() <= 2 && bent.is_empty() {
            return said;
        }
        let seen = self.file.held_out.get(j).map(|held| held.speed_seen);
        let speeds = speeds(j, settings.along, seen);
        let all = vec![speeds.clone(); self.model.robot.joints()];
        let whole = friction_at(refined, bent, all).swap_remove(j);
        let curves = if settings.bends {
            &CURVES[..]
        } else {
            &CURVES[..2]
        };
        let sizes = nearest_sizes(&whole, curves, &speeds);
        sizes.map_or(said, |sizes| {
            std::array::from_fn(|k| sizes.get(k).copied().unwrap_or(0.0))
        })
    }
}

/// The body of a link of these standard parameters, as readers take it.
fn body_of(
    link: &str,
    standard: &[f64; STANDARD],
    any: bool,
    unconstrained: bool,
) -> Result<Body, ExportError> {
    let body = Body::of(standard);
    let physical = body.physical(COMPUTED);
    let (mass, moment) = (standard[9], &standard[6..9]);
    let size = moment.iter().map(|x| x * x).sum::<f64>().sqrt();
    // a centre of gravity a kilometre away would cost the digits of the inertia
    if any && size > 1e3 * mass.abs() {
        let link = link.to_owned();
        return Err(ExportError::NoMass {
            link,
            mass,
            moment: size,
        });
    }
    let written = any.then_some(body);
    physical.or(written).ok_or_else(|| ExportError::Impossible {
        link: link.to_owned(),
        remedy: match unconstrained {
            true => "identify with `lsq` without --unconstrained, whose links can exist",
            false => {
                "its parameters are not those of its [[link]] tables: fit again, or export with --c or --rust"
            }
        },
    })
}

/// Takes an effect into bodies, drives or gravity, where it is one of these.
fn fold(property: RobotProperty, bodies: &mut [f64], drives: &mut [f64], gravity: &mut Vector) {
    match property {
        RobotProperty::Drive { joint, inertia } => drives[joint] += inertia,
        RobotProperty::Gravity([gx, gy]) => {
            gravity[0] += gx;
            gravity[1] += gy;
        }
        RobotProperty::Body(body) => {
            let first = bodies.len() - STANDARD;
            for (sum, x) in bodies[first..].iter_mut().zip(body.standard()) {
                *sum += x;
            }
        }
    }
}

/// A rotation as quaternion w, x, y, z.
pub(super) fn quaternion(r: &Rotation) -> [f64; 4] {
    let matrix = Matrix3::from_fn(|i, j| r[i][j]);
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    [q.w, q.i, q.j, q.k]
}

/// Principal moments of a body and the rotation of its principal axes.
pub(super) fn principal(body: &Body) -> ([f64; 3], Rotation) {
    let [xx, xy, xz, yy, yz, zz] = body.inertia;
    let eigen = SymmetricEigen::new(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let moments = eigen.eigenvalues;
    (
        [moments[0], moments[1], moments[2]],
        std::array::from_fn(|i| std::array::from_fn(|j| axes[(i, j)])),
    )
}

/// A rotation that takes the z axis to this one.
pub(super) fn z_to(axis: &Vector) -> Rotation {
    // the shorter of two helpers is far enough from the axis
    let least = (0..3).min_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs()));
    let mut helper = [0.0; 3];
    helper[least.unwrap_or(0)] = 1.0;
    let x = cross(&helper, axis);
    let size = x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let x = times(1.0 / size, &x);
    let y = cross(axis, &x);
    std::array::from_fn(|i| [x[i], y[i], axis[i]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use cft_ident_core::robot::tree::space::turn;

    #[test]
    fn the_z_axis_is_turned_to_any_axis_by_a_rotation() {
        for axis in [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.6, 0.0, -0.8]] {
            let r = z_to(&axis);
            assert_eq!(turn(&r, &[0.0, 0.0, 1.0]), axis);
            let det = Matrix3::from_fn(|i, j| r[i][j]).determinant();
            assert!((det - 1.0).abs() < 1e-15, "{det}");
        }
    }

    #[test]
    fn principal_axes_give_the_inertia_back() {
        let body = Body {
            mass: 2.0,
            centre: [0.0; 3],
            inertia: [0.03, 0.002, -0.004, 0.05, 0.001, 0.06],
        };
        let (moments, axes) = principal(&body);
        let r = Matrix3::from_fn(|i, j| axes[i][j]);
        let back = r * Matrix3::from_diagonal(&moments.into()) * r.transpose();
        let places = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        for (place, inertia) in places.into_iter().zip(body.inertia) {
            assert!((back[place] - inertia).abs() < 1e-15);
        }
    }
}
