//! `payload` of a serial robot: a ball on the last link, its centre somewhere in that link's frame. All of
//! what a body does to its link would be ten numbers, which few logs determine; mass, centre and one moment of
//! inertia, the same about every axis, are five.
//!
//! Files and tables have first moments in the place of the centre: mx = mass x.

use super::payload;
use super::{EffectReparametrisation, KeyValue, Law, RobotProperty, ShapeSpan};
use crate::robot::standard::Body;
use crate::robot::tree::MOST_JOINTS;

/// Distance from the link's origin at which the search begins, along each axis \[m\].
const START_DISTANCE_M: f64 = 0.1;
/// Farthest that a centre is looked for, along each axis \[m\].
const MAX_DISTANCE_M: f64 = 1.0;

pub static LAW: Law = Law {
    fits: |robot, _, _| !robot.tool_stays_level(),
    shape: &["x", "y", "z"],
    starts: |_, _| {
        let corner = |k: usize, axis: usize| match k >> axis & 1 {
            0 => START_DISTANCE_M,
            _ => -START_DISTANCE_M,
        };
        let corners = (0..8).map(|k| (0..3).map(|axis| corner(k, axis)).collect());
        Ok(corners.collect())
    },
    limits: |_, _, _| vec![ShapeSpan::of(-MAX_DISTANCE_M, MAX_DISTANCE_M); 3],
    reparametrised: Some(EffectReparametrisation {
        of_keys: |values| {
            let [mass, moments @ ..] = payload::body(values)?;
            let centre = moments.map(|moment| moment / mass);
            Ok([centre.to_vec(), vec![mass, values.get_or("inertia", 0.0)?]])
        },
        to_keys: |centre, linear| {
            let mass = linear[0];
            let moments = ["mx", "my", "mz"].into_iter().zip(centre).enumerate();
            let moments = moments.map(|(i, (key, x))| {
                let mut slopes = vec![0.0; 5];
                slopes[i] = mass;
                slopes[3] = *x;
                KeyValue {
                    key,
                    value: mass * x,
                    slopes,
                }
            });
            let mass = KeyValue::plain("mass", mass, 3, 5);
            let inertia = KeyValue::plain("inertia", linear[1], 4, 5);
            std::iter::once(mass)
                .chain(moments)
                .chain([inertia])
                .collect()
        },
    }),
    code: Some(|to| {
        if let (&[x, y, z], &[mass, ball]) = (to.shape, to.linear) {
            to.bodies(to.model.robot.tool_links([mass, ball], [x, y, z]));
        }
    }),
    property: |_, centre, linear| {
        Some(RobotProperty::Body(Body {
            mass: linear[0],
            centre: [centre[0], centre[1], centre[2]],
            inertia: [linear[1], 0.0, 0.0, linear[1], 0.0, linear[1]],
        }))
    },
    ..Law::linear(&payload::ENTRY, &["mass", "inertia"], |at, _, out| {
        let &[x, y, z] = at.shape else { return };
        let robot = at.scene.robot;
        let state = at.state::<MOST_JOINTS>();
        let [q, v, a] = state.each_ref().map(|x| &x[..robot.joints()]);
        let row = robot.tool_row(at.joint, q, v, a);
        let of = |body: Body| row.iter().zip(body.standard()).map(|(y, x)| y * x).sum();
        out[0] = of(Body {
            mass: 1.0,
            centre: [x, y, z],
            inertia: [0.0; 6],
        });
        out[1] = of(Body {
            mass: 0.0,
            centre: [0.0; 3],
            inertia: [1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
        });
    })
};
