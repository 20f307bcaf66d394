//! What a format cannot say of a model, and how much of the torque that is.

use serde::Serialize;

use super::arm::{Arm, FormatSupport};
use super::dissipative::{CURVES, damping_and_friction, friction_at, scene};
use super::error::ExportError;
use super::prepared::hashed;
use super::turned::length;
use cft_ident_core::effect::{AugmentedModel, shifted};
use cft_ident_core::motion::Stretch;
use cft_ident_core::number;
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::friction::sign;
use cft_ident_core::robot::tree::Tree;
use cft_ident_core::robot::tree::space::{Vector, times};

/// A part of the model's torque that a file does not hold.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// What it is.
    pub what: String,
    /// Joint where it is largest; absent where no log determines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Its rms over that of the joint's torque, in percent; absent where no log determines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub percent_of_torque: Option<f64>,
    /// Whether it is a matter of the reader's, which no model file beside a URDF mends.
    #[serde(skip)]
    pub of_reader: bool,
}

/// A part of the model that a file cannot say, with the torque that it is worth.
pub(super) struct OmittedPart<'a> {
    pub what: String,
    pub of_reader: bool,
    pub torque: Box<Torque<'a>>,
}

/// Torque of every joint along a stretch, by the model's there.
pub(super) type Torque<'a> = dyn Fn(&Stretch, &[Vec<f64>]) -> Vec<Vec<f64>> + 'a;

/// What a format cannot say, with its size along the stretches given, of which there may be none.
pub fn left_out(
    arm: &Arm,
    refined: &AugmentedModel,
    says: FormatSupport,
    stretches: &[Stretch],
) -> Vec<LeftOut> {
    sized(parts(arm, refined, says), refined, stretches)
}

/// Parts of a model's torque with their sizes along stretches.
pub(super) fn sized(
    parts: Vec<OmittedPart>,
    refined: &AugmentedModel,
    stretches: &[Stretch],
) -> Vec<LeftOut> {
    let n = refined.model.robot.joints();
    let mut whole = vec![0.0; n];
    let mut own = vec![vec![0.0; n]; parts.len()];
    let add = |sums: &mut [f64], channels: &[Vec<f64>]| {
        for (sum, channel) in sums.iter_mut().zip(channels) {
            *sum += channel.iter().map(|x| x * x).sum::<f64>();
        }
    };
    for stretch in stretches {
        let torques = refined.torques(stretch);
        add(&mut whole, &torques.hat);
        for (part, own) in parts.iter().zip(&mut own) {
            add(own, &(part.torque)(stretch, &torques.hat));
        }
    }
    let names = refined.model.robot.joint_names();
    let shown = parts.into_iter().zip(own).map(|(part, own)| {
        let share = |j: usize| 100.0 * (own[j] / whole[j]).sqrt();
        let known = (0..n).filter(|j| whole[*j] > 0.0);
        let worst = known.max_by(|a, b| share(*a).total_cmp(&share(*b)));
        LeftOut {
            what: part.what,
            joint: worst.map(|j| names[j].clone()),
            // more digits than anybody can use would differ from machine to machine
            percent_of_torque: worst.map(|j| (1e4 * share(j)).round() / 1e4),
            of_reader: part.of_reader,
        }
    });
    shown.collect()
}

