//! OpenUSD as text, with the physics schemas that Isaac Sim and newton read: rigid bodies with mass properties, joints
//! with armature, friction and damping of PhysX and of newton. Numbers of bodies are of single precision there.

use std::fmt::Write;

use super::arm::{Arm, ArmJoint, ArmLink, FormatSupport, OwnJoint, principal, quaternion, z_to};
use super::prepared::{UsedNames, hashed};
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::tree::space::{Rotation, UNTURNED, Vector, add, product, turn};

/// What USD can say with the schemas of PhysX and newton.
pub const SAYS: FormatSupport = FormatSupport {
    armature: true,
    couplings: false,
    armature_readers: None,
    gravity_skipped_by: None,
};

/// Names of prims: letters, digits and underscores, each once.
#[derive(Default)]
struct PrimNames(UsedNames);

impl PrimNames {
    fn name(&mut self, name: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut name: String = name.chars().map(plain).collect();
        if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
            name.insert(0, '_');
        }
        self.0.give(name)
    }
}

/// Of joints whose names USD cannot hold.
const RENAMED: &str =
    "Joints whose names have other signs than letters, digits and _ keep them as displayName.";

/// Numbers in brackets.
fn tuple(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
    format!("({})", all.join(", "))
}

/// The text of a stage; `notes` stand at its head.
pub fn usd(arm: &Arm, notes: &[String]) -> String {
    let mut out = String::from("#usda 1.0\n");
    let [x, y, z] = arm.world_gravity();
    let size = (x * x + y * y + z * z).sqrt();
    let down = match size > 0.0 {
        true => [x / size, y / size, z / size],
        false => [0.0, 0.0, -1.0],
    };
    out.push_str(
        "(\n    defaultPrim = \"identified\"\n    metersPerUnit = 1\n    kilogramsPerUnit = 1\n    upAxis = \"Z\"\n)\n\n",
    );
    let mut prims = PrimNames::default();
    let scene = prims.name("scene");
    let root = prims.name(&arm.root);
    let bodies: Vec<String> = arm.links.iter().map(|l| prims.name(&l.name)).collect();
    let joints = arm.links.iter().map(|link| match &link.joint {
        ArmJoint::Own(joint) => (joint.name.clone(), prims.name(&joint.name)),
        ArmJoint::Mimic { name, .. } => (name.clone(), prims.name(name)),
        ArmJoint::Fixed => (String::new(), prims.name(&format!("{}_joint", link.name))),
    });
    let joints: Vec<(String, String)> = joints.collect();
    let mut notes = notes.to_vec();
    if joints
        .iter()
        .any(|(name, prim)| !name.is_empty() && name != prim)
    {
        notes.push(RENAMED.to_owned());
    }
    out += &hashed(&notes);
    let standing = arm.standing();
    let _ = write!(
        out,
        "\ndef Xform \"identified\" (\n    prepend apiSchemas = [\"PhysicsArticulationRootAPI\"]\n)\n{{\n    \
         def PhysicsScene \"{scene}\"\n    {{\n        vector3f physics:gravityDirection = {}\n        \
         float physics:gravityMagnitude = {size:?}\n    }}\n\n    def Xform \"{root}\" (\n        \
         prepend apiSchemas = [\"PhysicsRigidBodyAPI\"]\n    )\n    {{\n        quatd xformOp:orient = {stands}\n        \
         uniform token[] xformOpOrder = [\"xformOp:orient\"]\n    }}\n\n    def PhysicsFixedJoint \"{}\"\n    {{\n        \
         rel physics:body1 = </identified/{root}>\n        quatf physics:localRot0 = {stands}\n    }}\n",
        tuple(&down),
        prims.name("root_joint"),
        stands = tuple(&quaternion(&standing)),
    );
    let mut poses: Vec<(Rotation, Vector)> = Vec::new();
    for (i, link) in arm.links.iter().enumerate() {
        let (rotation, origin) = match link.parent.and_then(|parent| poses.get(parent)) {
            Some((r, o)) => (product(r, &link.rotation), add(o, &turn(r, &link.origin))),
            None => (
                product(&standing, &link.rotation),
                turn(&standing, &link.origin),
            ),
        };
        body(&mut out, link, &bodies[i], &rotation, &origin);
        poses.push((rotation, origin));
        let parent = link.parent.map_or(&root, |parent| &bodies[parent]);
        joint(&mut out, link, &joints, i, [parent, &bodies[i]]);
    }
    out.push_str("}\n");
    out
}

