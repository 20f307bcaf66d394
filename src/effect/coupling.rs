//! `coupling`: what another joint j does to joint i through shared gears or a linkage: viscous v_j,
//! coulomb sgn(v_i + r v_j), inertia a_j.
//!
//! Where both joints turn one motor, as in the wrist of many arms, what it asks of joint i it asks of
//! joint j too: power is kept, so that both rows have the same three numbers. That place is told by
//! `both`.

use super::{Family, Key, Kind, Place, Role, Unit, sign};

pub const KIND: Kind = Kind {
    name: "coupling",
    family: Family::Cross,
    role: Role::Columns,
    shape: &[Key::new("r", Unit::Text(""))],
    linear: &[
        Key::new("viscous", Unit::Viscous),
        Key::new("coulomb", Unit::Torque),
        Key::new("inertia", Unit::Inertia),
    ],
    places: |robot, _| {
        let n = robot.joints();
        // the motor is the one further out: its train passes through the joint before it
        let geared = (0..n).flat_map(|motor| (0..motor).map(move |o| (motor, o)));
        let geared = geared.map(|(motor, other)| Place::Geared { motor, other });
        let pairs = (0..n).flat_map(|on| (0..n).map(move |of| Place::Pair { on, of }));
        let pairs = pairs.filter(|p| !matches!(p, Place::Pair { on, of } if on == of));
        // of joints of two kinds the numbers would have two units
        let alike = |p: &Place| match *p {
            Place::Geared { motor, other } => robot.joint_kind(motor) == robot.joint_kind(other),
            _ => true,
        };
        geared.filter(alike).chain(pairs).collect()
    },
    starts: |cover, place| match place {
        Place::Pair { of, .. } if cover.joints[of].reversals >= 2 => {
            Ok(vec![vec![1.0], vec![-1.0]])
        }
        Place::Geared { motor, other }
            if cover.joints[motor].reversals >= 2 && cover.joints[other].reversals >= 2 =>
        {
            Ok(vec![vec![1.0], vec![-1.0]])
        }
        _ => Err("the other joint reverses fewer than two times".into()),
    },
    limits: |_, _| vec![[-1.0, 1.0]],
    columns: |scene, place, shape, joint, out| {
        let s = scene.stretch;
        let r = shape[0];
        // whose motion the row gets, what turns the motor, and how the row sees the motor
        let (of, [a, b], scale, lever) = match place {
            Place::Pair { on, of } => (of, [on, of], 1.0, 1.0),
            Place::Geared { motor, other } if joint == motor => (other, [motor, other], r, 1.0),
            Place::Geared { motor, other } => (motor, [motor, other], r, r),
            _ => return,
        };
        for (k, x) in out[0].iter_mut().enumerate() {
            *x = scale * s.v[of][k];
        }
        for (k, x) in out[1].iter_mut().enumerate() {
            *x = lever * sign(s.v[a][k] + r * s.v[b][k]);
        }
        for (k, x) in out[2].iter_mut().enumerate() {
            *x = scale * s.a[of][k];
        }
    },
    separate_by: "move the other joint alone, both ways at several speeds",
};