pub(super) fn parts<'a>(
    arm: &'a Arm,
    refined: &'a AugmentedModel,
    says: FormatSupport,
) -> Vec<OmittedPart<'a>> {
    let model = &refined.model;
    let n = model.robot.joints();
    let names = model.robot.joint_names();
    let mut out: Vec<OmittedPart> = Vec::new();
    // one joint's torque by its state
    let mut of_joint = |what: String, j: usize, f: Box<dyn Fn(f64, f64) -> f64 + 'a>| {
        out.push(OmittedPart {
            what,
            of_reader: false,
            torque: Box::new(move |s, _| {
                let mut all = vec![vec![0.0; s.len()]; n];
                let state = s.v[j].iter().zip(&s.a[j]);
                all[j] = state.map(|(v, a)| f(*v, *a)).collect();
                all
            }),
        });
    };
    let mut beside = Vec::new();
    for joint in arm.joints() {
        let (j, name) = (joint.index, &names[joint.index]);
        let offset = model.offset[j];
        if offset != 0.0 {
            of_joint(format!("offset of {name}"), j, Box::new(move |_, _| offset));
        }
        if joint.armature != 0.0 && !says.armature {
            let armature = joint.armature;
            let but = says.armature_readers.map_or(String::new(), |readers| {
                format!(", which {readers} alone reads")
            });
            of_joint(
                format!("drive inertia of {name}{but}"),
                j,
                Box::new(move |_, a| armature * a),
            );
        }
        let law = model.friction[j];
        let [bend, cube] = joint.bend;
        let sizes = [joint.damping, joint.friction, bend, cube];
        let differs = damping_and_friction(&law) != [sizes[0], sizes[1]];
        if differs || law.parameters() > 2 || !arm.bent.is_empty() {
            beside.push((j, sizes));
        }
    }
    out.extend(beside.into_iter().map(|(j, sizes)| OmittedPart {
        what: format!(
            "the friction law of {} beside damping and friction",
            names[j]
        ),
        of_reader: false,
        torque: Box::new(move |s, _| {
            let mut all = vec![vec![0.0; s.len()]; n];
            all[j] = friction_at(refined, &arm.bent, s.v.clone()).swap_remove(j);
            for (rest, v) in all[j].iter_mut().zip(&s.v[j]) {
                let said = CURVES
                    .iter()
                    .zip(sizes)
                    .map(|(curve, size)| size * curve(*v));
                *rest -= said.sum::<f64>();
            }
            all
        }),
    }));
    if let Some((what, off)) = arm.gravity_skipped(says) {
        out.push(OmittedPart {
            what,
            of_reader: true,
            torque: Box::new(move |s, _| arm.held_in(&model.robot, off, s)),
        });
    }
    if !(says.couplings && arm.trains().is_some()) {
        for (c, [inertia, viscous, coulomb]) in &arm.couplings {
            let (m, o, r) = (c.motor, c.other, c.ratio);
            out.push(OmittedPart {
                what: format!("gear train of {} that {} turns too", names[m], names[o]),
                of_reader: false,
                torque: Box::new(move |s, _| {
                    let mut all = vec![vec![0.0; s.len()]; n];
                    let turning = |k: usize| coulomb * sign(s.v[m][k] + r * s.v[o][k]);
                    let of = |k: usize, j: usize| inertia * s.a[j][k] + viscous * s.v[j][k];
                    all[m] = (0..s.len()).map(|k| r * of(k, o) + turning(k)).collect();
                    all[o] = (0..s.len()).map(|k| r * (of(k, m) + turning(k))).collect();
                    all
                }),
            });
        }
    }
    for (i, effect) in refined.effects.iter().enumerate() {
        // a drive's inertia is named with that of its joint
        if arm.held.contains(&i) {
            continue;
        }
        let late = (0..n).any(|j| effect.shift(j) != 0.0);
        out.push(OmittedPart {
            what: effect.title(&model.robot),
            of_reader: false,
            torque: Box::new(move |s, hat| {
                if late {
                    let each = hat.iter().enumerate().map(|(j, hat)| {
                        let mut moved = hat.clone();
                        shifted(&mut moved, effect.shift(j) / s.dt);
                        moved.iter().zip(hat).map(|(x, y)| x - y).collect()
                    });
                    return each.collect();
                }
                let plain = AugmentedModel::plain(model.clone()).torques(s);
                let scene = scene(model, s, &plain);
                let mut all = vec![vec![0.0; s.len()]; n];
                for (j, out) in all.iter_mut().enumerate() {
                    effect.torque(&scene, j, out);
                }
                all
            }),
        });
    }
    out
}

