//! MuJoCo's MJCF: bodies with inertials, joints with armature, damping, friction loss and ranges, gear trains
//! of two joints as tendons, followers as equalities.

use std::fmt::Write;

use super::arm::{Arm, ArmJoint, ArmLink, FormatSupport, OwnJoint, quaternion};
use super::prepared::{in_comment, quoted, words};
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::standard::Body;
use cft_ident_core::robot::tree::space::of_roll_pitch_yaw;

/// What MJCF can say.
pub const SAYS: FormatSupport = FormatSupport {
    armature: true,
    couplings: true,
    armature_readers: None,
    gravity_skipped_by: Some("Pinocchio and newton take"),
};

/// The text of a model; `notes` stand at its head.
pub fn mjcf(arm: &Arm, notes: &[String]) -> String {
    let mut out = format!("<!--\n{}", in_comment(notes));
    let _ = write!(
        out,
        "-->\n<mujoco model=\"identified\">\n  <compiler angle=\"radian\" autolimits=\"true\"/>\n  \
         <option gravity=\"{}\"/>\n  <worldbody>\n    <body name=\"{}\">\n",
        words(&arm.world_gravity()),
        quoted(&arm.root)
    );
    let own = arm.trains();
    // Pinocchio skips the pose of a body that is fixed to the world
    if let Some(turn) = &arm.turn {
        let _ = writeln!(
            out,
            "      <body name=\"{}_turned\" quat=\"{}\">",
            quoted(&arm.root),
            words(&quaternion(turn))
        );
    }
    bodies(
        &mut out,
        arm,
        None,
        3 + usize::from(arm.turn.is_some()),
        own.as_deref(),
    );
    if arm.turn.is_some() {
        out.push_str("      </body>\n");
    }
    out.push_str("    </body>\n  </worldbody>\n");
    if let (Some(_), false) = (&own, arm.couplings.is_empty()) {
        tendons(&mut out, arm, &str::to_owned);
    }
    followers(&mut out, arm);
    out.push_str("  <actuator>\n");
    for joint in arm.joints() {
        let range = joint.limits.torque.map_or(String::new(), |top| {
            format!(" ctrlrange=\"{}\"", words(&[-top, top]))
        });
        let name = quoted(&joint.name);
        let _ = writeln!(out, "    <motor name=\"{name}\" joint=\"{name}\"{range}/>");
    }
    out.push_str("  </actuator>\n</mujoco>\n");
    out
}

/// The inertia of a body about its centre.
pub(super) fn inertial(body: &Body) -> String {
    let [xx, xy, xz, yy, yz, zz] = body.inertia;
    format!(
        "<inertial pos=\"{}\" mass=\"{:?}\" fullinertia=\"{}\"/>",
        words(&body.centre),
        body.mass,
        words(&[xx, yy, zz, xy, xz, yz])
    )
}

/// The links that hang on `parent`, each with all that hang on it; trees are at most as deep as they have links.
fn bodies(
    out: &mut String,
    arm: &Arm,
    parent: Option<usize>,
    depth: usize,
    own: Option<&[[f64; 2]]>,
) {
    let pad = "  ".repeat(depth);
    let all = arm.links.iter().enumerate();
    for (i, link) in all.filter(|(_, link)| link.parent == parent) {
        let _ = write!(
            out,
            "{pad}<body name=\"{}\" pos=\"{}\" quat=\"{}\">\n{pad}  {}\n",
            quoted(&link.name),
            words(&link.origin),
            words(&quaternion(&link.rotation)),
            inertial(&link.body)
        );
        joint(out, link, &pad, own);
        for frame in arm.frames.iter().filter(|frame| frame.link == link.name) {
            let _ = writeln!(
                out,
                "{pad}  <site name=\"{}\" pos=\"{}\" quat=\"{}\"/>",
                quoted(&frame.name),
                words(&frame.xyz),
                words(&quaternion(&of_roll_pitch_yaw(&frame.rpy)))
            );
        }
        bodies(out, arm, Some(i), depth + 1, own);
        let _ = writeln!(out, "{pad}</body>");
    }
}

fn joint(out: &mut String, link: &ArmLink, pad: &str, own: Option<&[[f64; 2]]>) {
    let kind = match link.kind {
        JointKind::Revolute => "hinge",
        JointKind::Prismatic => "slide",
    };
    let axis = words(&link.axis);
    match &link.joint {
        ArmJoint::Fixed => {}
        ArmJoint::Mimic { name, .. } => {
            let name = quoted(name);
            let _ = writeln!(
                out,
                "{pad}  <joint name=\"{name}\" type=\"{kind}\" axis=\"{axis}\"/>"
            );
        }
        ArmJoint::Own(joint) => {
            let whole = [joint.armature, joint.damping];
            let [armature, damping] = own.map_or(whole, |own| own[joint.index]);
            let range = joint.limits.position;
            let range = range.map_or(String::new(), |ends| format!(" range=\"{}\"", words(&ends)));
            let _ = writeln!(
                out,
                "{pad}  <joint name=\"{}\" type=\"{kind}\" axis=\"{axis}\" armature=\"{armature:?}\" \
                 damping=\"{}\" frictionloss=\"{:?}\"{range}/>",
                quoted(&joint.name),
                damping_of(joint, damping),
                joint.friction
            );
        }
    }
}

/// The damping of a joint that has this much of its own, with what bends it where the model has that.
pub(super) fn damping_of(joint: &OwnJoint, damping: f64) -> String {
    match joint.bend {
        [0.0, 0.0] => format!("{damping:?}"),
        [bend, cube] => words(&[damping, bend, cube]),
    }
}

/// Gear trains of two joints: what turns with v_motor + ratio v_other. Joints have the names that they are `called`.
pub(super) fn tendons(out: &mut String, arm: &Arm, called: &dyn Fn(&str) -> String) {
    let joints = arm.joints();
    out.push_str("  <tendon>\n");
    for (c, [inertia, damping, friction]) in &arm.couplings {
        let [motor, other] = [c.motor, c.other].map(|j| quoted(&called(&joints[j].name)));
        let _ = write!(
            out,
            "    <fixed name=\"{motor}_{other}\" armature=\"{inertia:?}\" damping=\"{damping:?}\" \
             frictionloss=\"{friction:?}\">\n      <joint joint=\"{motor}\" coef=\"1\"/>\n      \
             <joint joint=\"{other}\" coef=\"{:?}\"/>\n    </fixed>\n",
            c.ratio
        );
    }
    out.push_str("  </tendon>\n");
}

fn followers(out: &mut String, arm: &Arm) {
    let mut lines = String::new();
    for link in &arm.links {
        if let ArmJoint::Mimic {
            name,
            of,
            factor,
            offset,
        } = &link.joint
        {
            let _ = writeln!(
                lines,
                "    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{}\"/>",
                quoted(name),
                quoted(of),
                words(&[*offset, *factor, 0.0, 0.0, 0.0])
            );
        }
    }
    if !lines.is_empty() {
        let _ = write!(out, "  <equality>\n{lines}  </equality>\n");
    }
}
