//! A written file is read back, and its torques are compared with the model's: what differs without a known cause is refused.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::arm::{Arm, ArmJoint, FormatSupport};
use super::error::ExportError;
use super::left_out::{LeftOut, OmittedPart, parts, sized};
use super::source_text::WrittenSource;
use crate::read_back::ReadError;
use crate::read_back::mechanism::{
    DrivenMechanism, ReadBody, ReadJoint, ReadMechanism, TorquePart,
};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::Stretch;
use cft_ident_core::number;
use cft_ident_core::robot::JointKind;

/// What is held against what when a file is read back.
struct AgreementLimits {
    /// States that are drawn. Half may miss an axis that few states show; twice finds nothing that forty do not.
    states: usize,
    /// Share of a joint's rms that may differ. Readers differ by 6e-9, and six digits of an angle are 1e-6: half refuses files of
    /// six digits, twice lets pass what a reader with 1e-6 notices.
    of_joint: f64,
    /// Share of the largest joint's rms that may differ, for joints that carry next to nothing: rounding of the sums behind
    /// it. Half or twice is a newton millimetre of a robot of a ton.
    of_largest: f64,
}

const AGREEMENT: AgreementLimits = AgreementLimits {
    states: 40,
    of_joint: 1e-6,
    of_largest: 1e-9,
};

/// A file that was written of a model.
#[derive(Clone, Copy)]
pub struct FileToCheck<'a> {
    /// Its name in errors.
    pub file: &'a str,
    pub text: &'a str,
    pub says: FormatSupport,
    /// The user's own file that it was written into.
    pub source: Option<&'a WrittenSource>,
}

/// Reads a URDF back, and gives what it adds or lacks for a cause that is known.
///
/// # Errors
/// [`ExportError::ReadBack`] where it is another robot than the model.
pub fn urdf(
    written: &FileToCheck,
    arm: &Arm,
    refined: &AugmentedModel,
    along: &[Stretch],
) -> Result<Vec<LeftOut>, ExportError> {
    let read = crate::read_back::urdf::read(written.text, arm.world_gravity());
    agrees(written, read, arm, refined, along)
}

/// Reads an MJCF back, likewise.
///
/// # Errors
/// [`ExportError::ReadBack`] where it is another robot than the model.
pub fn mjcf(
    written: &FileToCheck,
    arm: &Arm,
    refined: &AugmentedModel,
    along: &[Stretch],
) -> Result<Vec<LeftOut>, ExportError> {
    let read = crate::read_back::mjcf::read(written.text);
    agrees(written, read, arm, refined, along)
}

fn agrees(
    written: &FileToCheck,
    read: Result<ReadMechanism, ReadError>,
    arm: &Arm,
    refined: &AugmentedModel,
    along: &[Stretch],
) -> Result<Vec<LeftOut>, ExportError> {
    let refused = |problem: String| ExportError::ReadBack {
        file: written.file.to_owned(),
        problem,
    };
    let failed = |error: ReadError| refused(error.problem);
    let mechanism = read.map_err(failed)?;
    let own: Vec<String> = arm
        .joints()
        .iter()
        .map(|joint| joint.name.clone())
        .collect();
    let none = BTreeMap::new();
    let (names, held) = match written.source {
        Some(source) => (&source.joints, &source.held),
        None => (&own, &none),
    };
    let file = mechanism.driven(names, held).map_err(failed)?;
    if let Some(unread) = file.unread() {
        return Err(refused(format!("{unread} is not known")));
    }
    // the model as it stands, and as it stands in the frames of the source
    let meant = in_frames(arm, None);
    let meant = meant.driven(&own, &none).map_err(failed)?;
    let placed = written.source.map(|source| in_frames(arm, Some(source)));
    let placed = placed.as_ref().map(|placed| placed.driven(&own, &none));
    let placed = placed.transpose().map_err(failed)?;
    let moved = |s: &Stretch| -> Vec<Vec<f64>> {
        let of = |from: &DrivenMechanism| torques(from, &[TorquePart::Bodies], s);
        match &placed {
            Some(placed) => minus(of(placed), &of(&meant)),
            None => vec![vec![0.0; s.len()]; own.len()],
        }
    };
    let states = drawn_states(arm);
    let wanted = said(arm, refined, written.says, &states);
    let ours = own_parts(&mechanism, arm, names);
    let off = minus(
        minus(torques(&file, &ours, &states), &wanted),
        &moved(&states),
    );
    let limits = limits(&wanted);
    for (j, name) in own.iter().enumerate() {
        let worst = off[j].iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if worst.is_nan() || worst > limits[j] {
            let share = 100.0 * worst / root_mean_square(&wanted[j]);
            let share = number::significant(share, 2);
            return Err(refused(format!("the torque of {name} is {share} % off")));
        }
    }
    let mut more: Vec<OmittedPart> = Vec::new();
    let off = moved(&states);
    if (0..own.len()).any(|j| off[j].iter().any(|x| x.abs() > limits[j])) {
        let lost = written
            .source
            .is_some_and(|source| source.links.iter().any(Option::is_none));
        let what = match lost {
            true => "links that the source lacks, and its rounded frames".to_owned(),
            false => "frames of the source, which are rounded".to_owned(),
        };
        more.push(OmittedPart {
            what,
            of_reader: true,
            torque: Box::new(|s, _| moved(s)),
        });
    }
    for (what, part) in foreign_parts(&mechanism, &ours) {
        let of_states = torques(&file, &[part], &states);
        if of_states.iter().flatten().any(|x| *x != 0.0) {
            let file = &file;
            more.push(OmittedPart {
                what,
                of_reader: true,
                torque: Box::new(move |s, _| torques(file, &[part], s)),
            });
        }
    }
    let mut out = sized(more, refined, along);
    out.extend(mechanism.beyond.iter().map(|what| LeftOut {
        what: format!("the source adds {what}, which is not computed"),
        joint: None,
        percent_of_torque: None,
        of_reader: true,
    }));
    Ok(out)
}