fn body(out: &mut String, link: &ArmLink, name: &str, rotation: &Rotation, origin: &Vector) {
    let (moments, axes) = principal(&link.body);
    let _ = write!(
        out,
        "\n    def Xform \"{name}\" (\n        prepend apiSchemas = [\"PhysicsRigidBodyAPI\", \"PhysicsMassAPI\"]\n    \
         )\n    {{\n        double3 xformOp:translate = {}\n        quatd xformOp:orient = {}\n        \
         uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]\n        \
         float physics:mass = {:?}\n        point3f physics:centerOfMass = {}\n        \
         float3 physics:diagonalInertia = {}\n        quatf physics:principalAxes = {}\n    }}\n",
        tuple(origin),
        tuple(&quaternion(rotation)),
        link.body.mass,
        tuple(&link.body.centre),
        tuple(&moments),
        tuple(&quaternion(&axes)),
    );
}

/// The joint before link `i`; `joints` are the names of all and of their prims.
fn joint(
    out: &mut String,
    link: &ArmLink,
    joints: &[(String, String)],
    i: usize,
    [parent, child]: [&String; 2],
) {
    let (said, name) = &joints[i];
    // a joint turns about its own z
    let axis = z_to(&link.axis);
    let place = match &link.joint {
        ArmJoint::Fixed => [product(&link.rotation, &UNTURNED), UNTURNED],
        _ => [product(&link.rotation, &axis), axis],
    };
    let (kind, axis_name, per) = match link.kind {
        JointKind::Revolute => ("PhysicsRevoluteJoint", "angular", 1f64.to_radians()),
        JointKind::Prismatic => ("PhysicsPrismaticJoint", "linear", 1.0),
    };
    let kind = match link.joint {
        ArmJoint::Fixed => "PhysicsFixedJoint",
        _ => kind,
    };
    let mut schemas = String::new();
    let mut lines = String::new();
    match &link.joint {
        ArmJoint::Own(joint) => {
            schemas =
                format!("\"PhysxJointAxisAPI:{axis_name}\", \"PhysxJointAPI\", \"NewtonJointAPI\"");
            own(&mut lines, joint, axis_name, per);
        }
        ArmJoint::Mimic {
            of, factor, offset, ..
        } => {
            let mimic = match link.kind {
                JointKind::Revolute => "rotZ",
                JointKind::Prismatic => "transZ",
            };
            schemas = format!("\"PhysxMimicJointAPI:{mimic}\"");
            let reference = joints.iter().find(|(name, _)| name == of);
            // q + gearing reference + offset = 0
            let _ = write!(
                lines,
                "        float physxMimicJoint:{mimic}:gearing = {:?}\n        \
                 float physxMimicJoint:{mimic}:offset = {:?}\n        \
                 rel physxMimicJoint:{mimic}:referenceJoint = </identified/{}>\n",
                -factor,
                -offset / per,
                reference.map_or("", |(_, prim)| prim)
            );
        }
        ArmJoint::Fixed => {}
    }
    let mut metadata = String::new();
    if !schemas.is_empty() {
        let _ = writeln!(metadata, "        prepend apiSchemas = [{schemas}]");
    }
    if name != said && !matches!(link.joint, ArmJoint::Fixed) {
        let _ = writeln!(metadata, "        displayName = \"{}\"", said);
    }
    if !metadata.is_empty() {
        metadata = format!(" (\n{metadata}    )");
    }
    let _ = write!(
        out,
        "\n    def {kind} \"{name}\"{metadata}\n    {{\n        rel physics:body0 = </identified/{parent}>\n        \
         rel physics:body1 = </identified/{child}>\n        point3f physics:localPos0 = {}\n        \
         quatf physics:localRot0 = {}\n        point3f physics:localPos1 = (0, 0, 0)\n        \
         quatf physics:localRot1 = {}\n",
        tuple(&link.origin),
        tuple(&quaternion(&place[0])),
        tuple(&quaternion(&place[1])),
    );
    if !matches!(link.joint, ArmJoint::Fixed) {
        out.push_str("        uniform token physics:axis = \"Z\"\n");
    }
    out.push_str(&lines);
    out.push_str("    }\n");
}

/// Angles are in degrees there, and so is what goes with speeds.
fn own(lines: &mut String, joint: &OwnJoint, axis: &str, per: f64) {
    if let Some([low, high]) = joint.limits.position {
        let _ = write!(
            lines,
            "        float physics:lowerLimit = {:?}\n        float physics:upperLimit = {:?}\n",
            low / per,
            high / per
        );
    }
    let _ = write!(
        lines,
        "        float physxJoint:armature = {0:?}\n        float physxJointAxis:{axis}:armature = {0:?}\n        \
         float physxJointAxis:{axis}:staticFrictionEffort = {1:?}\n        \
         float physxJointAxis:{axis}:dynamicFrictionEffort = {1:?}\n        \
         float physxJointAxis:{axis}:viscousFrictionCoefficient = {2:?}\n        \
         float newton:armature = {0:?}\n        float newton:friction = {1:?}\n        float newton:damping = {2:?}\n",
        joint.armature,
        joint.friction,
        joint.damping * per
    );
    if let Some(speed) = joint.limits.speed {
        let _ = writeln!(
            lines,
            "        float physxJointAxis:{axis}:maxJointVelocity = {:?}",
            speed / per
        );
    }
}