/// Acceleration of free fall that readers take where they skip what the file says \[m/s^2\].
const EARTH: f64 = 9.81;

impl Arm {
    /// Free fall in the frame of the base less that which readers take who skip what a file says, and what is said of it;
    /// none where it is one, or where no reader skips it.
    fn gravity_skipped(&self, says: FormatSupport) -> Option<(String, Vector)> {
        let [x, y, z] = self.gravity;
        let taken = match self.turn {
            Some(_) => times(EARTH / length(&self.gravity), &self.gravity),
            None => [0.0, 0.0, -EARTH],
        };
        let off = [x - taken[0], y - taken[1], z - taken[2]];
        // gravity of sixteen digits is that of the earth
        let who = says
            .gravity_skipped_by
            .filter(|_| length(&off) > 1e-12 * EARTH)?;
        let [x, y, z] = self.world_gravity().map(|x| number::significant(x, 6));
        let said = format!(
            "gravity along ({x}, {y}, {z}) m/s^2, for which {who} (0, 0, -9.81): set it there"
        );
        Some((said, off))
    }

    /// Torques that hold the arm along a stretch in a gravity of its own \[m/s^2\].
    fn held_in(&self, robot: &Robot, gravity: Vector, s: &Stretch) -> Vec<Vec<f64>> {
        let (n, links) = (robot.joints(), robot.tree().links().to_vec());
        let mut all = vec![vec![0.0; s.len()]; n];
        let Ok(tree) = Tree::new(links, n, gravity) else {
            return all;
        };
        let robot = Robot::of_tree(tree, robot.joint_names().to_vec(), false, Vec::new());
        let standard = self.links.iter().flat_map(|link| link.body.standard());
        let theta = robot.base_of(&standard.collect::<Vec<f64>>());
        let (rest, mut tau) = (vec![0.0; n], vec![0.0; n]);
        for k in 0..s.len() {
            let q: Vec<f64> = s.q.iter().map(|q| q[k]).collect();
            robot.torque(&theta, &q, &rest, &rest, &mut tau);
            for (all, tau) in all.iter_mut().zip(&tau) {
                all[k] = *tau;
            }
        }
        all
    }
}

/// Where what a file cannot say is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OmissionPlace {
    /// Nowhere.
    Nowhere,
    /// In the model file beside a URDF.
    Beside,
}

/// The list as lines for the head of a file; `logs` names the logs of the sizes.
pub fn lines(left_out: &[LeftOut], logs: &[String], elsewhere: OmissionPlace) -> Vec<String> {
    if left_out.is_empty() {
        return vec!["Nothing of the model's torque is left out.".to_owned()];
    }
    let along = match logs.is_empty() {
        true => "no log was given, so their sizes are not known".to_owned(),
        false => format!(
            "rms over that of the joint's torque along {}, where it is largest",
            logs.join(", ")
        ),
    };
    let head = match elsewhere {
        OmissionPlace::Nowhere => "NOT in here, though the model has it",
        OmissionPlace::Beside => "Not in the URDF, but in the model file beside it",
    };
    let mut out = vec![format!("{head} ({along}):")];
    for part in left_out {
        let size = match (part.percent_of_torque, &part.joint) {
            (Some(percent), Some(joint)) => {
                format!(", {} % at {joint}", number::significant(percent, 3))
            }
            _ => String::new(),
        };
        out.push(format!("  {}{size}", part.what));
    }
    out
}

/// The list as a file of its own.
///
/// # Errors
/// [`ExportError::Side`]; none is known: the tables hold words and numbers.
pub fn side_file(
    left_out: &[LeftOut],
    notes: &[String],
    logs: &[String],
) -> Result<String, ExportError> {
    #[derive(Serialize)]
    struct File<'a> {
        /// Logs along which sizes were taken.
        logs: &'a [String],
        left_out: &'a [LeftOut],
    }
    let text = toml::to_string(&File { logs, left_out })?;
    Ok(format!("{}\n{text}", hashed(notes)))
}