/// Parts of a file that are of the model.
fn own_parts(mechanism: &ReadMechanism, arm: &Arm, names: &[String]) -> Vec<TorquePart> {
    let trains = arm.couplings.iter();
    let trains: Vec<String> = trains
        .map(|(c, _)| format!("{}_{}", names[c.motor], names[c.other]))
        .collect();
    let tendons = mechanism.tendons.iter().enumerate();
    let ours = tendons.filter(|(_, tendon)| trains.contains(&tendon.name));
    let mut out = vec![TorquePart::Bodies];
    out.extend(ours.map(|(i, _)| TorquePart::Tendon(i)));
    out
}

/// Parts that only the user's file has.
fn foreign_parts(mechanism: &ReadMechanism, ours: &[TorquePart]) -> Vec<(String, TorquePart)> {
    let mut out = Vec::new();
    let joints = mechanism.bodies.iter().flat_map(|body| &body.joints);
    for (i, joint) in joints
        .enumerate()
        .filter(|(_, joint)| joint.stiffness != [0.0; 3])
    {
        let what = format!("the source adds the spring of {}", joint.name);
        out.push((what, TorquePart::Spring(i)));
    }
    let what = "the source adds gravcomp, which carries weight".to_owned();
    out.push((what, TorquePart::Weightless));
    for (i, tendon) in mechanism.tendons.iter().enumerate() {
        let part = TorquePart::Tendon(i);
        if !ours.contains(&part) {
            out.push((format!("the source adds the tendon {}", tendon.name), part));
        }
    }
    if mechanism.fluid != [0.0; 2] {
        let what = "the source adds a fluid (density, viscosity)".to_owned();
        out.push((what, TorquePart::Fluid));
    }
    out
}

/// What the model says that a format can say, along a stretch.
fn said(arm: &Arm, refined: &AugmentedModel, says: FormatSupport, s: &Stretch) -> Vec<Vec<f64>> {
    let held = arm
        .held
        .iter()
        .filter_map(|i| refined.effects.get(*i).cloned());
    let effects: Vec<_> = held.collect();
    let arm = Arm {
        held: (0..effects.len()).collect(),
        ..arm.clone()
    };
    let refined = AugmentedModel {
        model: refined.model.clone(),
        effects,
    };
    let mut out = refined.torques(s).hat;
    // this reader takes gravity from the file
    let says = FormatSupport {
        gravity_skipped_by: None,
        ..says
    };
    for part in parts(&arm, &refined, says) {
        out = minus(out, &(part.torque)(s, &[]));
    }
    // a drive whose inertia was found below zero has none in the file
    for joint in arm.joints() {
        let below = joint.armature - arm.drives[joint.index];
        for (x, a) in out[joint.index].iter_mut().zip(&s.a[joint.index]) {
            *x += below * a;
        }
    }
    out
}

/// The model as a mechanism, in its own frames or in those of a source; links that the source lacks are left out.
fn in_frames(arm: &Arm, source: Option<&WrittenSource>) -> ReadMechanism {
    let mut places = Vec::with_capacity(arm.links.len());
    let mut out = ReadMechanism {
        gravity: Vector3::from(arm.gravity),
        ..ReadMechanism::default()
    };
    for (i, link) in arm.links.iter().enumerate() {
        let (mut rotation, mut origin, mut axis) = (link.rotation, link.origin, link.axis);
        if let Some(source) = source {
            let Some(there) = &source.links[i] else {
                places.push(None);
                continue;
            };
            if !matches!(link.joint, ArmJoint::Fixed) {
                (rotation, origin, axis) = (there.rotation, there.origin, there.axis);
            }
        }
        let matrix = Matrix3::from_fn(|i, j| rotation[i][j]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
        let (name, follows) = match &link.joint {
            ArmJoint::Own(joint) => (joint.name.clone(), None),
            ArmJoint::Mimic {
                name,
                of,
                factor,
                offset,
            } => {
                let law = [*offset, *factor, 0.0, 0.0, 0.0];
                (name.clone(), Some((of.clone(), law)))
            }
            ArmJoint::Fixed => (String::new(), None),
        };
        let joint = ReadJoint {
            name,
            slides: link.kind == JointKind::Prismatic,
            axis: Vector3::from(axis),
            point: Vector3::zeros(),
            reference: 0.0,
            armature: 0.0,
            damping: [0.0; 3],
            friction: 0.0,
            stiffness: [0.0; 3],
            rest: 0.0,
            follows,
        };
        let moves = !matches!(link.joint, ArmJoint::Fixed);
        let [xx, xy, xz, yy, yz, zz] = link.body.inertia;
        let [x, y, z] = origin;
        out.bodies.push(ReadBody {
            name: link.name.clone(),
            parent: link.parent.and_then(|parent| places[parent]),
            place: Isometry3::from_parts(Translation3::new(x, y, z), rotation),
            joints: if moves { vec![joint] } else { Vec::new() },
            mass: link.body.mass,
            centre: Vector3::from(link.body.centre),
            inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            weightless: 0.0,
        });
        places.push(Some(out.bodies.len() - 1));
    }
    out
}

/// Torques of parts of a mechanism along a stretch, joint by joint.
fn torques(of: &DrivenMechanism, parts: &[TorquePart], s: &Stretch) -> Vec<Vec<f64>> {
    let n = s.q.len();
    let mut out = vec![vec![0.0; s.len()]; n];
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for k in 0..s.len() {
        s.at(k, &mut q, &mut v, &mut a);
        for part in parts {
            for (out, tau) in out.iter_mut().zip(of.torque(*part, &q, &v, &a)) {
                out[k] += tau;
            }
        }
    }
    out
}

fn minus(mut one: Vec<Vec<f64>>, other: &[Vec<f64>]) -> Vec<Vec<f64>> {
    for (x, y) in one.iter_mut().flatten().zip(other.iter().flatten()) {
        *x -= y;
    }
    one
}

fn root_mean_square(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// Torque of each joint that may differ.
fn limits(wanted: &[Vec<f64>]) -> Vec<f64> {
    let sizes: Vec<f64> = wanted.iter().map(|x| root_mean_square(x)).collect();
    let most = sizes.iter().fold(0.0, |most: f64, x| most.max(*x));
    let floor = AGREEMENT.of_largest * most;
    let each = sizes.iter();
    each.map(|size| (AGREEMENT.of_joint * size).max(floor))
        .collect()
}

/// States within the limits of position; speeds and accelerations up to 1 and 3 of their units.
fn drawn_states(arm: &Arm) -> Stretch {
    // 64 bits of a counter that are mixed (Steele, Lea and Flood 2014, SplitMix64)
    let mut counter = 0u64;
    let mut draw = move || {
        counter = counter.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = counter;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let joints = arm.joints();
    let mut many = |ends: &dyn Fn(usize) -> [f64; 2]| -> Vec<Vec<f64>> {
        let each = (0..joints.len()).map(|j| {
            let [low, high] = ends(j);
            (0..AGREEMENT.states)
                .map(|_| low + (high - low) * draw())
                .collect()
        });
        each.collect()
    };
    let q = many(&|j| joints[j].limits.position.unwrap_or([-1.0, 1.0]));
    let (v, a) = (many(&|_| [-1.0, 1.0]), many(&|_| [-3.0, 3.0]));
    Stretch {
        dt: 1.0,
        t: (0..AGREEMENT.states).map(|k| k as f64).collect(),
        tau: vec![vec![0.0; AGREEMENT.states]; joints.len()],
        q,
        v,
        a,
        ..Stretch::default()
    }
}
